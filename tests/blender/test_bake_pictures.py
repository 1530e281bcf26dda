"""Baked materials and meshes, against Cycles' own render."""

from __future__ import annotations

import pytest

bpy = pytest.importorskip("bpy")
np = pytest.importorskip("numpy")

if not hasattr(bpy.types.Scene, "cycles") and not hasattr(bpy.context.scene, "cycles"):
    pytest.skip("this Blender has no Cycles", allow_module_level=True)
pytest.importorskip("blinn")

from node_trees import add_node, link_checker, new_material, new_world  # noqa: E402

# Mean difference of 255, where Cycles' grain and models of light are left. Without baking it is 1.5 times as large.
CLOSE = 3.0


@pytest.fixture()
def studio(cycles_scene, add_light):
    """A sun and a grey world for an object at the origin."""
    scene = cycles_scene
    scene.camera.location = (0.0, -4.0, 2.5)
    scene.camera.rotation_euler = (-scene.camera.location).to_track_quat("-Z", "Y").to_euler()
    new_world(scene).inputs["Color"].default_value = (0.2, 0.2, 0.2, 1.0)
    add_light("SUN", energy=2.0, angle=0.3).rotation_euler = (0.7, 0.3, 0.0)
    scene.blinn.bake_size = 128
    return scene


def ball(scene, material):
    bpy.ops.mesh.primitive_uv_sphere_add(segments=48, ring_count=24, radius=1.2)
    bpy.ops.object.shade_smooth()
    bpy.context.object.data.materials.append(material)
    return bpy.context.object


def halves(name, socket, first, second, **inputs):
    """A material whose input is one value on the left and another one on the right."""
    material, tree, shader = new_material(name, **inputs)
    colors = [value if isinstance(value, tuple) else (value,) * 3 for value in (first, second)]
    link_checker(tree, shader.inputs[socket], *colors)
    return material


def sheen_weight(scene):
    dark = {"Base_Color": (0.02, 0.02, 0.02, 1.0), "Specular_IOR_Level": 0.0, "Sheen_Tint": (1.0, 0.4, 0.2, 1.0)}
    ball(scene, halves("Felt", "Sheen Weight", 0.0, 1.0, Sheen_Roughness=0.6, **dark))


def sheen_tint(scene):
    dark = {"Base_Color": (0.02, 0.02, 0.02, 1.0), "Specular_IOR_Level": 0.0, "Sheen_Weight": 0.7}
    ball(scene, halves("Felt", "Sheen Tint", (1.0, 0.1, 0.0), (0.0, 0.2, 1.0), Sheen_Roughness=0.5, **dark))


def sheen_roughness(scene):
    dark = {"Base_Color": (0.02, 0.02, 0.02, 1.0), "Specular_IOR_Level": 0.0, "Sheen_Weight": 1.0}
    ball(scene, halves("Felt", "Sheen Roughness", 0.15, 0.9, **dark))


def specular_level(scene):
    ball(scene, halves("Lacquer", "Specular IOR Level", 0.0, 1.0, Base_Color=(0.02, 0.02, 0.02, 1.0), Roughness=0.4))


def specular_tint(scene):
    dark = {"Base_Color": (0.02, 0.02, 0.02, 1.0), "Specular_IOR_Level": 1.0, "Roughness": 0.4}
    ball(scene, halves("Lacquer", "Specular Tint", (1.0, 0.1, 0.1), (0.1, 0.1, 1.0), **dark))


def ball_with_turned_map(scene, material):
    """A ball whose map has exchanged axes, so that it is mirrored. Strokes without a tangent go around the z axis."""
    layer = ball(scene, material).data.uv_layers[0].uv
    uv = np.empty(2 * len(layer), np.float32)
    layer.foreach_get("vector", uv)
    layer.foreach_set("vector", np.ascontiguousarray(uv.reshape(-1, 2)[:, ::-1]).ravel())


def brushed(scene):
    material, _, _ = new_material("Brushed", Metallic=1.0, Roughness=0.4, Anisotropic=0.9, Anisotropic_Rotation=0.1)
    ball_with_turned_map(scene, material)


def turned_strokes(scene):
    metal = {"Metallic": 1.0, "Roughness": 0.4, "Anisotropic": 0.9}
    ball_with_turned_map(scene, halves("Brushed", "Anisotropic Rotation", 0.0, 0.125, **metal))


def strokes_of_strength(scene):
    ball_with_turned_map(scene, halves("Brushed", "Anisotropic", 0.0, 0.95, Metallic=1.0, Roughness=0.4))


def coat(scene):
    ball(scene, halves("Coated", "Coat Weight", 0.0, 1.0, Base_Color=(0.02, 0.02, 0.02, 1.0), Roughness=1.0))


def coat_tint(scene):
    red, blue = (1.0, 0.2, 0.1), (0.1, 0.3, 1.0)
    ball(scene, halves("Coated", "Coat Tint", red, blue, Coat_Weight=1.0, Roughness=1.0, Specular_IOR_Level=0.0))


