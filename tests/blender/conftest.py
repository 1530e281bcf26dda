"""Exports with the extension, by a Python that has bpy. Without it, all tests here are skipped."""

from __future__ import annotations

import json
import struct
import sys
from pathlib import Path
from typing import Any, Callable

import pytest

try:
    import bpy
    import numpy
except ImportError:
    bpy = numpy = None  # The modules with tests skip themselves.

ROOT = Path(__file__).resolve().parents[2]
MODULE = "blinn_extension"


@pytest.fixture(scope="session", autouse=True)
def extension(tmp_path_factory: pytest.TempPathFactory) -> None:
    """Enables the extension as Blender does, under a name of its own."""
    import addon_utils

    folder = tmp_path_factory.mktemp("addons")
    (folder / MODULE).symlink_to(ROOT / "src/blender", target_is_directory=True)
    sys.path.insert(0, str(folder))
    sys.dont_write_bytecode = True
    assert addon_utils.enable(MODULE, default_set=True) is not None


@pytest.fixture()
def scene() -> Any:
    """An empty scene with a camera."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    import addon_utils

    addon_utils.enable(MODULE, default_set=True)
    scene = bpy.context.scene
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    scene.collection.objects.link(camera)
    scene.camera = camera
    return scene


@pytest.fixture()
def small_picture(scene: Any) -> Any:
    """The scene, which blinn renders in 40 by 30 pixels at few samples, without a background."""
    scene.render.engine = "BLINN"
    scene.render.resolution_x, scene.render.resolution_y = 40, 30
    scene.render.film_transparent = True
    scene.blinn.samples, scene.blinn.indirect = 4, 0
    return scene


@pytest.fixture()
def cycles_scene(scene: Any) -> Any:
    """The scene, which Cycles renders in 48 by 36 pixels for the standard view."""
    scene.render.engine = "CYCLES"
    scene.cycles.samples, scene.cycles.use_denoising, scene.cycles.use_adaptive_sampling = 32, True, False
    scene.cycles.caustics_reflective = scene.cycles.caustics_refractive = False
    scene.render.resolution_x, scene.render.resolution_y = 48, 36
    scene.render.threads_mode, scene.render.threads = "FIXED", 2
    scene.render.dither_intensity = 0.0
    scene.view_settings.view_transform = "Standard"
    return scene


@pytest.fixture()
def add_light(scene: Any) -> Callable[..., Any]:
    """A function that adds a light with attributes, and returns its object."""

    def add(kind: str, **attributes: Any) -> Any:
        light = bpy.data.lights.new(kind.title(), kind)
        for name, value in attributes.items():
            setattr(light, name, value)
        light_object = bpy.data.objects.new(kind.title(), light)
        scene.collection.objects.link(light_object)
        bpy.context.view_layer.update()
        return light_object

    return add


class Export:
    """A file that was exported."""

    def __init__(self, path: Path) -> None:
        data = path.read_bytes()
        length = struct.unpack("<I", data[12:16])[0]
        self.json = json.loads(data[20 : 20 + length])
        self.binary = data[28 + length :]

    @property
    def settings(self) -> dict[str, Any]:
        return self.json["scenes"][0]["extras"]["blinn"]

    @property
    def area_lights(self) -> list[dict[str, Any]]:
        return self.json.get("extensions", {}).get("EXT_lights_area", {}).get("lights", [])

    @property
    def lights(self) -> list[dict[str, Any]]:
        return self.json["extensions"]["KHR_lights_punctual"]["lights"]

    def view(self, index: int) -> bytes:
        view = self.json["bufferViews"][index]
        start = view.get("byteOffset", 0)
        return self.binary[start : start + view["byteLength"]]

    def contains_blinn(self) -> bool:
        return "blinn" in json.dumps(self.json) or bool(self.area_lights)


@pytest.fixture()
def export(tmp_path: Path) -> Callable[..., Export]:
    """A function that exports the scene as a GLB."""

    def run(**options: Any) -> Export:
        bpy.context.view_layer.update()
        path = tmp_path / "scene.glb"
        options = {"export_lights": True, "export_cameras": True, **options}
        assert bpy.ops.export_scene.gltf(filepath=str(path), export_format="GLB", **options) == {"FINISHED"}
        return Export(path)

    return run


@pytest.fixture()
def cycles(tmp_path: Path) -> Callable[[], Any]:
    """A function that renders by Cycles, and returns the bytes of the picture, the uppermost row first."""

    def run() -> Any:
        scene = bpy.context.scene
        settings = scene.render.image_settings
        settings.file_format, settings.color_mode = "PNG", "RGBA"
        scene.render.filepath = str(tmp_path / "cycles.png")
        assert bpy.ops.render.render(write_still=True) == {"FINISHED"}
        image = bpy.data.images.load(scene.render.filepath, check_existing=False)
        width, height = image.size
        texels = numpy.empty(width * height * 4, numpy.float32)
        image.pixels.foreach_get(texels)
        bpy.data.images.remove(image)
        return over_black(numpy.rint(texels.reshape(height, width, 4)[::-1] * 255.0))

    return run


def over_black(rgba: Any) -> Any:
    """The picture over black, with its alpha."""
    return numpy.concatenate([rgba[..., :3] * (rgba[..., 3:] / 255.0), rgba[..., 3:]], axis=-1)


@pytest.fixture()
def exported(export: Callable[..., Export], tmp_path: Path) -> Callable[[], Any]:
    """A function that exports the scene, and returns the picture that blinn makes of the file alone."""

    def run() -> Any:
        blinn = pytest.importorskip("blinn")
        export(export_apply=True)
        return over_black(blinn.load(tmp_path / "scene.glb").render(samples=16).rgba.astype(float))

    return run
