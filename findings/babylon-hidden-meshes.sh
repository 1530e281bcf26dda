#!/usr/bin/env bash
# Babylon.js exports hidden meshes as visible ones, in three ways.
#
# A mesh of Babylon.js disappears with isVisible = false, with setEnabled(false), or with visibility = 0. The glTF exporter
# writes all three like any other mesh: no KHR_node_visibility, no transparent material, nothing in extras. Colliders, picking
# helpers and the other variants of a configurator, hidden by these means, stand in the exported scene.
#
# Seen with @babylonjs/core and @babylonjs/serializers 9.28.0 on Node 20: four boxes, one of them visible in the engine.
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
import { MeshBuilder } from '@babylonjs/core/Meshes/meshBuilder.js';
import { GLTF2Export } from '@babylonjs/serializers/glTF/2.0/glTFSerializer.js';

const scene = new Scene(new NullEngine());
MeshBuilder.CreateBox('visible', {}, scene);
MeshBuilder.CreateBox('isVisible = false', {}, scene).isVisible = false;
MeshBuilder.CreateBox('setEnabled(false)', {}, scene).setEnabled(false);
MeshBuilder.CreateBox('visibility = 0', {}, scene).visibility = 0;
const shown = scene.meshes.filter(mesh => mesh.isEnabled() && mesh.isVisible && mesh.visibility > 0);
assert.equal(shown.length, 1);

const { files } = await GLTF2Export.GLTFAsync(scene, 'scene');
const gltf = JSON.parse(files['scene.gltf']);
for (const node of gltf.nodes) console.log(JSON.stringify(node), JSON.stringify(gltf.meshes[node.mesh].primitives[0].material));
const plain = gltf.nodes.filter(node => node.mesh !== undefined && !node.extensions && !node.extras);
assert.equal(plain.length, 4, 'hidden meshes are left out or marked now');
assert.ok(gltf.materials.every(material => !material.alphaMode), 'they are transparent now');
JAVASCRIPT
node export.mjs
echo "ok: hidden meshes are exported as visible ones"
