"""Shared by the Blender scripts: an empty scene, objects from Shapes, materials, lights, cameras, export."""

from math import radians

import bpy  # isort: skip
import bmesh  # isort: skip (bpy provides it)
from mathutils import Vector

from shapes import Shape


def new_scene(width=1280, height=720, world=0.05):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.render.resolution_x, scene.render.resolution_y = width, height
    scene.render.fps = 24
    scene.world = bpy.data.worlds.new("World")
    scene.world.color = (world,) * 3
    return scene


def srgb(code):
    """Linear (r, g, b) of "#rrggbb"."""
    channels = (int(code[i : i + 2], 16) / 255 for i in (1, 3, 5))
    return tuple(c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in channels)


def image(path, data=False):
    img = bpy.data.images.load(str(path))
    if data:
        img.colorspace_settings.name = "Non-Color"
    return img


def material(name, color="#cccccc", roughness=0.5, metallic=0.0, emission=None, alpha=1.0):
    """A Principled material; glTF gets its base colour, roughness, metallic, emission, alpha."""
    m = bpy.data.materials.new(name)
    m.use_nodes = True
    p = m.node_tree.nodes["Principled BSDF"]
    rgb = srgb(color) if isinstance(color, str) else color
    p.inputs["Base Color"].default_value = (*rgb, 1)
    p.inputs["Roughness"].default_value = roughness
    p.inputs["Metallic"].default_value = metallic
    p.inputs["Alpha"].default_value = alpha
    m.diffuse_color = (*rgb, alpha)
    if emission:
        p.inputs["Emission Color"].default_value = (*srgb(emission[0]), 1)
        p.inputs["Emission Strength"].default_value = emission[1]
    return m


def texture(mat, img, extension="REPEAT"):
    """A texture node of the image in a material's tree; returns (node, principled, links)."""
    tree = mat.node_tree
    node = tree.nodes.new("ShaderNodeTexImage")
    node.image = img
    node.extension = extension
    return node, tree.nodes["Principled BSDF"], tree.links


def base_texture(mat, img):
    node, principled, links = texture(mat, img)
    links.new(node.outputs["Color"], principled.inputs["Base Color"])
    return node


def mesh(name, shape, mat=None, smooth=None):
    """A mesh of a Shape; `smooth` is the angle in degrees above which an edge stays sharp."""
    data = bpy.data.meshes.new(name)
    data.from_pydata(shape.verts, [], shape.faces)
    if shape.uvs:
        layer = data.uv_layers.new(name="UVMap")
        layer.data.foreach_set("uv", [c for face in shape.uvs for uv in face for c in uv])
    if mat:
        data.materials.append(mat)
    data.update()
    if smooth is not None:
        data.polygons.foreach_set("use_smooth", [True] * len(data.polygons))
        data.set_sharp_from_angle(angle=radians(smooth))
    return data


def place(name, data, location=(0, 0, 0), rotation=(0, 0, 0), scale=(1, 1, 1), parent=None):
    """An object (data None: an empty); rotation in degrees. Objects given the same mesh share it."""
    obj = bpy.data.objects.new(name, data)
    obj.location, obj.scale = location, scale
    obj.rotation_euler = [radians(a) for a in rotation]
    obj.parent = parent
    bpy.context.scene.collection.objects.link(obj)
    return obj


def add(name, shape, mat, location=(0, 0, 0), rotation=(0, 0, 0), scale=(1, 1, 1), parent=None, smooth=None):
    return place(name, mesh(name, shape, mat, smooth), location, rotation, scale, parent)


def bevelled(name, shape, mat, width, segments=2, **where):
    """As `add`, with rounded edges and without UVs (a bevel's UVs differ in their last bit from run to run)."""
    obj = add(name, Shape(shape.verts, shape.faces), mat, **where)
    bm = bmesh.new()
    bm.from_mesh(obj.data)
    bmesh.ops.bevel(
        bm, geom=bm.edges[:], offset=width, offset_type="OFFSET", segments=segments, profile=0.5, affect="EDGES"
    )
    bm.to_mesh(obj.data)
    bm.free()
    obj.data.polygons.foreach_set("use_smooth", [True] * len(obj.data.polygons))
    obj.data.set_sharp_from_angle(angle=radians(40))
    return obj


def aim(obj, target):
    """Rotates a camera or a light so that its −Z points at the target."""
    obj.rotation_euler = (Vector(target) - obj.location).to_track_quat("-Z", "Y").to_euler()


def camera(name, eye, target, fov=40.0, ortho=None, near=0.1, far=100.0):
    """Perspective with a horizontal angle of fov degrees, or orthographic `ortho` metres wide."""
    data = bpy.data.cameras.new(name)
    if ortho:
        data.type, data.ortho_scale = "ORTHO", ortho
    else:
        data.angle = radians(fov)
    data.clip_start, data.clip_end = near, far
    obj = place(name, data, eye)
    aim(obj, target)
    if bpy.context.scene.camera is None:
        bpy.context.scene.camera = obj
    return obj


def light(name, kind, at, power, target=(0, 0, 0), color="#ffffff", cone=45.0, blend=0.2, radius=0.0):
    """kind: POINT or SPOT (watts), or SUN (W/m²); a spot's cone is its whole angle in degrees."""
    data = bpy.data.lights.new(name, kind)
    data.energy = power
    data.color = srgb(color)
    if kind == "SUN":
        data.angle = 0
    else:
        data.shadow_soft_size = radius
    if kind == "SPOT":
        data.spot_size, data.spot_blend = radians(cone), blend
    obj = place(name, data, at)
    if kind != "POINT":
        aim(obj, target)
    return obj


def export_gltf(path, **options):
    """GLB (or .gltf with its files beside it) with cameras, lights in SI units, modifiers applied."""
    separate = path.suffix == ".gltf"
    bpy.ops.export_scene.gltf(
        filepath=str(path),
        export_format="GLTF_SEPARATE" if separate else "GLB",
        export_cameras=True,
        export_lights=True,
        export_import_convert_lighting_mode="SPEC",
        export_apply=options.pop("export_apply", True),
        export_yup=True,
        **options,
    )


def export_obj(path):
    bpy.ops.wm.obj_export(
        filepath=str(path), export_materials=True, path_mode="RELATIVE", forward_axis="NEGATIVE_Z", up_axis="Y"
    )
