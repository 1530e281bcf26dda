"""Conversion of .blend files in a process of its own."""

from __future__ import annotations

import argparse
import json
import struct
import subprocess
import sys
from pathlib import Path

import pytest

bpy = pytest.importorskip("bpy")

EEVEE = "BLENDER_EEVEE" if bpy.app.version >= (5, 0, 0) else "BLENDER_EEVEE_NEXT"
SCRIPT = Path(__file__).resolve().parents[2] / "src/blender/convert.py"


class Converted:
    """The result of a conversion."""

    def __init__(self, folder: Path, status: int) -> None:
        self.status = status
        report = folder / "report.txt"
        lines = report.read_text().splitlines() if report.exists() else []
        self.report = [tuple(line.split(" ", 1)) for line in lines]
        glb = folder / "scene.glb"
        self.json = {}
        if glb.exists():
            data = glb.read_bytes()
            self.json = json.loads(data[20 : 20 + struct.unpack("<I", data[12:16])[0]])

    @property
    def nodes(self) -> dict:
        return {node["name"]: node for node in self.json.get("nodes", [])}

    def vertices(self, name: str) -> int:
        mesh = self.json["meshes"][self.nodes[name]["mesh"]]
        return self.json["accessors"][mesh["primitives"][0]["attributes"]["POSITION"]]["count"]


@pytest.fixture()
def convert(tmp_path):
    """A function that converts a file, or else saves and converts the scene."""

    def run(*arguments: str, file: Path | None = None) -> Converted:
        if file is None:
            file = tmp_path / "scene.blend"
            bpy.ops.wm.save_as_mainfile(filepath=str(file), copy=True)
        folder = tmp_path / "out"
        folder.mkdir(exist_ok=True)
        command = [sys.executable, SCRIPT, "--input", file, "--output", folder / "scene.glb"]
        command += ["--report", folder / "report.txt", *arguments]
        status = subprocess.run(command, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, timeout=300).returncode
        return Converted(folder, status)

    return run


def add_cube(scene, name, collection=None):
    bpy.ops.mesh.primitive_cube_add()
    cube = bpy.context.object
    cube.name = name
    if collection is not None:
        scene.collection.objects.unlink(cube)
        collection.objects.link(cube)
    return cube


def test_a_scene_is_converted_with_its_lights_and_settings(scene, add_light, convert):
    add_light("AREA")
    scene.render.resolution_x = 123
    add_cube(scene, "Cube")
    result = convert()
    assert result.status == 0 and result.report == []
    assert set(result.nodes) == {"Camera", "Area", "Cube"} and "cameras" in result.json
    assert result.json["extensions"]["EXT_lights_area"]["lights"]
    assert result.json["scenes"][0]["extras"]["blinn"]["resolution"][0] == 123
    assert "animations" not in result.json


def test_only_what_renders_is_converted(scene, convert):
    hidden = bpy.data.collections.new("Hidden")
    unseen = bpy.data.collections.new("Unseen")
    for collection in [hidden, unseen]:
        scene.collection.children.link(collection)
    hidden.hide_render = True
    unseen.hide_viewport = True
    add_cube(scene, "Shown")
    add_cube(scene, "Cutter").hide_render = True
    add_cube(scene, "Behind").hide_viewport = True
    add_cube(scene, "Closed").hide_set(True)
    add_cube(scene, "In hidden", hidden)
    add_cube(scene, "In unseen", unseen)
    excluded = bpy.data.collections.new("Excluded")
    scene.collection.children.link(excluded)
    add_cube(scene, "In excluded", excluded)
    bpy.context.view_layer.layer_collection.children["Excluded"].exclude = True
    scene.camera.hide_render = True
    assert set(convert().nodes) == {"Camera", "Shown", "Behind", "Closed", "In unseen"}


def test_modifiers_and_levels_are_those_of_renders(scene, convert):
    smooth, hidden = add_cube(scene, "Smooth"), add_cube(scene, "Hidden")
    subdivision = smooth.modifiers.new("S", "SUBSURF")
    subdivision.levels, subdivision.render_levels = 0, 2
    array = hidden.modifiers.new("A", "ARRAY")
    array.show_viewport, array.show_render = True, False
    result = convert()
    assert result.vertices("Smooth") > 90 and result.vertices("Hidden") == 24


