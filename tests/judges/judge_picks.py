#!/usr/bin/env python3
"""judge_picks.py PALPATE TWIN PICKED:ALONG[,ALONG...] [...]: what comes along when a part is picked up, in MuJoCo and in rapier.

Of each PICKED part the twin is lifted by 12 cm in 1.5 s, once by `palpate simulate TWIN --do pick:PICKED`, once in MuJoCo from
`scene.xml` (a hand welded to the part). What rises by half of that or more came along; it must
be what stands behind the colon, and nothing else (`loose-upper:` for nothing). Fails where either engine has it otherwise."""
import json, subprocess, sys

import mujoco

HEIGHT, SECONDS = 0.12, 1.5


def in_mujoco(twin, picked):
    spec = mujoco.MjSpec.from_file(f"{twin}/scene.xml")
    plain = spec.compile()
    data = mujoco.MjData(plain)
    mujoco.mj_forward(plain, data)
    # A hand that holds the part as it stands.
    spec.worldbody.add_body(name="hand", mocap=True, pos=data.xpos[plain.body(picked).id], quat=data.xquat[plain.body(picked).id])
    grip = spec.add_equality(type=mujoco.mjtEq.mjEQ_WELD, objtype=mujoco.mjtObj.mjOBJ_BODY, name1="hand", name2=picked)
    grip.data[:11] = [0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 1]
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    start, hand = data.xipos.copy(), data.mocap_pos[0].copy()
    while data.time < SECONDS + 1.0:
        s = min(max(data.time - 0.5, 0.0) / SECONDS, 1.0)
        data.mocap_pos[0] = hand + [0, 0, HEIGHT * (3 * s * s - 2 * s ** 3)]
        mujoco.mj_step(model, data)
    rises = data.xipos[:, 2] - start[:, 2]
    return {model.body(b).name: rises[b] for b in range(1, model.nbody) if model.body_mass[b] > 0}


def in_rapier(palpate, twin, picked):
    told = subprocess.run([palpate, "simulate", twin, "--do", f"pick:{picked}", "--json"], capture_output=True, text=True)
    if told.returncode:
        raise SystemExit(told.stderr.strip())
    return {part["link"] for part in json.loads(told.stdout)["parts"] if part["verdict"] == "along"}


def main():
    palpate, twin, bad = sys.argv[1], sys.argv[2], 0
    for word in sys.argv[3:]:
        picked, _, along = word.partition(":")
        wanted = {name for name in along.split(",") if name}
        rises = in_mujoco(twin, picked.replace("-", "_"))
        mine = picked.replace("-", "_")
        came = {n for n, r in rises.items() if r > 0.5 * HEIGHT and n != mine}
        both = in_rapier(palpate, twin, picked)
        right = came == {n.replace("-", "_") for n in wanted} and both == wanted and rises[mine] > 0.9 * HEIGHT
        others = max((abs(r) for n, r in rises.items() if n != mine and n not in came), default=0.0)
        print(f"{'right' if right else 'WRONG'}: pick {picked}: MuJoCo lifts it by {1e3 * rises[mine]:.0f} mm with "
              f"{', '.join(f'{n} ({1e3 * rises[n]:.0f} mm)' for n in sorted(came)) or 'nothing'}, the others by at most "
              f"{1e3 * others:.1f} mm; rapier with {', '.join(sorted(both)) or 'nothing'}")
        bad += not right
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