def bumpy_half(scene):
    """Bumps on one part of a mix, which the other part does not have."""
    material, tree, smooth = new_material("Parts", Roughness=0.4, Metallic=1.0)
    rough = add_node(tree, "BsdfPrincipled", Roughness=0.4, Metallic=1.0)
    bump, waves = add_node(tree, "Bump", Distance=0.5), add_node(tree, "TexWave", Scale=1.0)
    tree.links.new(waves.outputs["Fac" if "Fac" in waves.outputs else 0], bump.inputs["Height"])
    tree.links.new(bump.outputs[0], rough.inputs["Normal"])
    mix = add_node(tree, "MixShader")
    link_checker(tree, mix.inputs[0], (0.0, 0.0, 0.0), (1.0, 1.0, 1.0))
    for i, shader in ((1, smooth), (2, rough)):
        tree.links.new(shader.outputs[0], mix.inputs[i])
    tree.links.new(mix.outputs[0], tree.nodes["Material Output"].inputs["Surface"])
    ball(scene, material)


def painted():
    return halves("Painted", "Base Color", (0.9, 0.1, 0.05), (0.05, 0.2, 0.9), Roughness=1.0, Specular_IOR_Level=0.0)


def text(scene):
    bpy.ops.object.text_add(rotation=(0.9, 0.0, 0.0))
    letters = bpy.context.object
    letters.data.body, letters.data.extrude, letters.data.size = "Ao", 0.15, 2.0
    letters.data.align_x = "CENTER"
    letters.data.materials.append(painted())


def curve(scene):
    bpy.ops.curve.primitive_bezier_circle_add(radius=1.0)
    ring = bpy.context.object
    ring.data.bevel_depth = 0.3
    ring.data.materials.append(painted())


def metaballs(scene):
    for x in (-0.6, 0.6):
        bpy.ops.object.metaball_add(radius=1.0, location=(x, 0.0, 0.0))
        bpy.context.object.data.materials.append(painted())
        bpy.context.object.data.render_resolution = bpy.context.object.data.resolution = 0.1


def library(scene, as_instance):
    """An object of another file, whose colours are a procedure."""
    path = bpy.app.tempdir + "library.blend"
    item = ball(scene, painted())
    collection = bpy.data.collections.new("Shared")
    collection.objects.link(item)
    bpy.data.libraries.write(path, {collection})
    bpy.data.objects.remove(item)
    bpy.data.collections.remove(collection)
    with bpy.data.libraries.load(path, link=True) as (_, found):
        found.collections = ["Shared"]
    (shared,) = found.collections
    if as_instance:
        empty = bpy.data.objects.new("Instance", None)
        empty.instance_type, empty.instance_collection = "COLLECTION", shared
        empty.rotation_euler.z = 0.5
        scene.collection.objects.link(empty)
    else:
        scene.collection.children.link(shared)


CASES = {
    "sheen weight": sheen_weight,
    "sheen tint": sheen_tint,
    "sheen roughness": sheen_roughness,
    "specular level": specular_level,
    "specular tint": specular_tint,
    "brushed metal": brushed,
    "turned strokes": turned_strokes,
    "strength of strokes": strokes_of_strength,
    "coat weight": coat,
    "coat tint": coat_tint,
    "bumpy half": bumpy_half,
    "text": text,
    "curve": curve,
    "metaballs": metaballs,
    "linked object": lambda scene: library(scene, False),
    "instance of a linked collection": lambda scene: library(scene, True),
}


@pytest.mark.parametrize("name", CASES)
def test_pictures_of_baked_files_are_those_of_cycles(studio, cycles, exported, name):
    CASES[name](studio)
    expected = cycles()
    errors = {}
    for bake in ("never", "auto"):
        studio.blinn.bake = bake
        errors[bake] = np.abs(exported() - expected).mean()
    assert errors["auto"] < CLOSE and errors["never"] > 1.5 * errors["auto"], errors


def test_constant_sheens_and_tints_of_coats_need_no_baking(studio, cycles, exported):
    sheen = {"Base_Color": (0.02, 0.02, 0.02, 1.0), "Specular_IOR_Level": 0.0, "Sheen_Weight": 0.3}
    coated = {"Coat_Weight": 0.8, "Coat_Tint": (1.0, 0.2, 0.1, 1.0), "Roughness": 1.0, "Specular_IOR_Level": 0.0}
    for inputs in (sheen, coated):
        item = ball(studio, new_material("Constant", **inputs)[0])
        assert np.abs(exported() - cycles()).mean() < CLOSE
        bpy.data.objects.remove(item)


@pytest.mark.parametrize("beyond", ["REPEAT", "EXTEND"])
def test_images_on_meshes_without_a_map_show_their_origin(studio, cycles, exported, beyond):
    colors = [(1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0), (1.0, 1.0, 0.0)]
    material, tree, shader = new_material("Corners")
    texture = add_node(tree, "TexImage")
    texture.extension, texture.image = beyond, bpy.data.images.new("Corners", 2, 2)
    texture.image.pixels.foreach_set(np.array([(*color, 1.0) for color in colors], np.float32).ravel())
    texture.image.pack()
    tree.links.new(texture.outputs["Color"], shader.inputs["Base Color"])
    maps = ball(studio, material).data.uv_layers
    maps.remove(maps[0])
    assert np.abs(exported() - cycles()).mean() < CLOSE
