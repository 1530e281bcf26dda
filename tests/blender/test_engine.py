"""The render engine, with the Python module of blinn."""

from __future__ import annotations

import json

import pytest

bpy = pytest.importorskip("bpy")
np = pytest.importorskip("numpy")
blinn = pytest.importorskip("blinn")

SIZE = (40, 30)


@pytest.fixture()
def cubes(small_picture, add_light):
    """A scene of two cubes before an empty background, rendered by blinn."""
    scene = small_picture
    scene.camera.location = (0.0, 0.0, 12.0)
    for i, name in enumerate(["Left", "Right"]):
        bpy.ops.mesh.primitive_cube_add(location=(4.0 * i - 2.0, 0.0, 0.0))
        cube = bpy.context.object
        cube.name, cube.pass_index = name, 10 + i
        cube.data.materials.append(bpy.data.materials.new(f"M{name}"))
        cube.data.materials[0].pass_index = 20 + i
    add_light("SUN", energy=3.0)
    return scene


@pytest.fixture()
def render(tmp_path):
    """A function that renders, and returns the channels of the OpenEXR file by name, the uppermost row first."""

    def run() -> dict[str, np.ndarray]:
        OpenEXR = pytest.importorskip("OpenEXR")
        scene = bpy.context.scene
        settings = scene.render.image_settings
        if hasattr(settings, "media_type"):
            settings.media_type = "MULTI_LAYER_IMAGE"
        settings.file_format, settings.color_depth = "OPEN_EXR_MULTILAYER", "32"
        scene.render.filepath = str(tmp_path / "picture.exr")
        assert bpy.ops.render.render(write_still=True) == {"FINISHED"}
        channels = {}
        with OpenEXR.File(scene.render.filepath, separate_channels=True) as file:
            for part in file.parts:
                for name, channel in part.channels.items():
                    channels[name.removeprefix("ViewLayer.")] = np.array(channel.pixels)
                channels["header"] = {**channels.get("header", {}), **part.header}
        return channels

    return run


def test_the_engine_returns_the_linear_light_of_blinn(cubes, render, tmp_path):
    channels = render()
    combined = np.stack([channels[f"Combined.{c}"] for c in "RGBA"], axis=-1)
    path = tmp_path / "scene.glb"
    bpy.ops.export_scene.gltf(
        filepath=str(path), export_format="GLB", export_lights=True, export_cameras=True, export_apply=True
    )
    expected = blinn.load(path).render(samples=4).linear
    assert combined.shape == expected.shape == (SIZE[1], SIZE[0], 4)
    assert np.array_equal(combined, expected)
    assert 0.0 < combined[..., 3].mean() < 1.0 and combined[..., :3].max() > 0.0
    # Exposure and view transform are Blender's own, and not applied twice.
    cubes.view_settings.exposure = 3.0
    assert np.array_equal(render()["Combined.R"], channels["Combined.R"])


def test_passes_are_in_the_terms_of_blender(cubes, render):
    layer = bpy.context.view_layer
    for name in ["z", "normal", "position", "object_index", "material_index"]:
        setattr(layer, f"use_pass_{name}", True)
    channels = render()
    is_old = bpy.app.version < (5, 0, 0)
    row, left = SIZE[1] // 2, 12
    at = lambda name: float(channels[name][row, left])  # noqa: E731
    assert at("Depth.Z") == pytest.approx(11.0, abs=1e-4) and channels["Depth.Z"][0, 0] == np.float32(1e10)
    assert [at(f"Normal.{c}") for c in "XYZ"] == pytest.approx([0.0, 0.0, 1.0], abs=1e-6)
    x, y, z = (at(f"Position.{c}") for c in "XYZ")
    assert -3.0 < x < -1.0 and -1.0 < y < 1.0 and z == pytest.approx(1.0, abs=1e-5)
    assert channels["Position.Y"][row - 3, left] > channels["Position.Y"][row + 3, left]
    indices = [
        channels[f"{name}.X"] for name in (["IndexOB", "IndexMA"] if is_old else ["Object Index", "Material Index"])
    ]
    assert [float(i[row, left]) for i in indices] == [10.0, 20.0]
    assert [sorted(np.unique(i)) for i in indices] == [[0.0, 10.0, 11.0], [0.0, 20.0, 21.0]]


