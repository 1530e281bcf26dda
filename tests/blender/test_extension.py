"""What the extension adds to exported files."""

from __future__ import annotations

import math
import re
from pathlib import Path

import pytest

bpy = pytest.importorskip("bpy")
np = pytest.importorskip("numpy")

from mathutils import Euler, Quaternion, Vector  # noqa: E402

LUMENS_PER_WATT = 683.0


def close(a, b):
    return a == pytest.approx(b, rel=1e-5, abs=1e-6)


@pytest.mark.parametrize(
    ("shape", "kind", "area", "size", "aspect"),
    [
        ("SQUARE", "rect", 4.0, 2.0, 1.0),
        ("RECTANGLE", "rect", 1.0, 0.5, 4.0),
        ("DISK", "disk", math.pi, 2.0, None),
        ("ELLIPSE", "disk", math.pi / 4.0, 1.0, None),
    ],
)
def test_area_lights_keep_their_power(scene, add_light, export, shape, kind, area, size, aspect):
    add_light("AREA", shape=shape, size=2.0, size_y=0.5, energy=80.0, color=(1.0, 0.5, 0.25))
    result = export()
    (light,) = result.area_lights
    assert light["type"] == kind and close(light["size"], size)
    assert light["color"] == [1, 0.5, 0.25]
    assert close(light["intensity"] * area * math.pi, 80.0 * LUMENS_PER_WATT)
    assert aspect is None or close(light["rect"]["aspect"], aspect)
    assert shape != "ELLIPSE" or close(light["extras"]["blinn"]["aspect"], 4.0)
    (node,) = [node for node in result.json["nodes"] if node["name"] == "Area"]
    assert node["extensions"]["EXT_lights_area"] == {"light": 0}
    assert "EXT_lights_area" in result.json["extensionsUsed"]
    assert "EXT_lights_area" not in result.json.get("extensionsRequired", [])


def test_area_lights_are_scaled_by_the_largest_component(scene, add_light, export):
    light_object = add_light("AREA", shape="RECTANGLE", size=1.0, size_y=2.0, energy=10.0)
    light_object.scale = (2.0, 3.0, 4.0)
    (light,) = export().area_lights
    # Blender's light is 2 m by 6 m; readers multiply by 4.
    assert close(light["size"] * 4.0, 6.0) and close(light["rect"]["aspect"], 2.0 / 6.0)
    assert close(light["intensity"] * 12.0 * math.pi, 10.0 * LUMENS_PER_WATT)


def test_intensities_follow_the_lighting_mode(scene, add_light, export):
    add_light("AREA", shape="SQUARE", size=1.0, energy=math.pi)
    for mode, intensity, units in [("SPEC", 683.0, "standard"), ("COMPAT", 1.0, "unitless"), ("RAW", 1.0, "raw")]:
        result = export(export_import_convert_lighting_mode=mode)
        assert close(result.area_lights[0]["intensity"], intensity)
        assert result.settings["lightUnits"] == units


def test_exposures_of_lights_count(scene, add_light, export):
    area = add_light("AREA", shape="SQUARE", size=1.0, energy=math.pi)
    if not hasattr(area.data, "exposure"):
        pytest.skip("lights of this Blender have no exposure")
    area.data.exposure = 2.0
    assert close(export().area_lights[0]["intensity"], 4.0 * LUMENS_PER_WATT)


def test_point_lights_and_spots_have_radii(scene, add_light, export):
    add_light("POINT", shadow_soft_size=0.3)
    add_light("SPOT", shadow_soft_size=0.7)
    radii = [light["extras"]["blinn"]["radius"] for light in export().lights]
    assert close(sorted(radii), [0.3, 0.7])


def test_suns_have_their_angle_and_true_strength(scene, add_light, export):
    add_light("SUN", energy=2.5, angle=0.25, color=(1.0, 0.5, 0.25))
    for engine in ["CYCLES", "BLENDER_WORKBENCH"]:
        scene.render.engine = engine
        (light,) = export().lights
        blinn = light["extras"]["blinn"]
        assert close([blinn["strength"], blinn["angle"]], [2.5, 0.25]) and close(blinn["color"], [1.0, 0.5, 0.25])


