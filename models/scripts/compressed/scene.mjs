// An independent reader for the fixtures: draco3d and meshoptimizer's decoder, then nodes, instances, skins, morph
// targets and animations down to positions in the world.
import draco3d from "draco3d";
import { MeshoptDecoder } from "meshoptimizer";
import { ARRAY, WIDTH, load } from "./file.mjs";
import { crc32 } from "./crc.mjs";
import { decode } from "./draco.mjs";

await MeshoptDecoder.ready;
const draco_module = await draco3d.createDecoderModule();
const MESHOPT = ["EXT_meshopt_compression", "KHR_meshopt_compression"];
export const DRACO = "KHR_draco_mesh_compression";

export class Scene {
  constructor(path) {
    Object.assign(this, load(path));
    this.views = new Map();
    this.coded = [];
    this.draco = new Map();
    (this.json.bufferViews ?? []).forEach((_, i) => this.view(i));
  }

  view(i) {
    if (this.views.has(i)) return this.views.get(i);
    const v = this.json.bufferViews[i], name = MESHOPT.find((n) => v.extensions?.[n]);
    let data;
    if (name) {
      const e = v.extensions[name], source = this.buffers[e.buffer].subarray(e.byteOffset ?? 0, (e.byteOffset ?? 0) + e.byteLength);
      data = new Uint8Array(e.count * e.byteStride);
      MeshoptDecoder.decodeGltfBuffer(data, e.count, e.byteStride, source, e.mode, e.filter);
      const item = { view: i, mode: e.mode, ...(e.filter && { filter: e.filter }), count: e.count, stride: e.byteStride, head: source[0].toString(16), crc32: crc32(data) };
      if (e.filter && e.filter !== "NONE") {
        const raw = new Uint8Array(data.length);
        MeshoptDecoder.decodeGltfBuffer(raw, e.count, e.byteStride, source, e.mode);
        item.crc32_before_filter = crc32(raw);
      }
      const plain = this.buffers[v.buffer];
      if (plain) item.fallback_same = crc32(plain.subarray(v.byteOffset ?? 0, (v.byteOffset ?? 0) + v.byteLength)) === item.crc32;
      this.coded.push(item);
    } else {
      data = this.buffers[v.buffer]?.subarray(v.byteOffset ?? 0, (v.byteOffset ?? 0) + v.byteLength);
    }
    this.views.set(i, data);
    return data;
  }

  // Raw values, tightly packed, with sparse values applied.
  raw(i) {
    const a = this.json.accessors[i], width = WIDTH[a.type], Type = ARRAY[a.componentType], size = width * Type.BYTES_PER_ELEMENT;
    const out = new Uint8Array(size * a.count);
    if (a.bufferView !== undefined) {
      const stride = this.json.bufferViews[a.bufferView].byteStride ?? size, data = this.view(a.bufferView);
      for (let k = 0; k < a.count; k++) {
        const at = (a.byteOffset ?? 0) + k * stride;
        out.set(data.subarray(at, at + size), k * size);
      }
    }
    const array = new Type(out.buffer);
    if (a.sparse) {
      const { indices: I, values: V, count } = a.sparse;
      const from = this.view(I.bufferView).slice(I.byteOffset ?? 0), which = new ARRAY[I.componentType](from.buffer, 0, count);
      const values = new Type(this.view(V.bufferView).slice(V.byteOffset ?? 0).buffer, 0, count * width);
      which.forEach((w, k) => array.set(values.subarray(k * width, (k + 1) * width), w * width));
    }
    return array;
  }

  real(i, array = this.raw(i)) {
    const a = this.json.accessors[i];
    return Float64Array.from(array, real_of(a));
  }

