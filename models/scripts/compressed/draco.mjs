// Writes KHR_draco_mesh_compression variants of the twins with draco3dgltf's encoder and JSON of our own.
import draco3d from "draco3dgltf";
import { join } from "node:path";
import { Glb, OUT, WIDTH, bounds, bytes, load, plain } from "./file.mjs";

const EXT = "KHR_draco_mesh_compression";
const encoder_module = await draco3d.createEncoderModule();
const decoder_module = await draco3d.createDecoderModule();
const KIND = { POSITION: "POSITION", NORMAL: "NORMAL", COLOR: "COLOR", TEXCOORD: "TEX_COORD" };
const ADD = { 5120: "AddInt8Attribute", 5121: "AddUInt8Attribute", 5122: "AddInt16Attribute", 5123: "AddUInt16Attribute", 5125: "AddUInt32Attribute", 5126: "AddFloatAttribute" };
const LOSSY = { POSITION: 14, NORMAL: 10, COLOR: 8, TEX_COORD: 12, GENERIC: 12 };

// Encodes some attributes of a primitive. `bits` 0 leaves floats as they are.
function encode(file, primitive, names, triangles, { method, encode = 5, decode = 5, bits = LOSSY, dedup = true }) {
  const m = encoder_module, builder = new m.MeshBuilder(), mesh = new m.Mesh(), encoder = new m.ExpertEncoder(mesh);
  const ids = {};
  for (const name of names) {
    const index = primitive.attributes[name], a = file.json.accessors[index], data = plain(file, index);
    const kind = KIND[name.replace(/_\d+$/, "")] ?? "GENERIC";
    ids[name] = builder[ADD[a.componentType]](mesh, m[kind], a.count, WIDTH[a.type], data);
    if (a.componentType === 5126 && bits[kind]) encoder.SetAttributeQuantization(ids[name], bits[kind]);
  }
  builder.AddFacesToMesh(mesh, triangles.length / 3, Uint32Array.from(triangles));
  encoder.SetSpeedOptions(encode, decode);
  encoder.SetTrackEncodedProperties(true);
  encoder.SetEncodingMethod(method === "edgebreaker" ? m.MESH_EDGEBREAKER_ENCODING : m.MESH_SEQUENTIAL_ENCODING);
  const out = new m.DracoInt8Array(), length = encoder.EncodeToDracoBuffer(dedup, out);
  if (length <= 0) throw new Error("draco: nothing encoded");
  const data = Uint8Array.from({ length }, (_, i) => out.GetValue(i) & 255);
  return { data, ids, points: encoder.GetNumberOfEncodedPoints(), faces: encoder.GetNumberOfEncodedFaces() };
}

// Decodes what was encoded, for fallback accessors and bounds. The same code as in read.mjs, with this older build.
export function decode(data, ids, types, module = decoder_module) {
  const m = module, decoder = new m.Decoder(), buffer = new m.DecoderBuffer(), mesh = new m.Mesh();
  buffer.Init(new Int8Array(data), data.length);
  const status = decoder.DecodeBufferToMesh(buffer, mesh);
  if (!status.ok()) throw new Error(status.error_msg());
  const out = {};
  const TYPE = { 5120: [m.DT_INT8, Int8Array], 5121: [m.DT_UINT8, Uint8Array], 5122: [m.DT_INT16, Int16Array], 5123: [m.DT_UINT16, Uint16Array], 5125: [m.DT_UINT32, Uint32Array], 5126: [m.DT_FLOAT32, Float32Array] };
  for (const [name, id] of Object.entries(ids)) {
    const attribute = decoder.GetAttributeByUniqueId(mesh, id), [kind, Type] = TYPE[types[name]];
    const length = mesh.num_points() * attribute.num_components() * Type.BYTES_PER_ELEMENT;
    const at = m._malloc(length);
    decoder.GetAttributeDataArrayForAllPoints(mesh, attribute, kind, length, at);
    out[name] = new Type(m.HEAPU8.slice(at, at + length).buffer);
    m._free(at);
  }
  const length = mesh.num_faces() * 12, at = m._malloc(length);
  decoder.GetTrianglesUInt32Array(mesh, length, at);
  const indices = new Uint32Array(m.HEAPU8.slice(at, at + length).buffer);
  m._free(at);
  return { attributes: out, indices, points: mesh.num_points() };
}

// Copies an accessor of the source with its data.
function copy(glb, file, index, done) {
  if (done.has(index)) return done.get(index);
  const { bufferView, byteOffset, ...a } = file.json.accessors[index];
  const view = file.json.bufferViews[bufferView];
  const data = bytes(plain(file, index));
  const size = data.length / a.count, stride = view.target === 34962 && size % 4 ? (size + 3) & ~3 : size;
  let packed = data;
  if (stride !== size) {
    packed = new Uint8Array(stride * a.count);
    for (let i = 0; i < a.count; i++) packed.set(data.subarray(i * size, (i + 1) * size), i * stride);
  }
  const more = { ...(view.target && { target: view.target }), ...(stride !== size && { byteStride: stride }) };
  done.set(index, glb.accessor({ bufferView: glb.view(packed, more), ...a }));
  return done.get(index);
}