def test_animation_is_converted_if_there_is_some(scene, convert):
    cube = add_cube(scene, "Cube")
    scene.frame_start, scene.frame_end = 1, 11
    for frame, x in [(1, 0.0), (11, 10.0)]:
        cube.location.x = x
        cube.keyframe_insert("location", frame=frame)
    (animation,) = convert().json["animations"]
    assert len(animation["channels"]) == 1
    still = convert("--frame", "6.5")
    assert "animations" not in still.json
    assert 0.0 < still.nodes["Cube"]["translation"][0] < 10.0


def test_a_scene_is_chosen_by_name_or_index(scene, convert):
    other = bpy.data.scenes.new("Other")
    other.collection.objects.link(bpy.data.objects.new("Only here", None))
    for choice in ["Other", str(list(bpy.data.scenes).index(other))]:
        result = convert(f"--scene={choice}")
        assert [s["name"] for s in result.json["scenes"]] == ["Other"] and set(result.nodes) == {"Only here"}
    result = convert("--scene=Missing")
    assert result.status == 1
    assert result.report == [("error", "there is no scene 'Missing'; the file has: 0 'Other', 1 'Scene'")]


def test_linked_files_are_listed(scene, convert, tmp_path):
    path = tmp_path / "a picture.png"
    image = bpy.data.images.new("A", 2, 2)
    image.filepath_raw, image.file_format = str(path), "PNG"
    image.save()
    linked = bpy.data.images.load(str(path), check_existing=False)
    linked.use_fake_user = True
    assert ("file", str(path)) in convert().report


@pytest.mark.parametrize("is_packed", [False, True])
def test_images_outside_the_folder_are_read_on_request(scene, convert, tmp_path, is_packed):
    (tmp_path / "inside").mkdir()
    for folder in [tmp_path, tmp_path / "inside"]:
        image = bpy.data.images.new(folder.name, 2, 2)
        image.generated_color = (float(folder == tmp_path), 0.5, 0.5, 1.0)
        image.filepath_raw, image.file_format = str(folder / f"{folder.name}.png"), "PNG"
        image.save()
        material = bpy.data.materials.new(folder.name)
        if bpy.app.version < (5, 0, 0):
            material.use_nodes = True
        nodes, links = material.node_tree.nodes, material.node_tree.links
        texture = nodes.new("ShaderNodeTexImage")
        texture.image = bpy.data.images.load(str(folder / f"{folder.name}.png"), check_existing=False)
        if is_packed:
            texture.image.pack()
        surface = next(n for n in nodes if n.bl_idname == "ShaderNodeBsdfPrincipled")
        links.new(texture.outputs["Color"], surface.inputs["Base Color"])
        add_cube(scene, folder.name).data.materials.append(material)
    file = tmp_path / "inside/scene.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(file), copy=True)
    result = convert("--only-folder", file=file)
    assert len(result.json["images"]) == (2 if is_packed else 1)
    assert sum(key == "warning" and "`allow-outside`" in text for key, text in result.report) == (not is_packed)
    result = convert(file=file)
    assert len(result.json["images"]) == 2 and not any(key == "warning" for key, _ in result.report)


def test_scripts_of_the_file_do_not_run(scene, convert, tmp_path):
    mark = tmp_path / "mark"
    text = bpy.data.texts.new("evil.py")
    text.write(f"open({str(mark)!r}, 'w').close()")
    text.use_module = True
    cube = add_cube(scene, "Cube")
    driver = cube.driver_add("location", 0).driver
    driver.type, driver.expression = "SCRIPTED", f"[open({str(mark)!r}, 'w'), 1.0][1]"
    result = convert()
    assert result.status == 0 and not mark.exists()
    assert any(key == "warning" and "scripts were not run" in text for key, text in result.report)


