// A hand that holds one thing by a point and a finger that pushes: what they can do is bounded, as a hand is.
import { Vector3 } from 'three';
import { vec } from './world.js';

/** A hand does not pull harder than this, N, nor turn harder than this, N·m. */
const STRENGTH = 60;
const TWIST = 2;
/** How fast a hand follows with all that hangs on what it holds, 1/s. */
const QUICK = 60;
/** Its wrist: N·m/rad and N·m·s/rad. */
const WRIST = 40;
const WRIST_DAMPING = 0.5;
/** A motor of the engine whose stiffness is in N/m and N·m/rad. */
const BY_FORCE = 1;
const UNTURNED = { x: 0, y: 0, z: 0, w: 1 };
/** Radius of the fingertip, m. */
export const FINGER = 0.008;
/** No hand goes faster than this, m/s. */
const FASTEST = 0.6;

/** Moves `from` towards `to` by no more than `most`. */
function towards(from, to, most) {
  const way = to.clone().sub(from);
  return from.add(way.clampLength(0, most));
}

/** How a hand holds: by a point, about which what is held may turn; with its turn too; or fast, without giving. */
export const HOLD = { point: 3, turn: 6, fast: 0 };

/** Holds a part by a point of it, world. */
export class Hand {
  constructor(world, part, point, hold = HOLD.turn) {
    this.world = world;
    this.part = part;
    this.goal = point.clone();
    this.from = point.clone();
    const { RigidBodyDesc, JointData } = world.rapier;
    const turn = part.body.rotation();
    this.body = world.world.createRigidBody(RigidBodyDesc.kinematicPositionBased().setTranslation(point.x, point.y, point.z).setRotation(turn));
    const grip = point.clone().sub(vec(part.body.translation())).applyQuaternion(world.rotation(part).invert());
    this.grip = grip;
    if (hold === HOLD.fast) {
      world.world.createImpulseJoint(JointData.fixed(new Vector3(), UNTURNED, grip, UNTURNED), this.body, part.body, true);
      return;
    }
    this.joint = world.world.createImpulseJoint(JointData.generic(new Vector3(), grip, { x: 1, y: 0, z: 0 }, 0), this.body, part.body, true);
    this.motors(hold);
    world.held = part;
  }

  /** The other hand, which holds on and does not give. */
  static aside(world, part) {
    const hand = new Hand(world, part, world.comOf(part), HOLD.fast);
    hand.aside = true;
    return hand;
  }

  motors(count) {
    const { rawSet, handle } = this.joint;
    const mass = [...this.world.bonds.side(this.part, null)].reduce((sum, p) => sum + p.data.mass, 0);
    for (let axis = 0; axis < count; axis++) {
      const [stiffness, damping, most] = axis < 3 ? [mass * QUICK * QUICK, 2 * mass * QUICK, STRENGTH] : [WRIST, WRIST_DAMPING, TWIST];
      rawSet.jointConfigureMotorModel(handle, axis, BY_FORCE);
      rawSet.jointConfigureMotorPosition(handle, axis, 0, stiffness, damping);
      rawSet.jointSetMotorMaxForce(handle, axis, most);
    }
  }

  /** Where the held point is now, world. */
  get point() {
    return this.grip.clone().applyQuaternion(this.world.rotation(this.part)).add(this.world.position(this.part));
  }

  /** Called before each step of `dt` seconds. */
  follow(dt) {
    const next = towards(vec(this.body.translation()), this.goal, FASTEST * dt);
    this.body.setNextKinematicTranslation(next);
    // What is held does not fall asleep in the hand.
    this.part.body.wakeUp();
  }

  letGo() {
    if (this.world.held === this.part) this.world.held = null;
    this.world.world.removeRigidBody(this.body);
  }
}

/** A fingertip that goes where it is told and pushes what is in its way. */
export class Finger {
  constructor(world, point) {
    this.world = world;
    this.goal = point.clone();
    this.from = point.clone();
    const { RigidBodyDesc, ColliderDesc } = world.rapier;
    this.body = world.world.createRigidBody(RigidBodyDesc.kinematicPositionBased().setTranslation(point.x, point.y, point.z));
    world.world.createCollider(ColliderDesc.ball(FINGER).setFriction(0), this.body);
  }

  get point() {
    return vec(this.body.translation());
  }

  follow(dt) {
    this.body.setNextKinematicTranslation(towards(this.point, this.goal, 0.5 * FASTEST * dt));
  }

  letGo() {
    this.world.world.removeRigidBody(this.body);
  }
}