def test_the_temperature_of_a_light_counts_once_in_each_export(scene, add_light, export):
    # Not of a sun: the exporter of Blender 5.0.1 fails on it.
    area = add_light("AREA", shape="SQUARE", size=1.0, energy=math.pi, color=(0.5, 0.5, 0.5))
    if not hasattr(area.data, "use_temperature"):
        pytest.skip("lights of this Blender have no temperature")
    area.data.use_temperature, area.data.temperature = True, 2000.0
    expected = [0.5 * LUMENS_PER_WATT * channel for channel in area.data.temperature_color]
    for _ in range(2):
        (light,) = export().area_lights
        assert max(light["color"]) <= 1.0
        assert close([light["intensity"] * channel for channel in light["color"]], expected)


def test_the_active_camera_is_marked(scene, export):
    other = bpy.data.objects.new("A", bpy.data.cameras.new("A"))
    scene.collection.objects.link(other)
    nodes = {node["name"]: node.get("extras") for node in export().json["nodes"]}
    assert nodes == {"A": None, "Camera": {"blinn": {"activeCamera": True}}}


@pytest.mark.parametrize(
    ("fit", "size", "shift"),
    [
        ("AUTO", (200, 100), (0.25, -0.5)),
        ("AUTO", (100, 200), (0.25, -0.5)),
        ("HORIZONTAL", (100, 200), (0.125, -0.25)),
        ("VERTICAL", (200, 100), (0.125, -0.25)),
    ],
)
def test_lens_shifts_are_in_units_of_the_larger_side(scene, export, fit, size, shift):
    camera = scene.camera.data
    camera.sensor_fit, camera.shift_x, camera.shift_y = fit, 0.25, -0.5
    scene.render.resolution_x, scene.render.resolution_y = size
    assert close(export().json["cameras"][0]["extras"]["blinn"]["shift"], shift)


def test_depth_of_field_is_in_metres(scene, export):
    assert "extras" not in export().json["cameras"][0]
    camera = scene.camera.data
    camera.lens, camera.dof.use_dof, camera.dof.aperture_fstop, camera.dof.focus_distance = 50.0, True, 2.5, 3.0
    dof = export().json["cameras"][0]["extras"]["blinn"]["depthOfField"]
    assert close([dof["focusDistance"], dof["apertureRadius"]], [3.0, 0.01])
    focus = bpy.data.objects.new("Focus", None)
    focus.location = (1.0, 0.0, -7.0)
    scene.collection.objects.link(focus)
    camera.dof.focus_object = focus
    assert close(export().json["cameras"][0]["extras"]["blinn"]["depthOfField"]["focusDistance"], 7.0)


def test_render_settings(scene, export):
    render = scene.render
    render.resolution_x, render.resolution_y, render.resolution_percentage = 640, 480, 50
    render.pixel_aspect_x, render.pixel_aspect_y = 3.0, 2.0
    render.use_border, render.border_min_x, render.border_max_x = True, 0.25, 0.75
    render.border_min_y, render.border_max_y = 0.0, 0.5
    render.film_transparent = True
    render.fps, render.fps_base = 30, 1.001
    scene.frame_start, scene.frame_end, scene.frame_step = 3, 40, 2
    scene.frame_set(7)
    scene.view_settings.view_transform = "AgX"
    scene.view_settings.look = "AgX - Punchy"
    scene.view_settings.exposure, scene.view_settings.gamma = -1.5, 1.25
    settings = export().settings
    assert (settings["resolution"], settings["percentage"], settings["pixelAspect"]) == ([640, 480], 50, 1.5)
    assert settings["region"] == {"min": [0.25, 0.0], "max": [0.75, 0.5]}
    assert settings["filmTransparent"] is True
    assert close(settings["frames"].pop("rate"), 30.0 / 1.001)
    assert settings["frames"] == {"start": 3, "end": 40, "step": 2, "current": 7}
    view = settings["view"]
    assert (view["transform"], view["look"]) == ("AgX", "AgX - Punchy")
    assert (view["exposure"], view["gamma"]) == (-1.5, 1.25)
    render.use_border = False
    assert "region" not in export().settings


