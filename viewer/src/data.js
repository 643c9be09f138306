// Unpacks the scene: base64 of little-endian numbers into typed arrays.

/** Base64 as bytes. */
export function bytes(text) {
  const raw = atob(text);
  const out = new Uint8Array(raw.length);
  for (let i = 0; i < raw.length; i++) out[i] = raw.charCodeAt(i);
  return out;
}

function positions(mesh) {
  const counts = new Uint16Array(bytes(mesh.positions).buffer);
  const out = new Float32Array(counts.length);
  for (let i = 0; i < counts.length; i++) {
    const k = i % 3;
    out[i] = mesh.low[k] + (counts[i] / 65535) * mesh.span[k];
  }
  return out;
}

function flags(text, count) {
  if (!text) return null;
  const packed = bytes(text);
  return Array.from({ length: count }, (_, i) => (packed[i >> 3] >> (i & 7)) & 1);
}

function unpackMesh(mesh) {
  const raw = bytes(mesh.indices);
  const seen = flags(mesh.seen, mesh.vertices);
  const mirrored = flags(mesh.mirrored, mesh.vertices);
  return {
    file: mesh.file,
    positions: positions(mesh),
    indices: mesh.wide ? new Uint32Array(raw.buffer) : new Uint16Array(raw.buffer),
    colors: mesh.colors ? bytes(mesh.colors) : null,
    seen,
    mirrored,
  };
}

/** A path as rows: times in s, places in m (or N), turns as quaternions or none. */
function unpackPath(path) {
  if (!path) return null;
  const times = Array.from(new Uint16Array(bytes(path.times).buffer), (c) => path.start + (c / 65535) * path.lasts);
  const counts = new Uint16Array(bytes(path.places).buffer);
  const turns = path.turns ? new Int16Array(bytes(path.turns).buffer) : null;
  const places = times.map((_, i) => [0, 1, 2].map((k) => path.low[k] + (counts[3 * i + k] / 65535) * path.span[k]));
  return { times, places, turns: turns && times.map((_, i) => Array.from(turns.subarray(4 * i, 4 * i + 4), (x) => x / 32767)) };
}

function unpackReplay(replay) {
  const all = (paths) => Object.fromEntries(Object.entries(paths).map(([name, path]) => [name, unpackPath(path)]));
  return { ...replay, measured: all(replay.measured), predicted: all(replay.predicted), tool: unpackPath(replay.tool), force: unpackPath(replay.force) };
}

export function readScene(scene) {
  for (const link of scene.links) {
    link.mesh = link.mesh ? unpackMesh(link.mesh) : null;
    link.parts = link.parts.map(unpackMesh);
  }
  scene.replays = (scene.replays || []).map(unpackReplay);
  return scene;
}
