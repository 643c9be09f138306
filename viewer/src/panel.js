// Switches and sliders beside the scene.
import { element } from './dom.js';
import { showParts } from './links.js';

function toggle(box, text, on, change, hint) {
  const input = element('input', { type: 'checkbox' });
  input.checked = on;
  input.addEventListener('change', () => change(input.checked));
  box.append(element('label', { class: 'switch', title: hint }, input, element('span', {}, text)));
}

function amount(freedom, value) {
  const turns = freedom.kind === 'r';
  const size = Math.abs(turns ? (value * 180) / Math.PI : 1000 * value).toFixed(1);
  const minus = value < 0 && Number(size) ? '\u2212' : '';
  return `${minus}${size}${turns ? '\u00b0' : ' mm'}`;
}

function slider(box, joints, joint, freedom, several, before) {
  const [low, high] = freedom.range;
  const input = element('input', { type: 'range', min: low, max: high, step: (high - low) / 400 });
  const name = several ? `${joint.data.name} (${freedom.kind === 'r' ? 'turn' : 'slide'})` : joint.data.name;
  input.value = 0;
  input.setAttribute('aria-label', `Move ${name}`);
  const shown = element('output', {}, amount(freedom, 0));
  input.addEventListener('input', () => {
    before();
    freedom.value = Number(input.value);
    shown.textContent = amount(freedom, freedom.value);
    joints.move();
  });
  const kind = element('span', { class: 'muted' }, ` ${joint.data.kind}`);
  box.append(element('label', { class: 'slider' }, element('span', { class: 'slider-name' }, name, kind, shown), input));
  const earlier = joint.shown;
  joint.shown = () => {
    earlier?.();
    input.value = freedom.value;
    shown.textContent = amount(freedom, freedom.value);
  };
}

/** `moving` is called before a slider moves a joint. */
export function buildPanel(root, stage, { links, joints, marks, moving, home }) {
  const switches = root.querySelector('.scene-switches');
  const show = (objects) => (on) => {
    objects.forEach((o) => { o.visible = on; });
    stage.draw();
  };
  toggle(switches, 'Names', true, (on) => {
    root.classList.toggle('no-labels', !on);
  }, 'Names of the links');
  const movable = joints.list.filter((j) => j.freedoms.length);
  if (movable.length) toggle(switches, 'Joints', true, show(movable.map((j) => j.marks)), 'Axes and ranges of the joints');
  if (marks.coms.length) toggle(switches, 'Centres of mass', false, show(marks.coms), 'With the ellipsoid that holds it at 95 %; grey where it is assumed');
  marks.coms.forEach((m) => { m.visible = false; });
  if (links.some((l) => l.data.parts.length)) {
    toggle(switches, 'Collision parts', false, (on) => {
      for (const link of links) {
        showParts(link, on);
        if (!link.mesh) continue;
        link.mesh.visible = !(on && link.data.parts.length);
      }
      stage.draw();
    }, 'The convex parts that a simulator collides');
  }
  if (links.some((l) => l.data.mesh?.seen)) {
    toggle(switches, 'What was not seen', false, (on) => {
      for (const link of links) {
        if (!link.mesh) continue;
        link.mesh.geometry.setAttribute('color', link.mesh.userData.colors[on ? 1 : 0]);
      }
      stage.draw();
    }, 'Blue: mirrored by its symmetry; orange: closed or filled in; no view showed either');
  }
  if (marks.planes.length) toggle(switches, 'Symmetry', false, show(marks.planes), 'Planes of reflection, the best three of each link');
  const sliders = root.querySelector('.scene-sliders');
  for (const joint of movable) {
    joint.freedoms.forEach((f) => slider(sliders, joints, joint, f, joint.freedoms.length > 1, moving));
  }
  const again = element('button', { type: 'button', class: 'plain' }, 'Start view');
  again.addEventListener('click', () => {
    home();
    stage.home();
  });
  switches.append(again);
}