def test_light_paths_are_those_of_the_engine(scene, export):
    scene.render.engine = "CYCLES"
    scene.cycles.diffuse_bounces, scene.cycles.max_bounces = 3, 2
    scene.cycles.caustics_reflective = scene.cycles.caustics_refractive = False
    scene.cycles.film_exposure = 2.0
    settings = export().settings
    assert (settings["indirect"], settings["caustics"], settings["view"]["filmExposure"]) == (2, False, 2)
    scene.cycles.caustics_refractive = True
    assert export().settings["caustics"] is True
    scene.render.engine = "BLENDER_WORKBENCH"
    assert "indirect" not in export().settings


@pytest.mark.parametrize("is_current", [False, True])
def test_static_values_are_those_of_the_frame_of_objects(scene, add_light, export, is_current):
    scene.frame_start, scene.frame_end = 0, 20
    area, sun = add_light("AREA", shape="SQUARE", size=1.0), add_light("SUN")
    _, background = world_of(scene)
    owners = [
        (area, "location", lambda value: (value, 0.0, 0.0)),
        (area.data, "energy", lambda value: value * math.pi),
        (area.data, "color", lambda value: (value / 100.0, 1.0, 1.0)),
        (sun.data, "angle", lambda value: value / 100.0),
        (sun.data, "color", lambda value: (value / 100.0, 1.0, 1.0)),
        (scene.camera.data, "shift_x", lambda value: value),
        (scene.view_settings, "exposure", lambda value: value / 10.0),
        (background.inputs["Strength"], "default_value", lambda value: value),
    ]
    background.inputs["Color"].default_value = (1.0, 1.0, 1.0, 1.0)
    for frame, value in [(0, 10.0), (10, 40.0), (20, 80.0)]:
        scene.frame_set(frame)
        for owner, name, at in owners:
            setattr(owner, name, at(value))
            owner = scene if owner == scene.view_settings else owner
            owner.keyframe_insert(f"view_settings.{name}" if owner == scene else name, frame=frame)
    scene.frame_set(10)
    result = export(export_current_frame=is_current, export_animations=True, export_animation_mode="SCENE")
    value = 40.0 if is_current else 10.0
    (node,) = [node for node in result.json["nodes"] if node["name"] == "Area"]
    assert result.json["animations"] and close(node["translation"], [value, 0.0, 0.0])
    (light,) = result.area_lights
    assert close([light["intensity"], light["color"][0]], [value * LUMENS_PER_WATT, value / 100.0])
    (blinn,) = [light["extras"]["blinn"] for light in result.lights]
    assert close([blinn["angle"], blinn["color"][0]], [value / 100.0, value / 100.0])
    assert close(result.json["cameras"][0]["extras"]["blinn"]["shift"][0], value)
    settings = result.settings
    assert close(settings["view"]["exposure"], value / 10.0) and close(settings["world"]["color"], [value] * 3)
    assert settings["frames"]["current"] == 10


def world_of(scene):
    """A new world with nodes, and its Background node."""
    scene.world = bpy.data.worlds.new("World")
    if bpy.app.version < (5, 0, 0):
        scene.world.use_nodes = True
    return scene.world, next(n for n in scene.world.node_tree.nodes if n.bl_idname == "ShaderNodeBackground")


def picture_world(scene, image):
    """A world with a picture, and its Mapping node."""
    world, background = world_of(scene)
    nodes, links = world.node_tree.nodes, world.node_tree.links
    texture, mapping = nodes.new("ShaderNodeTexEnvironment"), nodes.new("ShaderNodeMapping")
    coordinates = nodes.new("ShaderNodeTexCoord")
    texture.image = image
    links.new(coordinates.outputs["Generated"], mapping.inputs["Vector"])
    links.new(mapping.outputs["Vector"], texture.inputs["Vector"])
    links.new(texture.outputs["Color"], background.inputs["Color"])
    return background, mapping


