// Time: loads the engine when it is first needed, steps it while anything moves, shows where everything is, and stops by itself
// once all is at rest, so that a page that nobody touches costs nothing.
import { World, STEP } from './world.js';
import { memory, outcome } from './words.js';

/** A scene is at rest where nothing was faster than this, m/s, for this long, s. */
const SLOW = 2e-3;
const QUIET = 0.6;
/** Time at most for everything to come to rest before a hand comes, s, and how many steps of it are taken at once. */
const SETTLING = 0.4;
const AT_ONCE = 10;
/** No frame may spend longer on physics, ms: then time goes slower than the clock's. */
const BUDGET = 20;

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
    this.listeners = { said: [], state: [], reset: [] };
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

  /** A world that begins where everything is shown now, and has settled. */
  ready() {
    if (!this.physics) return Promise.reject(new Error('nothing can be moved here'));
    if (!this.coming) {
      const turn = {};
      this.turn = turn;
      this.coming = this.start(turn);
    }
    return this.coming;
  }

  async start(turn) {
    const first = !engine;
    if (first) this.say('The engine starts \u2026');
    const rapier = await loadEngine();
    const world = new World(rapier, this.physics, this.meshes);
    for (const part of world.parts.filter((p) => p.body)) {
      const link = this.posed.get(part.data.link);
      if (link) world.place(part, link.group.matrix);
    }
    for (let left = Math.round(SETTLING / STEP); left > 0; left -= AT_ONCE) {
      for (let i = 0; i < AT_ONCE; i++) world.step();
      await new Promise((go) => { setTimeout(go); });
      if (world.time > SETTLING / 4 && world.unrest() < SLOW) break;
    }
    if (this.turn !== turn) {
      world.free();
      return this.ready();
    }
    this.world = world;
    if (first) this.say('Physics runs. Take hold of something.');
    this.show();
    this.changed();
    return world;
  }

  /** Leaves the engine; everything stays where it is shown. */
  leave() {
    this.pause();
    this.hands = [];
    Object.assign(this, { deed: null, grip: null, left: false, before: null });
    // What is still starting ends as nobody's.
    this.coming = null;
    this.turn = null;
    this.world?.free();
    this.world = null;
    this.onShow?.();
    this.changed();
  }

  /** Back to the first view. */
  reset() {
    this.leave();
    for (const link of this.links) {
      link.group.matrix.copy(link.start);
      link.group.matrixWorldNeedsUpdate = true;
    }
    this.joints.home();
    this.stage.draw();
    this.listeners.reset.forEach((l) => l());
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

  /** Lets go of what a key or a deed holds. */
  release() {
    const { grip } = this;
    this.grip = null;
    if (grip) this.drop(grip);
    if (this.world) this.play();
  }

  /** Ends what a hand does by itself, and lets go. */
  stopDeed() {
    if (this.deed) this.finish();
    this.release();
    [...this.hands].forEach((hand) => this.drop(hand));
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
