// Mouse, pen and touch on the scene: what is under the pointer is taken and follows it, or a finger pushes.
import { Plane, Raycaster, Vector2, Vector3 } from 'three';
import { Finger, FINGER, Hand, HOLD } from './hand.js';

/** The plane through a point that faces the viewer as far as it may and holds `along`. */
function facing(stage, point, along) {
  const sight = stage.camera.position.clone().sub(point);
  sight.addScaledVector(along, -sight.dot(along));
  return new Plane().setFromNormalAndCoplanarPoint(sight.normalize(), point);
}

export class Pointer {
  constructor(stage, sim, links) {
    Object.assign(this, { stage, sim, links });
    this.tool = 'lift';
    this.ray = new Raycaster();
    this.held = null;
    const { canvas } = stage;
    canvas.addEventListener('pointerdown', (e) => this.down(e), { capture: true });
    canvas.addEventListener('pointermove', (e) => this.move(e));
    for (const end of ['pointerup', 'pointercancel', 'lostpointercapture']) canvas.addEventListener(end, (e) => this.up(e));
    // A touch that begins on a thing takes it; elsewhere it scrolls or turns as before.
    canvas.addEventListener('touchstart', (e) => {
      if (e.touches.length === 1 && (this.held || this.under(e.touches[0]))) e.preventDefault();
    }, { passive: false });
  }

  aim(event) {
    const box = this.stage.canvas.getBoundingClientRect();
    const at = new Vector2((2 * (event.clientX - box.left)) / box.width - 1, 1 - (2 * (event.clientY - box.top)) / box.height);
    this.ray.setFromCamera(at, this.stage.camera);
    return this.ray.ray;
  }

  /** The nearest thing under the pointer that can be taken, with the point. */
  under(event) {
    this.aim(event);
    this.stage.scene.updateMatrixWorld();
    const meshes = this.links.filter((l) => l.mesh).map((l) => l.mesh);
    const [hit] = this.ray.intersectObjects(meshes, false);
    if (!hit) return null;
    const link = this.links.find((l) => l.mesh === hit.object);
    const part = this.sim.physics.parts.find((p) => p.link === link.data.name);
    return part ? { link, part, point: hit.point.clone() } : null;
  }

  down(event) {
    if (event.button !== 0 || this.held || !this.sim.physics) return;
    const found = this.under(event);
    if (!found) return;
    // The view does not turn meanwhile.
    this.stage.controls.enabled = false;
    this.stage.canvas.setPointerCapture(event.pointerId);
    this.held = { id: event.pointerId, found, plane: null, hand: null, last: { clientX: event.clientX, clientY: event.clientY } };
    this.begin(this.held);
    this.onChoose?.(found.link.data.name);
  }

  async begin(held) {
    const { sim } = this;
    sim.stopDeed();
    await sim.play();
    if (this.held !== held) return;
    const part = sim.world.part(held.found.link.data.name);
    if (!part) return;
    sim.remember(part);
    held.plane = this.planeFor(part, held.found.point);
    if (this.tool === 'push') {
      const start = held.found.point.clone().addScaledVector(this.ray.ray.direction, -1.5 * FINGER);
      held.plane = new Plane().setFromNormalAndCoplanarPoint(sim.world.up, start);
      held.hand = sim.add(new Finger(sim.world, start));
    } else {
      // A lid turns in the hand that opens it.
      const swings = part.data.joint && part.data.joint.kind !== 'fixed';
      held.hand = sim.add(new Hand(sim.world, part, held.found.point, swings ? HOLD.point : HOLD.turn));
      // To open a drawer takes two hands: the other holds what it hangs on.
      const opens = this.tool === 'lift' && part.data.joint?.motion?.alone;
      if (opens) held.other = sim.add(Hand.aside(sim.world, part.parent));
    }
    held.offset = this.on(held.plane, held.last).sub(held.hand.goal);
    sim.changed();
  }

  /** Where the pointer goes in space: a slide along its axis, a lid around it, all else as the tool says. */
  planeFor(part, point) {
    const { world } = this.sim;
    const { up } = world;
    const motion = part.data.joint?.motion;
    if (motion?.alone && this.tool === 'lift') {
      const axis = part.axis.clone().applyQuaternion(world.rotation(part));
      if (!motion.turns) return facing(this.stage, point, axis);
      const plane = new Plane().setFromNormalAndCoplanarPoint(axis, point);
      const sight = this.stage.camera.position.clone().sub(point).normalize();
      if (Math.abs(sight.dot(axis)) > 0.25) return plane;
    }
    if (this.tool === 'slide') return new Plane().setFromNormalAndCoplanarPoint(up, point);
    return facing(this.stage, point, up);
  }

  on(plane, event) {
    const hit = this.aim(event).intersectPlane(plane, new Vector3());
    return hit || this.held.hand.goal.clone();
  }

  move(event) {
    if (!this.held) {
      if (event.pointerType === 'mouse') this.hover(event);
      return;
    }
    if (event.pointerId !== this.held.id) return;
    this.held.last = { clientX: event.clientX, clientY: event.clientY };
    const { hand, plane } = this.held;
    if (!hand) return;
    hand.goal.copy(this.bounded(this.on(plane, this.held.last).sub(this.held.offset)));
    clearTimeout(this.soon);
    this.soon = setTimeout(() => this.held?.hand instanceof Hand && this.sim.tell(true), 700);
  }

  /** Within reach, and not into the table. */
  bounded(goal) {
    const { world } = this.sim;
    const foot = new Vector3(...this.sim.physics.floor.point);
    const low = goal.clone().sub(foot).dot(world.up) - 0.004;
    if (low < 0) goal.addScaledVector(world.up, -low);
    const away = goal.clone().sub(this.stage.centre).clampLength(0, 4 * this.stage.radius);
    return away.add(this.stage.centre);
  }

  hover(event) {
    if (event.buttons) return;
    this.stage.canvas.style.cursor = this.sim.physics && this.under(event) ? 'pointer' : '';
  }

  up(event) {
    if (!this.held || event.pointerId !== this.held.id) return;
    const { hand, other } = this.held;
    this.held = null;
    this.stage.controls.enabled = true;
    [hand, other].filter(Boolean).forEach((h) => this.sim.drop(h));
  }
}