  primitive(m, k) {
    const key = `${m}.${k}`, p = this.json.meshes[m].primitives[k];
    this.cache ??= new Map();
    if (this.cache.has(key)) return this.cache.get(key);
    const out = { p, attributes: {}, targets: [] }, e = p.extensions?.[DRACO];
    let coded;
    if (e) {
      const types = Object.fromEntries(Object.keys(e.attributes).map((n) => [n, this.json.accessors[p.attributes[n]].componentType]));
      const data = this.view(e.bufferView).slice();
      coded = decode(data, e.attributes, types, draco_module);
      const item = { mesh: m, primitive: k, bytes: data.length, version: `${data[5]}.${data[6]}`, method: data[8] ? "edgebreaker" : "sequential" };
      if (data[8]) item.traversal = ["standard", "predictive", "valence"][data[11]];
      Object.assign(item, { points: coded.points, faces: coded.indices.length / 3, indices: crc32(new Uint8Array(coded.indices.buffer)), attributes: {} });
      if (coded.attributes.POSITION) item.first_position = [...coded.attributes.POSITION.slice(0, 3)];
      for (const [n, id] of Object.entries(e.attributes)) {
        const v = coded.attributes[n];
        item.attributes[n] = [id, v.constructor.name.replace("Array", ""), crc32(new Uint8Array(v.buffer))];
      }
      this.draco.set(key, item);
    }
    for (const [n, i] of Object.entries(p.attributes)) {
      const a = this.json.accessors[i];
      out.attributes[n] = { width: WIDTH[a.type], values: this.real(i, coded?.attributes[n] ?? this.raw(i)) };
    }
    for (const t of p.targets ?? []) out.targets.push(Object.fromEntries(Object.entries(t).map(([n, i]) => [n, this.real(i)])));
    const count = out.attributes.POSITION.values.length / 3;
    let indices = coded ? [...coded.indices] : p.indices !== undefined ? [...this.raw(p.indices)] : [...Array(count).keys()];
    if (p.mode === 5 && !coded) {
      indices = indices.slice(2).flatMap((c, i) => (i % 2 ? [indices[i + 1], indices[i], c] : [indices[i], indices[i + 1], c]));
    }
    out.indices = indices;
    out.count = count;
    this.cache.set(key, out);
    return out;
  }

  // Nodes' local transforms and weights at a time of an animation (or at rest).
  pose(animation, time) {
    const nodes = (this.json.nodes ?? []).map((n) => ({
      translation: n.translation ?? [0, 0, 0], rotation: n.rotation ?? [0, 0, 0, 1], scale: n.scale ?? [1, 1, 1], matrix: n.matrix,
      weights: n.weights ?? this.json.meshes?.[n.mesh]?.weights,
    }));
    if (animation === undefined) return nodes;
    const a = this.json.animations[animation];
    for (const c of a.channels) {
      if (c.target.node === undefined) continue;
      nodes[c.target.node][c.target.path] = this.sample(a.samplers[c.sampler], time, c.target.path);
    }
    return nodes;
  }

  sample(s, time, path) {
    const times = this.real(s.input), values = this.real(s.output), cubic = s.interpolation === "CUBICSPLINE";
    const w = values.length / times.length / (cubic ? 3 : 1);
    const at = (k, part = 1) => [...values.slice((cubic ? 3 * k + part : k) * w, (cubic ? 3 * k + part : k) * w + w)];
    if (time <= times[0]) return at(0);
    if (time >= times[times.length - 1]) return at(times.length - 1);
    let k = 0;
    while (times[k + 1] <= time) k++;
    const d = times[k + 1] - times[k], t = (time - times[k]) / d, a = at(k), b = at(k + 1);
    if (s.interpolation === "STEP") return a;
    if (cubic) {
      const o = at(k, 2), i = at(k + 1, 0), t2 = t * t, t3 = t2 * t;
      const v = a.map((_, n) => (2 * t3 - 3 * t2 + 1) * a[n] + d * (t3 - 2 * t2 + t) * o[n] + (3 * t2 - 2 * t3) * b[n] + d * (t3 - t2) * i[n]);
      return path === "rotation" ? unit(v) : v;
    }
    if (path !== "rotation") return a.map((v, n) => v + (b[n] - v) * t);
    let dot = a.reduce((x, v, n) => x + v * b[n], 0);
    const sign = Math.sign(dot) || 1;
    dot = Math.min(1, Math.abs(dot));
    const angle = Math.acos(dot);
    if (angle < 1e-6) return unit(a);
    const [p, q] = [Math.sin((1 - t) * angle), sign * Math.sin(t * angle)].map((v) => v / Math.sin(angle));
    return unit(a.map((v, n) => v * p + b[n] * q));
  }