def test_worlds_of_one_colour(scene, export):
    assert export().settings["world"] == {"color": [0.0, 0.0, 0.0]}
    _, background = world_of(scene)
    background.inputs["Color"].default_value = (0.5, 0.25, 0.125, 1.0)
    background.inputs["Strength"].default_value = 2.0
    assert close(export().settings["world"]["color"], [1.0, 0.5, 0.25])


@pytest.fixture()
def panorama():
    """A picture of floats, 8 x 4, of which each row has its own colour."""
    image = bpy.data.images.new("Sky", 8, 4, float_buffer=True)
    texels = np.ones((4, 8, 4), dtype=np.float32)
    texels[..., 0] = np.array([0.125, 0.5, 2.0, 8.0])[:, None]
    texels[..., 1] = 1.0
    texels[..., 2] = 0.0
    image.pixels.foreach_set(texels.ravel())
    return image


def test_pictures_of_the_world_are_radiance_pictures(scene, export, panorama):
    background, _ = picture_world(scene, panorama)
    background.inputs["Strength"].default_value = 0.5
    result = export()
    world = result.settings["world"]
    assert (world["mimeType"], world["strength"]) == ("image/vnd.radiance", 0.5)
    header, data = result.view(world["bufferView"]).split(b"\n\n")
    size, texels = data.split(b"\n", 1)
    assert header.startswith(b"#?RADIANCE") and size == b"-Y 4 +X 8"
    rgbe = np.frombuffer(texels, np.uint8).reshape(4, 8, 4).astype(float)
    radiance = rgbe[..., :3] * 2.0 ** (rgbe[..., 3:] - 136)
    assert np.allclose(radiance[:, 0], [[8, 1, 0], [2, 1, 0], [0.5, 1, 0], [0.125, 1, 0]], rtol=0.01, atol=0.01)


def test_linear_openexr_pictures_stay_as_they_are(scene, export, panorama, tmp_path):
    path = tmp_path / "sky.exr"
    panorama.filepath_raw, panorama.file_format = str(path), "OPEN_EXR"
    panorama.save()
    for packed in [False, True]:
        image = bpy.data.images.load(str(path), check_existing=False)
        image.colorspace_settings.name = "Linear Rec.709"
        if packed:
            image.pack()
        picture_world(scene, image)
        result = export()
        world = result.settings["world"]
        assert world["mimeType"] == "image/x-exr" and result.view(world["bufferView"]) == path.read_bytes()
    # In another colour space its numbers are not linear.
    image.colorspace_settings.name = "sRGB"
    assert export().settings["world"]["mimeType"] == "image/vnd.radiance"


def test_openexr_pictures_without_places_of_blocks_are_noticed():
    import blinn_extension.panorama as panorama_module

    header = panorama_module.EXR_MAGIC + b"\2\0\0\0" + b"compression\0compression\0\1\0\0\0\0" + b"a\0int\0\4\0\0\0\0\0\0\0"
    assert panorama_module.has_offsets(header + b"\0" + b"\x80" + bytes(7))
    for damaged in [header + bytes(9), header, header[:20], b""]:
        assert not panorama_module.has_offsets(damaged)


@pytest.mark.parametrize("kind", ["POINT", "TEXTURE"])
def test_rotations_of_the_world(scene, export, panorama, kind):
    _, mapping = picture_world(scene, panorama)
    mapping.vector_type = kind
    turn = Euler((0.3, -0.4, 1.1))
    mapping.inputs["Rotation"].default_value = turn
    x, y, z, w = export().settings["world"]["rotation"]
    to_world = Quaternion((w, x, y, z))
    # The mapping takes a direction of Blender's world to one of the picture.
    matrix = turn.to_matrix() if kind == "POINT" else turn.to_matrix().inverted()
    for direction in [Vector((1, 0, 0)), Vector((0, 1, 0)), Vector((0, 0, 1))]:
        in_picture = matrix @ direction
        gltf = lambda v: Vector((v.x, v.z, -v.y))  # noqa: E731
        assert (to_world @ gltf(in_picture) - gltf(direction)).length < 1e-5


