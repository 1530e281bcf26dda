"""Files of the extension that Blender imports again."""

from __future__ import annotations

import json
import struct

import pytest

bpy = pytest.importorskip("bpy")
np = pytest.importorskip("numpy")

from mathutils import Euler  # noqa: E402


@pytest.fixture()
def reopen(tmp_path):
    """A function that imports the exported file into an empty scene, and returns the scene."""

    def run(scene_settings=False, **options):
        import addon_utils

        bpy.ops.wm.read_factory_settings(use_empty=True)
        addon_utils.enable("blinn_extension", default_set=True)
        bpy.context.scene.blinn_import_scene = scene_settings
        assert bpy.ops.import_scene.gltf(filepath=str(tmp_path / "scene.glb"), **options) == {"FINISHED"}
        bpy.context.view_layer.update()
        return bpy.context.scene

    return run


def close(a, b, rel=1e-4):
    return a == pytest.approx(b, rel=rel, abs=1e-5)


@pytest.mark.parametrize("mode", ["SPEC", "COMPAT", "RAW"])
@pytest.mark.parametrize("shape", ["SQUARE", "RECTANGLE", "DISK", "ELLIPSE"])
def test_area_lights_come_back(scene, add_light, export, reopen, shape, mode):
    item = add_light("AREA", shape=shape, size=2.0, size_y=0.5, energy=80.0, color=(1.0, 0.5, 0.25))
    item.location, item.rotation_euler, item.scale = (1.0, 2.0, 3.0), (0.4, -0.7, 1.1), (2.0, 2.0, 2.0)
    child = bpy.data.objects.new("Child", None)
    child.parent, child.location = item, (0.0, 1.0, 0.0)
    scene.collection.objects.link(child)
    bpy.context.view_layer.update()
    places = {name: bpy.data.objects[name].matrix_world.copy() for name in ("Area", "Child")}
    first = export(export_import_convert_lighting_mode=mode)
    reopen()
    light = bpy.data.objects["Area"].data
    assert (light.type, light.shape, light.name) == ("AREA", shape, "Area")
    assert close([light.energy, light.size], [80.0, 2.0]) and close(list(light.color), [1.0, 0.5, 0.25])
    assert shape in {"SQUARE", "DISK"} or close(light.size_y, 0.5)
    for name, place in places.items():
        assert np.allclose(bpy.data.objects[name].matrix_world, place, atol=1e-4)
    second = export(export_import_convert_lighting_mode=mode)
    (before,), (after,) = first.area_lights, second.area_lights
    assert before.pop("name") == after.pop("name")
    assert set(before) == set(after) and before["type"] == after["type"]
    for name in ("size", "intensity", "color"):
        assert close(after[name], before[name])
    assert close(after.get("rect", {}), before.get("rect", {}))


def test_area_lights_below_uneven_scales_come_back(scene, add_light, export, reopen):
    add_light("AREA", shape="RECTANGLE", size=1.0, size_y=2.0, energy=10.0).scale = (2.0, 3.0, 4.0)
    (before,) = export().area_lights
    light = reopen().objects["Area"].data
    assert close([light.size, light.size_y, light.energy], [1.0, 2.0, 10.0])
    (after,) = export().area_lights
    assert close([after["size"], after["intensity"]], [before["size"], before["intensity"]])


def test_radii_angles_and_strengths_come_back(scene, add_light, export, reopen):
    add_light("POINT", shadow_soft_size=0.3, energy=50.0)
    add_light("SPOT", shadow_soft_size=0.7, energy=60.0)
    add_light("SUN", energy=2.5, angle=0.25, color=(1.0, 0.5, 0.25))
    before = export().lights
    objects = reopen().objects
    assert close(objects["Point"].data.shadow_soft_size, 0.3) and close(objects["Spot"].data.shadow_soft_size, 0.7)
    sun = objects["Sun"].data
    assert close([sun.energy, sun.angle], [2.5, 0.25]) and close(list(sun.color), [1.0, 0.5, 0.25])
    assert not any("blinn" in item.keys() or "blinn" in (item.data or {}).keys() for item in objects)
    after = export().lights
    for a, b in zip(after, before):
        assert a["type"] == b["type"] and close(a["intensity"], b["intensity"])
        a, b = a["extras"]["blinn"], b["extras"]["blinn"]
        assert a.keys() == b.keys() and all(close(a[name], b[name]) for name in a)