  // Every drawn primitive: its world positions and normals, its triangles. Lines and points have no triangles.
  drawn(animation, time) {
    const pose = this.pose(animation, time), world = [];
    const visit = (i, parent) => {
      world[i] = multiply(parent, local(pose[i]));
      for (const c of this.json.nodes[i].children ?? []) visit(c, world[i]);
    };
    for (const i of this.json.scenes[this.json.scene ?? 0].nodes) visit(i, IDENTITY);
    const out = [];
    this.json.nodes.forEach((n, i) => {
      if (n.mesh === undefined || !world[i]) return;
      this.json.meshes[n.mesh].primitives.forEach((_, k) => {
        const g = this.primitive(n.mesh, k), weights = pose[i].weights;
        const base = (name) => {
          const v = g.attributes[name]?.values.slice();
          if (v && weights) g.targets.forEach((t, j) => t[name]?.forEach((d, c) => (v[c] += d * (weights[j] ?? 0))));
          return v;
        };
        const position = base("POSITION"), normal = base("NORMAL");
        let places = [world[i]];
        const e = n.extensions?.EXT_mesh_gpu_instancing?.attributes;
        if (e) {
          const T = e.TRANSLATION !== undefined && this.real(e.TRANSLATION), R = e.ROTATION !== undefined && this.real(e.ROTATION), S = e.SCALE !== undefined && this.real(e.SCALE);
          const count = this.json.accessors[Object.values(e)[0]].count;
          places = Array.from({ length: count }, (_, j) => multiply(world[i], local({ translation: T ? [...T.slice(3 * j, 3 * j + 3)] : [0, 0, 0], rotation: R ? unit([...R.slice(4 * j, 4 * j + 4)]) : [0, 0, 0, 1], scale: S ? [...S.slice(3 * j, 3 * j + 3)] : [1, 1, 1] })));
        }
        let joints;
        if (n.skin !== undefined) {
          const s = this.json.skins[n.skin], bind = this.real(s.inverseBindMatrices);
          joints = s.joints.map((j, m) => multiply(world[j], [...bind.slice(16 * m, 16 * m + 16)]));
        }
        for (const place of places) {
          const P = new Float64Array(position.length), N = normal && new Float64Array(position.length);
          for (let v = 0; v < g.count; v++) {
            let m = place;
            if (joints) {
              m = Array(16).fill(0);
              let sum = 0;
              for (let c = 0; c < 4; c++) sum += g.attributes.WEIGHTS_0.values[4 * v + c];
              for (let c = 0; c < 4; c++) {
                const w = g.attributes.WEIGHTS_0.values[4 * v + c] / sum, j = joints[g.attributes.JOINTS_0.values[4 * v + c]];
                if (w) for (let x = 0; x < 16; x++) m[x] += w * j[x];
              }
            }
            P.set(point(m, position.subarray(3 * v, 3 * v + 3)), 3 * v);
            if (N) N.set(unit(covector(m, normal.subarray(3 * v, 3 * v + 3))), 3 * v);
          }
          out.push({ node: n.name, mesh: n.mesh, k, g, P, N, mirrored: !joints && determinant(place) < 0, material: g.p.material });
        }
      });
    });
    return out;
  }
}

function real_of(a) {
  if (!a.normalized) return (v) => v;
  const max = { 5120: 127, 5121: 255, 5122: 32767, 5123: 65535 }[a.componentType];
  return (v) => Math.max(v / max, -1);
}

export const IDENTITY = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1];

export function unit(v) {
  const n = Math.hypot(...v) || 1;
  return [...v].map((c) => c / n);
}

function multiply(a, b) {
  const out = Array(16).fill(0);
  for (let c = 0; c < 4; c++) for (let r = 0; r < 4; r++) for (let k = 0; k < 4; k++) out[4 * c + r] += a[4 * k + r] * b[4 * c + k];
  return out;
}

function local({ matrix, translation: t, rotation, scale: s }) {
  if (matrix) return matrix;
  const [x, y, z, w] = rotation;
  return [
    (1 - 2 * (y * y + z * z)) * s[0], 2 * (x * y + z * w) * s[0], 2 * (x * z - y * w) * s[0], 0,
    2 * (x * y - z * w) * s[1], (1 - 2 * (x * x + z * z)) * s[1], 2 * (y * z + x * w) * s[1], 0,
    2 * (x * z + y * w) * s[2], 2 * (y * z - x * w) * s[2], (1 - 2 * (x * x + y * y)) * s[2], 0,
    t[0], t[1], t[2], 1,
  ];
}

function point(m, [x, y, z]) {
  return [0, 1, 2].map((r) => m[r] * x + m[4 + r] * y + m[8 + r] * z + m[12 + r]);
}

function determinant(m) {
  return m[0] * (m[5] * m[10] - m[6] * m[9]) - m[4] * (m[1] * m[10] - m[2] * m[9]) + m[8] * (m[1] * m[6] - m[2] * m[5]);
}

// A normal: the cofactor matrix times it, times the determinant's sign.
function covector(m, [x, y, z]) {
  const a = m.slice(0, 3), b = m.slice(4, 7), c = m.slice(8, 11), cross = (u, v) => [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
  const [p, q, r] = [cross(b, c), cross(c, a), cross(a, b)], sign = Math.sign(determinant(m)) || 1;
  return [0, 1, 2].map((k) => sign * (p[k] * x + q[k] * y + r[k] * z));
}
