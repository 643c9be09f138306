// The scene to touch inside report.html: reads the data that the page carries and draws it. Fetches nothing.
import { readScene } from './data.js';
import { Stage } from './stage.js';
import { buildLinks } from './links.js';
import { buildJoints } from './joints.js';
import { buildMarks } from './marks.js';
import { buildPanel } from './panel.js';
import { Simulation } from './play/simulation.js';
import { Pointer } from './play/pointer.js';
import { Keys } from './play/keys.js';
import { Bar } from './play/bar.js';
import { TouchMarks } from './play/touch_marks.js';
import { Film } from './replay/film.js';
import { Player } from './replay/player.js';
import { exposeHandle } from './handle.js';
import { element } from './dom.js';

/** Hands, buttons and replays, where the twin can be put into an engine. */
function playable(root, stage, scene, { links, joints, sim }) {
  if (!scene.physics || !('DecompressionStream' in window)) {
    const why = scene.why_not || 'This browser is too old to unpack the engine (it lacks DecompressionStream).';
    root.querySelector('.scene-play').append(element('p', { class: 'play-said' }, `Nothing can be moved by hand here: ${why}`));
    return null;
  }
  const pointer = new Pointer(stage, sim, links);
  const bar = new Bar(root, stage, sim, pointer);
  new Keys(stage, sim, bar);
  const marks = new TouchMarks(stage, sim, links);
  sim.onShow = () => marks.update();
  exposeHandle(stage, sim, links, bar, pointer);
  const film = new Film(stage, links, joints);
  return new Player(root, stage, scene.replays, film, sim);
}

/** The stage, or none where the browser has no WebGL 2. */
function stageOf(root, scene) {
  // What three.js says of that to the console, the page says to the reader.
  const { error } = console;
  console.error = () => {};
  try {
    return new Stage(root.querySelector('.scene-view'), scene);
  } catch {
    root.classList.add('no-webgl');
    return null;
  } finally {
    console.error = error;
  }
}

function start() {
 const root = document.getElementById('scene');
  const text = document.getElementById('scene-data');
  if (!root || !text) return;
  const scene = readScene(JSON.parse(text.textContent));
 const stage = stageOf(root, scene);
  if (!stage) return;
 const links = buildLinks(stage, scene);
  const joints = buildJoints(stage, scene, links);
  const marks = buildMarks(stage, scene, links);
 const sim = new Simulation(stage, scene, links, joints);
  const player = playable(root, stage, scene, { links, joints, sim });
  buildPanel(root, stage, {
    links, joints, marks,
    moving: () => { player?.leave(); sim.leave(); },
    home: () => { player?.leave(); sim.reset(); },
  });
 stage.begin();
 root.classList.add('ready');
}

try {
  start();
} finally {
  window.palpateReady = true;
}
