"""Materials that are baked to images for the time of an export."""

from __future__ import annotations

import zlib

import pytest

bpy = pytest.importorskip("bpy")
np = pytest.importorskip("numpy")

from node_trees import add_cube, add_node, link_checker, link_noise, new_material  # noqa: E402

if not hasattr(bpy.types.Scene, "cycles") and not hasattr(bpy.context.scene, "cycles"):
    pytest.skip("this Blender has no Cycles", allow_module_level=True)

SIZE = 64


@pytest.fixture()
def baking(scene):
    """A scene whose exports bake."""
    scene.blinn.bake, scene.blinn.bake_size = "auto", SIZE
    return scene


def png(result, texture):
    """The pixels of an image of the file as bytes, height x width x channels, the uppermost row first."""
    image = result.json["images"][result.json["textures"][texture["index"]]["source"]]
    data, chunks, at = result.view(image["bufferView"]), b"", 8
    width, height, depth, kind = 0, 0, 0, 0
    while at < len(data):
        length, name = int.from_bytes(data[at : at + 4], "big"), data[at + 4 : at + 8]
        body = data[at + 8 : at + 8 + length]
        if name == b"IHDR":
            width, height, depth, kind = *(int.from_bytes(body[i : i + 4], "big") for i in (0, 4)), body[8], body[9]
        elif name == b"IDAT":
            chunks += body
        at += 12 + length
    assert depth == 8
    channels = {0: 1, 2: 3, 4: 2, 6: 4}[kind]
    rows = np.frombuffer(zlib.decompress(chunks), np.uint8).reshape(height, 1 + width * channels)
    result, above = np.zeros((height, width * channels), np.int64), np.zeros(width * channels, np.int64)
    for y, row in enumerate(rows):
        line = result[y]
        for x, value in enumerate(row[1:].astype(np.int64)):
            left = line[x - channels] if x >= channels else 0
            corner = above[x - channels] if x >= channels else 0
            guess = left + above[x] - corner
            near = min((abs(guess - v), i) for i, v in enumerate((left, above[x], corner)))[1]
            added = (0, left, above[x], (left + above[x]) // 2, (left, above[x], corner)[near])[row[0]]
            line[x] = (value + added) % 256
        above = line
    return result.reshape(height, width, channels)


def materials_of(result):
    return {material["name"]: material for material in result.json["materials"]}


def attribute(result, primitive, name):
    accessor = result.json["accessors"][primitive["attributes"][name]]
    width = {"VEC2": 2, "VEC3": 3}[accessor["type"]]
    values = np.frombuffer(result.view(accessor["bufferView"]), np.float32)
    return values[: accessor["count"] * width].reshape(-1, width)


def state():
    """All that an export might leave behind."""
    found = {}
    for name in ("objects", "meshes", "materials", "images", "node_groups", "scenes", "cameras"):
        found[name] = sorted((block.name, block.users) for block in getattr(bpy.data, name))
    for item in bpy.data.objects:
        slots = [(slot.link, slot.material and slot.material.name) for slot in item.material_slots]
        shown = [modifier.show_viewport for modifier in item.modifiers]
        place = tuple(map(tuple, item.matrix_world))
        found[item.name] = (item.data and item.data.name, slots, shown, item.select_get(), place)
    for mesh in bpy.data.meshes:
        keys = mesh.shape_keys and [(key.name, key.value, key.mute) for key in mesh.shape_keys.key_blocks]
        found["mesh " + mesh.name] = ([layer.name for layer in mesh.uv_layers], mesh.use_auto_texspace, keys)
    for tree in [m.node_tree for m in bpy.data.materials] + list(bpy.data.node_groups):
        ends = [(link.from_node, link.from_socket, link.to_node, link.to_socket) for link in tree.links]
        links = sorted([tuple(end.name for end in link) for link in ends])
        found["tree " + tree.name, tree.as_pointer()] = (sorted(node.name for node in tree.nodes), links)
    context = bpy.context
    scene, active = context.scene, context.view_layer.objects.active
    found["context"] = (scene.name, context.view_layer.name, active and active.name, scene.frame_current)
    return found


def test_colors_of_nodes_become_images(baking, export):
    material, tree, shader = new_material("Halves", Roughness=0.25)
    link_checker(tree, shader.inputs["Base Color"], (1.0, 0.0, 0.0), (0.0, 0.0, 1.0))
    add_cube(baking, material)
    result = export()
    written = materials_of(result)["Halves"]["pbrMetallicRoughness"]
    assert "baseColorFactor" not in written and written["roughnessFactor"] == 0.25
    pixels = png(result, written["baseColorTexture"])
    assert pixels.shape[:2] == (SIZE, SIZE)
    (mesh,) = result.json["meshes"]
    (primitive,) = mesh["primitives"]
    assert mesh["name"] == "Cube"
    name = f"TEXCOORD_{written['baseColorTexture'].get('texCoord', 0)}"
    positions, uv = attribute(result, primitive, "POSITION"), attribute(result, primitive, name)
    # Faces at both ends of x have one colour each.
    for end, color in ((-1.0, [255, 0, 0]), (1.0, [0, 0, 255])):
        normals = attribute(result, primitive, "NORMAL")
        corners = uv[(positions[:, 0] == end) & (abs(normals[:, 0]) > 0.5)]
        x, y = (corners.mean(axis=0) * SIZE).astype(int)
        assert pixels[y, x, :3].tolist() == color


def test_only_what_is_lost_is_baked(baking, export):
    plain, _, _ = new_material("Plain", Base_Color=(0.1, 0.2, 0.3, 1.0))
    rough, tree, shader = new_material("Rough", Base_Color=(0.1, 0.2, 0.3, 1.0), Metallic=1.0)
    link_noise(tree, shader.inputs["Roughness"])
    cube = add_cube(baking, plain, rough)
    cube.data.polygons[0].material_index = 1
    result = export()
    written = materials_of(result)
    assert set(written) == {"Plain", "Rough"} and len(result.json["images"]) == 1
    assert "extensions" not in written["Plain"] and "baseColorTexture" not in written["Plain"]["pbrMetallicRoughness"]
    values = written["Rough"]["pbrMetallicRoughness"]
    assert "metallicRoughnessTexture" in values and values["baseColorFactor"][:3] == pytest.approx([0.1, 0.2, 0.3])
    pixels = png(result, values["metallicRoughnessTexture"])
    assert pixels[..., 1].std() > 1.0 and (pixels[..., 2] == 255).all()


def test_images_of_the_material_keep_their_map(baking, export):
    material, tree, shader = new_material("Painted")
    texture = add_node(tree, "TexImage")
    texture.image = bpy.data.images.new("Paint", 8, 8)
    texture.image.pack()
    tree.links.new(texture.outputs["Color"], shader.inputs["Base Color"])
    link_noise(tree, shader.inputs["Roughness"])
    layer = add_cube(baking, material).data.uv_layers[0].uv
    # A tiled map is none for baking.
    layer.foreach_set("vector", np.tile([0.0, 0.0, 3.0, 0.0, 3.0, 3.0, 0.0, 3.0], 6).astype(np.float32))
    result = export()
    written = materials_of(result)["Painted"]["pbrMetallicRoughness"]
    assert written["baseColorTexture"].get("texCoord", 0) == 0
    assert written["metallicRoughnessTexture"]["texCoord"] == 1
    (primitive,) = result.json["meshes"][0]["primitives"]
    assert attribute(result, primitive, "TEXCOORD_0").max() == 3.0
    assert 0.0 <= attribute(result, primitive, "TEXCOORD_1").min() < attribute(result, primitive, "TEXCOORD_1").max() <= 1.0


def test_mixes_of_shaders_are_baked_by_their_factor(baking, export):
    material, tree, metal = new_material("Rust", Metallic=1.0, Roughness=0.2, Base_Color=(1.0, 1.0, 1.0, 1.0))
    rust = add_node(tree, "BsdfPrincipled", Metallic=0.0, Roughness=1.0)
    rust.inputs["Base Color"].default_value = (0.2, 0.2, 0.2, 1.0)
    mix = add_node(tree, "MixShader")
    link_noise(tree, mix.inputs[0])
    tree.links.new(metal.outputs[0], mix.inputs[1])
    tree.links.new(rust.outputs[0], mix.inputs[2])
    tree.links.new(mix.outputs[0], tree.nodes["Material Output"].inputs["Surface"])
    add_cube(baking, material)
    result = export()
    written = materials_of(result)["Rust"]["pbrMetallicRoughness"]
    pixels = png(result, written["metallicRoughnessTexture"])
    # Black is what no face uses.
    used = pixels[..., 1] > 0
    _, roughness, metallic = pixels[used][:, :3].T / 255.0
    gray = png(result, written["baseColorTexture"])[used][:, 0] / 255.0
    color = ((gray + 0.055) / 1.055) ** 2.4
    factor = (1.0 - color) / 0.8
    assert len(factor) > SIZE * SIZE / 5 and factor.std() > 0.01
    # Metal that reflects all counts more than rust.
    metal, rest = 1.0 - factor, 0.2 * factor
    assert np.abs(metallic - metal / (metal + rest)).max() < 0.02
    metal, rest = 1.0 - factor, 0.04 * factor
    assert np.abs(roughness - (0.2 * metal + 1.0 * rest) / (metal + rest)).max() < 0.02


def test_shaders_in_groups_are_baked(baking, export):
    material, tree, shader = new_material("Grouped")
    group = bpy.data.node_groups.new("Inner", "ShaderNodeTree")
    group.interface.new_socket("BSDF", in_out="OUTPUT", socket_type="NodeSocketShader")
    inner = add_node(group, "BsdfPrincipled", Metallic=1.0)
    link_noise(group, inner.inputs["Roughness"])
    group.links.new(inner.outputs[0], group.nodes.new("NodeGroupOutput").inputs[0])
    node = tree.nodes.new("ShaderNodeGroup")
    node.node_tree = group
    tree.nodes.remove(shader)
    tree.links.new(node.outputs[0], tree.nodes["Material Output"].inputs["Surface"])
    add_cube(baking, material)
    before = state()
    written = materials_of(export())["Grouped"]["pbrMetallicRoughness"]
    assert "metallicRoughnessTexture" in written and written.get("metallicFactor", 1.0) == 1.0
    assert state() == before


def test_a_transparent_part_of_a_mix_becomes_alpha(baking, export):
    material, tree, leaf = new_material("Leaf", Base_Color=(0.0, 1.0, 0.0, 1.0), Roughness=0.75)
    mix = add_node(tree, "MixShader")
    link_noise(tree, mix.inputs[0])
    tree.links.new(add_node(tree, "BsdfTransparent").outputs[0], mix.inputs[1])
    tree.links.new(leaf.outputs[0], mix.inputs[2])
    tree.links.new(mix.outputs[0], tree.nodes["Material Output"].inputs["Surface"])
    add_cube(baking, material)
    result = export()
    written = materials_of(result)["Leaf"]
    values = written["pbrMetallicRoughness"]
    assert written["alphaMode"] == "BLEND" and values["roughnessFactor"] == 0.75
    pixels = png(result, values["baseColorTexture"])
    assert (pixels[..., :3] == [0, 255, 0]).all() and pixels[..., 3].std() > 2.0


def test_one_group_in_both_parts_of_a_mix_is_baked(baking, export):
    group = bpy.data.node_groups.new("Inner", "ShaderNodeTree")
    group.interface.new_socket("Value", in_out="INPUT", socket_type="NodeSocketFloat")
    group.interface.new_socket("BSDF", in_out="OUTPUT", socket_type="NodeSocketShader")
    inner = add_node(group, "BsdfPrincipled")
    group.links.new(group.nodes.new("NodeGroupInput").outputs[0], inner.inputs["Roughness"])
    group.links.new(inner.outputs[0], group.nodes.new("NodeGroupOutput").inputs[0])
    material, tree, _ = new_material("Twice")
    mix = add_node(tree, "MixShader")
    for i in (1, 2):
        node = tree.nodes.new("ShaderNodeGroup")
        node.node_tree = group
        link_noise(tree, node.inputs[0])
        tree.links.new(node.outputs[0], mix.inputs[i])
    tree.links.new(mix.outputs[0], tree.nodes["Material Output"].inputs["Surface"])
    add_cube(baking, material)
    before = state()
    assert "metallicRoughnessTexture" in materials_of(export())["Twice"]["pbrMetallicRoughness"]
    assert state() == before


def test_meshes_without_faces_are_left_as_they_are(baking, export):
    material, tree, shader = new_material("Cloudy")
    link_noise(tree, shader.inputs["Base Color"])
    for name, edges in (("Points", []), ("Line", [(0, 1)])):
        mesh = bpy.data.meshes.new(name)
        mesh.from_pydata([(0.0, 0.0, 0.0), (1.0, 0.0, 0.0)], edges, [])
        mesh.materials.append(material)
        baking.collection.objects.link(bpy.data.objects.new(name, mesh))
    add_cube(baking, material)
    result = export()
    assert [image["name"] for image in result.json["images"]] == ["Cloudy Base Color"]


def test_bumps_become_normal_maps(baking, export):
    heights = bpy.data.images.new("Heights", 16, 16)
    heights.pixels.foreach_set(np.tile(np.repeat([[0.0, 1.0]], 4, axis=1).ravel(), 128).astype(np.float32))
    for name in ("Bump", "Heights", "Displacement"):
        material, tree, shader = new_material(name)
        if name != "Displacement":
            bump = add_node(tree, "Bump", Distance=0.5)
            if name == "Bump":
                link_noise(tree, bump.inputs["Height"])
            else:
                texture = add_node(tree, "TexImage")
                texture.image = heights
                tree.links.new(texture.outputs["Color"], bump.inputs["Height"])
            tree.links.new(bump.outputs[0], shader.inputs["Normal"])
        else:
            displacement = add_node(tree, "Displacement", Scale=0.5)
            link_noise(tree, displacement.inputs["Height"])
            tree.links.new(displacement.outputs[0], tree.nodes["Material Output"].inputs["Displacement"])
        add_cube(baking, material)
    result = export()
    assert len(materials_of(result)) == 3
    for material in materials_of(result).values():
        pixels = png(result, material["normalTexture"])
        assert pixels[..., 2].mean() > 160 and pixels[..., 0].std() > 2.0


def test_emission_keeps_its_strength(baking, export):
    material, tree, shader = new_material("Lamp", Emission_Strength=20.0)
    link_checker(tree, shader.inputs["Emission Color"], (0.0, 0.0, 0.0), (1.0, 0.5, 0.25))
    add_cube(baking, material)
    result = export()
    written = materials_of(result)["Lamp"]
    assert written["extensions"]["KHR_materials_emissive_strength"]["emissiveStrength"] == pytest.approx(20.0)
    assert png(result, written["emissiveTexture"]).max(axis=(0, 1))[:3].tolist() == [255, 188, 137]


@pytest.mark.parametrize("applied", [False, True])
def test_the_scene_stays_as_it_is(baking, export, applied):
    material, tree, shader = new_material("Cloudy")
    link_noise(tree, shader.inputs["Base Color"])
    first = add_cube(baking, material)
    first.modifiers.new("S", "SUBSURF").levels = 1
    second = add_cube(baking, None, location=(3.0, 0.0, 0.0))
    second.material_slots[0].link = "OBJECT"
    second.material_slots[0].material = material
    second.shape_key_add(name="Basis")
    second.shape_key_add(name="Key").value = 0.5
    collection = bpy.data.collections.new("Shared")
    collection.objects.link(second)
    instance = bpy.data.objects.new("Instance", None)
    instance.instance_type, instance.instance_collection = "COLLECTION", collection
    baking.collection.objects.link(instance)
    baking.frame_set(7)
    bpy.context.view_layer.update()
    before = state()
    result = export(export_apply=applied)
    assert state() == before
    assert {m["name"] for m in result.json["materials"]} == {"Cloudy"}
    assert all("baseColorTexture" in m["pbrMetallicRoughness"] for m in result.json["materials"])
    assert len([n for n in result.json["nodes"] if "mesh" in n]) == 3
    accessors = [m["primitives"][0]["attributes"]["POSITION"] for m in result.json["meshes"]]
    vertices = [result.json["accessors"][index]["count"] for index in accessors]
    assert (max(vertices) > 24) == applied


def test_the_scene_stays_as_it_is_after_a_failure(baking, export, monkeypatch):
    import blinn_extension.bake_scene as bake_scene

    material, tree, shader = new_material("Cloudy")
    link_noise(tree, shader.inputs["Base Color"])
    add_cube(baking, material)
    before = state()
    for error in (RuntimeError("broken"), MemoryError()):

        def fail(_, error=error):
            raise error

        monkeypatch.setattr(bake_scene, "bake", fail)
        assert "images" not in export().json
        assert state() == before


def test_the_scene_is_restored_before_it_is_saved(baking, export, monkeypatch, tmp_path):
    import io_scene_gltf2.blender.exp.export as exporter

    material, tree, shader = new_material("Cloudy")
    link_noise(tree, shader.inputs["Base Color"])
    add_cube(baking, material)
    # A failed export stays where it was.
    baking.frame_set(0)
    before = state()

    def fail(_):
        raise RuntimeError("broken")

    monkeypatch.setattr(exporter, "__export", fail)
    with pytest.raises(RuntimeError, match="broken"):
        export()
    assert state() != before
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "a.blend"), copy=True)
    assert state() == before


