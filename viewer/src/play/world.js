// The twin in the engine: bodies, table, joints with their losses and springs, bonds that give way. The same laws as in
// src/export/engine.rs. A body's frame has its origin at the part's and, at the first view, the axes of the world, so that a
// joint's axis is the same in both of its bodies.
import { Matrix4, Quaternion, Vector3 } from 'three';
import { colliders } from './colliders.js';
import { Bonds } from './bonds.js';
import { follow, thread, wholeTurns } from './coupled.js';

/** Step, s. */
export const STEP = 0.004;
/** The engine's measure of how large things are, m: how deep contacts may be and from where on they are foreseen go with it. */
const LENGTH = 0.3;
/** Rounds of the solver more for what is held together: a light drawer must carry its heavy chest. */
export const ROUNDS = 8;
/** Axes of a joint in the engine, by number: three slides, three turns. */
const TURN_X = 3;
/** The widest turn to either side that the engine tells from one the other way round, rad. */
const HALF_ROUND = 3;
const FREE = { revolute: 0b110111, screw: 0b110111, thread: 0b110110, prismatic: 0b111110, cylindrical: 0b110110, planar: 0b110001, spherical: 0b000111 };

export const vec = (v) => new Vector3(v.x, v.y, v.z);
const quat = (q) => new Quaternion(q.x, q.y, q.z, q.w);
const UNTURNED = { x: 0, y: 0, z: 0, w: 1 };

export class World {
  /** `meshes` by file; `rapier` is ready. */
  constructor(rapier, physics, meshes) {
    this.rapier = rapier;
    this.physics = physics;
    this.gravity = new Vector3(...physics.gravity);
    this.up = new Vector3(...physics.floor.normal);
    this.world = new rapier.World(this.gravity);
    this.world.timestep = STEP;
    this.world.lengthUnit = LENGTH;
    this.time = 0;
    this.pulls = [];
    this.parts = physics.parts.map((data, index) => ({ data, index, body: null }));
    this.addFloor();
    this.parts.forEach((part) => this.addPart(part, meshes));
    this.parts.forEach((part) => this.addJoint(part));
    this.bonds = new Bonds(this, physics.bonds);
  }

  free() {
    this.world.free();
  }

  /** The friction of a contact is the body's: the table's is nought and the greater of the two counts. */
  addFloor() {
    const { RigidBodyDesc, ColliderDesc, CoefficientCombineRule, HalfSpace } = this.rapier;
    const ground = this.world.createRigidBody(RigidBodyDesc.fixed().setTranslation(...this.physics.floor.point));
    const plane = new ColliderDesc(new HalfSpace(this.up)).setFriction(0).setFrictionCombineRule(CoefficientCombineRule.Max);
    this.world.createCollider(plane, ground);
  }

  addPart(part, meshes) {
    const { data } = part;
    const [x, y, z, ...q] = data.pose;
    part.start = new Vector3(x, y, z);
    part.turn = new Quaternion(...q);
    part.com = new Vector3(...data.com).applyQuaternion(part.turn);
    // World-from-link is the body's pose times this.
    part.bodyFromLink = new Matrix4().compose(new Vector3(...data.origin).applyQuaternion(part.turn), part.turn, new Vector3(1, 1, 1));
    const whole = this.physics.parts.filter((p) => p.tree === data.tree);
    // A tree of which nothing can touch the table would fall for ever.
    if (whole.every((p) => !p.hulls.length)) return;
    const { RigidBodyDesc } = this.rapier;
    const kind = data.anchored ? RigidBodyDesc.fixed() : RigidBodyDesc.dynamic();
    const principal = part.turn.clone().multiply(new Quaternion(...data.principal));
    const [a, b, c] = data.moments;
    kind.setTranslation(x, y, z).setCanSleep(true)
      .setAdditionalMassProperties(data.mass, part.com, { x: a, y: b, z: c }, principal);
    part.body = this.world.createRigidBody(kind);
    const groups = this.groupsOf(part.index);
    const shapes = colliders(this.rapier, data, part.turn, this.up, data.hulls.map((file) => meshes.get(file)).filter(Boolean));
    part.colliders = shapes.map((shape) => this.world.createCollider(shape.setCollisionGroups(groups), part.body));
  }

