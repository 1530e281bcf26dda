#!/usr/bin/env bash
# The smooth walls of a cylinder with flat caps reflect in Cycles as if they were a barrel.
#
# Blender keeps two kinds of normals. Those of corners treat the edge between a smooth and a flat face as sharp: on the walls of
# a standing cylinder they are horizontal, and the glTF exporter writes them. Those of vertices average all faces around, flat
# ones too: at the rim they lean by some 45 degrees. Cycles interpolates the vertices' over the smooth faces, as long as no edge
# is marked sharp. A chrome leg of two rings of vertices mirrors a window above in its upper half, a picture that the exported
# file cannot give: there the walls are straight. A renderer of the file that is compared with Cycles looks wrong and is right.
# With the rims marked sharp, Cycles agrees with the file.
#
# Seen with bpy 5.0.1 on x86-64: near the rim Cycles' normal has an upward part of 0.69, the corners' and the glTF file's 0.
# Needs Python 3.11 with venv, and pip. Fails if the behaviour changes.
set -euo pipefail

dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT
python3.11 -m venv "$dir/venv"
"$dir/venv/bin/pip" install --quiet bpy==5.0.1

cat >"$dir/cylinder.py" <<'PYTHON'
import json
import math
import struct
import sys

import bpy
import numpy as np

folder = sys.argv[-1]


def upward_at_the_rim(marks_rims_sharp):
    """Cycles' upward part of the normal, from the middle of the wall to its upper end."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    bpy.ops.mesh.primitive_cylinder_add(vertices=64, radius=0.5, depth=4)
    mesh = bpy.context.object.data
    for polygon in mesh.polygons:
        polygon.use_smooth = len(polygon.vertices) == 4
        if not polygon.use_smooth:
            for edge in polygon.edge_keys:
                mesh.edges[mesh.edge_keys.index(edge)].use_edge_sharp = marks_rims_sharp

    material = bpy.data.materials.new("normal")
    material.use_nodes = True
    tree = material.node_tree
    tree.nodes.clear()
    geometry, split, emission, output = (
        tree.nodes.new(kind)
        for kind in ("ShaderNodeNewGeometry", "ShaderNodeSeparateXYZ", "ShaderNodeEmission", "ShaderNodeOutputMaterial")
    )
    tree.links.new(geometry.outputs["Normal"], split.inputs[0])
    tree.links.new(split.outputs["Z"], emission.inputs["Color"])
    tree.links.new(emission.outputs[0], output.inputs[0])
    mesh.materials.append(material)

    data = bpy.data.cameras.new("camera")
    data.type, data.ortho_scale = "ORTHO", 5
    camera = bpy.data.objects.new("camera", data)
    camera.location, camera.rotation_euler = (0, -5, 0), (math.pi / 2, 0, 0)
    scene.collection.objects.link(camera)
    scene.camera = camera
    scene.render.engine = "CYCLES"
    scene.cycles.samples, scene.cycles.use_denoising = 4, False
    scene.render.resolution_x = scene.render.resolution_y = 50
    scene.render.image_settings.file_format, scene.render.image_settings.color_depth = "OPEN_EXR", "32"
    scene.render.filepath = f"{folder}/normal.exr"
    bpy.ops.render.render(write_still=True)
    image = bpy.data.images.load(scene.render.filepath, check_existing=False)
    column = np.array(image.pixels[:]).reshape(50, 50, 4)[:, 25, 0]
    corners = [mesh.corner_normals[i].vector.z for p in mesh.polygons if p.use_smooth for i in p.loop_indices]
    return float(column[25]), float(column[44]), max(map(abs, corners))


middle, rim, corners = upward_at_the_rim(False)
bpy.ops.export_scene.gltf(filepath=f"{folder}/cylinder.glb")
file = open(f"{folder}/cylinder.glb", "rb").read()
length = struct.unpack_from("<I", file, 12)[0]
document = json.loads(file[20 : 20 + length])
accessor = document["accessors"][document["meshes"][0]["primitives"][0]["attributes"]["NORMAL"]]
start = 28 + length + document["bufferViews"][accessor["bufferView"]].get("byteOffset", 0)
normals = np.frombuffer(file, "<f4", 3 * accessor["count"], start).reshape(-1, 3)
# glTF's y is up: normals of caps are vertical, all others belong to the walls.
walls = normals[np.abs(normals[:, 1]) < 0.99]
exported = float(np.abs(walls[:, 1]).max())
_, sharp, _ = upward_at_the_rim(True)
print(f"Cycles: {middle:.2f} in the middle, {rim:.2f} at the rim; corners: {corners:.2f}; glTF: {exported:.2f}")
print(f"Cycles with sharp rims: {sharp:.2f}")
assert abs(middle) < 0.05 and 0.6 < rim < 0.75, "Cycles interpolates other normals"
assert corners < 1e-3 and exported < 1e-3, "corners or the exported file lean"
assert abs(sharp) < 1e-3, "sharp rims do not help"
PYTHON
"$dir/venv/bin/python" "$dir/cylinder.py" "$dir" | grep Cycles
