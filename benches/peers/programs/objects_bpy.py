"""Blender by bpy: 12 views of each file: `objects_bpy.py LIST FOLDER SIDE ENGINE`. CYCLES takes one sample of direct light
on the CPU, BLENDER_WORKBENCH needs OpenGL."""

import math
import sys
from pathlib import Path

import bpy
from mathutils import Vector

files, folder, side = Path(sys.argv[1]).read_text().split(), Path(sys.argv[2]), int(sys.argv[3])
for file in files:
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.import_scene.gltf(filepath=file)
    scene = bpy.context.scene
    corners = [o.matrix_world @ Vector(c) for o in scene.objects if o.type == "MESH" for c in o.bound_box]
    low, high = (Vector(f(c[i] for c in corners) for i in range(3)) for f in (min, max))
    centre, radius = (low + high) / 2, (high - low).length / 2
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.data.angle = math.radians(30)
    camera.data.clip_end = 100 * radius
    lamp = bpy.data.objects.new("Lamp", bpy.data.lights.new("Lamp", "POINT"))
    lamp.data.energy, lamp.data.shadow_soft_size = 800 * radius ** 2, 0
    lamp.location = centre + radius * Vector((3, -2, 4))
    for made in (camera, lamp):
        scene.collection.objects.link(made)
    scene.camera = camera
    scene.render.engine = sys.argv[4]
    scene.render.resolution_x = scene.render.resolution_y = side
    scene.render.image_settings.file_format = "PNG"
    if sys.argv[4] == "CYCLES":
        cycles = scene.cycles
        cycles.device, cycles.samples = "CPU", 1
        cycles.use_adaptive_sampling = cycles.use_denoising = False
        cycles.max_bounces = cycles.diffuse_bounces = cycles.glossy_bounces = 0
        scene.render.use_persistent_data = True
    for view in range(12):
        azimuth, elevation = math.radians(30 * view), math.radians(22)
        direction = Vector((math.cos(elevation) * math.sin(azimuth), -math.cos(elevation) * math.cos(azimuth),
                            math.sin(elevation)))
        camera.location = centre + radius / math.sin(math.radians(15)) * direction
        camera.rotation_euler = (-direction).to_track_quat("-Z", "Y").to_euler()
        scene.render.filepath = str(folder / f"{Path(file).stem}-{view + 1:02}.png")
        bpy.ops.render.render(write_still=True)