def test_cryptomattes_have_a_manifest(cubes, render):
    layer = bpy.context.view_layer
    layer.use_pass_cryptomatte_object, layer.use_pass_cryptomatte_material = True, True
    layer.pass_cryptomatte_depth = 4
    channels = render()
    names = [name for name in channels if name.startswith("CryptoObject")]
    assert len(names) == 8
    manifests = {
        k: v for k, v in channels["header"].items() if k.startswith("cryptomatte/") and k.endswith("/manifest")
    }
    ids = [json.loads(text) for text in manifests.values()]
    assert len(ids) == 2
    objects = next(manifest for manifest in ids if "Left" in manifest)
    number = lambda name: np.uint32(int(objects[name], 16)).view(np.float32)  # noqa: E731
    row, left = SIZE[1] // 2, 12
    first = lambda c: next(v for k, v in channels.items() if k.lower() == f"cryptoobject00.{c}")  # noqa: E731
    assert first("r")[row, left] == number("Left") and first("g")[row, left] == 1.0
    assert first("r")[row, SIZE[0] - left] == number("Right")
    # Samples of coverage at edges add up with those of the background.
    coverage = first("g") + first("a")
    assert (coverage <= 1.0 + 1e-6).all() and ((first("g") > 0.0) & (first("g") < 1.0)).any()


@pytest.mark.parametrize("is_cropped", [False, True])
def test_percentages_and_regions(cubes, render, is_cropped):
    whole = render()["Combined.A"]
    settings = cubes.render
    settings.use_border, settings.use_crop_to_border = True, is_cropped
    settings.border_min_x, settings.border_max_x = 0.25, 0.6
    settings.border_min_y, settings.border_max_y = 0.4, 1.0
    part = render()["Combined.A"]
    rows, columns = slice(0, 18), slice(10, 24)
    if is_cropped:
        assert np.array_equal(part, whole[rows, columns])
    else:
        outside = part.copy()
        outside[rows, columns] = 0.0
        assert np.array_equal(part[rows, columns], whole[rows, columns]) and not outside.any()
    settings.use_border, settings.resolution_percentage = False, 55
    assert render()["Combined.A"].shape == (16, 22)


def test_frames_are_rendered_as_they_are(cubes, render):
    cube = bpy.data.objects["Left"]
    for frame, y in [(1, 0.0), (3, 20.0)]:
        cube.location.y = y
        cube.keyframe_insert("location", frame=frame)
    covered = []
    for frame in [1, 3]:
        cubes.frame_set(frame)
        covered.append(render()["Combined.A"].sum())
    assert covered[1] == pytest.approx(covered[0] / 2.0, rel=0.1)


def test_changes_that_are_not_saved_count_and_the_scene_stays(cubes, render):
    bpy.data.objects["Left"].hide_render = True
    bpy.data.objects["Right"].modifiers.new("S", "SUBSURF").levels = 0
    before = [(o.name, o.hide_viewport, o.hide_get()) for o in cubes.objects]
    covered = render()["Combined.A"]
    assert not covered[:, : SIZE[0] // 2].any() and covered.any()
    assert [(o.name, o.hide_viewport, o.hide_get()) for o in cubes.objects] == before
    assert bpy.data.objects["Right"].modifiers["S"].levels == 0


def test_settings_are_exported(cubes, export):
    cubes.blinn.indirect, cubes.blinn.caustics = 3, True
    settings = export().settings
    assert (settings["indirect"], settings["caustics"]) == (3, True)


def test_errors_end_the_render(cubes, tmp_path):
    cubes.blinn.limit_memory, cubes.blinn.memory = True, 64
    bpy.ops.mesh.primitive_grid_add(x_subdivisions=1000, y_subdivisions=1000)
    cubes.render.filepath = str(tmp_path / "picture")
    with pytest.raises(RuntimeError, match="memory"):
        bpy.ops.render.render(write_still=True)


@pytest.fixture()
def written(monkeypatch):
    """A list that gets an entry for each picture that the engine gives to Blender."""
    import blinn_extension.engine as engine

    pictures = []
    monkeypatch.setattr(engine.BlinnRenderEngine, "write", lambda self, picture, *_: pictures.append(picture))
    return pictures


# Blender reports exceptions of an engine, and goes on: what happened shows afterwards only.
@pytest.mark.parametrize("stage", ["export", "rendering", None])
def test_a_cancelled_render_ends(cubes, monkeypatch, written, stage):
    import blinn_extension.engine as engine

    exports = []
    convert = engine.engine_export.export

    def export(*arguments):
        exports.append(convert(*arguments))
        return exports[-1]

    monkeypatch.setattr(engine.engine_export, "export", export)
    is_cancelled = {"export": lambda _: True, "rendering": lambda _: len(exports) == 1, None: lambda _: False}[stage]
    monkeypatch.setattr(engine.BlinnRenderEngine, "is_cancelled", is_cancelled)
    bpy.ops.render.render()
    assert [exported is None for exported in exports] == [stage == "export"]
    assert len(written) == (1 if stage is None else 0)
