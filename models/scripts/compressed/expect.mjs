// Reads every fixture with scene.mjs and writes out/expected.json: the results of a correct reader, and the deviation of
// each compressed file from its twin. Fails if a file's triangles are not its twin's.
import { mkdirSync, readFileSync, readdirSync, renameSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { OUT } from "./file.mjs";
import { DRACO, Scene } from "./scene.mjs";

const twin_of = (name) => {
  if (/^blender_(draco|webp)/.test(name)) return "blender_plain.glb";
  if (name.startsWith("blender_skin_draco")) return "blender_skin_plain.glb";
  if (name === "blender_instances.glb") return "blender_instances_plain.glb";
  if (name.startsWith("basisu") && !name.includes("twin")) return "basisu_twin.glb";
  if (name === "quantised.glb" || name === "quantised_draco.glb") return "quantised_twin.glb";
  if (name.startsWith("strip_")) return "strip.glb";
  const m = /^(torus|ring|patch|mixed|instances)_/.exec(name);
  return m && `${m[1]}.glb`;
};

const round = (v, n = 6) => (typeof v === "number" ? +v.toPrecision(n) : Array.from(v, (x) => +x.toPrecision(n)));

function world(drawn) {
  const min = [Infinity, Infinity, Infinity], max = min.map((v) => -v), moment = [0, 0, 0];
  let triangles = 0, area = 0, outward = 0;
  for (const { P, N, g, mirrored } of drawn) {
    for (let i = 0; i < P.length; i++) (min[i % 3] = Math.min(min[i % 3], P[i])), (max[i % 3] = Math.max(max[i % 3], P[i]));
    if (![undefined, 4, 5].includes(g.p.mode)) continue;
    for (let t = 0; t < g.indices.length; t += 3) {
      const [a, b, c] = [0, 1, 2].map((k) => P.subarray(3 * g.indices[t + k], 3 * g.indices[t + k] + 3));
      const u = [0, 1, 2].map((k) => b[k] - a[k]), v = [0, 1, 2].map((k) => c[k] - a[k]);
      const n = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]], size = Math.hypot(...n) / 2;
      triangles++;
      area += size;
      for (let k = 0; k < 3; k++) moment[k] += (size * (a[k] + b[k] + c[k])) / 3;
      if (N) {
        const m = N.subarray(3 * g.indices[t], 3 * g.indices[t] + 3), dot = n[0] * m[0] + n[1] * m[1] + n[2] * m[2];
        outward += (mirrored ? -dot : dot) > 0 ? 1 : 0;
      }
    }
  }
  return { triangles, min: round(min), max: round(max), area: round(area), centroid: round(moment.map((m) => m / area)), facing: outward };
}

// One list of vertices with the attributes that both files have, and the triangles over it.
function soup(scene, drawn) {
  const vertices = [], triangles = [];
  for (const d of drawn) {
    if (![undefined, 4, 5].includes(d.g.p.mode)) continue;
    const first = vertices.length, material = scene.json.materials?.[d.material];
    const textures = [material?.pbrMetallicRoughness?.baseColorTexture, material?.occlusionTexture].filter(Boolean);
    const transform = (n) => textures.find((t) => `TEXCOORD_${t.texCoord ?? 0}` === n)?.extensions?.KHR_texture_transform;
    for (let v = 0; v < d.g.count; v++) {
      const row = { POSITION: [...d.P.subarray(3 * v, 3 * v + 3)], material: material?.name };
      if (d.N) row.NORMAL = [...d.N.subarray(3 * v, 3 * v + 3)];
      for (const [n, { width, values }] of Object.entries(d.g.attributes)) {
        if (["POSITION", "NORMAL", "JOINTS_0", "WEIGHTS_0"].includes(n) || (n === "TANGENT" && d.g.p.targets)) continue;
        row[n] = [...values.subarray(v * width, (v + 1) * width)];
        // gltfpack's quantized UVs cannot be decoded without a texture's transform.
        if (n.startsWith("TEXCOORD") && !textures.length && scene.json.asset.generator?.startsWith("gltfpack")) delete row[n];
        if (n.startsWith("TEXCOORD") && !row[n]) continue;
        if (n.startsWith("COLOR") && width === 3) row[n].push(1);
        const texture = n.startsWith("TEXCOORD") && transform(n);
        if (texture) row[n] = row[n].map((c, i) => c * (texture.scale?.[i] ?? 1) + (texture.offset?.[i] ?? 0));
      }
      vertices.push(row);
    }
    for (let t = 0; t < d.g.indices.length; t += 3) triangles.push([0, 1, 2].map((k) => first + d.g.indices[t + k]));
  }
  return { vertices, triangles };
}

