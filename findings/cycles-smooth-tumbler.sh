#!/usr/bin/env bash
# A tumbler of clear glass, smooth-shaded as one surface, is nearly black in Cycles.
#
# Screw and Solidify make a tumbler whose walls, rim and bottom share vertices, and "smooth shading" is Screw's default. The
# vertex normals at rim and bottom lean by 45 degrees, outside and inside in opposite directions. Cycles refracts at the
# interpolated normals, so that a parallel wall of 3 mm acts as a prism; rays that a lobe would send to the wrong side of the
# triangle end there, and their light is lost. In a white world, in which clear glass of any shape is white, two thirds are
# missing; in a room the tumbler is black. Flat shading, or sharp edges at rim and bottom, show clear glass. Neither a glTF
# file nor a viewport preview tells: rasterisers do not refract at these normals.
#
# Seen with bpy 5.0.1 on x86-64: flat 0.95, smooth 0.34 of the world's radiance at the middle of the wall.
# Needs Python 3.11 with venv, and pip. Fails if the behaviour changes.
set -euo pipefail

dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT
python3.11 -m venv "$dir/venv"
"$dir/venv/bin/pip" install --quiet bpy==5.0.1

cat >"$dir/tumbler.py" <<'PYTHON'
import sys

import bpy


def render(smooth, path):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.render.engine = 'CYCLES'
    scene.cycles.samples = 16
    scene.cycles.use_denoising = False
    scene.render.resolution_x = scene.render.resolution_y = 64
    scene.view_settings.view_transform = 'Raw'
    scene.render.image_settings.file_format = 'PNG'

    # A white world without anything in it: clear glass of any shape is white.
    world = bpy.data.worlds.new('White')
    world.use_nodes = True
    world.node_tree.nodes['Background'].inputs['Color'].default_value = (1, 1, 1, 1)
    scene.world = world

    # Half of the profile of a tumbler, turned about z and made 3 mm thick.
    mesh = bpy.data.meshes.new('Tumbler')
    mesh.from_pydata([(0, 0, 0), (.035, 0, 0), (.04, 0, .12)], [(0, 1), (1, 2)], [])
    tumbler = bpy.data.objects.new('Tumbler', mesh)
    scene.collection.objects.link(tumbler)
    screw = tumbler.modifiers.new('Screw', 'SCREW')
    screw.steps = screw.render_steps = 48
    screw.use_smooth_shade = smooth
    screw.use_merge_vertices = True
    screw.merge_threshold = 1e-4
    screw.use_normal_calculate = True
    tumbler.modifiers.new('Solidify', 'SOLIDIFY').thickness = .003

    glass = bpy.data.materials.new('Glass')
    glass.use_nodes = True
    inputs = glass.node_tree.nodes['Principled BSDF'].inputs
    inputs['Base Color'].default_value = (1, 1, 1, 1)
    inputs['Roughness'].default_value = 0
    inputs['Transmission Weight'].default_value = 1
    mesh.materials.append(glass)

    camera = bpy.data.objects.new('Camera', bpy.data.cameras.new('Camera'))
    scene.collection.objects.link(camera)
    camera.location = (0, -.5, .06)
    camera.rotation_euler = (1.5708, 0, 0)
    scene.camera = camera

    scene.render.filepath = path
    bpy.ops.render.render(write_still=True)
    pixels = bpy.data.images.load(path).pixels[:]
    # The middle of the wall: 16 x 16 pixels around the centre of the picture.
    wall = [pixels[4 * (y * 64 + x) + 1] for y in range(24, 40) for x in range(24, 40)]
    return sum(wall) / len(wall)


flat, smooth = (render(smooth, f'{sys.argv[1]}/{smooth}.png') for smooth in (False, True))
print(f'Blender {bpy.app.version_string}: wall of the tumbler, world = 1: flat {flat:.2f}, smooth {smooth:.2f}')
sys.exit(0 if flat > .8 and smooth < .4 else 1)
PYTHON
"$dir/venv/bin/python" -W ignore "$dir/tumbler.py" "$dir" | grep '^Blender'
