#!/usr/bin/env bash
# Blender's glTF exporter writes the heights of a Bump node as a normal map.
#
# The Normal input of a Principled BSDF may come from an Image Texture through a Bump node, which takes grey heights. The exporter
# looks behind the node, finds an image and writes it as normalTexture: without conversion, and without a message. Grey
# texels are then read as normals, of which white is (1, 1, 1) / √3 and black points into the surface, so that readers of the
# file show stripes of black where Blender shows small bumps.
#
# Seen with bpy 5.0.1 (Blender's glTF exporter 5.0) on x86-64.
# Needs Python 3.11 with venv, and pip. Fails if the behaviour changes.
set -euo pipefail

dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT
python3.11 -m venv "$dir/venv"
"$dir/venv/bin/pip" install --quiet bpy==5.0.1

cat >"$dir/bump.py" <<'PYTHON'
import base64
import json
import sys

import bpy
import numpy

path = f'{sys.argv[-1]}/bump.gltf'
bpy.ops.wm.read_factory_settings(use_empty=True)
bpy.ops.mesh.primitive_plane_add()

heights = bpy.data.images.new('Heights', 8, 8)
texels = numpy.ones((8, 8, 4), numpy.float32)
texels[..., :3] = numpy.linspace(0, 1, 8)[None, :, None]
heights.pixels.foreach_set(texels.ravel())
heights.pack()

material = bpy.data.materials.new('Rough')
material.use_nodes = True
tree = material.node_tree
texture = tree.nodes.new('ShaderNodeTexImage')
texture.image = heights
bump = tree.nodes.new('ShaderNodeBump')
tree.links.new(texture.outputs['Color'], bump.inputs['Height'])
tree.links.new(bump.outputs['Normal'], tree.nodes['Principled BSDF'].inputs['Normal'])
bpy.context.object.data.materials.append(material)

bpy.ops.export_scene.gltf(filepath=path, export_format='GLTF_SEPARATE', export_texture_dir='')
with open(path) as file:
    gltf = json.load(file)
normal = gltf['materials'][0].get('normalTexture')
print('normalTexture:', normal)
assert normal is not None, 'heights are no normal map now'
image = gltf['images'][gltf['textures'][normal['index']]['source']]
stored = bpy.data.images.load(f"{sys.argv[-1]}/{image['uri']}")
pixels = numpy.empty(len(stored.pixels), numpy.float32)
stored.pixels.foreach_get(pixels)
row = pixels.reshape(8, 8, 4)[0, :, :3]
print('its first row:', (255 * row).round().astype(int).tolist())
assert numpy.ptp(row, axis=1).max() == 0 and numpy.ptp(row[:, 0]) > .9, 'the image is not grey now'
PYTHON

"$dir/venv/bin/python" "$dir/bump.py" -- "$dir"
echo "ok: heights are written as a normal map"