def test_worlds_of_other_nodes_are_converted(scene, convert):
    scene.world = bpy.data.worlds.new("World")
    if bpy.app.version < (5, 0, 0):
        scene.world.use_nodes = True
    nodes, links = scene.world.node_tree.nodes, scene.world.node_tree.links
    background = next(n for n in nodes if n.bl_idname == "ShaderNodeBackground")
    links.new(nodes.new("ShaderNodeTexNoise").outputs[0], background.inputs["Color"])
    result = convert()
    assert result.report == [] and "bufferView" in result.json["scenes"][0]["extras"]["blinn"]["world"]


def test_files_of_newer_versions_are_warnings(scene, convert, tmp_path):
    path = tmp_path / "newer.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path), copy=True, compress=False)
    data = path.read_bytes()
    major, minor = bpy.app.version[:2]
    old, new = (b"v%02d%02d" % (major, m) if major >= 5 else b"v%d%02d" % (major, m) for m in (minor, minor + 1))
    assert old in data[:20]
    path.write_bytes(data[:20].replace(old, new) + data[20:])
    result = convert(file=path)
    warnings = [text for key, text in result.report if key == "warning"]
    assert result.status == 0 and len(warnings) == 1
    assert f"Blender {major}.{minor + 1} saved the file and Blender {major}.{minor} opened it" in warnings[0]


DAMAGED = [b"BLENDER-v405", b"BLENDER17-01v0500" + bytes(100), b"BLENDER" + bytes(60), b"", b"\x28\xb5\x2f\xfd\0\0"]


@pytest.mark.parametrize("content", DAMAGED)
def test_damaged_files_are_one_error(convert, tmp_path, content):
    path = tmp_path / "damaged.blend"
    path.write_bytes(content)
    result = convert(file=path)
    assert result.status != 0 and not result.json
    ((key, text),) = result.report
    assert key == "error" and "it is damaged or was cut off; save it again in Blender" in text
    assert "newer" not in text and str(path) not in text


