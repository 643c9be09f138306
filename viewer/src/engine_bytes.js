// The engine's WebAssembly, unpacked on first use.
import packed from 'packed-engine';
import { bytes } from './data.js';

/** A promise of the module's bytes. */
export async function engineBytes() {
  const stream = new Blob([bytes(packed)]).stream().pipeThrough(new DecompressionStream('deflate-raw'));
  return new Response(stream).arrayBuffer();
}