// `choose` maps a primitive (its index, itself) to false (leave it) or to options for `encode`, with `only` (the names to
// compress; the others stay uncompressed) and `fallback` (also write uncompressed data).
function write(twin, name, choose) {
  const file = load(join(OUT, twin)), glb = new Glb(file), done = new Map();
  const keep = (i) => copy(glb, file, i, done);
  let required = true;
  const blobs = new Map();
  for (const mesh of glb.json.meshes) {
    mesh.primitives = mesh.primitives.map((p, k) => {
      const options = choose(k, p), out = { ...p, attributes: {} };
      if (p.targets) out.targets = p.targets.map((t) => Object.fromEntries(Object.entries(t).map(([s, i]) => [s, keep(i)])));
      if (!options) {
        for (const [s, i] of Object.entries(p.attributes)) out.attributes[s] = keep(i);
        if (p.indices !== undefined) out.indices = keep(p.indices);
        return out;
      }
      const names = options.only ?? Object.keys(p.attributes);
      let triangles = [...plain(file, p.indices)];
      if (p.mode === 5) {
        triangles = triangles.slice(2).flatMap((c, i) => (i % 2 ? [triangles[i + 1], triangles[i], c] : [triangles[i], triangles[i + 1], c]));
      }
      const { data, ids } = encode(file, p, names, triangles, options);
      const types = Object.fromEntries(names.map((n) => [n, file.json.accessors[p.attributes[n]].componentType]));
      const decoded = decode(data, ids, types);
      required &&= !options.fallback;
      for (const [s, i] of Object.entries(p.attributes)) {
        if (!names.includes(s)) {
          if (decoded.points !== file.json.accessors[i].count) throw new Error("order was not kept");
          out.attributes[s] = keep(i);
          continue;
        }
        const { bufferView, byteOffset, min, max, count, ...a } = file.json.accessors[i], values = decoded.attributes[s];
        const more = s === "POSITION" ? bounds(values, 3) : {};
        let view = {};
        if (options.fallback) {
          const size = bytes(values).length / decoded.points;
          if (size % 4) throw new Error("fallback rows must be of 4 bytes");
          view = { bufferView: glb.view(bytes(values), { target: 34962 }) };
        }
        out.attributes[s] = glb.accessor({ ...view, ...a, count: decoded.points, ...more });
      }
      let flat = decoded.indices;
      if (p.mode === 5) {
        // Sequential coding keeps the vertices, so the strip's own indices stay valid.
        flat = Uint32Array.from(plain(file, p.indices));
      }
      const small = decoded.points < 65535 ? Uint16Array.from(flat) : flat;
      const view = options.fallback ? { bufferView: glb.view(bytes(small), { target: 34963 }) } : {};
      out.indices = glb.accessor({ ...view, componentType: 5123, count: flat.length, type: "SCALAR" });
      out.extensions = { ...p.extensions, [EXT]: { bufferView: glb.view(data), attributes: ids } };
      return out;
    });
  }
  for (const a of glb.json.animations ?? []) {
    for (const s of a.samplers) (s.input = keep(s.input)), (s.output = keep(s.output));
  }
  for (const s of glb.json.skins ?? []) s.inverseBindMatrices = keep(s.inverseBindMatrices);
  glb.keep_images();
  glb.uses(EXT, required);
  glb.write(name);
}

if (process.argv[1].endsWith("draco.mjs")) {
  const no_bits = { POSITION: 0, NORMAL: 0, COLOR: 0, TEX_COORD: 0, GENERIC: 0 };
  const few = { POSITION: 8, NORMAL: 6, COLOR: 6, TEX_COORD: 7, GENERIC: 6 };
  const many = { POSITION: 20, NORMAL: 14, COLOR: 12, TEX_COORD: 16, GENERIC: 16 };
  const all = (o) => () => o;
  // Speed selects the prediction schemes: 0 the most expensive (valence edgebreaker, multi-parallelogram, geometric normals).
  write("torus.glb", "torus_draco_eb.glb", all({ method: "edgebreaker" }));
  write("torus.glb", "torus_draco_eb_slow.glb", all({ method: "edgebreaker", encode: 0, decode: 0 }));
  write("torus.glb", "torus_draco_eb_fast.glb", all({ method: "edgebreaker", encode: 10, decode: 10, bits: few }));
  write("torus.glb", "torus_draco_eb_many_bits.glb", all({ method: "edgebreaker", bits: many, encode: 3, decode: 3 }));
  write("torus.glb", "torus_draco_seq.glb", all({ method: "sequential" }));
  write("torus.glb", "torus_draco_lossless.glb", all({ method: "sequential", bits: no_bits, encode: 10, decode: 10, dedup: false }));
  write("torus.glb", "torus_draco_eb_lossless.glb", all({ method: "edgebreaker", bits: no_bits }));
  write("torus.glb", "torus_draco_partial.glb", all({ method: "sequential", dedup: false, only: ["NORMAL", "POSITION", "TEXCOORD_0"] }));
  write("ring.glb", "ring_draco_valence.glb", all({ method: "edgebreaker", encode: 0, decode: 0 }));
  write("ring.glb", "ring_draco_eb.glb", all({ method: "edgebreaker" }));
  write("ring.glb", "ring_draco_seq.glb", all({ method: "sequential", encode: 3, decode: 3, bits: few }));
  write("patch.glb", "patch_draco_morph.glb", all({ method: "sequential", dedup: false }));
  write("mixed.glb", "mixed_draco_one.glb", (k) => k === 1 && { method: "edgebreaker" });
  write("mixed.glb", "mixed_draco_two.glb", (k) => k < 2 && { method: k ? "sequential" : "edgebreaker" });
  write("patch.glb", "patch_draco_fallback.glb", all({ method: "sequential", dedup: false, fallback: true, bits: few }));
  write("strip.glb", "strip_draco.glb", all({ method: "sequential", dedup: false }));
  write("strip.glb", "strip_draco_fallback.glb", all({ method: "sequential", dedup: false, fallback: true }));
  // Integers inside Draco: quantised positions, normals and UVs kept as they are.
  write("quantised.glb", "quantised_draco.glb", (k, p) => ({ method: "sequential", dedup: false }));
}
