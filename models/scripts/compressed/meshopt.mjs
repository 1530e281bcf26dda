// Writes EXT_ and KHR_meshopt_compression variants of the twins with meshoptimizer's encoder and JSON of our own. The
// order of vertices and triangles is kept, so decoded data can be compared with the twin value by value (only a
// triangle's first vertex may change).
import { MeshoptEncoder as E } from "meshoptimizer";
import { join } from "node:path";
import { Glb, OUT, WIDTH, bounds, bytes, load, plain } from "./file.mjs";

await E.ready;

const I8 = 5120, U8 = 5121, I16 = 5122, U16 = 5123, F32 = 5126;

// Floats of an accessor, normalised integers as reals, rows widened to `width`.
function floats(file, index, width, fill = 1) {
  const a = file.json.accessors[index], w = WIDTH[a.type], data = plain(file, index);
  const scale = a.normalized ? { 5120: 127, 5121: 255, 5122: 32767, 5123: 65535 }[a.componentType] : 1;
  const out = new Float32Array(a.count * width).fill(fill);
  for (let i = 0; i < a.count; i++) for (let c = 0; c < w; c++) out[i * width + c] = data[i * w + c] / scale;
  return out;
}

// Where an accessor is used: a semantic, an animation path, "indices", "time", "bind".
function uses(json) {
  const use = {};
  for (const m of json.meshes ?? []) {
    for (const p of m.primitives) {
      if (p.indices !== undefined) use[p.indices] = (p.mode ?? 4) === 4 ? "triangles" : "indices";
      for (const [s, i] of Object.entries(p.attributes)) use[i] = s;
      for (const t of p.targets ?? []) for (const [s, i] of Object.entries(t)) use[i] = "delta " + s;
    }
  }
  for (const a of json.animations ?? []) {
    for (const c of a.channels) {
      use[a.samplers[c.sampler].input] = "time";
      use[a.samplers[c.sampler].output] = c.target.path;
    }
  }
  for (const s of json.skins ?? []) use[s.inverseBindMatrices] = "bind";
  return use;
}

// The encoding of one accessor: the stride, the bytes before the codec, the mode, the filter and the accessor's new type.
function prepare(file, index, use, o) {
  const a = file.json.accessors[index], raw = plain(file, index), size = bytes(raw).length / a.count;
  if (use === "triangles" || use === "indices") {
    const mode = use === "triangles" && !o.sequences ? "TRIANGLES" : "INDICES";
    return { mode, stride: size, data: bytes(raw), target: 34963, type: {} };
  }
  const vertex = !["time", "rotation", "translation", "scale", "weights", "bind"].includes(use);
  const target = vertex ? 34962 : undefined;
  if (o.filters) {
    const oct = (bits) => ({
      mode: "ATTRIBUTES",
      filter: "OCTAHEDRAL",
      stride: bits > 8 ? 8 : 4,
      data: E.encodeFilterOct(floats(file, index, 4, 0), a.count, bits > 8 ? 8 : 4, bits),
      target,
      type: { componentType: bits > 8 ? I16 : I8, normalized: true },
    });
    if (use === "NORMAL") return oct(o.normal_bits ?? 8);
    if (use === "TANGENT") return oct(o.tangent_bits ?? 8);
    if (use === "rotation") {
      const data = E.encodeFilterQuat(floats(file, index, 4), a.count, 8, o.rotation_bits ?? 12);
      return { mode: "ATTRIBUTES", filter: "QUATERNION", stride: 8, data, type: { componentType: I16, normalized: true } };
    }
    if (use.startsWith("COLOR_") && o.colours) {
      const stride = o.colours > 8 ? 8 : 4;
      const data = E.encodeFilterColor(floats(file, index, 4), a.count, stride, o.colours);
      return { mode: "ATTRIBUTES", filter: "COLOR", stride, data, target, type: { componentType: o.colours > 8 ? U16 : U8, normalized: true } };
    }
    if (a.componentType === F32 && use !== "bind" && use !== "time") {
      const width = WIDTH[a.type];
      const mode = use === "POSITION" ? "SharedVector" : use.startsWith("TEXCOORD") ? "Clamped" : use.startsWith("delta") ? "SharedComponent" : "Separate";
      const data = E.encodeFilterExp(floats(file, index, width), a.count, size, o.bits ?? 15, mode);
      return { mode: "ATTRIBUTES", filter: "EXPONENTIAL", stride: size, data, target, type: {} };
    }
  }
  let stride = size, data = bytes(raw);
  if (size % 4) {
    stride = (size + 3) & ~3;
    data = new Uint8Array(stride * a.count);
    for (let i = 0; i < a.count; i++) data.set(bytes(raw).subarray(i * size, (i + 1) * size), i * stride);
  }
  return { mode: "ATTRIBUTES", stride, data, target, type: {} };
}

