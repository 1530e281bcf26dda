"""Scenes of many kinds, for tests of what exports have in common. Each function adds one to an empty scene."""

from __future__ import annotations

from typing import Any, Callable

import bpy
import numpy as np
from node_trees import add_cube, add_node, link_noise, new_material, new_world

Build = Callable[[Any], None]


def new_image(name: str, is_data: bool = False) -> bpy.types.Image:
    image = bpy.data.images.new(name, 8, 8, alpha=True, is_data=is_data)
    image.pixels.foreach_set(np.linspace(0.1, 1.0, 256, dtype=np.float32))
    image.pack()
    return image


def link_image(tree: Any, socket: Any, vector: Any = None, is_data: bool = True, output: str = "Color") -> Any:
    texture = add_node(tree, "TexImage")
    texture.image = new_image(socket.name, is_data)
    if vector is not None:
        tree.links.new(vector, texture.inputs["Vector"])
    tree.links.new(texture.outputs[output], socket)
    return texture


def with_images(*names: str, **numbers: Any) -> bpy.types.Material:
    """A material with an image in each of the inputs."""
    material, tree, shader = new_material("Images", **numbers)
    for name in names:
        if name.endswith("Normal"):
            bend = add_node(tree, "NormalMap")
            link_image(tree, bend.inputs["Color"])
            tree.links.new(bend.outputs[0], shader.inputs[name])
        else:
            output = "Alpha" if name == "Alpha" else "Color"
            link_image(tree, shader.inputs[name], is_data="Color" not in name and "Tint" not in name, output=output)
    return material


def with_noise(*names: str, **numbers: Any) -> bpy.types.Material:
    """A material with a procedure in each of the inputs."""
    material, tree, shader = new_material("Noise", **numbers)
    for name in names:
        link_noise(tree, shader.inputs[name])
    return material


def with_map(name: str, shift: tuple[float, float, float] | None = None) -> bpy.types.Material:
    """A material with an image on a named map."""
    material, tree, shader = new_material("Map")
    place = add_node(tree, "UVMap")
    place.uv_map = name
    vector = place.outputs[0]
    if shift is not None:
        moved = add_node(tree, "Mapping", Location=shift)
        tree.links.new(vector, moved.inputs["Vector"])
        vector = moved.outputs[0]
    link_image(tree, shader.inputs["Base Color"], vector, is_data=False)
    return material


def with_bump() -> bpy.types.Material:
    material, tree, shader = new_material("Bump")
    bump = add_node(tree, "Bump")
    link_noise(tree, bump.inputs["Height"])
    tree.links.new(bump.outputs[0], shader.inputs["Normal"])
    return material


def with_mix() -> bpy.types.Material:
    material, tree, shader = new_material("Mix")
    other, mix = add_node(tree, "BsdfGlossy", Roughness=0.2), add_node(tree, "MixShader")
    link_noise(tree, mix.inputs[0])
    tree.links.new(shader.outputs[0], mix.inputs[1])
    tree.links.new(other.outputs[0], mix.inputs[2])
    tree.links.new(mix.outputs[0], tree.get_output_node("CYCLES").inputs["Surface"])
    return material


def without_maps(item: bpy.types.Object) -> bpy.types.Object:
    while item.data.uv_layers:
        item.data.uv_layers.remove(item.data.uv_layers[0])
    return item


def bare(*make: Callable[[], bpy.types.Material]) -> Build:
    """A cube without maps."""

    def build(scene: Any) -> None:
        cube = without_maps(add_cube(scene, *(each() for each in make)))
        for i, face in enumerate(cube.data.polygons):
            face.material_index = i % len(make)

    return build


def mapped(make: Callable[[], bpy.types.Material], *maps: str) -> Build:
    """A cube with maps."""

    def build(scene: Any) -> None:
        cube = add_cube(scene, make())
        for name in maps:
            cube.data.uv_layers.new(name=name)

    return build


def loose(scene: Any) -> None:
    """Faces, edges and points with one image."""
    mesh = bpy.data.meshes.new("Loose")
    corners = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (2, 0, 0), (3, 0, 0), (4, 0, 0)]
    mesh.from_pydata(corners, [(3, 4)], [(0, 1, 2)])
    mesh.materials.append(with_images("Base Color", "Normal"))
    scene.collection.objects.link(bpy.data.objects.new("Loose", mesh))


def shared(scene: Any) -> None:
    """One material on meshes with and without maps, and one mesh with two materials of objects."""
    material = with_images("Base Color", "Roughness")
    add_cube(scene, material)
    bald = without_maps(add_cube(scene, material, location=(3.0, 0.0, 0.0)))
    twin = bpy.data.objects.new("Twin", bald.data)
    scene.collection.objects.link(twin)
    twin.material_slots[0].link = "OBJECT"
    twin.material_slots[0].material = new_material("Plain")[0]


def shape_keys(scene: Any) -> None:
    cube = without_maps(add_cube(scene, with_images("Base Color")))
    cube.shape_key_add(name="Basis")
    key = cube.shape_key_add(name="Wide")
    for point in key.data:
        point.co.x *= 2.0
    scene.frame_end = 10
    for frame, value in ((1, 0.0), (10, 1.0)):
        key.value = value
        key.keyframe_insert("value", frame=frame)


