// A hand that holds one thing by a point and a finger that pushes: what they can do is bounded, as a hand is.
import { Vector3 } from 'three';
import { vec } from './world.js';

/** A hand does not pull harder than this, N, nor turn harder than this, N·m. */
const STRENGTH = 60;
const TWIST = 2;
/** How fast a hand follows with a place and with a turn, 1/s. */
const QUICK = 60;
const QUICK_TURN = 150;
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

/** Holds a part by a point of it, world. A part that hangs on a joint is held by the point alone and may turn about it. */
export class Hand {
  constructor(world, part, point, aside = false) {
    this.world = world;
    this.part = part;
    this.goal = point.clone();
    this.from = point.clone();
    const { RigidBodyDesc, JointData } = world.rapier;
    const turn = part.body.rotation();
    this.body = world.world.createRigidBody(RigidBodyDesc.kinematicPositionBased().setTranslation(point.x, point.y, point.z).setRotation(turn));
    const grip = point.clone().sub(vec(part.body.translation())).applyQuaternion(world.rotation(part).invert());
    this.grip = grip;
    this.aside = aside;
    if (aside) {
      world.world.createImpulseJoint(JointData.fixed(new Vector3(), UNTURNED, grip, UNTURNED), this.body, part.body, true);
      return;
    }
    this.joint = world.world.createImpulseJoint(JointData.generic(new Vector3(), grip, { x: 1, y: 0, z: 0 }, 0), this.body, part.body, true);
    const swings = part.data.joint && part.data.joint.kind !== 'fixed';
    this.motors(swings ? 3 : 6);
    world.held = part;
  }

  /** The other hand, which holds on and does not give. */
  static aside(world, part) {
    return new Hand(world, part, world.comOf(part), true);
  }

  motors(count) {
    const { rawSet, handle } = this.joint;
    for (let axis = 0; axis < count; axis++) {
      const quick = axis < 3 ? QUICK : QUICK_TURN;
      rawSet.jointConfigureMotorPosition(handle, axis, 0, quick * quick, 2 * quick);
      rawSet.jointSetMotorMaxForce(handle, axis, axis < 3 ? STRENGTH : TWIST);
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
