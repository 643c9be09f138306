// The scene to turn inside report.html: reads the data that the page carries and draws it. Fetches nothing.
import { readScene } from './data.js';
import { Stage } from './stage.js';
import { buildLinks } from './links.js';
import { buildJoints } from './joints.js';
import { buildMarks } from './marks.js';
import { buildPanel } from './panel.js';

function webglWorks() {
  try {
    const gl = document.createElement('canvas').getContext('webgl2');
    if (!gl) return false;
    gl.getExtension('WEBGL_lose_context')?.loseContext();
    return true;
  } catch {
    return false;
  }
}

function start() {
  const root = document.getElementById('scene');
  const text = document.getElementById('scene-data');
  if (!root || !text) return;
  const scene = readScene(JSON.parse(text.textContent));
  if (!webglWorks()) {
    root.classList.add('no-webgl');
    return;
  }
  const stage = new Stage(root.querySelector('.scene-view'), scene);
  const links = buildLinks(stage, scene);
  const joints = buildJoints(stage, scene, links);
  const marks = buildMarks(stage, scene, links);
  buildPanel(root, stage, { links, joints, marks });
  stage.begin();
  root.classList.add('ready');
}

try {
  start();
} finally {
  window.palpateReady = true;
}
