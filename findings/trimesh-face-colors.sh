#!/usr/bin/env bash
# trimesh blends the colours of faces in glTF files.
#
# mesh.visual.face_colors gives each triangle a colour of its own, which trimesh's own viewer shows with hard borders. glTF
# has colours of vertices only. The exporter keeps the vertices that faces share, and gives each the mean of the faces
# around it: a box with one red and five blue sides has no red vertex, and labels of a segmentation become a gradient
# of colours that are no label's. mesh.unmerge_vertices() before the export keeps the colours apart, but only the first
# export: after another one, the mesh has colours for its old vertices too, and the exporter drops them. Hence the copy.
#
# Seen with trimesh 5.2.0 on x86-64: no vertex is red.
# Needs Python 3.11 with venv, and pip. Fails if the behaviour changes.
set -euo pipefail

dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT
python3.11 -m venv "$dir/venv"
"$dir/venv/bin/pip" install --quiet trimesh==5.2.0 scipy==1.17.1

cat >"$dir/faces.py" <<'PYTHON'
import json
import struct

import trimesh

red, blue = (255, 0, 0, 255), (0, 0, 255, 255)


def stored_colors(mesh):
    data = mesh.export(file_type='glb')
    size = struct.unpack_from('<I', data, 12)[0]
    gltf = json.loads(data[20:20 + size])
    accessor = gltf['accessors'][gltf['meshes'][0]['primitives'][0]['attributes']['COLOR_0']]
    view = gltf['bufferViews'][accessor['bufferView']]
    start = 28 + size + view.get('byteOffset', 0) + accessor.get('byteOffset', 0)
    return {tuple(data[start + 4 * i:start + 4 * i + 4]) for i in range(accessor['count'])}


box = trimesh.creation.box()
up = box.face_normals[:, 2] > .9
box.visual.face_colors = [red if top else blue for top in up]
shared = stored_colors(box)
print(trimesh.__version__, 'shared vertices:', sorted(shared))
assert red not in shared and len(shared) > 2, 'colours of faces are kept apart now'

parts = box.copy()
parts.unmerge_vertices()
apart = stored_colors(parts)
print('unmerged:', sorted(apart))
assert apart == {red, blue}
PYTHON
"$dir/venv/bin/python" "$dir/faces.py"
echo "ok: colours of faces are blended"