def test_shift_depth_of_field_and_the_active_camera_come_back(scene, export, reopen):
    other = bpy.data.objects.new("A", bpy.data.cameras.new("A"))
    scene.collection.objects.link(other)
    camera = scene.camera.data
    camera.lens, camera.shift_x, camera.shift_y = 50.0, 0.25, -0.5
    camera.dof.use_dof, camera.dof.aperture_fstop, camera.dof.focus_distance = True, 2.5, 3.0
    camera.dof.aperture_blades = 6
    before = export()
    scene = reopen()
    assert scene.camera.name == "Camera" and not scene.objects["A"].data.dof.use_dof
    after = export()
    names = [c["name"] for c in before.json["cameras"]]
    assert names == [c["name"] for c in after.json["cameras"]]
    for a, b in zip(after.json["cameras"], before.json["cameras"]):
        a, b = (c.get("extras", {}).get("blinn", {}) for c in (a, b))
        assert set(a) == set(b) and close(a.get("shift", []), b.get("shift", []))
        assert close(a.get("depthOfField", {}), b.get("depthOfField", {}))


def test_world_and_settings_come_back_on_request(scene, export, reopen):
    render = scene.render
    render.resolution_x, render.resolution_y, render.resolution_percentage = 640, 480, 50
    render.pixel_aspect_x, render.pixel_aspect_y = 1.0, 2.0
    render.use_border, render.border_min_x, render.border_max_x = True, 0.25, 0.75
    render.film_transparent, render.fps, render.fps_base = True, 30, 1.001
    scene.frame_start, scene.frame_end, scene.frame_step = 3, 40, 2
    scene.view_settings.view_transform, scene.view_settings.exposure = "AgX", -1.5
    scene.world = bpy.data.worlds.new("World")
    if bpy.app.version < (5, 0, 0):
        scene.world.use_nodes = True
    tree = scene.world.node_tree
    background = next(node for node in tree.nodes if node.bl_idname == "ShaderNodeBackground")
    image = bpy.data.images.new("Sky", 8, 4, float_buffer=True)
    image.pixels.foreach_set(np.linspace(0.0, 2.0, 128, dtype=np.float32))
    texture, mapping = tree.nodes.new("ShaderNodeTexEnvironment"), tree.nodes.new("ShaderNodeMapping")
    texture.image, mapping.inputs["Rotation"].default_value = image, Euler((0.3, -0.4, 1.1))
    tree.links.new(tree.nodes.new("ShaderNodeTexCoord").outputs["Generated"], mapping.inputs["Vector"])
    tree.links.new(mapping.outputs["Vector"], texture.inputs["Vector"])
    tree.links.new(texture.outputs["Color"], background.inputs["Color"])
    background.inputs["Strength"].default_value = 0.5
    before = export()
    assert reopen().render.resolution_x == 1920 and bpy.context.scene.world is None
    reopen(scene_settings=True)
    after = export()
    a, b = after.settings, before.settings
    worlds = a.pop("world"), b.pop("world")
    assert close(worlds[0].pop("rotation"), worlds[1].pop("rotation"))
    views = [result.view(world.pop("bufferView")) for result, world in zip((after, before), worlds)]
    assert views[0] == views[1] and worlds[0] == worlds[1]
    for name in ("view", "frames", "region"):
        one, two = a.pop(name), b.pop(name)
        one.pop("current", None), two.pop("current", None)
        assert one.keys() == two.keys()
        assert all(close(one[key], two[key]) if not isinstance(one[key], str) else one[key] == two[key] for key in one)
    a.pop("lightUnits"), b.pop("lightUnits")
    assert a == b


WRONG = ["text", [], {}, None, True, -1.0, 1e39, [1.0, "text"]]


@pytest.mark.parametrize("wrong", WRONG, ids=str)
def test_wrong_values_leave_an_import_whole(scene, add_light, export, reopen, tmp_path, wrong):
    for kind in ("AREA", "POINT", "SUN"):
        add_light(kind)
    scene.camera.data.shift_x, scene.camera.data.dof.use_dof = 0.5, True
    export()
    path = tmp_path / "scene.glb"
    data = path.read_bytes()
    length = struct.unpack("<I", data[12:16])[0]

    def change(values, keys):
        for key in keys:
            if isinstance(values.get(key), dict) and key not in ("world",):
                change(values[key], list(values[key]))
            else:
                values[key] = wrong

    document = json.loads(data[20 : 20 + length])
    change(document["scenes"][0]["extras"], ["blinn"])
    change(document["cameras"][0]["extras"], ["blinn"])
    change(document["extensions"]["EXT_lights_area"]["lights"][0], ["type", "color", "intensity", "size", "rect"])
    for light in document["extensions"]["KHR_lights_punctual"]["lights"]:
        change(light["extras"], ["blinn"])
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    rest = data[20 + length :]
    header = struct.pack("<4sII", b"glTF", 2, 20 + len(text) + len(rest)) + struct.pack("<I4s", len(text), b"JSON")
    path.write_bytes(header + text + rest)
    assert {"Area", "Point", "Sun", "Camera"} <= {item.name for item in reopen(scene_settings=True).objects}


def test_files_of_others_are_imported(scene, add_light, export, reopen):
    scene.blinn_export = False
    add_light("POINT", shadow_soft_size=0.3)
    export()
    assert reopen(scene_settings=True).objects["Point"].data.type == "POINT"
