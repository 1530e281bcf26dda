#!/usr/bin/env bash
# obj2gltf --metallicRoughness copies the shininess of an MTL into roughnessFactor.
#
# Without the option obj2gltf turns Ns, a shininess of 0 to 1000, into a roughness of 0 to 1. The option says that the MTL's
# values are metallic-roughness values already, with the roughness in Ns. A file from a modeller then has roughnessFactor 200,
# where glTF allows 0 to 1: the conversion reports success, and a glossy material is as rough as can be in viewers that
# clamp. Ks becomes metallicFactor, so that a plastic with Ks 0.5 is half a metal.
#
# Seen with obj2gltf 3.2.0 on Node 20: roughnessFactor 0.8 without the option, 200 with it.
# Needs Node 20 and npm. Fails if the behaviour changes.
set -euo pipefail

dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT
cd "$dir"
npm install --silent --no-audit --no-fund obj2gltf@3.2.0 >/dev/null

printf '%s\n' 'mtllib a.mtl' 'v 0 0 0' 'v 1 0 0' 'v 0 1 0' 'usemtl plastic' 'f 1 2 3' >a.obj
printf '%s\n' 'newmtl plastic' 'Kd .8 .2 .2' 'Ks .5 .5 .5' 'Ns 200' >a.mtl
npx obj2gltf -i a.obj -o plain.gltf
npx obj2gltf -i a.obj -o option.gltf --metallicRoughness
node -e "
const assert = require('node:assert/strict');
const read = name => JSON.parse(require('node:fs').readFileSync(name)).materials[0].pbrMetallicRoughness;
const [plain, option] = [read('plain.gltf'), read('option.gltf')];
console.log('without the option', plain);
console.log('with the option', option);
assert.equal(plain.roughnessFactor, .8);
assert.equal(option.roughnessFactor, 200, 'the factor is in range now');
assert.equal(option.metallicFactor, .5);
"
echo "ok: roughnessFactor 200"