function write(twin, name, o) {
  const ext = o.khr ? "KHR_meshopt_compression" : "EXT_meshopt_compression";
  const file = load(join(OUT, twin)), glb = new Glb(file), use = uses(file.json);
  let length = 0, quantised = false;
  file.json.accessors.forEach((a, i) => {
    const p = prepare(file, i, use[i], o);
    const version = o.khr ? 1 : 0;
    const data = p.mode === "ATTRIBUTES" ? E.encodeVertexBufferLevel(p.data, a.count, p.stride, o.level ?? 2, version) : E.encodeGltfBuffer(p.data, a.count, p.stride, p.mode, version);
    const at = glb.push(data);
    const { bufferView, byteOffset, min, max, ...rest } = a;
    const size = { 5120: 1, 5121: 1, 5122: 2, 5123: 2 }[p.type.componentType ?? a.componentType] ?? 4;
    // Vertex data always has a stride; other data where it is wider than a row.
    const strided = p.mode === "ATTRIBUTES" && (p.target || p.stride !== size * WIDTH[a.type]);
    length = (length + 3) & ~3;
    glb.json.bufferViews.push({
      buffer: 1,
      byteOffset: length,
      byteLength: p.stride * a.count,
      ...(strided && { byteStride: p.stride }),
      ...(p.target && { target: p.target }),
      extensions: {
        [ext]: { buffer: 0, byteOffset: at, byteLength: data.length, byteStride: p.stride, mode: p.mode, ...(p.filter && { filter: p.filter }), count: a.count },
      },
    });
    length += p.stride * a.count;
    const exact = !p.filter && min ? { min, max } : {};
    // Positions through the exponential filter: bounds from the decoded values.
    const around = p.filter && min ? o.bounds(p, a) : {};
    glb.accessor({ bufferView: i, ...rest, ...p.type, ...exact, ...around });
    if (p.type.componentType && use[i] !== "rotation" && !use[i].startsWith("COLOR")) quantised = true;
  });
  glb.keep_images();
  glb.uses(ext, true);
  if (quantised) glb.uses("KHR_mesh_quantization", true);
  glb.json.buffers = [{ byteLength: glb.length }, { byteLength: length, extensions: { [ext]: { fallback: true } } }];
  glb.write(name);
}

// 24 bits of mantissa, 8 of exponent: what the exponential filter stores.
const exp = (p, a) => {
  const words = new Int32Array(p.data.buffer.slice(p.data.byteOffset, p.data.byteOffset + p.data.byteLength));
  return bounds(Array.from(words, (w) => Math.fround((w << 8 >> 8) * 2 ** (w >> 24))), WIDTH[a.type]);
};

const f = { filters: true, bounds: exp };
write("torus.glb", "torus_meshopt_raw.glb", {});
write("torus.glb", "torus_meshopt_filters.glb", { ...f });
write("torus.glb", "torus_meshopt_filters16.glb", { ...f, normal_bits: 12, tangent_bits: 16, rotation_bits: 16, bits: 20 });
write("torus.glb", "torus_meshopt_khr_raw.glb", { khr: true, level: 3 });
write("torus.glb", "torus_meshopt_khr_filters.glb", { ...f, khr: true, level: 2, colours: 8 });
write("torus.glb", "torus_meshopt_khr_filters16.glb", { ...f, khr: true, level: 3, colours: 12, normal_bits: 10, tangent_bits: 12, rotation_bits: 10 });
write("ring.glb", "ring_meshopt_khr_filters.glb", { ...f, khr: true, level: 3, bits: 12 });
write("torus.glb", "torus_meshopt_khr_level0.glb", { khr: true, level: 0, sequences: true });
write("patch.glb", "patch_meshopt_filters.glb", { ...f });
write("mixed.glb", "mixed_meshopt_raw.glb", {});
write("mixed.glb", "mixed_meshopt_khr_filters.glb", { ...f, khr: true, colours: 16 });
