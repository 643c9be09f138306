// Unpacks the scene: base64 of little-endian numbers into typed arrays.

function bytes(text) {
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
    positions: positions(mesh),
    indices: mesh.wide ? new Uint32Array(raw.buffer) : new Uint16Array(raw.buffer),
    colors: mesh.colors ? bytes(mesh.colors) : null,
    seen,
    mirrored,
  };
}

export function readScene(scene) {
  for (const link of scene.links) {
    link.mesh = link.mesh ? unpackMesh(link.mesh) : null;
    link.parts = link.parts.map(unpackMesh);
  }
  return scene;
}
