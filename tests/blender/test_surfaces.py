"""Materials other than one Principled BSDF, and what is no surface."""

from __future__ import annotations

import pytest

bpy = pytest.importorskip("bpy")
np = pytest.importorskip("numpy")

from node_trees import add_cube, add_node, new_material  # noqa: E402


def close(a, b):
    return a == pytest.approx(b, rel=1e-4, abs=1e-5)


def link_surface(tree, shader, name="Surface"):
    tree.links.new(shader.outputs[0], tree.nodes["Material Output"].inputs[name])


def volume(name):
    material, tree, shader = new_material(name)
    tree.nodes.remove(shader)
    link_surface(tree, add_node(tree, "VolumePrincipled"), "Volume")
    return material


def warnings_of(capfd):
    return [line.split("blinn: ", 1)[1] for line in capfd.readouterr().out.splitlines() if "blinn: " in line]


@pytest.mark.parametrize("applied", [False, True])
def test_volumes_without_a_surface_are_left_out(scene, export, capfd, applied):
    add_cube(scene, volume("Fog")).name = "Domain"
    mixed = add_cube(scene, new_material("Plain")[0], volume("Smoke"))
    mixed.name = "Mixed"
    mixed.data.polygons[0].material_index = 1
    result = export(export_apply=applied)
    assert [material["name"] for material in result.json["materials"]] == ["Plain"]
    nodes = {node["name"]: node for node in result.json["nodes"]}
    assert "mesh" not in nodes["Domain"]
    (mesh,) = result.json["meshes"]
    (part,) = mesh["primitives"]
    assert result.json["accessors"][part["indices"]]["count"] == 5 * 6
    assert warnings_of(capfd) == ["volumes are not written, nor the faces around them: 'Fog', 'Smoke'"]


@pytest.fixture()
def add_surface(scene):
    """A function that adds a cube, whose material is made by a function of its nodes and its Principled BSDF."""

    def add(name, build):
        material, tree, shader = new_material(name)
        link_surface(tree, build(tree, shader))
        add_cube(scene, material)
        return material

    return add


def image_node(tree, name, texels, is_data=False):
    """An Image Texture of 2 x 2 texels of bytes."""
    image = bpy.data.images.new(name, 2, 2, alpha=True, is_data=is_data)
    image.pixels.foreach_set(np.array(texels, np.float32).ravel())
    image.pack()
    node = add_node(tree, "TexImage")
    node.image = image
    return node


def mix_node(tree, factor, first, second):
    """A Mix Shader by a number or an output."""
    node = add_node(tree, "MixShader")
    if isinstance(factor, float):
        node.inputs[0].default_value = factor
    else:
        tree.links.new(factor, node.inputs[0])
    tree.links.new(first.outputs[0], node.inputs[1])
    tree.links.new(second.outputs[0], node.inputs[2])
    return node


def material_of(result):
    (material,) = result.json["materials"]
    return material


CONSTANT_MIXES = {
    "transparent first": lambda tree, shader, clear: mix_node(tree, 0.25, clear, shader),
    "transparent second": lambda tree, shader, clear: mix_node(tree, 0.75, shader, clear),
}


@pytest.mark.parametrize("name", CONSTANT_MIXES)
def test_mixes_with_a_transparent_shader_are_alpha(add_surface, export, capfd, name):
    def build(tree, shader):
        shader.inputs["Base Color"].default_value = (0.5, 0.25, 0.125, 1.0)
        shader.inputs["Metallic"].default_value = 0.5
        return CONSTANT_MIXES[name](tree, shader, add_node(tree, "BsdfTransparent"))

    material = add_surface("Veil", build)
    written = material_of(export())
    assert written["name"] == "Veil" and written["alphaMode"] == "BLEND"
    assert close(written["pbrMetallicRoughness"]["baseColorFactor"], [0.5, 0.25, 0.125, 0.25])
    assert written["pbrMetallicRoughness"]["metallicFactor"] == 0.5
    assert warnings_of(capfd) == []
    # The scene stays as it is.
    assert [m.name for m in bpy.data.materials] == ["Veil"] and bpy.context.object.data.materials[0] == material
    assert material.node_tree.nodes["Material Output"].inputs["Surface"].links[0].from_node.bl_label == "Mix Shader"


ALPHAS = np.array([0.0, 0.25, 0.5, 1.0])


def leaf_texels():
    texels = np.full((4, 4), 0.5)
    texels[:, 3] = ALPHAS
    return texels


def alpha_mix(tree, shader, leaf):
    return mix_node(tree, leaf.outputs["Alpha"], add_node(tree, "BsdfTransparent"), shader)


