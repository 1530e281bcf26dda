#!/usr/bin/env bash
# Cycles multiplies the colours of an image by its alpha if nothing uses the alpha.
#
# An Image Texture node has the outputs Color and Alpha. Color is the stored colour if Alpha is linked, to whatever, and
# the stored colour times alpha if it is not: the link of one output changes the other. A PNG with unused alpha, such as a mask
# that some programs keep there, makes a surface dark or black. Exporters do not write the links: a program that reads the
# exported file shows the stored colours and differs from Blender's render.
#
# Stored colours are multiplied, before they are decoded to linear light.
#
# Seen with bpy 5.0.1 on x86-64: white with an alpha of 64/255 is 1.000 with the link and 0.051 without, in linear light.
# Needs Python 3.11 with venv, and pip. Fails if the behaviour changes.
set -euo pipefail

dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT
python3.11 -m venv "$dir/venv"
"$dir/venv/bin/pip" install --quiet bpy==5.0.1 pillow==12.0.0

cat >"$dir/alpha.py" <<'PYTHON'
import sys

import bpy
import numpy
from PIL import Image

folder = sys.argv[-1]
Image.new('RGBA', (8, 8), (255, 255, 255, 64)).save(f'{folder}/white.png')


def render(uses_alpha):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.render.engine = 'CYCLES'
    scene.cycles.samples = 1
    scene.cycles.use_denoising = False
    scene.render.resolution_x = scene.render.resolution_y = 16
    scene.view_settings.view_transform = 'Raw'
    bpy.ops.mesh.primitive_plane_add(size=4)
    material = bpy.data.materials.new('Image')
    material.use_nodes = True
    tree = material.node_tree
    tree.nodes.clear()
    image = tree.nodes.new('ShaderNodeTexImage')
    image.image = bpy.data.images.load(f'{folder}/white.png')
    emission = tree.nodes.new('ShaderNodeEmission')
    output = tree.nodes.new('ShaderNodeOutputMaterial')
    tree.links.new(image.outputs['Color'], emission.inputs['Color'])
    tree.links.new(emission.outputs['Emission'], output.inputs['Surface'])
    if uses_alpha:
        # The strength is 1 as before: only the link matters.
        greater = tree.nodes.new('ShaderNodeMath')
        greater.operation = 'GREATER_THAN'
        greater.inputs[1].default_value = .1
        tree.links.new(image.outputs['Alpha'], greater.inputs[0])
        tree.links.new(greater.outputs[0], emission.inputs['Strength'])
    bpy.context.object.data.materials.append(material)
    camera = bpy.data.objects.new('Camera', bpy.data.cameras.new('Camera'))
    scene.collection.objects.link(camera)
    camera.location = (0, 0, 2)
    scene.camera = camera
    scene.render.image_settings.file_format = 'PNG'
    scene.render.filepath = f'{folder}/{uses_alpha}.png'
    bpy.ops.render.render(write_still=True)
    return numpy.asarray(Image.open(scene.render.filepath).convert('RGB'))[8, 8, 0] / 255


linked, unused = render(True), render(False)
print(f'white with an alpha of 64/255: {linked:.3f} with Alpha linked, {unused:.3f} without')
encoded = 64 / 255
multiplied = ((encoded + .055) / 1.055) ** 2.4
assert abs(linked - 1) < .01 and abs(unused - multiplied) < .01, 'links of Alpha do not matter now'
PYTHON

"$dir/venv/bin/python" "$dir/alpha.py" -- "$dir"
echo "ok: the link of Alpha changes Color"
