"""Exports from Blender: python blender.py (bpy 5.0.1).

A board with an image texture, a bent tube of cells (several linked copies of one mesh), lights, a camera."""

import math
from pathlib import Path

import bpy

OUT = Path(__file__).resolve().parents[2] / "tests" / "gltf"


def clear():
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.preferences.addon_enable(module="io_scene_gltf2")
    scene = bpy.context.scene
    scene.render.fps = 24
    scene.frame_start, scene.frame_end = 1, 25
    return scene


def mesh_object(name, build, material=None):
    build()
    thing = bpy.context.object
    thing.name = thing.data.name = name
    if material:
        thing.data.materials.append(material)
    return thing


def material(name, rgb, roughness=0.5, metallic=0.0):
    m = bpy.data.materials.new(name)
    m.use_nodes = True
    bsdf = m.node_tree.nodes["Principled BSDF"]
    bsdf.inputs["Base Color"].default_value = (*rgb, 1)
    bsdf.inputs["Roughness"].default_value = roughness
    bsdf.inputs["Metallic"].default_value = metallic
    return m


def picture(name, n=16):
    image = bpy.data.images.new(name, n, n, alpha=False)
    values = []
    for y in range(n):
        for x in range(n):
            on = (x // 4 + y // 4) % 2
            values += [x / n, y / n, 0.8 if on else 0.2, 1]
    image.pixels = values
    image.pack()
    return image


def textured(name):
    m = material(name, (1, 1, 1))
    nodes, links = m.node_tree.nodes, m.node_tree.links
    node = nodes.new("ShaderNodeTexImage")
    node.image = picture(name + " picture")
    links.new(node.outputs["Color"], nodes["Principled BSDF"].inputs["Base Color"])
    return m


def ring_and_cone():
    """A torus with a texture and vertex colours, and a cone; small enough for a fixture."""
    ring = mesh_object(
        "Ring",
        lambda: bpy.ops.mesh.primitive_torus_add(major_segments=12, minor_segments=8, major_radius=1, minor_radius=0.3),
        textured("Striped"),
    )
    colours = ring.data.color_attributes.new("Color", "FLOAT_COLOR", "POINT")
    for i, v in enumerate(ring.data.vertices):
        colours.data[i].color = (0.5 + v.co.x / 3, 0.5 + v.co.y / 3, 0.5, 1)
    for p in ring.data.polygons:
        p.use_smooth = True
    cone = mesh_object(
        "Cone", lambda: bpy.ops.mesh.primitive_cone_add(vertices=12, radius1=0.4, depth=1), material("Red", (0.8, 0.1, 0.1))
    )
    cone.location = (0, 0, 0.8)
    return ring, cone


def export(name, **options):
    common = dict(filepath=str(OUT / name), export_format="GLB", export_yup=True, export_apply=False)
    bpy.ops.export_scene.gltf(**{**common, **options})


# 1. Draco, with its uncompressed twin.
clear()
ring_and_cone()
export("blender_plain.glb", export_vertex_color="ACTIVE")
export(
    "blender_draco.glb",
    export_vertex_color="ACTIVE",
    export_draco_mesh_compression_enable=True,
    export_draco_mesh_compression_level=6,
)
# Level 10 quantizes more coarsely here and uses the most expensive schemes.
export(
    "blender_draco_10.glb",
    export_vertex_color="ACTIVE",
    export_tangents=True,
    export_draco_mesh_compression_enable=True,
    export_draco_mesh_compression_level=10,
    export_draco_position_quantization=11,
    export_draco_normal_quantization=8,
    export_draco_texcoord_quantization=10,
)
# 2. WebP: instead of the PNG, and with it as fallback.
export("blender_webp.glb", export_vertex_color="ACTIVE", export_image_format="WEBP", export_image_quality=90)
export(
    "blender_webp_fallback.glb",
    export_vertex_color="ACTIVE",
    export_image_format="AUTO",
    export_image_add_webp=True,
    export_image_webp_fallback=True,
)

# 3. Draco with a skin, an animation and a shape key.
scene = clear()
tube = mesh_object(
    "Tube", lambda: bpy.ops.mesh.primitive_cylinder_add(vertices=6, radius=0.3, depth=2, end_fill_type="NOTHING"), material("Rubber", (0.1, 0.1, 0.1))
)
bpy.ops.object.mode_set(mode="EDIT")
bpy.ops.mesh.select_all(action="SELECT")
bpy.ops.mesh.subdivide(number_cuts=2)
bpy.ops.object.mode_set(mode="OBJECT")
for p in tube.data.polygons:
    p.use_smooth = True
tube.shape_key_add(name="Basis")
key = tube.shape_key_add(name="Bulge")
for i, v in enumerate(tube.data.vertices):
    key.data[i].co = (v.co.x * 1.6, v.co.y * 1.6, v.co.z) if abs(v.co.z) < 0.5 else v.co
bpy.ops.object.armature_add(location=(0, 0, -1))
rig = bpy.context.object
rig.name = "Rig"
bpy.ops.object.mode_set(mode="EDIT")
first = rig.data.edit_bones[0]
first.name, first.head, first.tail = "Lower", (0, 0, 0), (0, 0, 1)
upper = rig.data.edit_bones.new("Upper")
upper.head, upper.tail, upper.parent = (0, 0, 1), (0, 0, 2), first
bpy.ops.object.mode_set(mode="OBJECT")
tube.parent = rig
tube.matrix_parent_inverse = rig.matrix_world.inverted()
for bone in ("Lower", "Upper"):
    group = tube.vertex_groups.new(name=bone)
    for v in tube.data.vertices:
        w = max(0.0, min(1.0, v.co.z + 0.5))
        weight = w if bone == "Upper" else 1 - w
        if weight:
            group.add([v.index], weight, "REPLACE")
tube.modifiers.new("Armature", "ARMATURE").object = rig
pose = rig.pose.bones["Upper"]
pose.rotation_mode = "QUATERNION"
for frame, angle in ((1, 0.0), (13, 0.8), (25, 0.0)):
    pose.rotation_quaternion = (math.cos(angle / 2), math.sin(angle / 2), 0, 0)
    pose.keyframe_insert("rotation_quaternion", frame=frame)
    key.value = angle
    key.keyframe_insert("value", frame=frame)
export("blender_skin_plain.glb", export_morph_normal=True, export_try_sparse_sk=False)
export("blender_skin_draco.glb", export_morph_normal=True, export_draco_mesh_compression_enable=True)

# 4. Instances: linked copies of one mesh, with and without EXT_mesh_gpu_instancing.
clear()
cube = mesh_object("Cube", lambda: bpy.ops.mesh.primitive_cube_add(size=1), material("Blue", (0.1, 0.2, 0.8)))
holder = bpy.data.objects.new("Holder", None)
bpy.context.collection.objects.link(holder)
cube.parent = holder
for i in range(1, 12):
    copy = bpy.data.objects.new(f"Cube {i}", cube.data)
    copy.location = (1.5 * (i % 4), 1.5 * (i // 4), 0.2 * i)
    copy.rotation_euler = (0, 0, 0.3 * i)
    copy.scale = (0.5 + 0.05 * i,) * 3
    copy.parent = holder
    bpy.context.collection.objects.link(copy)
export("blender_instances_plain.glb")
export("blender_instances.glb", export_gpu_instances=True)

# 5. KHR_animation_pointer: a material's colour and roughness, a light's energy, a camera's lens.
scene = clear()
red, green, blue = (material(n, c) for n, c in (("Red", (0.8, 0.1, 0.1)), ("Green", (0.1, 0.7, 0.2)), ("Blue", (0.1, 0.2, 0.8))))
box = mesh_object("Box", lambda: bpy.ops.mesh.primitive_cube_add(size=1), red)
bsdf = red.node_tree.nodes["Principled BSDF"]
for frame, colour, rough in ((1, (0.8, 0.1, 0.1, 1), 0.2), (25, (0.1, 0.8, 0.8, 1), 0.9)):
    bsdf.inputs["Base Color"].default_value = colour
    bsdf.inputs["Base Color"].keyframe_insert("default_value", frame=frame)
    bsdf.inputs["Roughness"].default_value = rough
    bsdf.inputs["Roughness"].keyframe_insert("default_value", frame=frame)
lamp_data = bpy.data.lights.new("Lamp", "POINT")
lamp = bpy.data.objects.new("Lamp", lamp_data)
lamp.location = (2, -2, 3)
lens = bpy.data.cameras.new("Lens")
camera = bpy.data.objects.new("Camera", lens)
camera.location, camera.rotation_euler = (0, -5, 1), (1.4, 0, 0)
for thing in (lamp, camera):
    bpy.context.collection.objects.link(thing)
scene.camera = camera
for frame, energy, angle in ((1, 100, 0.9), (25, 1000, 0.5)):
    lamp_data.energy = energy
    lamp_data.keyframe_insert("energy", frame=frame)
    lens.angle = angle
    lens.keyframe_insert("lens", frame=frame)
export(
    "blender_pointer.glb",
    export_pointer_animation=True,
    export_animation_mode="SCENE",
    export_lights=True,
    export_cameras=True,
    export_optimize_animation_size=True,
)

# 6. KHR_materials_variants, as Blender's own panel writes them: Night has no mapping for the second slot.
scene = clear()
bpy.context.preferences.addons["io_scene_gltf2"].preferences.KHR_materials_variants_ui = True
names = ("Plain", "Sand", "Rust", "Ink", "Moss")
plain, sand, rust, ink, moss = (material(n, (0.15 * i + 0.1, 0.5, 0.9 - 0.2 * i)) for i, n in enumerate(names))
box = mesh_object("Box", lambda: bpy.ops.mesh.primitive_cube_add(size=1), plain)
box.data.materials.append(moss)
for p in box.data.polygons[:2]:
    p.material_index = 1
for i, name in enumerate(("Day", "Dusk", "Night")):
    variant = scene.gltf2_KHR_materials_variants_variants.add()
    variant.name, variant.variant_idx = name, i
for slot, chosen, which in ((0, sand, (0,)), (0, rust, (1,)), (0, ink, (2,)), (1, rust, (0, 1))):
    mapping = box.data.gltf2_variant_mesh_data.add()
    mapping.material_slot_index, mapping.material = slot, chosen
    for i in which:
        mapping.variants.add().variant.variant_idx = i
export("blender_variants.glb")
