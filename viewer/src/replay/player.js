// Plays an interaction again: a choice of touches, a button, a time to drag; and a button beside every touch further down.
import { element } from '../dom.js';
import { Film } from './film.js';

/** Longer recordings are shortened to this by playing them faster, s. */
const LONGEST = 8;

const KEY = [['measured', 'as measured'], ['ghost', 'as predicted'], ['force', 'force of the tool']];

export class Player {
  constructor(root, stage, replays, film, sim) {
    Object.assign(this, { root, stage, replays, film, sim, playing: false });
    this.build(root.querySelector('.scene-play'));
    this.buttons();
    sim.on('state', () => sim.world && this.leave());
    sim.on('reset', () => this.leave());
  }

  build(box) {
    this.select = element('select', { 'aria-label': 'Interaction to see again' }, element('option', { value: '' }, 'Choose a touch \u2026'),
      ...this.replays.map((r, i) => element('option', { value: i }, `${r.name} (${r.kind}${r.held_out ? ', held out' : ''})`)));
    this.select.addEventListener('change', () => (this.select.value === '' ? this.home() : this.open(this.replays[Number(this.select.value)])));
    this.button = element('button', { type: 'button', class: 'plain' }, 'Play');
    this.button.addEventListener('click', () => (this.playing ? this.halt() : this.run()));
    this.time = element('input', { type: 'range', min: 0, max: 1, step: 0.001, value: 0, 'aria-label': 'Time of the replay' });
    this.time.addEventListener('input', () => {
      this.halt();
      this.at(Number(this.time.value));
    });
    this.shown = element('output', { class: 'num' });
    this.key = element('ul', { class: 'legend' }, ...KEY.map(([name, text]) => element('li', { class: `key-${name}` }, text)));
    const group = element('div', { class: 'play-group replay', role: 'group', 'aria-label': 'Replay of what was recorded' },
      element('span', { class: 'play-name' }, 'Seen again'), this.select, this.button, this.time, this.shown, this.key);
    box.append(group);
    this.refresh();
  }

  buttons() {
    for (const touch of document.querySelectorAll('details.interaction[data-touch]')) {
      const replay = this.replays.find((r) => r.name === touch.dataset.touch);
      if (!replay) continue;
      const button = element('button', { type: 'button', class: 'plain see' }, 'See it in the scene');
      button.addEventListener('click', () => {
        this.root.scrollIntoView({ block: 'start' });
        this.open(replay);
        this.button.focus({ preventScroll: true });
      });
      touch.querySelector('summary').after(element('p', { class: 'see-row' }, button));
    }
  }

  open(replay) {
    this.sim.reset();
    this.replay = replay;
    this.select.value = String(this.replays.indexOf(replay));
    [this.begin, this.end] = Film.span(replay);
    this.speed = Math.max(1, (this.end - this.begin) / LONGEST);
    this.film.start(replay);
    this.at(0);
    this.run();
    const ghost = Object.keys(replay.predicted).length;
    this.sim.say(`${replay.name}: ${ghost ? 'in its colours as measured, in orange where the twin has it elsewhere' : 'as measured; the twin predicts no motion of it'}.`);
  }

  /** Shows a share of the whole, 0 to 1. */
  at(share) {
    this.share = share;
    const t = this.begin + share * (this.end - this.begin);
    const force = this.film.show(t);
    this.time.value = share;
    const seconds = `${(t - this.begin).toFixed(2)} s`;
    this.shown.textContent = force === null ? seconds : `${seconds}, ${force.toFixed(force < 10 ? 2 : 1)} N`;
  }

  run() {
    if (!this.replay) return;
    if (this.share >= 1) this.at(0);
    this.playing = true;
    let last = null;
    const frame = (now) => {
      if (!this.playing) return;
      const passed = last === null ? 0 : (now - last) / 1000;
      last = now;
      this.at(Math.min(1, this.share + (passed * this.speed) / Math.max(1e-6, this.end - this.begin)));
      if (this.share >= 1) this.halt();
      else requestAnimationFrame(frame);
    };
    requestAnimationFrame(frame);
    this.refresh();
  }

  halt() {
    this.playing = false;
    this.refresh();
  }

  /** A hand or the engine takes over: the recording ends, things stay where it had them. */
  leave() {
    if (!this.replay) return;
    this.playing = false;
    this.replay = null;
    this.film.stop();
    this.select.value = '';
    this.refresh();
    this.stage.draw();
  }

  home() {
    this.leave();
    this.sim.reset();
  }

  refresh() {
    const idle = !this.replay;
    this.button.textContent = this.playing ? 'Pause' : 'Play';
    this.button.hidden = this.time.hidden = this.shown.hidden = this.key.hidden = idle;
    this.key.querySelector('.key-ghost').hidden = idle || !Object.keys(this.replay.predicted).length;
    this.key.querySelector('.key-force').hidden = idle || !this.replay.force;
  }
}
