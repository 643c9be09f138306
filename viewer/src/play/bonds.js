// Bonds between bodies, which give way at a force. The engine does not tell the force in a joint, so it is had from Newton's law
// for what hangs on one end: mass times acceleration less gravity, hands and contacts.
import { Vector3 } from 'three';
import { ROUNDS, STEP, vec } from './world.js';

/** Share of the force in one step that goes into its running mean: the mean is over some 20 ms. */
const SHARE = 0.1;
const UNTURNED = { x: 0, y: 0, z: 0, w: 1 };

export class Bonds {
  constructor(world, bonds) {
    this.world = world;
    this.list = bonds.map((data) => this.bond(data)).filter(Boolean);
  }

  bond({ ends, breakaway }) {
    const [a, b] = ends.map((i) => this.world.parts[i]);
    if (!a.body || !b.body) return null;
    const { JointData } = this.world.rapier;
    const data = JointData.fixed(b.start.clone().sub(a.start), UNTURNED, new Vector3(), UNTURNED);
    const joint = this.world.world.createImpulseJoint(data, a.body, b.body, true);
    joint.setContactsEnabled(false);
    b.body.setAdditionalPgsIterations(ROUNDS);
    return { ends: [a, b], joint, breakaway, force: 0, broken: false };
  }

  /** Everything that hangs on `part`, joints and other bonds followed, but for `without`. */
  side(part, without) {
    const found = new Set([part]);
    for (const at of found) {
      for (const p of this.world.parts) {
        if (p.parent === at) found.add(p);
        if (at.parent === p) found.add(p);
      }
      for (const other of this.list) {
        if (other === without || other.broken || !other.ends.includes(at)) continue;
        other.ends.forEach((end) => found.add(end));
      }
    }
    return found;
  }

  get breakable() {
    return this.list.filter((b) => !b.broken && b.breakaway !== null && b.breakaway !== undefined);
  }

  before() {
    for (const bond of this.breakable) {
      const sides = bond.ends.map((end) => this.side(end, bond));
      // Where the ends are held together in another way too, no law parts the two.
      if (sides[0].has(bond.ends[1])) { bond.side = null; continue; }
      // A hand's force is not known either, so the end without a hand, and of those the one that touches less.
      const known = (side) => [...side].reduce((n, p) => n + (this.world.touches(p) ? 1 : 0) + (p === this.world.held ? 1000 : 0), 0);
      const [a, b] = sides.map(known);
      bond.side = [...sides[a <= b ? 0 : 1]].filter((p) => p.body);
      bond.speeds = bond.side.map((p) => vec(p.body.linvel()));
    }
  }

  after() {
    for (const bond of this.breakable) {
      if (!bond.side) continue;
      const force = new Vector3();
      bond.side.forEach((p, i) => {
        const change = vec(p.body.linvel()).sub(bond.speeds[i]).divideScalar(STEP).sub(this.world.gravity);
        force.addScaledVector(change, p.data.mass);
      });
      force.sub(this.pushes(bond.side));
      bond.force += SHARE * (force.length() - bond.force);
      if (bond.force > bond.breakaway) {
        bond.broken = true;
        this.world.world.removeImpulseJoint(bond.joint, true);
      }
    }
  }

  /** What everything else does to `side` by contact, without friction, N: the engine tells no more of a contact. */
  pushes(side) {
    const { world } = this.world;
    const own = new Set(side.flatMap((p) => p.colliders.map((c) => c.handle)));
    const force = new Vector3();
    for (const c of side.flatMap((p) => p.colliders)) {
      world.contactPairsWith(c, (other) => {
        if (own.has(other.handle)) return;
        world.contactPair(c, other, (m, flipped) => {
          const normal = vec(m.normal());
          for (let i = 0; i < m.numContacts(); i++) force.addScaledVector(normal, ((flipped ? 1 : -1) * m.contactImpulse(i)) / STEP);
        });
      });
    }
    return force;
  }

  get broken() {
    return this.list.filter((b) => b.broken).map((b) => b.ends.map((p) => p.data.link));
  }
}
