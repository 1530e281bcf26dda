"""Blender's Cycles on the CPU by bpy, direct light alone: `with_cycles.py SCENE OUT SAMPLES`."""

import sys

import bpy
from mathutils import Vector

path, out, samples = sys.argv[1:4]
bpy.ops.wm.read_factory_settings(use_empty=True)
if path.endswith(".obj"):
    bpy.ops.wm.obj_import(filepath=path, forward_axis="NEGATIVE_Z", up_axis="Y")
else:
    bpy.ops.import_scene.gltf(filepath=path, export_import_convert_lighting_mode="COMPAT")
scene = bpy.context.scene
# World +Y up to Blender's +Z: (x, y, z) is (x, −z, y).
eye = Vector((0.62, -1.75, 0.42))
camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
camera.data.sensor_fit, camera.data.angle = "VERTICAL", 0.733
camera.location, camera.rotation_euler = eye, (-eye).to_track_quat("-Z", "Y").to_euler()
scene.collection.objects.link(camera)
scene.camera = camera
if not any(o.type == "LIGHT" for o in scene.objects):
    lamp = bpy.data.objects.new("Lamp", bpy.data.lights.new("Lamp", "POINT"))
    lamp.data.energy, lamp.data.shadow_soft_size, lamp.location = 800, 0, (3, -2, 4)
    scene.collection.objects.link(lamp)
scene.render.engine = "CYCLES"
scene.render.resolution_x, scene.render.resolution_y = 1280, 720
scene.render.image_settings.file_format = "PNG"
scene.render.filepath = out
cycles = scene.cycles
cycles.device, cycles.samples = "CPU", int(samples)
cycles.use_adaptive_sampling = cycles.use_denoising = False
cycles.max_bounces = cycles.diffuse_bounces = cycles.glossy_bounces = 0
bpy.ops.render.render(write_still=True)
