// glTF and GLB files: reading with buffers, and building a GLB from JSON and byte chunks.
import { readFileSync, writeFileSync, mkdirSync, existsSync } from "node:fs";
import { dirname, join } from "node:path";
import { fileURLToPath } from "node:url";

export const OUT = join(dirname(fileURLToPath(import.meta.url)), "..", "..", "tests", "gltf");
mkdirSync(OUT, { recursive: true });

export const WIDTH = { SCALAR: 1, VEC2: 2, VEC3: 3, VEC4: 4, MAT2: 4, MAT3: 9, MAT4: 16 };
export const ARRAY = { 5120: Int8Array, 5121: Uint8Array, 5122: Int16Array, 5123: Uint16Array, 5125: Uint32Array, 5126: Float32Array };

export function load(path) {
  const data = new Uint8Array(readFileSync(path));
  if (!path.endsWith(".glb")) {
    const json = JSON.parse(new TextDecoder().decode(data));
    return { json, buffers: buffers(json, null, dirname(path)) };
  }
  const view = new DataView(data.buffer, data.byteOffset, data.byteLength);
  let json, bin, at = 12;
  while (at < data.length) {
    const length = view.getUint32(at, true), kind = view.getUint32(at + 4, true);
    const chunk = data.subarray(at + 8, at + 8 + length);
    if (kind === 0x4e4f534a) json = JSON.parse(new TextDecoder().decode(chunk));
    else if (kind === 0x004e4942) bin = chunk;
    at += 8 + length;
  }
  return { json, buffers: buffers(json, bin, dirname(path)) };
}

function buffers(json, bin, folder) {
  return (json.buffers ?? []).map((b, i) => {
    if (!b.uri) return i === 0 && bin ? bin : null;
    if (b.uri.startsWith("data:")) return new Uint8Array(Buffer.from(b.uri.split(",")[1], "base64"));
    const path = join(folder, decodeURIComponent(b.uri));
    return existsSync(path) ? new Uint8Array(readFileSync(path)) : null;
  });
}

export function bytes(array) {
  return new Uint8Array(array.buffer, array.byteOffset, array.byteLength);
}

// The raw values of an accessor with a plain buffer view, tightly packed.
export function plain({ json, buffers }, index) {
  const a = json.accessors[index], width = WIDTH[a.type], Type = ARRAY[a.componentType];
  const view = json.bufferViews[a.bufferView], source = buffers[view.buffer];
  const size = width * Type.BYTES_PER_ELEMENT, stride = view.byteStride ?? size;
  const from = (view.byteOffset ?? 0) + (a.byteOffset ?? 0);
  const out = new Uint8Array(size * a.count);
  for (let i = 0; i < a.count; i++) out.set(source.subarray(from + i * stride, from + i * stride + size), i * size);
  return new Type(out.buffer);
}

// A GLB being written: the JSON of a source without its accessors and views.
export class Glb {
  constructor(source) {
    this.json = structuredClone(source.json);
    this.json.asset.generator = "blinn test fixtures";
    this.json.bufferViews = [];
    this.json.accessors = [];
    this.chunks = [];
    this.length = 0;
    this.source = source;
  }

  // Copies the images of the source's buffer.
  keep_images() {
    for (const image of this.json.images ?? []) {
      if (image.bufferView === undefined) continue;
      const v = this.source.json.bufferViews[image.bufferView], at = v.byteOffset ?? 0;
      image.bufferView = this.view(this.source.buffers[v.buffer].subarray(at, at + v.byteLength));
    }
  }

  push(data) {
    const pad = -this.length & 3;
    this.chunks.push(new Uint8Array(pad), data);
    const at = this.length + pad;
    this.length = at + data.length;
    return at;
  }

  view(data, more = {}) {
    this.json.bufferViews.push({ buffer: 0, byteOffset: this.push(data), byteLength: data.length, ...more });
    return this.json.bufferViews.length - 1;
  }

  accessor(item) {
    this.json.accessors.push(item);
    return this.json.accessors.length - 1;
  }

  uses(name, required) {
    for (const key of required ? ["extensionsUsed", "extensionsRequired"] : ["extensionsUsed"]) {
      this.json[key] = [...new Set([...(this.json[key] ?? []), name])];
    }
  }

  write(name) {
    const body = new Uint8Array((this.length + 3) & ~3);
    let at = 0;
    for (const c of this.chunks) body.set(c, at), (at += c.length);
    (this.json.buffers ??= [])[0] = { byteLength: this.length };
    if (!this.json.bufferViews.length) delete this.json.bufferViews;
    let text = JSON.stringify(this.json);
    text += " ".repeat(-Buffer.byteLength(text) & 3);
    const head = Buffer.from(text);
    const file = Buffer.alloc(12 + 8 + head.length + 8 + body.length);
    file.write("glTF", 0, "latin1");
    file.writeUInt32LE(2, 4);
    file.writeUInt32LE(file.length, 8);
    file.writeUInt32LE(head.length, 12);
    file.write("JSON", 16, "latin1");
    head.copy(file, 20);
    file.writeUInt32LE(body.length, 20 + head.length);
    file.write("BIN\0", 24 + head.length, "latin1");
    file.set(body, 28 + head.length);
    writeFileSync(join(OUT, name), file);
  }
}

// min and max of each component.
export function bounds(array, width) {
  const min = Array(width).fill(Infinity), max = Array(width).fill(-Infinity);
  array.forEach((v, i) => {
    const c = i % width;
    if (v < min[c]) min[c] = v;
    if (v > max[c]) max[c] = v;
  });
  return { min, max };
}