  /** What a joint holds together does not collide; said in groups too, of which there are sixteen, for speed. */
  groupsOf(index) {
    const { parts } = this.physics;
    const tied = (i) => parts.map((_, k) => k).filter((k) => parts[i].joint?.parent === k || parts[k].joint?.parent === i);
    const bits = parts.map((_, i) => i).filter((i) => tied(i).length).slice(0, 15);
    const bit = (i) => 1 << (1 + bits.indexOf(i));
    const own = bits.includes(index) ? bit(index) : 1;
    const others = tied(index).filter((i) => bits.includes(i)).reduce((all, i) => all | bit(i), 0);
    return ((own << 16) | (0xffff & ~others)) >>> 0;
  }

  addJoint(part) {
    const { joint } = part.data;
    const parent = joint && this.parts[joint.parent];
    if (!joint || !part.body || !parent.body) return;
    const { JointData } = this.rapier;
    const from = part.start.clone().sub(parent.start);
    const origin = new Vector3();
    part.axis = new Vector3(...joint.axis).normalize();
    const mask = FREE[joint.pitch ? 'thread' : joint.kind];
    const data = mask === undefined
      ? JointData.fixed(from, UNTURNED, origin, UNTURNED)
      : JointData.generic(from, origin, part.axis, mask);
    const made = this.world.createImpulseJoint(data, parent.body, part.body, true);
    made.setContactsEnabled(false);
    part.parent = parent;
    part.body.setAdditionalPgsIterations(ROUNDS);
    this.brake(made, joint);
  }

  /** Ends, and dry friction as a brake: a motor towards standstill that can do no more than the friction. */
  brake(joint, { motion, pitch }) {
    if (!motion) return;
    const axis = motion.turns ? TURN_X : 0;
    const raw = joint.rawSet;
    if (motion.range) {
      // The engine tells a turn within half a round only; beyond it a screw ends by its advance.
      const far = motion.turns && motion.range.some((end) => Math.abs(end) > HALF_ROUND);
      if (!far) raw.jointSetLimits(joint.handle, axis, ...motion.range);
      else if (pitch) raw.jointSetLimits(joint.handle, 0, ...motion.range.map((end) => end * pitch).sort((a, b) => a - b));
    }
    if (motion.friction > 0) {
      raw.jointConfigureMotorVelocity(joint.handle, axis, 0, 1e6);
      raw.jointSetMotorMaxForce(joint.handle, axis, motion.friction);
    }
  }

  part(name) {
    return this.parts.find((p) => p.data.link === name && p.body);
  }

  position(part) {
    return vec(part.body.translation());
  }

  rotation(part) {
    return quat(part.body.rotation());
  }

  /** World-from-link now. */
  linkMatrix(part) {
    return new Matrix4().compose(this.position(part), this.rotation(part), new Vector3(1, 1, 1)).multiply(part.bodyFromLink);
  }

  /** Puts a part where its link is shown, at rest. */
  place(part, linkMatrix) {
    const at = linkMatrix.clone().multiply(part.bodyFromLink.clone().invert());
    const [p, q] = [new Vector3(), new Quaternion()];
    at.decompose(p, q, new Vector3());
    part.body.setTranslation(p, true);
    part.body.setRotation(q, true);
    part.body.setLinvel({ x: 0, y: 0, z: 0 }, true);
    part.body.setAngvel({ x: 0, y: 0, z: 0 }, true);
  }

  comOf(part) {
    return part.com.clone().applyQuaternion(this.rotation(part)).add(this.position(part));
  }

  /** One step of STEP: springs, dampers and rolling resistance act on the state at its beginning. */
  step() {
    for (const part of this.parts) {
      if (!part.body) continue;
      part.body.resetForces(false);
      part.body.resetTorques(false);
    }
    for (const { part, force, point } of this.pulls.splice(0)) part.body.addForceAtPoint(force, point, true);
    this.parts.forEach((part) => this.spring(part));
    this.parts.forEach((part) => this.roll(part));
    this.bonds.before();
    this.world.step();
    this.bonds.after();
    this.time += STEP;
  }