def radiance_of(result):
    """The pixels of the world's picture, the uppermost row first."""
    header, data = result.view(result.settings["world"]["bufferView"]).split(b"\n\n")
    size, texels = data.split(b"\n", 1)
    height, width = (int(number) for number in size.split()[1::2])
    rgbe = np.frombuffer(texels, np.uint8).reshape(height, width, 4).astype(float)
    return rgbe[..., :3] * 2.0 ** (rgbe[..., 3:] - 136)


def test_worlds_of_other_nodes_become_a_picture(scene, export):
    world, background = world_of(scene)
    nodes, links = world.node_tree.nodes, world.node_tree.links
    # Each direction has a colour of its own.
    half = nodes.new("ShaderNodeVectorMath")
    half.operation = "MULTIPLY_ADD"
    half.inputs[1].default_value = half.inputs[2].default_value = (0.5, 0.5, 0.5)
    links.new(nodes.new("ShaderNodeTexCoord").outputs["Generated"], half.inputs[0])
    links.new(half.outputs[0], background.inputs["Color"])
    background.inputs["Strength"].default_value = 2.0
    result = export()
    found = result.settings["world"]
    assert found["mimeType"] == "image/vnd.radiance" and found["strength"] == 1
    pixels = radiance_of(result)
    height, width, _ = pixels.shape
    turn = Quaternion((found["rotation"][3], *found["rotation"][:3]))
    middle = height // 2
    for row, column in [(middle, width // 2), (middle, width // 4), (height // 4, 5), (height - 3, width // 3)]:
        azimuth, elevation = (column + 0.5) / width - 0.5, 0.5 - (row + 0.5) / height
        azimuth, elevation = 2.0 * math.pi * azimuth, math.pi * elevation
        # In the axes of the file, the middle is towards +X and the right side towards +Z.
        flat = math.cos(elevation)
        seen = turn @ Vector((flat * math.cos(azimuth), math.sin(elevation), flat * math.sin(azimuth)))
        blender = Vector((seen.x, -seen.z, seen.y))
        assert np.allclose(pixels[row, column], [1.0 + v for v in blender], atol=0.02), (row, column)
    names = [collection for collection in ("scenes", "worlds", "cameras") if len(getattr(bpy.data, collection)) != 1]
    assert names == []


def test_worlds_by_the_kind_of_a_ray_light_as_matte_surfaces_see_them(scene, export, capfd):
    world, background = world_of(scene)
    nodes, links = world.node_tree.nodes, world.node_tree.links
    seen, mix = nodes.new("ShaderNodeBackground"), nodes.new("ShaderNodeMixShader")
    background.inputs["Color"].default_value = (0.5, 0.25, 0.125, 1.0)
    background.inputs["Strength"].default_value = seen.inputs["Strength"].default_value = 1.0
    links.new(nodes.new("ShaderNodeLightPath").outputs["Is Camera Ray"], mix.inputs[0])
    links.new(background.outputs[0], mix.inputs[1])
    links.new(seen.outputs[0], mix.inputs[2])
    links.new(mix.outputs[0], nodes["World Output"].inputs["Surface"])
    color = export().settings["world"]["color"]
    assert np.allclose(color, [0.5, 0.25, 0.125], rtol=0.01)
    assert "the camera sees another world than the one that lights the scene: 'World'" in capfd.readouterr().out


def test_worlds_are_named_if_cycles_is_missing(scene, export, capfd, monkeypatch):
    import blinn_extension.world_picture as world_picture

    def fail(*_):
        raise world_picture.CannotRender("Cycles is disabled")

    monkeypatch.setattr(world_picture, "render_scene", fail)
    world, background = world_of(scene)
    noise = world.node_tree.nodes.new("ShaderNodeTexNoise")
    world.node_tree.links.new(noise.outputs[0], background.inputs["Color"])
    assert "world" not in export().settings
    assert "world 'World' is not written: its colour comes from 'Noise Texture'" in capfd.readouterr().out


@pytest.fixture()
def painted(scene):
    """A function that adds a plane with an image that has alpha, and returns the nodes of its material."""

    def add(alpha_mode="STRAIGHT", pixel=(200, 100, 51, 128), kind="Base Color"):
        image = bpy.data.images.new("Painted", 4, 4, alpha=True)
        image.pixels.foreach_set(np.tile(np.array(pixel, np.float32) / 255.0, 16))
        image.pack()
        image.alpha_mode = alpha_mode
        bpy.ops.mesh.primitive_plane_add()
        material = bpy.data.materials.new("Painted")
        if bpy.app.version < (5, 0, 0):
            material.use_nodes = True
        bpy.context.object.data.materials.append(material)
        nodes, links = material.node_tree.nodes, material.node_tree.links
        texture = nodes.new("ShaderNodeTexImage")
        texture.image = image
        shader = next(n for n in nodes if n.bl_idname == "ShaderNodeBsdfPrincipled")
        if kind == "Emission Color":
            shader.inputs["Emission Strength"].default_value = 1.0
        links.new(texture.outputs["Color"], shader.inputs[kind])
        return links, texture, shader

    return add


def pixel_of(result, tmp_path):
    """The first pixel of the only image."""
    (image,) = result.json["images"]
    path = tmp_path / "image.png"
    path.write_bytes(result.view(image["bufferView"]))
    loaded = bpy.data.images.load(str(path), check_existing=False)
    return [round(255.0 * value) for value in loaded.pixels[:4]]


@pytest.mark.parametrize("kind", ["Base Color", "Emission Color"])
def test_colours_are_multiplied_by_an_alpha_that_is_not_used(painted, export, tmp_path, kind):
    painted(kind=kind)
    assert pixel_of(export(), tmp_path) == [100, 50, 25, 255]


def test_images_whose_alpha_is_used_or_packed_stay(scene, painted, export, tmp_path):
    links, texture, shader = painted()
    links.new(texture.outputs["Alpha"], shader.inputs["Alpha"])
    assert pixel_of(export(), tmp_path) == [200, 100, 51, 128]
    for packed in [{"alpha_mode": "CHANNEL_PACKED"}, {"pixel": (200, 100, 51, 255)}]:
        bpy.data.objects.remove(bpy.data.objects["Plane"])
        painted(**packed)
        assert pixel_of(export(), tmp_path)[:3] == [200, 100, 51]


def test_a_checkbox_turns_the_extension_off(scene, add_light, export):
    add_light("AREA")
    add_light("SUN")
    assert scene.blinn_export and export().contains_blinn()
    scene.blinn_export = False
    assert not export().contains_blinn()


def test_lights_and_cameras_follow_the_exporter(scene, add_light, export):
    light = add_light("AREA")
    result = export(export_lights=False, export_cameras=False)
    assert not result.area_lights and "cameras" not in result.json
    light.hide_render = True
    assert export().area_lights and not export(use_renderable=True).area_lights


def test_custom_properties_stay(scene, add_light, export):
    sun = add_light("SUN")
    sun.data["mine"], scene["mine"], scene.camera["mine"] = 1, 2, 3
    result = export(export_extras=True)
    extras = [result.lights[0]["extras"], result.json["scenes"][0]["extras"]]
    extras += [node["extras"] for node in result.json["nodes"] if "camera" in node]
    assert [e["mine"] for e in extras] == [1, 2, 3] and all("blinn" in e for e in extras)


def test_the_versions_of_extension_and_program_agree():
    root = Path(__file__).resolve().parents[2]
    manifest = (root / "src/blender/blender_manifest.toml").read_text()
    workspace = (root / "Cargo.toml").read_text()
    version = re.compile(r'^version = "(.*)"$', re.M)
    assert version.search(manifest).group(1) == version.search(workspace).group(1)


def test_a_failure_never_ends_an_export(scene, export, monkeypatch):
    import blinn_extension.scene_settings as settings

    def fail(*_):
        raise RuntimeError("broken")

    monkeypatch.setattr(settings, "frames", fail)
    assert "extras" not in export().json["scenes"][0]
