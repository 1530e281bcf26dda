#!/usr/bin/env bash
# three.js exports instance colours that the instances do not have.
#
# InstancedMesh is made for a maximal number of instances, and programs lower its `count` to what is in use.
# GLTFExporter writes EXT_mesh_gpu_instancing with `count` translations, rotations and scales, but all elements of
# instanceColor, also of slots that were never filled. The extension wants the same count for all attributes: a reader that
# checks this refuses the scene, one that takes the longest attribute shows instances at places of its own choice.
#
# Seen with three.js 0.187.0 on Node 20: 2 translations, 4 colours.
# Needs Node 20 and npm. Fails if the behaviour changes.
set -euo pipefail

dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT
cd "$dir"
npm install --silent --no-audit --no-fund three@0.187.0 >/dev/null

cat >export.mjs <<'JAVASCRIPT'
import * as THREE from 'three';
import { GLTFExporter } from 'three/addons/exporters/GLTFExporter.js';

// The exporter reads its blobs with the browser's FileReader.
globalThis.FileReader = class {
  readAsDataURL(blob) {
    blob.arrayBuffer().then(bytes => {
      this.result = 'data:application/octet-stream;base64,' + Buffer.from(bytes).toString('base64');
      this.onloadend();
    });
  }
};

const boxes = new THREE.InstancedMesh(new THREE.BoxGeometry(), new THREE.MeshStandardMaterial(), 4);
boxes.count = 2;
for (let i = 0; i < boxes.count; i++) {
  boxes.setMatrixAt(i, new THREE.Matrix4().makeTranslation(2 * i, 0, 0));
  boxes.setColorAt(i, new THREE.Color(1, i, 0));
}
const gltf = await new GLTFExporter().parseAsync(new THREE.Scene().add(boxes), {});
const { attributes } = gltf.nodes.find(node => node.extensions).extensions.EXT_mesh_gpu_instancing;
const counts = Object.fromEntries(Object.entries(attributes).map(([name, i]) => [name, gltf.accessors[i].count]));
console.log(gltf.asset.generator, counts);
if (counts.TRANSLATION !== 2 || counts._COLOR_0 !== 4) throw 'all attributes have the same count now';
JAVASCRIPT
node export.mjs
echo "ok: 4 colours for 2 instances"
