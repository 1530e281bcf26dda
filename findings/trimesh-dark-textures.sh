#!/usr/bin/env bash
# trimesh darkens textures to 40 % in glTF and OBJ files.
#
# SimpleMaterial(image=...) is the usual material of textured meshes made in Python. Without the argument `diffuse` its
# colour is a grey of 0.4, and both exporters write it beside the texture: a GLB has baseColorFactor 0.4, an MTL Kd 0.4, and
# both formats multiply the texture by it. A white texture is shown as 0.4 of white. diffuse=[255, 255, 255, 255] helps.
# PBRMaterial has no such colour.
#
# Seen with trimesh 5.2.0 and Pillow 12.0.0 on x86-64.
# Needs Python 3.11 with venv, and pip. Fails if the behaviour changes.
set -euo pipefail

dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT
python3.11 -m venv "$dir/venv"
"$dir/venv/bin/pip" install --quiet trimesh==5.2.0 scipy==1.17.1 pillow==12.0.0

cat >"$dir/texture.py" <<'PYTHON'
import json
import struct
import sys

import trimesh
from PIL import Image
from trimesh.visual.material import PBRMaterial, SimpleMaterial

folder = sys.argv[1]
white = Image.new('RGB', (4, 4), 'white')


def box(material):
    mesh = trimesh.creation.box()
    mesh.visual = trimesh.visual.TextureVisuals(uv=mesh.vertices[:, :2], material=material)
    return mesh


def factor(material):
    data = box(material).export(file_type='glb')
    size = struct.unpack_from('<I', data, 12)[0]
    pbr = json.loads(data[20:20 + size])['materials'][0]['pbrMetallicRoughness']
    assert 'baseColorTexture' in pbr
    return pbr.get('baseColorFactor', [1, 1, 1, 1])


plain = factor(SimpleMaterial(image=white))
white_diffuse = factor(SimpleMaterial(image=white, diffuse=[255, 255, 255, 255]))
pbr = factor(PBRMaterial(baseColorTexture=white))
print('SimpleMaterial', plain, 'with diffuse', white_diffuse, 'PBRMaterial', pbr)
assert plain[:3] == [.4, .4, .4], 'textures are not darkened now'
assert white_diffuse[:3] == [1, 1, 1] and pbr[:3] == [1, 1, 1]

box(SimpleMaterial(image=white)).export(f'{folder}/box.obj')
with open(f'{folder}/material.mtl') as file:
    lines = [line.strip() for line in file if line.startswith(('Kd', 'map_Kd'))]
print(lines)
assert float(lines[0].split()[1]) == .4
PYTHON
"$dir/venv/bin/python" "$dir/texture.py" "$dir"
echo "ok: textures are multiplied by 0.4"