function compare(scene, twin, times) {
  const a = soup(scene, scene.drawn()), b = soup(twin, twin.drawn());
  const has = (s, n) => s.vertices.some((v) => n in v);
  const names = [...new Set(a.vertices.flatMap(Object.keys))].filter((n) => n !== "material" && has(b, n));
  const span = {};
  for (const n of names) {
    const all = b.vertices.flatMap((v) => v[n] ?? []);
    span[n] = Math.max(...all) - Math.min(...all) || 1;
  }
  const same = new Map(), id = b.vertices.map((v) => {
    const key = JSON.stringify([v.material, names.map((n) => v[n])]);
    if (!same.has(key)) same.set(key, same.size);
    return same.get(key);
  });
  const worst = Object.fromEntries(names.map((n) => [n, 0]));
  const match = a.vertices.map((v) => {
    let best = Infinity, which = -1;
    b.vertices.forEach((w, j) => {
      if (v.material !== undefined && w.material !== undefined && v.material !== w.material) return;
      let sum = 0;
      for (const n of names) {
        if (!v[n] || !w[n]) continue;
        for (let c = 0; c < w[n].length; c++) sum += ((v[n][c] - w[n][c]) / span[n]) ** 2;
        if (sum >= best) return;
      }
      (best = sum), (which = j);
    });
    for (const n of names) {
      if (!v[n] || !b.vertices[which][n]) continue;
      const d = Math.max(...b.vertices[which][n].map((x, c) => Math.abs(x - v[n][c])));
      if (d > worst[n]) worst[n] = d;
    }
    return which;
  });
  const bag = (list, to) => {
    const out = new Map();
    for (const t of list) {
      const k = t.map(to), i = k.indexOf(Math.min(...k)), key = [k[i], k[(i + 1) % 3], k[(i + 2) % 3]].join();
      out.set(key, (out.get(key) ?? 0) + 1);
    }
    return out;
  };
  const x = bag(a.triangles, (v) => id[match[v]]), y = bag(b.triangles, (v) => id[v]);
  let differ = 0;
  for (const [k, n] of y) differ += Math.abs(n - (x.get(k) ?? 0));
  for (const [k, n] of x) if (!y.has(k)) differ += n;
  const result = { triangles_that_differ: differ, deviation: Object.fromEntries(names.map((n) => [n, round(worst[n], 3)])) };
  if (scene.json.animations?.length && twin.json.animations?.length) {
    result.pose_deviation = Object.fromEntries(times.map((t) => {
      const p = soup(scene, scene.drawn(0, t)).vertices, q = soup(twin, twin.drawn(0, t)).vertices;
      return [t, round(Math.max(...p.map((v, i) => Math.hypot(...v.POSITION.map((c, k) => c - q[match[i]].POSITION[k])))), 3)];
    }));
  }
  return result;
}

