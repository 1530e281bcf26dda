"""Writes models/tests/light-units/: one light of each kind in each of the exporter's lighting modes, and Cycles' radiance.

    PYTHON light_units.py      PYTHON has `bpy==5.0.1` and `OpenEXR`

KIND_MODE.glb: a floor, a wall and a ball, of one colour each, under a point (400 W), a spot (400 W) or a sun (3 W/m²),
written as Standard (SPEC), Unitless (COMPAT) or Raw (RAW). KIND.exr: the radiance of the same scene by Cycles in
Blender's own units (R, G, B as half floats, 48 × 36, row 0 on top): Lambertian, direct light only, one sample through
each pixel's centre. Lights have no size, since files do not store one.
"""

import os
import sys
import tempfile
from math import radians

import bpy  # isort: skip (bpy provides numpy and mathutils)
import numpy as np
import OpenEXR
from files import folder

WIDTH, HEIGHT = 48, 36
LIGHTS = {"point": ("POINT", 400), "spot": ("SPOT", 400), "sun": ("SUN", 3)}
MODES = ["SPEC", "COMPAT", "RAW"]
out = folder("tests/light-units")


def diffuse(name, color):
    material = bpy.data.materials.new(name)
    material.use_nodes = True
    surface = material.node_tree.nodes["Principled BSDF"]
    for socket, value in (("Base Color", (*color, 1)), ("Roughness", 1), ("Specular IOR Level", 0)):
        surface.inputs[socket].default_value = value
    return material


def scene(kind, power):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    for add, place, material in (
        (bpy.ops.mesh.primitive_plane_add, dict(size=6), diffuse("Floor", (0.8, 0.8, 0.8))),
        (
            bpy.ops.mesh.primitive_plane_add,
            dict(size=6, location=(0, 3, 3), rotation=(radians(90), 0, 0)),
            diffuse("Wall", (0.6, 0.3, 0.1)),
        ),
        (
            bpy.ops.mesh.primitive_uv_sphere_add,
            dict(radius=0.8, location=(0.5, 0.8, 0.8), segments=16, ring_count=8),
            diffuse("Ball", (0.1, 0.4, 0.7)),
        ),
    ):
        add(**place)
        bpy.context.object.data.materials.append(material)
        if material.name == "Ball":
            bpy.ops.object.shade_smooth()
    light = bpy.data.lights.new("Light", kind)
    light.energy = power
    light.color = (1, 0.9, 0.7)
    if kind == "SUN":
        light.angle = 0
    else:
        light.shadow_soft_size = 0
    if kind == "SPOT":
        light.spot_size, light.spot_blend = radians(100), 0
    lamp = bpy.data.objects.new("Light", light)
    lamp.location, lamp.rotation_euler = (-1.2, -0.8, 3.4), (radians(25), radians(-20), 0)
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.location, camera.rotation_euler = (0, -7, 2.5), (radians(82), 0, 0)
    for thing in (lamp, camera):
        bpy.context.collection.objects.link(thing)
    s = bpy.context.scene
    s.camera = camera
    s.render.resolution_x, s.render.resolution_y, s.render.resolution_percentage = WIDTH, HEIGHT, 100
    s.world = bpy.data.worlds.new("Black")
    s.world.use_nodes = True
    s.world.node_tree.nodes["Background"].inputs["Strength"].default_value = 0
    return s


def lambert():
    """Replaces the exported material by Cycles' Lambertian one."""
    for material in bpy.data.materials:
        tree = material.node_tree
        color = tree.nodes["Principled BSDF"].inputs["Base Color"].default_value[:]
        bsdf = tree.nodes.new("ShaderNodeBsdfDiffuse")
        bsdf.inputs["Color"].default_value = color
        bsdf.inputs["Roughness"].default_value = 0
        tree.links.new(bsdf.outputs["BSDF"], tree.nodes["Material Output"].inputs["Surface"])


def radiance(s, temporary):
    s.render.engine = "CYCLES"
    s.cycles.device = "CPU"
    s.cycles.samples, s.cycles.use_adaptive_sampling, s.cycles.use_denoising = 1, False, False
    s.cycles.pixel_filter_type, s.cycles.filter_width = "BOX", 0.01
    s.cycles.max_bounces = s.cycles.diffuse_bounces = 0
    s.render.threads_mode, s.render.threads = "FIXED", 1
    s.render.image_settings.file_format, s.render.image_settings.color_depth = "OPEN_EXR", "32"
    s.render.filepath = temporary
    bpy.ops.render.render(write_still=True)
    with OpenEXR.File(temporary, separate_channels=True) as file:
        channels = file.channels()
        return {c: channels[c].pixels.astype(np.float16) for c in "RGB"}


with tempfile.TemporaryDirectory() as temporary:
    for name, (kind, power) in LIGHTS.items():
        s = scene(kind, power)
        for mode in MODES:
            bpy.ops.export_scene.gltf(
                filepath=str(out / f"{name}_{mode}.glb"),
                export_format="GLB",
                export_cameras=True,
                export_lights=True,
                export_texcoords=False,
                export_import_convert_lighting_mode=mode,
            )
        lambert()
        pixels = radiance(s, os.path.join(temporary, "render.exr"))
        OpenEXR.File({"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}, pixels).write(
            str(out / f"{name}.exr")
        )
        print(name, "made", file=sys.stderr)
