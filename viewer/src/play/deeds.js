// What a hand does by itself: lift, push, open. Each is stepped until it says that it is done.
import { Quaternion, Vector3 } from 'three';
import { FINGER, Finger, Hand, HOLD } from './hand.js';

/** Height of a lift, m, and its time, s. */
const LIFT = 0.12;
const LIFT_TIME = 1.5;
/** How far a finger goes on once it has come to the thing, m, its speed, m/s, and the room that it leaves before. */
const PUSH = 0.06;
const SPEED = 0.08;
const GAP = 0.003;
/** Where no end of a joint is known: how far it is opened, m or rad; else this share of the way to the further end. */
const OPENING = 0.1;
const TURNING = 1;
const SHARE = 0.95;
/** Speed of an opening, m/s or rad/s. */
const OPEN_SLIDE = 0.06;
const OPEN_TURN = 0.8;

/** Every corner of a part's convex parts, world. */
function corners(sim, part) {
  const origin = new Vector3(...part.data.origin);
  const turn = sim.world.rotation(part).multiply(part.turn);
  const at = sim.world.position(part);
  const out = [];
  for (const mesh of part.data.hulls.map((f) => sim.meshes.get(f)).filter(Boolean)) {
    for (let i = 0; i < mesh.positions.length; i += 3) out.push(new Vector3().fromArray(mesh.positions, i).add(origin).applyQuaternion(turn).add(at));
  }
  return out;
}

/** Takes a part at its centre of mass and raises it; holds it then. */
export function lift(sim, part) {
  const hand = sim.add(new Hand(sim.world, part, sim.world.comOf(part)));
  const from = hand.goal.clone();
  let time = 0;
  sim.remember(part);
  sim.grip = hand;
  return {
    step(dt) {
      time += dt;
      const s = Math.min(1, time / LIFT_TIME);
      // The way of least jerk (Flash & Hogan 1985).
      hand.goal.copy(from).addScaledVector(sim.world.up, LIFT * s ** 3 * (10 - 15 * s + 6 * s * s));
      return time < LIFT_TIME + 0.4;
    },
    done: () => sim.tell(true),
  };
}

/** Pushes a part with a fingertip in a level direction at the height of its centre of mass. */
export function push(sim, part, heading) {
  const com = sim.world.comOf(part);
  const reach = Math.max(0, ...corners(sim, part).map((c) => com.clone().sub(c).dot(heading))) + FINGER + GAP;
  const finger = sim.add(new Finger(sim.world, com.clone().addScaledVector(heading, -reach)));
  const from = finger.goal.clone();
  let gone = 0;
  sim.remember(part);
  return {
    step(dt) {
      gone += SPEED * dt;
      finger.goal.copy(from).addScaledVector(heading, Math.min(gone, GAP + PUSH));
      return gone < GAP + PUSH + SPEED * 0.2;
    },
    done: () => sim.drop(finger),
  };
}

/** How far to open from the first view: nearly to the end that is further away. */
function goalOf({ range, turns }) {
  if (!range) return turns ? TURNING : OPENING;
  return SHARE * (range[1] >= -range[0] ? range[1] : range[0]);
}

/** Pulls a joint open by what hangs on it, or shut where it stands open, while another hand holds what it hangs on. */
export function open(sim, part) {
  const { world } = sim;
  const { motion, pitch } = part.data.joint;
  const start = world.jointState(part).value;
  const goal = Math.abs(start) > 0.3 * Math.abs(goalOf(motion)) ? 0 : goalOf(motion);
  const turn = world.rotation(part);
  const axis = part.axis.clone().applyQuaternion(turn);
  const off = (c) => c.clone().sub(world.position(part)).cross(axis).length();
  const grip = motion.turns ? corners(sim, part).reduce((a, b) => (off(b) > off(a) ? b : a)) : world.comOf(part);
  const other = sim.add(Hand.aside(world, part.parent));
  const hand = sim.add(new Hand(world, part, grip, HOLD.point));
  const origin = world.position(part);
  let [at, time] = [start, 0];
  const speed = motion.turns ? OPEN_TURN : OPEN_SLIDE;
  sim.remember(part);
  return {
    step(dt) {
      time += dt;
      at += Math.sign(goal - start) * Math.min(speed * dt, Math.abs(goal - at));
      if (motion.turns) hand.goal.copy(grip).sub(origin).applyQuaternion(new Quaternion().setFromAxisAngle(axis, at - start)).add(origin).addScaledVector(axis, (pitch || 0) * (at - start));
      else hand.goal.copy(grip).addScaledVector(axis, at - start);
      return time < Math.abs(goal - start) / speed + 0.5;
    },
    done() {
      sim.drop(hand);
      sim.drop(other);
    },
  };
}

