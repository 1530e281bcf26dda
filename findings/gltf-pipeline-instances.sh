#!/usr/bin/env bash
# gltf-pipeline deletes the accessors of GPU instances when it compresses a mesh.
#
# With Draco options, gltf-pipeline removes accessors and buffer views that nothing uses after the compression. It does not
# know that EXT_mesh_gpu_instancing refers to accessors from nodes: the translations of the instances are deleted, the
# numbers of the remaining accessors shift, and the node still has the old number. It names no accessor now, or the wrong one,
# which may have the right type. Without compression the file passes unchanged. There is no message.
#
# Seen with gltf-pipeline 4.3.1 on Node 20: 3 accessors become 2, and the node refers to accessors[2].
# Needs Node 20 and npm. Fails if the behaviour changes.
set -euo pipefail

dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT
cd "$dir"
npm install --silent --no-audit --no-fund gltf-pipeline@4.3.1 >/dev/null

cat >compress.js <<'JAVASCRIPT'
const assert = require('node:assert/strict');
const { processGltf } = require('gltf-pipeline');

const floats = values => Buffer.from(new Float32Array(values).buffer);
const bytes = Buffer.concat([
  floats([0, 0, 0, 1, 0, 0, 0, 1, 0]),
  Buffer.from(new Uint16Array([0, 1, 2, 0]).buffer),
  floats([0, 0, 0, 5, 0, 0]),
]);
const scene = () => ({
  asset: { version: '2.0' },
  extensionsUsed: ['EXT_mesh_gpu_instancing'],
  scene: 0,
  scenes: [{ nodes: [0] }],
  nodes: [{ mesh: 0, extensions: { EXT_mesh_gpu_instancing: { attributes: { TRANSLATION: 2 } } } }],
  meshes: [{ primitives: [{ attributes: { POSITION: 0 }, indices: 1 }] }],
  accessors: [
    { bufferView: 0, componentType: 5126, type: 'VEC3', count: 3, min: [0, 0, 0], max: [1, 1, 0] },
    { bufferView: 1, componentType: 5123, type: 'SCALAR', count: 3 },
    { bufferView: 2, componentType: 5126, type: 'VEC3', count: 2 },
  ],
  bufferViews: [
    { buffer: 0, byteOffset: 0, byteLength: 36 },
    { buffer: 0, byteOffset: 36, byteLength: 8 },
    { buffer: 0, byteOffset: 44, byteLength: 24 },
  ],
  buffers: [{ byteLength: bytes.length, uri: 'data:application/octet-stream;base64,' + bytes.toString('base64') }],
});

async function main() {
  for (const [name, options] of [['plain', {}], ['Draco', { dracoOptions: { compressionLevel: 7 } }]]) {
    const { gltf } = await processGltf(scene(), options);
    const translation = gltf.nodes[0].extensions.EXT_mesh_gpu_instancing.attributes.TRANSLATION;
    console.log(`${name}: ${gltf.accessors.length} accessors, the instances use number ${translation}`);
    const exists = translation < gltf.accessors.length && gltf.accessors[translation].count === 2;
    assert.equal(exists, name === 'plain', 'instances survive compression now');
  }
}
main();
JAVASCRIPT
node compress.js
echo "ok: the accessor of the instances is deleted"
