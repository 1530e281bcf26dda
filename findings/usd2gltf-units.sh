#!/usr/bin/env bash
# usd2gltf ignores a stage's unit and up axis, and leaves out its cubes.
#
# A USD stage says how long its unit is (metersPerUnit) and which axis is up (upAxis); centimetres with Z up are common.
# glTF has metres with Y up. usd2gltf copies the numbers: a quad of 1 m that stands upright is 100 m and lies flat, and no
# node turns or scales it. USD's own shapes, such as Cube, are left out without a message; only meshes are converted. The file
# has no generator, by which a reader could know.
#
# Seen with usd2gltf 0.3.5 and usd-core 26.11 on x86-64.
# Needs Python 3.11 with venv, and pip. Fails if the behaviour changes.
set -euo pipefail

dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT
python3.11 -m venv "$dir/venv"
"$dir/venv/bin/pip" install --quiet usd2gltf==0.3.5 usd-core==26.11

cat >"$dir/stage.usda" <<'USD'
#usda 1.0
(
    metersPerUnit = 0.01
    upAxis = "Z"
)
def Mesh "Wall"
{
    point3f[] points = [(0, 0, 0), (100, 0, 0), (100, 0, 100), (0, 0, 100)]
    int[] faceVertexCounts = [4]
    int[] faceVertexIndices = [0, 1, 2, 3]
}
def Cube "Cube"
{
    double size = 50
}
USD
"$dir/venv/bin/usd2gltf" -i "$dir/stage.usda" -o "$dir/stage.gltf"

cat >"$dir/look.py" <<'PYTHON'
import json
import sys

with open(f'{sys.argv[1]}/stage.gltf') as file:
    gltf = json.load(file)
for node in gltf['nodes']:
    print(node)
position = gltf['accessors'][gltf['meshes'][0]['primitives'][0]['attributes']['POSITION']]
print('Wall:', position['min'], position['max'], 'generator:', gltf['asset'].get('generator'))
assert position['max'] == [100, 0, 100], 'positions are converted now'
assert all(not {'matrix', 'rotation', 'scale'} & node.keys() for node in gltf['nodes']), 'nodes turn or scale now'
assert len(gltf['meshes']) == 1 and all('Cube' not in node.get('name', '') or 'mesh' not in node for node in gltf['nodes'])
PYTHON
"$dir/venv/bin/python" "$dir/look.py" "$dir"
echo "ok: units, up axis and cubes are lost"
