// The buttons below the scene, and what is said.
import { Vector3 } from 'three';
import { element } from '../dom.js';
import { lift, open, push } from './deeds.js';

const TOOLS = [
  ['lift', 'Lift', 'What you drag goes up, down and sideways; drawers and lids follow their joints'],
  ['slide', 'Slide', 'What you drag goes over the table'],
  ['push', 'Finger', 'A fingertip pushes what is in its way and holds nothing'],
];

function button(text, act, hint, kind = 'plain') {
  const out = element('button', { type: 'button', class: kind, title: hint }, text);
  out.addEventListener('click', act);
  return out;
}

export class Bar {
  constructor(root, stage, sim, pointer) {
    Object.assign(this, { root, stage, sim, pointer });
    const box = root.querySelector('.scene-play');
    box.append(this.time(), this.tools(), this.things(), this.hint(), this.said());
    sim.on('said', (words) => { this.status.textContent = words; });
    sim.on('state', () => this.refresh());
    pointer.onChoose = (name) => { this.select.value = name; this.refresh(); };
    this.refresh();
  }

  time() {
    this.playing = button('', () => (this.sim.running ? this.sim.pause() : this.sim.play()), 'Physics runs by itself once a thing is touched');
    this.again = button('Reset', () => { this.sim.reset(); this.sim.say('Everything is where it was first seen.'); }, 'Everything back to the first view');
    return element('div', { class: 'play-group', role: 'group', 'aria-label': 'Time' }, this.playing, this.again);
  }

  tools() {
    const box = element('fieldset', { class: 'play-group tools' }, element('legend', { class: 'unseen' }, 'What dragging does'));
    for (const [value, text, hint] of TOOLS) {
      const input = element('input', { type: 'radio', name: 'palpate-tool', value });
      input.checked = value === this.pointer.tool;
      input.addEventListener('change', () => { this.pointer.tool = value; });
      box.append(element('label', { title: hint }, input, element('span', {}, text)));
    }
    return box;
  }

  things() {
    const parts = this.sim.physics.parts.filter((p) => p.hulls.length);
    this.select = element('select', { 'aria-label': 'Thing' }, ...parts.map((p) => element('option', { value: p.link }, p.link)));
    this.select.addEventListener('change', () => this.refresh());
    this.lifting = button('Lift it', () => this.does((part) => lift(this.sim, part)), 'A hand takes it and raises it by 120 mm');
    this.pushing = button('Push it', () => this.does((part) => push(this.sim, part, this.heading())), 'A finger pushes it away from you by 60 mm');
    this.opening = button('Open or shut it', () => this.does((part) => open(this.sim, part)), 'One hand holds what it hangs on, another pulls');
    this.free = button('Let go', () => this.sim.release(), 'The hand opens', 'plain strong');
    return element('div', { class: 'play-group', role: 'group', 'aria-label': 'Without a pointer' }, this.select, this.lifting, this.pushing, this.opening, this.free);
  }

  hint() {
    const rows = [
      ['Mouse or finger', 'Drag a thing to move it, the table to turn the view. Lift follows you upwards, Slide stays at one height, Finger only pushes. Drawers and lids follow their joints.'],
      ['Keyboard', 'In the scene, N and P choose a thing, Enter takes it and lets it go; arrow keys move what is held over the table, Page Up and Page Down lift and lower it. With nothing held, arrow keys turn the view, + and \u2212 zoom, 0 shows all.'],
      ['What it does not do', 'Things do not bend: what a soft thing gives under a finger is not shown. No hand is stronger than 60 N.'],
    ];
    const list = element('dl', {}, ...rows.flatMap(([dt, dd]) => [element('dt', {}, dt), element('dd', {}, dd)]));
    return element('details', { class: 'play-hint' }, element('summary', {}, 'How to take hold'), list);
  }

  said() {
    this.status = element('p', { class: 'play-said', role: 'status', 'aria-live': 'polite' }, 'Nothing has been touched yet.');
    return this.status;
  }

  chosen() {
    return this.select.value;
  }

  choose(step) {
    const count = this.select.options.length;
    if (!count) return;
    this.select.selectedIndex = (this.select.selectedIndex + step + count) % count;
    this.sim.say(`${this.chosen()} is chosen. Enter takes it.`);
    this.refresh();
  }

  /** Level, away from the viewer. */
  heading() {
    const away = new Vector3();
    this.stage.camera.getWorldDirection(away);
    return away.addScaledVector(this.stage.up, -away.dot(this.stage.up)).normalize();
  }

  async does(make) {
    this.sim.stopDeed();
    await this.sim.play();
    const part = this.sim.world.part(this.chosen());
    if (part) this.sim.begin(make(part));
  }

  refresh() {
    this.playing.textContent = this.sim.running ? 'Pause' : 'Play';
    this.playing.setAttribute('aria-pressed', String(this.sim.running));
    const part = this.sim.physics.parts.find((p) => p.link === this.chosen());
    this.opening.hidden = !part?.joint?.motion?.alone;
    this.free.hidden = !this.sim.grip;
    this.onRefresh?.(this.chosen());
  }
}
