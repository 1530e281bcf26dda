"""The tutorial's scene, made as a Blender user would: a toy tower of five rings and a ball, a camera, a lamp.

    python models/scripts/tower.py [FILE.glb]

Needs a Python that has bpy (`pip install bpy`), or Blender itself: `blender -b --python models/scripts/tower.py`.
"""

import sys
from math import radians
from pathlib import Path

import bpy

bpy.ops.wm.read_factory_settings(use_empty=True)


def material(name, color, roughness=0.35):
    made = bpy.data.materials.new(name)
    made.use_nodes = True
    shader = made.node_tree.nodes["Principled BSDF"]
    shader.inputs["Base Color"].default_value = (*color, 1)
    shader.inputs["Roughness"].default_value = roughness
    return made


def named(name, surface=None):
    thing = bpy.context.object
    thing.name = thing.data.name = name
    if surface:
        thing.data.materials.append(surface)
        bpy.ops.object.shade_smooth_by_angle(angle=radians(40))


wood = material("Wood", (0.55, 0.33, 0.16), 0.7)
bpy.ops.mesh.primitive_cylinder_add(location=(0, 0, 0.015), radius=0.13, depth=0.03, vertices=96)
named("Foot", wood)
bpy.ops.mesh.primitive_cylinder_add(location=(0, 0, 0.15), radius=0.013, depth=0.26, vertices=48)
named("Pole", wood)

height = 0.03
for i, (name, color) in enumerate({
    "Blue": (0.03, 0.16, 0.50),
    "Green": (0.06, 0.36, 0.14),
    "Yellow": (0.85, 0.53, 0.04),
    "Orange": (0.80, 0.20, 0.03),
    "Red": (0.62, 0.03, 0.04),
}.items()):
    thick = 0.030 - 0.003 * i
    height += thick
    bpy.ops.mesh.primitive_torus_add(
        location=(0, 0, height), major_radius=0.085 - 0.012 * i, minor_radius=thick, major_segments=80, minor_segments=24
    )
    named(f"{name} ring", material(name, color))
    height += thick * 0.95
bpy.ops.mesh.primitive_ico_sphere_add(location=(0, 0, height + 0.028), radius=0.034, subdivisions=5)
named("Ball", material("White", (0.85, 0.82, 0.76)))

bpy.ops.object.camera_add(location=(0.5, -0.85, 0.42), rotation=(radians(74), 0, radians(30.5)))
named("Camera")
bpy.context.scene.camera = bpy.context.object
bpy.ops.object.light_add(type="POINT", location=(-0.9, -1.2, 1.4))
named("Lamp")
bpy.context.object.data.energy = 110

path = Path(sys.argv[-1] if sys.argv[-1].endswith(".glb") else Path(__file__).parents[1] / "tower/tower.glb").absolute()
path.parent.mkdir(parents=True, exist_ok=True)
# By default the exporter leaves cameras and lights out; nothing here has a texture.
bpy.ops.export_scene.gltf(filepath=str(path), export_cameras=True, export_lights=True, export_texcoords=False)
