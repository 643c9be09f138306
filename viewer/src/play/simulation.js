// Time: loads the engine when it is first needed, steps it while anything moves, shows where everything is, and stops by itself
// once all is at rest, so that a page that nobody touches costs nothing.
import { World, STEP } from './world.js';
import { memory, outcome } from './words.js';

/** A scene is at rest where nothing was faster than this, m/s, for this long, s. */
const SLOW = 2e-3;
const QUIET = 0.6;
/** No frame may spend longer on physics, ms: then time goes slower than the clock's. */
const BUDGET = 14;

let engine = null;

/** The engine, unpacked and compiled once. */
function loadEngine() {
  engine ||= import('@dimforge/rapier3d-compat').then(async (rapier) => {
    await rapier.init();
    return rapier;
  });
  return engine;
}

export class Simulation {
  constructor(stage, scene, links, joints) {
    Object.assign(this, { stage, links, joints, physics: scene.physics });
    this.meshes = new Map(scene.links.flatMap((l) => [l.mesh, ...l.parts]).filter(Boolean).map((m) => [m.file, m]));
    this.world = null;
    this.hands = [];
    this.deed = null;
    this.running = false;
    this.listeners = { said: [], state: [] };
    this.posed = new Map(links.map((l) => [l.data.name, l]));
  }

  on(what, listener) {
    this.listeners[what].push(listener);
  }

  say(words) {
    this.words = words;
    this.listeners.said.forEach((l) => l(words));
  }

  changed() {
    this.listeners.state.forEach((l) => l(this));
  }

  /** A world that begins where everything is shown now. */
  async ready() {
    const rapier = await loadEngine();
    if (this.world) return this.world;
    this.world = new World(rapier, this.physics, this.meshes);
    for (const part of this.world.parts.filter((p) => p.body)) {
      const link = this.posed.get(part.data.link);
      if (link) this.world.place(part, link.group.matrix);
    }
    this.changed();
    return this.world;
  }

  /** Back to the first view; the engine is left. */
  reset() {
    this.pause();
    this.hands = [];
    this.deed = null;
    this.grip = null;
    this.world?.free();
    this.world = null;
    for (const link of this.links) {
      link.group.matrix.copy(link.start);
      link.group.matrixWorldNeedsUpdate = true;
    }
    this.joints.home();
    this.stage.draw();
    this.changed();
  }

  async play() {
    await this.ready();
    if (this.running) return;
    this.running = true;
    this.quiet = 0;
    this.last = null;
    this.debt = 0;
    this.changed();
    requestAnimationFrame((now) => this.frame(now));
  }

  pause() {
    if (!this.running) return;
    this.running = false;
    this.changed();
  }

  frame(now) {
    if (!this.running || !this.world) return;
    const passed = this.last === null ? 1 / 60 : Math.min(0.05, (now - this.last) / 1000);
    this.last = now;
    this.debt += passed;
    const began = performance.now();
    while (this.debt >= STEP) {
      this.step();
      this.debt -= STEP;
      if (performance.now() - began > BUDGET) this.debt = 0;
    }
    this.show();
    this.quiet = this.hands.length || this.deed || this.world.unrest() > SLOW ? 0 : this.quiet + passed;
    if (this.quiet > QUIET) {
      this.settled();
      this.pause();
      return;
    }
    requestAnimationFrame((next) => this.frame(next));
  }

  step() {
    if (this.deed && !this.deed.step(STEP)) this.finish();
    for (const hand of this.hands) hand.follow(STEP);
    this.world.step();
  }

  /** So many seconds at once, for those who count: the page's own clock stands meanwhile. */
  advance(seconds) {
    for (let i = Math.round(seconds / STEP); i > 0; i--) this.step();
    this.show();
  }

  /** Puts every link, axis and slider where the engine has it. */
  show() {
    for (const part of this.world.parts) {
      const link = part.body && this.posed.get(part.data.link);
      if (!link) continue;
      link.group.matrix.copy(this.world.linkMatrix(part));
      link.group.matrixWorldNeedsUpdate = true;
    }
    this.joints.follow((name) => this.jointValue(name));
    this.onShow?.();
    this.stage.draw();
  }

  jointValue(name) {
    const part = this.world.parts.find((p) => p.data.joint?.name === name);
    return part && this.world.hasState(part) ? this.world.jointState(part).value : null;
  }

  /** Remembers where all is, so that it can be said what a hand did. */
  remember(part) {
    this.before = memory(this.world);
    this.handled = part;
  }

  tell(held) {
    if (!this.before || !this.handled) return;
    this.say(outcome(this.world, this.before, this.handled, held));
  }

  settled() {
    if (this.left) this.tell(false);
    this.left = false;
  }

  add(hand) {
    this.hands.push(hand);
    return hand;
  }

  drop(hand) {
    if (!this.hands.includes(hand)) return;
    this.hands = this.hands.filter((h) => h !== hand);
    if (this.world) hand.letGo();
    this.left = true;
    this.changed();
  }

  begin(deed) {
    this.deed = deed;
    this.changed();
  }

  finish() {
    const deed = this.deed;
    this.deed = null;
    deed.done();
    this.changed();
  }
}
