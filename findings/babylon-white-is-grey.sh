#!/usr/bin/env bash
# A white StandardMaterial of Babylon.js is exported with half of its reflectance.
#
# StandardMaterial is the engine's usual material, with diffuseColor white by default. The glTF exporter converts it to
# metallic-roughness: the base colour is half of the linearised colour, so that white becomes 0.5, a middle grey of 0.5
# becomes 0.109, and no colour can be brighter than 0.5. A black specular colour, which leaves all light to the diffuse
# reflection, changes nothing.
#
# PBRMaterial is exported with the values that it has.
#
# Seen with @babylonjs/core and @babylonjs/serializers 9.28.0 on Node 20: diffuseColor 1 is baseColorFactor 0.5, PBR
# albedoColor 1 is baseColorFactor 1, which is left out.
# Needs Node 20 and npm. Fails if the behaviour changes.
set -euo pipefail

dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT
cd "$dir"
npm install --silent --no-audit --no-fund @babylonjs/core@9.28.0 @babylonjs/serializers@9.28.0 >/dev/null

cat >export.mjs <<'JAVASCRIPT'
import assert from 'node:assert/strict';
import { NullEngine } from '@babylonjs/core/Engines/nullEngine.js';
import { Scene } from '@babylonjs/core/scene.js';
import { Color3 } from '@babylonjs/core/Maths/math.color.js';
import { MeshBuilder } from '@babylonjs/core/Meshes/meshBuilder.js';
import { StandardMaterial } from '@babylonjs/core/Materials/standardMaterial.js';
import { PBRMaterial } from '@babylonjs/core/Materials/PBR/pbrMaterial.js';
import { GLTF2Export } from '@babylonjs/serializers/glTF/2.0/glTFSerializer.js';

const scene = new Scene(new NullEngine());
function box(material) {
  MeshBuilder.CreateBox(material.name, {}, scene).material = material;
  return material;
}
box(new StandardMaterial('white', scene));
box(new StandardMaterial('white, no specular', scene)).specularColor = Color3.Black();
box(new StandardMaterial('half', scene)).diffuseColor = new Color3(.5, .5, .5);
const pbr = box(new PBRMaterial('PBR white', scene));
pbr.metallic = 0;
pbr.roughness = 1;

const { files } = await GLTF2Export.GLTFAsync(scene, 'scene');
const reflectances = {};
for (const { name, pbrMetallicRoughness } of JSON.parse(files['scene.gltf']).materials)
  reflectances[name] = (pbrMetallicRoughness?.baseColorFactor ?? [1])[0];
console.log(reflectances);
assert.equal(reflectances['white'], .5, 'white is white now');
assert.equal(reflectances['white, no specular'], .5);
assert.ok(Math.abs(reflectances['half'] - .5 ** 2.2 / 2) < 1e-3);
assert.equal(reflectances['PBR white'], 1);
JAVASCRIPT
node export.mjs
echo "ok: white is exported as 0.5"
