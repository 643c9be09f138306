// What couples motions, as stiff springs and dampers between them, by the laws of src/export/coupled.rs: a joint and the one that it
// follows, the turn and the advance of a screw.
import { STEP } from './world.js';

/** Stiffness and damping between a joint and the one that it follows, over inertia and step: as stiff as with the shorter step there. */
const FOLLOWING = [0.4, 0.5];
/** The same of a thread, which carries what hangs on it: as stiff as one step bears. */
const THREAD = [0.5, 0.5];

/** A stiff spring and damper between a joint and its leader. */
export function follow(world, part, leader, ratio) {
  const [own, other] = [world.jointState(part), world.jointState(leader)];
  const inertia = 1 / (1 / world.inertia(part, own.axis) + (ratio * ratio) / world.inertia(leader, other.axis));
  const [stiffness, damping] = [(FOLLOWING[0] * inertia) / (STEP * STEP), (FOLLOWING[1] * inertia) / STEP];
  const effort = stiffness * (ratio * other.value - own.value) + damping * (ratio * other.speed - own.speed);
  world.load(part, own.axis, effort);
  world.load(leader, other.axis, -ratio * effort);
}

/** Holds the advance of a screw to pitch times turn; what is pushed along the axis turns, by virtual work. */
export function thread(world, part) {
  const { pitch } = part.data.joint;
  const [turn, slide] = [world.jointState(part), world.advance(part)];
  const yields = (p) => (p.data.anchored ? 0 : 1 / p.data.mass + pitch * pitch * world.yields(p, turn.axis));
  const inertia = 1 / Math.max(yields(part) + yields(part.parent), 1e-12);
  const [stiffness, damping] = [(THREAD[0] * inertia) / (STEP * STEP), (THREAD[1] * inertia) / STEP];
  const force = stiffness * (pitch * turn.value - slide.value) + damping * (pitch * turn.speed - slide.speed);
  world.pushApart(part, turn.axis, force);
  world.load(part, turn.axis, -pitch * force);
}

/** A turn of which the engine tells what is left of whole rounds, as the one nearest to `about`. */
export function wholeTurns(turn, about) {
  return turn + 2 * Math.PI * Math.round((about - turn) / (2 * Math.PI));
}