def armature(scene: Any) -> None:
    bpy.ops.object.armature_add()
    bones = bpy.context.object
    cube = without_maps(add_cube(scene, with_images("Base Color", "Normal")))
    group = cube.vertex_groups.new(name=bones.data.bones[0].name)
    group.add(range(8), 1.0, "REPLACE")
    cube.parent = bones
    cube.modifiers.new("Armature", "ARMATURE").object = bones
    scene.frame_end = 10
    for frame, turn in ((1, 0.0), (10, 1.0)):
        bones.pose.bones[0].rotation_quaternion = (1.0, turn, 0.0, 0.0)
        bones.pose.bones[0].keyframe_insert("rotation_quaternion", frame=frame)


def curves_and_texts(scene: Any) -> None:
    for kind in ("CURVE", "FONT"):
        data = bpy.data.curves.new(kind, kind)
        if kind == "CURVE":
            data.bevel_depth = 0.2
            data.splines.new("POLY").points.add(2)
            for i, point in enumerate(data.splines[0].points):
                point.co = (i, i * i, 0.0, 1.0)
        data.materials.append(with_images("Base Color", "Normal"))
        scene.collection.objects.link(bpy.data.objects.new(kind, data))


def metaball(scene: Any) -> None:
    ball = bpy.data.metaballs.new("Ball")
    ball.elements.new()
    ball.materials.append(with_images("Base Color"))
    scene.collection.objects.link(bpy.data.objects.new("Ball", ball))


def lights(scene: Any) -> None:
    for kind in ("AREA", "POINT", "SPOT", "SUN"):
        light = bpy.data.lights.new(kind, kind)
        scene.collection.objects.link(bpy.data.objects.new(kind, light))
    background = new_world(scene)
    background.inputs["Color"].default_value = (0.1, 0.2, 0.3, 1.0)
    scene.camera.data.dof.use_dof = True
    scene.camera.data.shift_x = 0.2


def modifiers(scene: Any) -> None:
    cube = without_maps(add_cube(scene, with_images("Base Color", "Metallic")))
    cube.modifiers.new("Subdivision", "SUBSURF")
    cube.modifiers.new("Array", "ARRAY")


def stretched(with_normal: bool, **numbers: float) -> bpy.types.Material:
    """An anisotropy along a map, with or without a normal map."""
    material = with_images("Normal") if with_normal else new_material("Stretched")[0]
    tree = material.node_tree
    shader = next(n for n in tree.nodes if n.bl_idname == "ShaderNodeBsdfPrincipled")
    shader.inputs["Metallic"].default_value, shader.inputs["Anisotropic"].default_value = 1.0, 0.7
    tangent = add_node(tree, "Tangent")
    tangent.direction_type = "UV_MAP"
    tree.links.new(tangent.outputs[0], shader.inputs["Tangent"])
    link_noise(tree, shader.inputs["Anisotropic Rotation"])
    return material


SURFACE = ("Base Color", "Alpha", "Roughness", "Metallic", "Emission Color")
LAYERS = ("Coat Weight", "Coat Roughness", "Sheen Tint", "Specular Tint", "Transmission Weight")

SUBJECTS: dict[str, Build] = {
    "lights": lights,
    "plain": mapped(lambda: new_material("Plain")[0]),
    "images": mapped(lambda: with_images(*SURFACE, Emission_Strength=1.0)),
    "images without maps": bare(lambda: with_images(*SURFACE, Emission_Strength=1.0)),
    "layers": mapped(lambda: with_images(*LAYERS, Sheen_Weight=1.0)),
    "layers without maps": bare(lambda: with_images(*LAYERS, Sheen_Weight=1.0)),
    "normals": mapped(lambda: with_images("Normal", "Coat Normal", Coat_Weight=1.0)),
    "normals without maps": bare(lambda: with_images("Normal", "Coat Normal", Coat_Weight=1.0)),
    "two materials without maps": bare(lambda: with_images("Base Color"), lambda: new_material("Plain")[0]),
    "second map": mapped(lambda: with_map("Second"), "Second"),
    "missing map": mapped(lambda: with_map("Missing")),
    "missing map of a bare mesh": bare(lambda: with_map("Missing")),
    "moved map": mapped(lambda: with_map("Second", (0.2, 0.3, 0.0)), "Second"),
    "moved map of a bare mesh": bare(lambda: with_map("Second", (0.2, 0.3, 0.0))),
    "noise": mapped(lambda: with_noise("Base Color", "Roughness")),
    "noise without maps": bare(lambda: with_noise("Base Color", "Metallic", "Coat Weight")),
    "noise beside a plain material": bare(lambda: with_noise("Base Color"), lambda: new_material("Plain")[0]),
    "bump": bare(with_bump),
    "mix": bare(with_mix),
    "anisotropy": mapped(lambda: stretched(False)),
    "anisotropy with normals": mapped(lambda: stretched(True)),
    "anisotropy without maps": bare(lambda: stretched(False)),
    "loose parts": loose,
    "shared": shared,
    "shape keys": shape_keys,
    "armature": armature,
    "curves": curves_and_texts,
    "metaball": metaball,
    "modifiers": modifiers,
}