def reversed_mix(tree, shader, leaf):
    return mix_node(tree, leaf.outputs["Alpha"], shader, add_node(tree, "BsdfTransparent"))


def inverted_mix(tree, shader, leaf):
    invert = add_node(tree, "Invert")
    tree.links.new(leaf.outputs["Alpha"], invert.inputs["Color"])
    return mix_node(tree, invert.outputs[0], shader, add_node(tree, "BsdfTransparent"))


def subtracted_mix(tree, shader, leaf):
    rest = add_node(tree, "Math")
    rest.operation = "SUBTRACT"
    rest.inputs[0].default_value = 1.0
    tree.links.new(leaf.outputs["Alpha"], rest.inputs[1])
    return mix_node(tree, rest.outputs[0], shader, add_node(tree, "BsdfTransparent"))


def halved_mix(tree, shader, leaf):
    shader.inputs["Alpha"].default_value = 0.5
    return alpha_mix(tree, shader, leaf)


def texels_of(result, index):
    """The texels of a texture's image, the lowest row first, 0 to 1."""
    from io import BytesIO

    from PIL import Image

    image = result.json["images"][result.json["textures"][index]["source"]]
    picture = Image.open(BytesIO(result.view(image["bufferView"])))
    return np.asarray(picture.convert("RGBA"), float)[::-1].reshape(4, 4) / 255.0


@pytest.mark.parametrize(
    ("build", "expected", "factor"),
    [
        (alpha_mix, ALPHAS, 1.0),
        (reversed_mix, 1.0 - ALPHAS, 1.0),
        (inverted_mix, ALPHAS, 1.0),
        (subtracted_mix, ALPHAS, 1.0),
        (halved_mix, ALPHAS, 0.5),
    ],
)
def test_mixes_by_an_image_are_an_image_of_alpha(add_surface, export, capfd, build, expected, factor):
    pytest.importorskip("PIL")

    def surface(tree, shader):
        leaf = image_node(tree, "Leaf", leaf_texels())
        tree.links.new(leaf.outputs["Color"], shader.inputs["Base Color"])
        return build(tree, shader, leaf)

    add_surface("Leaf", surface)
    result = export()
    written = material_of(result)
    surface = written["pbrMetallicRoughness"]
    assert written["alphaMode"] == "BLEND" and close(surface.get("baseColorFactor", [1.0] * 4)[3], factor)
    texels = texels_of(result, surface["baseColorTexture"]["index"])
    assert np.allclose(texels[:, 3], expected, atol=0.01)
    assert warnings_of(capfd) == []
    assert [image.name for image in bpy.data.images if image.name != "Render Result"] == ["Leaf"]


def test_masks_are_read_as_cycles_reads_them(add_surface, export):
    pytest.importorskip("PIL")

    def surface(tree, shader):
        mask = image_node(tree, "Mask", np.array([[0.0] * 3 + [1.0], [0.5] * 3 + [1.0], [0.5] * 3 + [1.0], [1.0] * 4]))
        return mix_node(tree, mask.outputs["Color"], add_node(tree, "BsdfTransparent"), shader)

    add_surface("Mask", surface)
    result = export()
    texels = texels_of(result, material_of(result)["pbrMetallicRoughness"]["baseColorTexture"]["index"])
    linear = ((0.5 + 0.055) / 1.055) ** 2.4
    assert np.allclose(texels[:, 3], [0.0, linear, linear, 1.0], atol=0.01)


SPECULAR, TRANSMISSION = "KHR_materials_specular", "KHR_materials_transmission"
PLAIN_SHADERS = {
    "BsdfDiffuse": ({"Color": (0.5, 0.25, 0.125, 1.0)}, [0.5, 0.25, 0.125], {}, {SPECULAR: {"specularFactor": 0}}),
    "BsdfGlossy": (
        {"Color": (0.5, 0.25, 0.125, 1.0), "Roughness": 0.25},
        [0.5, 0.25, 0.125],
        {"metallicFactor": 1, "roughnessFactor": 0.25},
        {},
    ),
    "BsdfGlass": (
        {"Color": (0.5, 1.0, 1.0, 1.0), "Roughness": 0.125, "IOR": 1.25},
        [0.25, 1.0, 1.0],
        {"metallicFactor": 0, "roughnessFactor": 0.125},
        {TRANSMISSION: {"transmissionFactor": 1}, "KHR_materials_ior": {"ior": 1.25}},
    ),
    "BsdfMetallic": (
        {"Base Color": (0.5, 0.25, 0.125, 1.0), "Roughness": 0.25},
        [0.5, 0.25, 0.125],
        {"metallicFactor": 1, "roughnessFactor": 0.25},
        {},
    ),
    "BsdfTranslucent": (
        {"Color": (0.5, 0.25, 0.125, 1.0)},
        [0.5, 0.25, 0.125],
        {},
        {
            "KHR_materials_diffuse_transmission": {
                "diffuseTransmissionFactor": 1,
                "diffuseTransmissionColorFactor": [0.5, 0.25, 0.125],
            }
        },
    ),
    "BsdfSheen": (
        {"Color": (0.5, 0.25, 0.125, 1.0), "Roughness": 0.25},
        [0.0, 0.0, 0.0],
        {},
        {"KHR_materials_sheen": {"sheenColorFactor": [0.5, 0.25, 0.125], "sheenRoughnessFactor": 0.25}},
    ),
}


