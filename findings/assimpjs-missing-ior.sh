#!/usr/bin/env bash
# assimpjs converts an OBJ material without an index of refraction into one that hardly reflects.
#
# MTL files rarely have `Ni`. In the glTF that assimpjs writes, each such material has KHR_materials_ior with ior 1, the
# index of air: its reflectance at normal incidence is ((1 - 1) / (1 + 1))² = 0, so that viewers show no highlight but at
# grazing angles, whatever the roughness is. A file without the extension would have glTF's default, 1.5. `Ni 1.5` in the
# MTL brings the reflection back. extensionsUsed also names KHR_materials_volume, which no material has.
#
# Seen with assimpjs 0.0.10 on Node 20.
# Needs Node 20 and npm. Fails if the behaviour changes.
set -euo pipefail

dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT
cd "$dir"
npm install --silent --no-audit --no-fund assimpjs@0.0.10 >/dev/null

cat >convert.js <<'JAVASCRIPT'
const assert = require('node:assert/strict');

const obj = `mtllib a.mtl
v 0 0 0
v 1 0 0
v 0 1 0
usemtl plain
f 1 2 3
usemtl glossy
f 1 2 3
`;
const mtl = `newmtl plain
Kd .8 .8 .8
Ks .5 .5 .5
Ns 200
newmtl glossy
Kd .8 .8 .8
Ks .5 .5 .5
Ns 200
Ni 1.5
`;

require('assimpjs')().then(assimp => {
  const files = new assimp.FileList();
  files.AddFile('a.obj', new TextEncoder().encode(obj));
  files.AddFile('a.mtl', new TextEncoder().encode(mtl));
  const result = assimp.ConvertFileList(files, 'gltf2');
  assert.ok(result.IsSuccess());
  const gltf = JSON.parse(new TextDecoder().decode(result.GetFile(0).GetContent()));
  const indices = {};
  for (const { name, extensions } of gltf.materials) indices[name] = extensions?.KHR_materials_ior?.ior;
  console.log(gltf.asset.generator, indices, gltf.extensionsUsed);
  assert.equal(indices.plain, 1, 'materials without Ni are left to the default now');
  assert.ok(indices.glossy === undefined || indices.glossy === 1.5);
  assert.ok(gltf.extensionsUsed.includes('KHR_materials_volume'));
  assert.ok(gltf.materials.every(({ extensions }) => !extensions?.KHR_materials_volume));
});
JAVASCRIPT
node convert.js
echo "ok: no Ni becomes ior 1"
