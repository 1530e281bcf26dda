// out/ktx2/random_uastc.ktx2: 256 UASTC blocks of pseudo-random bits, every mode 13 or 14 times, as no encoder
// produces; only blocks that Basis Universal's transcoder accepts are kept. random_uastc.decoded.png is its output.
import { readFileSync, writeFileSync } from "node:fs";
import { createRequire } from "node:module";
import { dirname, join } from "node:path";
import vm from "node:vm";
import { PNG } from "pngjs";
import * as KTX from "ktx-parse";
import { OUT } from "./file.mjs";
import { crc32 } from "./crc.mjs";

const require = createRequire(import.meta.url), folder = join(OUT, "ktx2");
const libs = join(dirname(require.resolve("three")), "../examples/jsm/libs/basis");
const BASIS = vm.runInThisContext(`(function(module, exports, require, __dirname){${readFileSync(join(libs, "basis_transcoder.js"), "utf8")}; return BASIS;})`)({}, {}, require, libs);
const basis = await BASIS({ wasmBinary: readFileSync(join(libs, "basis_transcoder.wasm")), print() {}, printErr() {} });
basis.initializeBasis();

// Another file's header with its one level replaced.
const template = new Uint8Array(readFileSync(join(folder, "busy_uastc.ktx2")));
function wrap(blocks, size) {
  const k = KTX.read(template);
  k.pixelWidth = k.pixelHeight = size;
  k.levels = [{ levelData: blocks, uncompressedByteLength: blocks.length }];
  return KTX.write(k, { keepWriter: true });
}
function unpack(file) {
  const f = new basis.KTX2File(file);
  try {
    if (!f.isValid() || !f.startTranscoding()) return null;
    const out = new Uint8Array(f.getImageTranscodedSizeInBytes(0, 0, 0, 13));
    return f.transcodeImage(out, 0, 0, 0, 13, 0, -1, -1) ? out : null;
  } finally {
    f.close();
    f.delete();
  }
}

let state = 12345;
const random = () => ((state = (Math.imul(state, 1664525) + 1013904223) >>> 0) >>> 24);
const MODES = [[1, 4], [0x35, 6], [0x1d, 5], [3, 5], [0x13, 5], [0xb, 5], [0x1b, 5], [7, 5], [0x17, 5], [0xf, 5], [2, 3], [0, 2], [6, 3], [0x1f, 5], [0xd, 5], [5, 7], [0x15, 6], [0x25, 6], [9, 4]];
const blocks = new Uint8Array(256 * 16);
let refused = 0;
for (let n = 0; n < 256; ) {
  const [code, bits] = MODES[n % 19], block = Uint8Array.from({ length: 16 }, random);
  block[0] = (block[0] & ~((1 << bits) - 1)) | code;
  if (!unpack(wrap(block, 4))) {
    if (++refused > 100000) throw new Error(`mode ${n % 19}`);
    continue;
  }
  blocks.set(block, 16 * n++);
}
const file = wrap(blocks, 64), pixels = unpack(file);
writeFileSync(join(folder, "random_uastc.ktx2"), file);
const image = new PNG({ width: 64, height: 64 });
image.data.set(pixels);
writeFileSync(join(folder, "random_uastc.decoded.png"), PNG.sync.write(image, { deflateLevel: 9 }));
console.log(`${refused} blocks refused, crc32 ${crc32(pixels)}`);