def test_objects_with_one_mesh_share_images(baking, export):
    material, tree, shader = new_material("Cloudy")
    link_noise(tree, shader.inputs["Base Color"])
    cube = add_cube(baking, material)
    twin = bpy.data.objects.new("Twin", cube.data)
    baking.collection.objects.link(twin)
    result = export()
    assert len(result.json["images"]) == 1 and len(result.json["meshes"]) == 1
    # In coordinates that differ between them, each has its own.
    tree.links.new(add_node(tree, "NewGeometry").outputs["Position"], tree.nodes["Noise Texture"].inputs["Vector"])
    twin.location.x = 5.0
    result = export()
    assert len(result.json["images"]) == 2 and len(result.json["meshes"]) == 2


def test_deformations_leave_the_texture_in_place(baking, export):
    material, tree, shader = new_material("Halves")
    link_noise(tree, shader.inputs["Base Color"])
    cube = add_cube(baking, material)
    straight = png(export(), {"index": 0})
    cast = cube.modifiers.new("C", "SIMPLE_DEFORM")
    cast.deform_method, cast.angle = "TWIST", 1.0
    bent = png(export(export_apply=True), {"index": 0})
    assert np.abs(straight - bent).mean() < 2.0


@pytest.mark.parametrize(("is_mirrored", "sine"), [(False, 255), (True, 0)])
def test_directions_of_highlights_become_an_image(baking, export, is_mirrored, sine, capfd):
    material, tree, shader = new_material("Brushed", Metallic=1.0, Anisotropic=0.5)
    link_checker(tree, shader.inputs["Anisotropic Rotation"], (0.0, 0.0, 0.0), (0.25, 0.25, 0.25))
    tangent = add_node(tree, "Tangent")
    tangent.direction_type, tangent.uv_map = "UV_MAP", "UVMap"
    tree.links.new(tangent.outputs[0], shader.inputs["Tangent"])
    bpy.ops.mesh.primitive_plane_add()
    plane = bpy.context.object.data
    plane.materials.append(material)
    corners = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)]
    # Without the tangent of the map, Cycles turns the strokes to the other side of a mirrored one.
    uv = [(1.0 - u, v) for u, v in corners] if is_mirrored else corners
    plane.uv_layers[0].uv.foreach_set("vector", np.array(uv, np.float32).ravel())
    result = export()
    stretch = materials_of(result)["Brushed"]["extensions"]["KHR_materials_anisotropy"]
    assert stretch["anisotropyStrength"] == 0.5 and "anisotropyRotation" not in stretch
    pixels = png(result, stretch["anisotropyTexture"])
    columns = {1 if is_mirrored else 0: [255, 128, 255], 0 if is_mirrored else 1: [128, sine, 255]}
    for half, expected in columns.items():
        assert np.abs(pixels[SIZE // 2, SIZE // 4 + half * SIZE // 2, :3] - expected).max() <= 2
    assert "loses" not in "".join(capfd.readouterr())


def test_metaballs_are_meshes_also_without_baking(scene, export):
    for x in (0.0, 1.0):
        bpy.ops.object.metaball_add(location=(x, 0.0, 0.0))
    bpy.context.object.data.materials.append(new_material("Clay")[0])
    before = state()
    result = export()
    assert state() == before
    assert [("mesh" in node) for node in result.json["nodes"] if node["name"].startswith("Mball")].count(True) == 1
    (mesh,) = result.json["meshes"]
    assert mesh["name"].startswith("Mball")
    positions = attribute(result, mesh["primitives"][0], "POSITION")
    # One surface around both.
    assert positions[:, 0].min() < -0.9 and positions[:, 0].max() > 1.9


def test_parts_with_different_normals_are_named_if_both_show(baking, export, capfd):
    for name, hard in (("Soft", False), ("Hard", True)):
        material, tree, smooth = new_material(name)
        bumpy, bump = add_node(tree, "BsdfPrincipled"), add_node(tree, "Bump")
        link_noise(tree, bump.inputs["Height"])
        tree.links.new(bump.outputs[0], bumpy.inputs["Normal"])
        mix = add_node(tree, "MixShader")
        if hard:
            link_checker(tree, mix.inputs[0], (0.0, 0.0, 0.0), (1.0, 1.0, 1.0))
        for i, shader in ((1, smooth), (2, bumpy)):
            tree.links.new(shader.outputs[0], mix.inputs[i])
        tree.links.new(mix.outputs[0], tree.nodes["Material Output"].inputs["Surface"])
        add_cube(baking, material)
    result = export()
    assert all("normalTexture" in material for material in result.json["materials"])
    printed = "".join(capfd.readouterr())
    assert "material 'Soft' has parts with different normals" in printed and "'Hard' has parts" not in printed


def test_linked_objects_and_curves_stay_as_they_are(baking, export, tmp_path):
    material, tree, shader = new_material("Cloudy")
    link_noise(tree, shader.inputs["Base Color"])
    cube = add_cube(baking, material)
    collection = bpy.data.collections.new("Shared")
    collection.objects.link(cube)
    bpy.data.libraries.write(str(tmp_path / "library.blend"), {collection})
    for block in (cube, collection):
        getattr(bpy.data, "objects" if block == cube else "collections").remove(block)
    bpy.data.orphans_purge()
    with bpy.data.libraries.load(str(tmp_path / "library.blend"), link=True) as (_, found):
        found.collections = ["Shared"]
    for i in range(2):
        empty = bpy.data.objects.new("Instance", None)
        empty.instance_type, empty.instance_collection = "COLLECTION", found.collections[0]
        empty.location.x = 3.0 * i
        baking.collection.objects.link(empty)
    bpy.ops.curve.primitive_bezier_circle_add()
    bpy.context.object.data.bevel_depth = 0.2
    bpy.ops.object.text_add()
    material, tree, shader = new_material("Painted")
    link_noise(tree, shader.inputs["Base Color"])
    for item in baking.collection.objects:
        if item.type in {"CURVE", "FONT"}:
            item.data.materials.append(material)
    bpy.context.view_layer.update()
    before = state()
    result = export()
    assert state() == before
    written = [node for node in result.json["nodes"] if "mesh" in node]
    assert len(written) == 4 and len({node["mesh"] for node in written}) == 3
    assert all("baseColorTexture" in material["pbrMetallicRoughness"] for material in result.json["materials"])
    assert sorted({material["name"] for material in result.json["materials"]}) == ["Cloudy", "Painted"]


def test_exports_are_repeatable(baking, export):
    material, tree, shader = new_material("Cloudy")
    link_noise(tree, shader.inputs["Base Color"])
    add_cube(baking, material)
    assert export().binary == export().binary


def test_what_cannot_be_baked_is_named(baking, export, capfd):
    material, tree, shader = new_material("Hairy")
    tree.links.new(add_node(tree, "BsdfHair").outputs[0], tree.nodes["Material Output"].inputs["Surface"])
    add_cube(baking, material)
    assert "images" not in export().json
    assert "material 'Hairy' is not baked: of its shader 'Hair BSDF'" in "".join(capfd.readouterr())


def test_nothing_is_baked_unless_asked(scene, export):
    material, tree, shader = new_material("Cloudy")
    link_noise(tree, shader.inputs["Base Color"])
    add_cube(scene, material)
    assert scene.blinn.bake == "never" and "images" not in export().json
