// The scene by keyboard: N and P choose a thing, Enter takes it and lets it go, arrows, Page Up and Page Down move it.
import { Vector3 } from 'three';
import { Hand } from './hand.js';

/** How far a key moves the hand, m. */
const PACE = 0.01;

export class Keys {
  constructor(stage, sim, bar) {
    Object.assign(this, { stage, sim, bar });
    stage.onKey = (event) => this.key(event);
  }

  /** Level directions to the viewer's right and away from the viewer. */
  level() {
    const away = new Vector3();
    this.stage.camera.getWorldDirection(away);
    away.addScaledVector(this.stage.up, -away.dot(this.stage.up)).normalize();
    return { away, right: new Vector3().crossVectors(away, this.stage.up) };
  }

  /** True where the key was meant for a thing and not for the view. */
  key(event) {
    const { key } = event;
    const step = { n: 1, N: 1, p: -1, P: -1 }[key];
    if (step) {
      this.bar.choose(step);
      return true;
    }
    if (key === 'Enter') {
      if (this.sim.grip) this.letGo();
      else this.take();
      return true;
    }
    if (key === 'Escape' && this.sim.grip) {
      this.letGo();
      return true;
    }
    return this.sim.grip ? this.carry(key) : false;
  }

  carry(key) {
    const { away, right } = this.level();
    const { up } = this.stage;
    const way = {
      ArrowLeft: right.negate(), ArrowRight: right, ArrowUp: away, ArrowDown: away.clone().negate(),
      PageUp: up, PageDown: up.clone().negate(),
    }[key];
    if (!way) return false;
    const { goal } = this.sim.grip;
    goal.addScaledVector(way, PACE);
    const low = goal.clone().sub(new Vector3(...this.sim.physics.floor.point)).dot(up) - 0.004;
    if (low < 0) goal.addScaledVector(up, -low);
    this.sim.play();
    clearTimeout(this.soon);
    this.soon = setTimeout(() => this.sim.grip && this.sim.tell(true), 700);
    return true;
  }

  async take() {
    const name = this.bar.chosen();
    if (!name) return;
    this.sim.stopDeed();
    await this.sim.play();
    const part = this.sim.world.part(name);
    if (!part) return;
    this.sim.remember(part);
    this.sim.grip = this.sim.add(new Hand(this.sim.world, part, this.sim.world.comOf(part)));
    this.sim.changed();
    this.sim.say(`You hold ${name}. Arrow keys move it over the table, Page Up and Page Down lift and lower it, Enter lets go.`);
  }

  letGo() {
    this.sim.release();
  }
}
