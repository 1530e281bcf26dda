#!/usr/bin/env bash
# cjio writes normals that point into the building.
#
# CityJSON's faces are counterclockwise from outside. The glTF that cjio makes keeps the winding, and adds a normal for each
# vertex: the mean over the faces that meet at the corner, pointing inwards. Viewers that cull by winding show the
# outside, and light it by normals that face away: buildings are black on the sunny side. No two triangles share a vertex in
# the file, so that each could have the normal of its own triangle.
#
# Seen with cjio 0.10.1 on x86-64: all normals of a tetrahedron point inwards.
# Needs Python 3.11 with venv, and pip. Fails if the behaviour changes.
set -euo pipefail

dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT
python3.11 -m venv "$dir/venv"
"$dir/venv/bin/pip" install --quiet cjio==0.10.1 triangle==20250106

cat >"$dir/tower.city.json" <<'JSON'
{"type": "CityJSON", "version": "2.0", "transform": {"scale": [1, 1, 1], "translate": [0, 0, 0]},
 "CityObjects": {"tower": {"type": "Building", "geometry": [{"type": "MultiSurface", "lod": "1",
   "boundaries": [[[0, 2, 1]], [[0, 1, 3]], [[1, 2, 3]], [[0, 3, 2]]]}]}},
 "vertices": [[0, 0, 0], [10, 0, 0], [0, 10, 0], [0, 0, 10]]}
JSON
"$dir/venv/bin/cjio" "$dir/tower.city.json" export glb "$dir/tower.glb"

cat >"$dir/look.py" <<'PYTHON'
import json
import struct
import sys

import numpy

with open(f'{sys.argv[1]}/tower.glb', 'rb') as file:
    data = file.read()
size = struct.unpack_from('<I', data, 12)[0]
gltf, chunk = json.loads(data[20:20 + size]), data[28 + size:]


def read(index, kind, width):
    accessor = gltf['accessors'][index]
    view = gltf['bufferViews'][accessor['bufferView']]
    start = view.get('byteOffset', 0) + accessor.get('byteOffset', 0)
    return numpy.frombuffer(chunk, kind, accessor['count'] * width, start).reshape(-1, width)


primitive = gltf['meshes'][0]['primitives'][0]
faces = read(primitive['indices'], '<u4', 1).reshape(-1, 3)
points = read(primitive['attributes']['POSITION'], '<f4', 3)
normals = read(primitive['attributes']['NORMAL'], '<f4', 3)
centre = points.mean(axis=0)
inward, outward_winding = 0, 0
for face in faces:
    a, b, c = points[face]
    outwards = (a + b + c) / 3 - centre
    outward_winding += numpy.dot(numpy.cross(b - a, c - a), outwards) > 0
    sides = normals[face] @ outwards
    inward += bool((sides < 0).all())
    print('normals', normals[face].round(2).tolist(), 'outwards' if (sides > 0).any() else 'inwards')
print(f'{outward_winding} of {len(faces)} faces are wound outwards, {inward} have inward normals')
assert outward_winding == len(faces)
assert inward == len(faces), 'normals point outwards now'
PYTHON
"$dir/venv/bin/python" "$dir/look.py" "$dir"
echo "ok: normals point inwards"
