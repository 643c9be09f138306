// Builds ../src/report/assets/viewer.js: the sources with three.js and rapier, whose WebAssembly is taken out of its
// package, deflated, and put back as text that is unpacked only when something is touched.
import { readFileSync } from 'node:fs';
import { deflateRawSync } from 'node:zlib';
import { build } from 'esbuild';

const WASM = /\w+\.toByteArray\("([A-Za-z0-9+/=]{1000000,})"\)\.buffer/;

const packEngine = {
  name: 'pack-engine',
  setup(bundler) {
    let packed = null;
    const take = (path) => {
      const source = readFileSync(path, 'utf8');
      const found = source.match(WASM);
      if (!found) throw new Error('rapier no longer carries its WebAssembly as expected');
      packed = deflateRawSync(Buffer.from(found[1], 'base64'), { level: 9 }).toString('base64');
      return source.replace(WASM, () => 'palpateEngineBytes()');
    };
    bundler.onLoad({ filter: /rapier3d-compat\/dist\/rapier\.mjs$/ }, ({ path }) => ({
      contents: `import { engineBytes as palpateEngineBytes } from 'engine-bytes';\n${take(path)}`,
      loader: 'js',
    }));
    bundler.onResolve({ filter: /^engine-bytes$/ }, () => ({ path: new URL('src/engine_bytes.js', import.meta.url).pathname }));
    bundler.onResolve({ filter: /^packed-engine$/ }, () => ({ path: 'packed-engine', namespace: 'packed' }));
    bundler.onLoad({ filter: /.*/, namespace: 'packed' }, () => ({ contents: packed, loader: 'text' }));
  },
};

await build({
  entryPoints: [new URL('src/main.js', import.meta.url).pathname],
  bundle: true, minify: true, format: 'iife', target: 'es2022', legalComments: 'eof', charset: 'ascii',
  outfile: new URL('../src/report/assets/viewer.js', import.meta.url).pathname,
  // The licence asks that a copy says so; the page carries this file alone.
  footer: { js: '/*! Bundles rapier 0.21.0, copyright Dimforge EURL, Apache License 2.0: https://www.apache.org/licenses/LICENSE-2.0 */' },
  plugins: [packEngine],
});