def test_truncated_files_are_one_error_or_a_scene(scene, convert, tmp_path):
    add_cube(scene, "Cube")
    path = tmp_path / "whole.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path), copy=True, compress=False)
    data = path.read_bytes()
    for part in [100, len(data) // 2, len(data) - 100]:
        path.write_bytes(data[:part])
        result = convert(file=path)
        assert result.status == 0 or [key for key, _ in result.report] == ["error"]


def test_a_lack_of_memory_in_the_exporter_names_the_option(scene, monkeypatch, tmp_path):
    from blinn_extension import conversion, convert, export_hook

    def replace(*_):
        raise MemoryError

    # An exception of this method ends the exporter.
    monkeypatch.setattr(export_hook.glTF2ExportUserExtension, "replace", replace)
    options = argparse.Namespace(frame=None, output=str(tmp_path / "scene.glb"))
    with pytest.raises(MemoryError) as raised:
        conversion.export(options, scene, lambda *_: None)
    assert "allow more with `max-memory`" in convert.reason(raised.value)


def test_the_end_of_input_ends_the_conversion(scene, convert, tmp_path):
    folder = tmp_path / "work"
    folder.mkdir()
    result = convert("--end-with-input", str(folder))
    assert result.status == 1 and not folder.exists()


def test_keys_of_materials_lights_and_cameras_are_converted(scene, add_light, convert):
    scene.frame_start, scene.frame_end = 1, 11
    light = add_light("POINT").data
    material = bpy.data.materials.new("Painted")
    if bpy.app.version < (5, 0, 0):
        material.use_nodes = True
    add_cube(scene, "Cube").data.materials.append(material)
    color = next(n for n in material.node_tree.nodes if n.bl_idname == "ShaderNodeBsdfPrincipled").inputs["Base Color"]
    for frame, value in [(1, 0.2), (11, 0.9)]:
        light.energy, color.default_value, scene.camera.data.lens = 100.0 * value, (value, 0.5, 0.5, 1.0), 50.0 * value
        light.keyframe_insert("energy", frame=frame)
        color.keyframe_insert("default_value", frame=frame)
        scene.camera.data.keyframe_insert("lens", frame=frame)
    (animation,) = convert().json["animations"]
    targets = [channel["target"] for channel in animation["channels"]]
    pointers = {target["extensions"]["KHR_animation_pointer"]["pointer"].rsplit("/", 1)[-1] for target in targets}
    assert pointers == {"intensity", "baseColorFactor", "yfov"}


@pytest.fixture()
def add_material(scene):
    """A function that adds a cube with a material, and returns the material's nodes and its Principled BSDF."""

    def add(name, **inputs):
        material = bpy.data.materials.new(name)
        if bpy.app.version < (5, 0, 0):
            material.use_nodes = True
        add_cube(scene, name).data.materials.append(material)
        tree = material.node_tree
        shader = next(n for n in tree.nodes if n.bl_idname == "ShaderNodeBsdfPrincipled")
        for socket, value in inputs.items():
            shader.inputs[socket.replace("_", " ")].default_value = value
        return tree, shader

    return add


def test_what_materials_lose_is_one_warning_each(scene, convert, add_material):
    add_material("Plain", Roughness=0.2, Coat_Weight=1.0, Coat_Tint=(1.0, 0.5, 0.2, 1.0))
    tree, shader = add_material("Lacquer", Coat_Weight=1.0, Subsurface_Weight=0.5)
    texture = tree.nodes.new("ShaderNodeTexImage")
    texture.image = bpy.data.images.new("Tints", 4, 4)
    tree.links.new(texture.outputs[0], shader.inputs["Coat Tint"])
    tree, shader = add_material("Cloudy")
    ramp = tree.nodes.new("ShaderNodeValToRGB")
    tree.links.new(tree.nodes.new("ShaderNodeTexNoise").outputs[0], ramp.inputs[0])
    tree.links.new(ramp.outputs[0], shader.inputs["Base Color"])
    tree, shader = add_material("Linear")
    texture = tree.nodes.new("ShaderNodeTexImage")
    texture.image = bpy.data.images.new("Values", 4, 4)
    texture.image.pack()
    texture.image.colorspace_settings.name = "Linear Rec.709"
    tree.links.new(texture.outputs[0], shader.inputs["Base Color"])
    tree, shader = add_material("Other")
    tree.links.new(tree.nodes.new("ShaderNodeBsdfHair").outputs[0], tree.nodes["Material Output"].inputs["Surface"])
    tree, shader = add_material("Pane")
    tree.links.new(tree.nodes.new("ShaderNodeBsdfGlass").outputs[0], tree.nodes["Material Output"].inputs["Surface"])
    tree, shader = add_material("Worn")
    mix = tree.nodes.new("ShaderNodeMixShader")
    tree.links.new(tree.nodes.new("ShaderNodeTexNoise").outputs[0], mix.inputs[0])
    tree.links.new(tree.nodes.new("ShaderNodeBsdfTransparent").outputs[0], mix.inputs[1])
    tree.links.new(shader.outputs[0], mix.inputs[2])
    tree.links.new(mix.outputs[0], tree.nodes["Material Output"].inputs["Surface"])
    tree, shader = add_material("Blended")
    mix = tree.nodes.new("ShaderNodeMixRGB")
    for i in (1, 2):
        texture = tree.nodes.new("ShaderNodeTexImage")
        texture.image = bpy.data.images.new("Colors", 4, 4)
        tree.links.new(texture.outputs[0], mix.inputs[i])
    tree.links.new(mix.outputs[0], shader.inputs["Base Color"])
    start = "loses what glTF cannot hold:"
    assert sorted(text for key, text in convert().report if key == "warning") == [
        f"material 'Blended' {start} 'Mix (Legacy)' in Base Color; `bake` makes images of it",
        f"material 'Cloudy' {start} 'Color Ramp' in Base Color, 'Noise Texture' in Base Color; "
        "`bake` makes images of it",
        f"material 'Lacquer' {start} Subsurface Weight, the colours in Coat Tint; `bake` makes images of it",
        f"material 'Linear' {start} the colour space 'Linear Rec.709' of image 'Values'",
        f"material 'Other' {start} the shader 'Hair BSDF'",
        f"material 'Worn' {start} 'Noise Texture' in the factor of 'Mix Shader'; `bake` makes images of it",
    ]


def test_materials_are_baked_on_request(scene, convert, add_material):
    tree, shader = add_material("Cloudy")
    tree.links.new(tree.nodes.new("ShaderNodeTexNoise").outputs[0], shader.inputs["Base Color"])
    scene.blinn.bake_size = 64
    assert "images" not in convert().json
    result = convert("--bake", "auto")
    assert result.report == [] and [image["name"] for image in result.json["images"]] == ["Cloudy Base Color"]
    scene.blinn.bake = "auto"
    assert "images" in convert().json and "images" not in convert("--bake", "never").json


def test_thin_walls_are_marked(scene, convert, add_material):
    _, shader = add_material("Pane", Transmission_Weight=1.0)
    add_material("Body", Transmission_Weight=1.0)
    if "Thin Wall" not in shader.inputs:
        pytest.skip("this Blender has no thin walls")
    shader.inputs["Thin Wall"].default_value = True
    marks = {m["name"]: m.get("extras", {}).get("blinn") for m in convert().json["materials"]}
    assert marks == {"Pane": {"thinWall": True}, "Body": None}


def test_the_spread_of_area_lights_is_a_warning(scene, add_light, convert):
    add_light("AREA")
    assert convert().report == []
    add_light("AREA").data.spread = 1.0
    assert convert().report == [("warning", "area light 'Area.001' shines to all sides: its spread is not written")]


@pytest.mark.parametrize("engine", ["CYCLES", EEVEE])
def test_lost_keys_of_lights_are_a_warning(scene, add_light, convert, engine):
    scene.render.engine = engine
    scene.frame_start, scene.frame_end = 1, 11
    for kind in ["AREA", "SUN"]:
        light = add_light(kind).data
        for frame, energy in [(1, 1.0), (11, 9.0)]:
            light.energy = energy
            light.keyframe_insert("energy", frame=frame)
    result = convert()
    text = "the keys of light '{}' are not written: it is the same in all frames"
    lost = ["Area", "Sun"] if bpy.app.version >= (5, 1, 0) and engine == "CYCLES" else ["Area"]
    assert sorted(result.report) == [("warning", text.format(name)) for name in lost]
    assert len(result.json.get("animations", [])) == 2 - len(lost)
    assert convert("--frame", "5").report == []


def test_opaque_materials_keep_their_index_of_refraction_and_thin_film(scene, convert, add_material):
    add_material("Plain", IOR=1.5)
    add_material("Diamond", IOR=2.4)
    add_material("Glass", IOR=1.45, Transmission_Weight=1.0)
    add_material("Bubble", IOR=1.5, Thin_Film_Thickness=450.0, Thin_Film_IOR=1.75)
    materials = {m["name"]: m.get("extensions", {}) for m in convert().json["materials"]}
    assert materials["Plain"] == {}
    assert materials["Diamond"]["KHR_materials_ior"] == {"ior": pytest.approx(2.4)}
    assert materials["Diamond"]["KHR_materials_specular"] == {"specularFactor": 1}
    assert materials["Glass"]["KHR_materials_ior"] == {"ior": pytest.approx(1.45)}
    film = {"iridescenceFactor": 1, "iridescenceIor": 1.75, "iridescenceThicknessMaximum": 450}
    assert materials["Bubble"] == {"KHR_materials_iridescence": film}


def test_a_missing_module_is_one_error(convert, tmp_path, monkeypatch):
    # As where a distribution builds Blender with a Python of its own.
    (tmp_path / "numpy.py").write_text("raise ModuleNotFoundError(\"No module named 'numpy'\", name='numpy')")
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    result = convert(file=tmp_path / "any.blend")
    assert result.status == 1
    assert result.report == [
        ("error", "Blender's Python has no module numpy; install it, as python3-numpy on Debian")
    ]