  /** Position of a joint with one freedom and its speed: m or rad, from the first view. */
  jointState(part) {
    const { motion, pitch } = part.data.joint;
    if (!motion.turns) return this.advance(part);
    const axis = part.axis.clone().applyQuaternion(this.rotation(part));
    const q = this.rotation(part.parent).invert().multiply(this.rotation(part));
    const turned = 2 * Math.atan2(q.x * part.axis.x + q.y * part.axis.y + q.z * part.axis.z, q.w);
    const [low, high] = motion.range || [0, 0];
    const value = wholeTurns(turned, pitch ? this.advance(part).value / pitch : (low + high) / 2);
    const spin = vec(part.body.angvel()).sub(vec(part.parent.body.angvel()));
    return { value, speed: spin.dot(axis), axis };
  }

  /** How far a part went along its joint's axis, m, and how fast, m/s, from the first view. */
  advance(part) {
    const { parent } = part;
    const axis = part.axis.clone().applyQuaternion(this.rotation(part));
    const from = part.start.clone().sub(parent.start);
    const moved = this.position(part).sub(this.position(parent)).applyQuaternion(this.rotation(parent).invert()).sub(from);
    const at = part.body.translation();
    const slip = vec(part.body.velocityAtPoint(at)).sub(vec(parent.body.velocityAtPoint(at)));
    return { value: moved.dot(part.axis), speed: slip.dot(axis), axis };
  }

  /** Whether a part hangs on a joint with one freedom. */
  hasState(part) {
    return Boolean(part.body && part.parent && part.data.joint.motion?.alone);
  }

  spring(part) {
    if (!this.hasState(part)) return;
    const { motion, pitch, follows } = part.data.joint;
    if (motion.stiffness > 0 || motion.damping > 0) {
      const { value, speed, axis } = this.jointState(part);
      // No explicit damper may do more in a step than stop the part.
      const damping = Math.min(motion.damping, (0.5 * this.inertia(part, axis)) / STEP);
      this.load(part, axis, -motion.stiffness * (value - motion.rest) - damping * speed);
    }
    if (pitch) thread(this, part);
    const leader = follows && this.parts[follows.part];
    if (leader && this.hasState(leader)) follow(this, part, leader, follows.ratio);
  }

  /** Inertia of a part along its freedom, as if nothing hung on it: kg·m² or kg. */
  inertia(part, axis) {
    return part.data.joint.motion.turns ? 1 / Math.max(this.yields(part, axis), 1e-12) : part.data.mass;
  }

  /** Loads a joint, N·m or N, and its parent the other way. */
  load(part, axis, effort) {
    if (!part.data.joint.motion.turns) return this.pushApart(part, axis, effort);
    part.body.addTorque(axis.clone().multiplyScalar(effort), true);
    part.parent.body.addTorque(axis.clone().multiplyScalar(-effort), true);
  }

  /** A force along a joint's axis on its child, N, and the other way on its parent. */
  pushApart(part, axis, force) {
    const at = part.body.translation();
    part.body.addForceAtPoint(axis.clone().multiplyScalar(force), at, true);
    part.parent.body.addForceAtPoint(axis.clone().multiplyScalar(-force), at, true);
  }

  /** Turning about an axis per torque: axis · I⁻¹ axis. */
  yields(part, axis) {
    const { x, y, z } = axis;
    const [xx, xy, xz, yy, yz, zz] = part.body.effectiveWorldInvInertia().elements;
    return xx * x * x + yy * y * y + zz * z * z + 2 * (xy * x * y + xz * x * z + yz * y * z);
  }

  /** Resistance to rolling: a torque of the rolling length times the weight against the turn about level axes. */
  roll(part) {
    const length = part.data.rolling;
    if (!length || !part.body) return;
    const level = vec(part.body.angvel());
    level.addScaledVector(this.up, -level.dot(this.up));
    const rate = level.length();
    if (rate < 1e-9 || !this.touches(part)) return;
    const stop = (0.5 * Math.min(...part.data.moments) * rate) / STEP;
    part.body.addTorque(level.multiplyScalar(-Math.min(stop, length * part.data.mass * this.gravity.length()) / rate), true);
  }

  touches(part) {
    return part.colliders.some((c) => {
      let any = false;
      this.world.contactPairsWith(c, (other) => this.world.contactPair(c, other, (m) => { any ||= m.numSolverContacts() > 0; }));
      return any;
    });
  }

  /** The greatest speed of any part, m/s (a turn counts at 50 mm). */
  unrest() {
    const speeds = this.parts.filter((p) => p.body && !p.body.isSleeping()).map((p) => vec(p.body.linvel()).length() + 0.05 * vec(p.body.angvel()).length());
    return Math.max(0, ...speeds);
  }
}
