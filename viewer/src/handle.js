// What a test or a curious reader drives by hand: `window.palpate`. Described in viewer/README.md.
import { Vector3 } from 'three';
import { Hand } from './play/hand.js';
import { lift, open, push } from './play/deeds.js';

const round = (v) => v.toArray().map((x) => Math.round(x * 1e6) / 1e6);

export function exposeHandle(stage, sim, links, bar, pointer) {
  const part = (name) => {
    const found = sim.world?.part(name);
    if (!found) throw new Error(`${name}: no such thing, or the engine has not begun`);
    return found;
  };
  let hand = null;
  window.palpate = {
    /** Begins the engine with the page's clock standing; `advance` is the clock then. */
    async begin() {
      await sim.ready();
      sim.pause();
    },
    /** Where every link is shown: name, place in m and quaternion x y z w, world. */
    bodies: () => links.map((l) => {
      const [at, turn] = [new Vector3().setFromMatrixPosition(l.group.matrix), l.group.matrix.clone()];
      const q = stage.camera.quaternion.clone().setFromRotationMatrix(turn);
      return { name: l.data.name, position: round(at), quaternion: round(q) };
    }),
    /** Where on the page, px from the window's corner, a pointer can take a link: in the midst of what shows of it, or null. */
    spot(name) {
      const box = stage.canvas.getBoundingClientRect();
      const hits = [];
      for (let y = 3; y < box.height; y += 6) {
        for (let x = 3; x < box.width; x += 6) {
          const event = { clientX: box.left + x, clientY: box.top + y };
          if (pointer.under(event)?.part.link === name) hits.push([event.clientX, event.clientY]);
        }
      }
      if (!hits.length) return null;
      const middle = [0, 1].map((k) => hits.reduce((sum, h) => sum + h[k], 0) / hits.length);
      const off = (h) => Math.hypot(h[0] - middle[0], h[1] - middle[1]);
      return hits.reduce((a, h) => (off(h) < off(a) ? h : a));
    },
    /** Position of every joint with one freedom, m or rad. */
    joints: () => Object.fromEntries((sim.world?.parts || []).filter((p) => sim.world.hasState(p)).map((p) => [p.data.joint.name, sim.world.jointState(p).value])),
    /** Takes a link at a point (m, world; without one at its centre of mass). */
    grab(name, point) {
      const taken = part(name);
      sim.remember(taken);
      hand = sim.add(new Hand(sim.world, taken, point ? new Vector3(...point) : sim.world.comOf(taken)));
      sim.grip = hand;
    },
    /** The hand goes by so much, m, world, within so many seconds. */
    move(way, seconds = 1) {
      const from = hand.goal.clone();
      const steps = Math.max(1, Math.round(seconds / 0.02));
      for (let i = 1; i <= steps; i++) {
        hand.goal.copy(from).addScaledVector(new Vector3(...way), i / steps);
        sim.advance(seconds / steps);
      }
    },
    /** Says what came along, and lets go. */
    release() {
      sim.tell(true);
      sim.drop(hand);
      if (sim.grip === hand) sim.grip = null;
      hand = null;
    },
    /** Lets `seconds` pass. */
    advance: (seconds) => sim.advance(seconds),
    /** One of the deeds behind the buttons, to its end. */
    lift: (name) => deed(lift(sim, part(name))),
    open: (name) => deed(open(sim, part(name))),
    push: (name, heading) => deed(push(sim, part(name), new Vector3(...heading).normalize())),
    /** How far the hand still is from where it was sent, m. */
    handGap: () => Math.max(0, ...sim.hands.map((h) => new Vector3().copy(h.body.translation()).distanceTo(h.goal))),
    /** The engine's clock, s. */
    time: () => sim.world?.time ?? 0,
    reset: () => sim.reset(),
    running: () => sim.running,
    said: () => bar.status.textContent,
  };
  function deed(made) {
    sim.begin(made);
    for (let i = 0; i < 20000 && sim.deed; i++) sim.step();
    sim.show();
  }
}