@pytest.mark.parametrize("kind", PLAIN_SHADERS)
def test_plain_shaders_become_the_nearest_material(add_surface, export, capfd, kind):
    values, color, numbers, extensions = PLAIN_SHADERS[kind]
    if not hasattr(bpy.types, f"ShaderNode{kind}") and kind != "BsdfGlossy":
        pytest.skip("this Blender does not have it")
    add_surface(kind, lambda tree, _: add_node(tree, kind, **values))
    written = material_of(export())
    surface = written["pbrMetallicRoughness"]
    assert close(surface.get("baseColorFactor", [1.0] * 4)[:3], color)
    for name, value in numbers.items():
        assert close(surface.get(name, 1.0), value), name
    for name, expected in extensions.items():
        present = written["extensions"][name]
        assert all(close(present[key], value) for key, value in expected.items()), present
    assert warnings_of(capfd) == []


def test_leaves_keep_their_image_on_both_sides(add_surface, export, capfd):
    def build(tree, _):
        leaf = image_node(tree, "Leaf", leaf_texels())
        parts = [add_node(tree, kind) for kind in ("BsdfDiffuse", "BsdfTranslucent")]
        for part in parts:
            tree.links.new(leaf.outputs["Color"], part.inputs["Color"])
        return mix_node(tree, 0.25, *parts)

    add_surface("Leaf", build)
    written = material_of(export())
    passing = written["extensions"]["KHR_materials_diffuse_transmission"]
    assert passing["diffuseTransmissionFactor"] == 0.25
    texture = written["pbrMetallicRoughness"]["baseColorTexture"]["index"]
    assert passing["diffuseTransmissionColorTexture"]["index"] == texture
    assert warnings_of(capfd) == []


def test_a_gloss_by_fresnels_equations_is_that_of_a_dielectric(add_surface, export):
    def build(tree, _):
        base = add_node(tree, "BsdfDiffuse", Color=(0.5, 0.25, 0.125, 1.0))
        gloss = add_node(tree, "BsdfGlossy", Color=(1.0, 1.0, 1.0, 1.0), Roughness=0.25)
        return mix_node(tree, add_node(tree, "Fresnel", IOR=2.0).outputs[0], base, gloss)

    add_surface("Plastic", build)
    written = material_of(export())
    surface = written["pbrMetallicRoughness"]
    assert close(surface["baseColorFactor"], [0.5, 0.25, 0.125, 1.0])
    assert surface["metallicFactor"] == 0 and surface["roughnessFactor"] == 0.25
    assert written["extensions"]["KHR_materials_ior"] == {"ior": 2}


def test_mixes_by_the_kind_of_a_ray_are_as_the_camera_sees_them(add_surface, export, capfd):
    def build(tree, shader):
        paths, either = add_node(tree, "LightPath"), add_node(tree, "Math")
        either.operation = "MAXIMUM"
        tree.links.new(paths.outputs["Is Shadow Ray"], either.inputs[0])
        tree.links.new(paths.outputs["Is Diffuse Ray"], either.inputs[1])
        return mix_node(tree, either.outputs[0], add_node(tree, "BsdfGlass"), add_node(tree, "BsdfTransparent"))

    add_surface("Window", build)
    written = material_of(export())
    assert written["extensions"][TRANSMISSION] == {"transmissionFactor": 1} and "alphaMode" not in written
    assert warnings_of(capfd) == []


def test_what_one_surface_cannot_hold_stays(add_surface, export, capfd):
    def build(tree, shader):
        mask = image_node(tree, "Mask", leaf_texels(), is_data=True)
        return mix_node(tree, mask.outputs["Color"], shader, add_node(tree, "BsdfDiffuse"))

    material = add_surface("Painted", build)
    assert material_of(export())["name"] == "Painted"
    assert warnings_of(capfd) == ["material 'Painted' loses what glTF cannot hold: the shader 'Diffuse BSDF'"]
    assert [m.name for m in bpy.data.materials] == ["Painted"] and material.users == 1