const times = [0.3, 0.7];
const found = {};
const scenes = {};
const open = (name) => (scenes[name] ??= new Scene(join(OUT, name)));
let failed = 0;
for (const name of readdirSync(OUT).filter((n) => /\.gl(b|tf)$/.test(n)).sort()) {
  const scene = open(name), { json } = scene, twin = twin_of(name), drawn = scene.drawn();
  const item = { twin, bytes: readFileSync(join(OUT, name)).length, extensions: json.extensionsUsed ?? [], required: json.extensionsRequired ?? [] };
  if (!twin) delete item.twin;
  item.world = world(drawn);
  if (!twin && json.animations?.length && json.animations[0].channels.some((c) => c.target.node !== undefined)) {
    item.poses = Object.fromEntries(times.map((t) => [t, (({ min, max, area }) => ({ min, max, area }))(world(scene.drawn(0, t)))]));
  }
  item.primitives = json.meshes.flatMap((m, i) => m.primitives.map((p, k) => {
    const g = scene.primitive(i, k), n = { mesh: m.name ?? i, primitive: k };
    if (p.mode !== undefined && p.mode !== 4) n.mode = p.mode;
    n.vertices = g.count;
    n.indices = g.indices.length;
    n.attributes = Object.keys(p.attributes);
    if (p.targets) n.targets = p.targets.length;
    if (p.extensions?.[DRACO]) n.draco = true;
    return n;
  }));
  if (scene.draco.size) item.draco = [...scene.draco.values()];
  if (scene.coded.length) {
    const columns = ["view", "mode", "filter", "count", "stride", "head", "crc32", "crc32_before_filter", "fallback_same"];
    item.meshopt = scene.coded.map((c) => columns.map((k) => c[k] ?? null));
    for (const row of item.meshopt) while (row[row.length - 1] === null) row.pop();
  }
  if (twin) {
    item.compared = compare(scene, open(twin), times);
    if (item.compared.triangles_that_differ) failed++, console.log("triangles differ:", name, item.compared.triangles_that_differ);
  }
  found[name] = item;
}
const line = (v) => (Array.isArray(v) && typeof v[0] === "object" ? `[\n      ${v.map((x) => JSON.stringify(x)).join(",\n      ")}\n    ]` : JSON.stringify(v));
function write(path, names) {
  const text = names.map((n) => `  ${JSON.stringify(n)}: {\n${Object.entries(found[n]).map(([k, x]) => `    ${JSON.stringify(k)}: ${line(x)}`).join(",\n")}\n  }`);
  writeFileSync(join(OUT, path), `{\n${text.join(",\n")}\n}\n`);
}

// Fixtures that add least go to tests/gltf/more/, with their own expected.json.
const MORE = `torus_draco_eb_slow torus_draco_eb_many_bits torus_draco_lossless mixed_draco_two mixed_gt_draco patch_gt_draco
  torus_gt_draco ring_draco_eb ring_draco_seq torus_meshopt_filters16 torus_meshopt_khr_level0 torus_meshopt_khr_filters16
  mixed_meshopt_raw torus_pack_c torus_pack_quantised instances_pack_mi_cc patch_pack_normalised patch_pack_cc mixed_pack_quantised
  torus_gt_meshopt_high torus_gt_quantised patch_gt_meshopt_medium blender_draco_10 blender_webp_fallback
  instances_pack_mi ring_pack_cc_noq blender_skin_plain blender_skin_draco torus_draco_eb_lossless patch_gt_quantised
  mixed_pack_cc blender_instances blender_instances_plain patch_pack_khr_cf`.split(/\s+/).map((n) => n + (n.endsWith("_cf") ? ".gltf" : ".glb"));
const names = Object.keys(found);
mkdirSync(join(OUT, "more"), { recursive: true });
for (const n of [...MORE, "patch_pack_khr_cf.bin", "patch_pack_khr_cf.fallback.bin"]) renameSync(join(OUT, n), join(OUT, "more", n));
write("expected.json", names.filter((n) => !MORE.includes(n)));
write("more/expected.json", names.filter((n) => MORE.includes(n)));
process.exitCode = failed ? 1 : 0;
