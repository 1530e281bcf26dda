"""Area lights as EXT_lights_area, the draft of https://github.com/KhronosGroup/glTF/pull/2525."""

from __future__ import annotations

import math
from typing import Any

import bpy

from . import light_emission
from .gltf_types import ChildOfRootExtension, Extension, set_extras

EXTENSION = "EXT_lights_area"
# Blender's exporter has the same factor from watts to lumens.
LUMENS_PER_WATT = 683.0
# Radians. Blender's default is 180 degrees in single precision.
FULL_SPREAD = math.radians(179.9)


def write(node: Any, light_object: bpy.types.Object, color: tuple[float, ...], settings: dict[str, Any]) -> None:
    """Adds the light of an object to its node. ``color`` is the light's own colour, without temperature."""
    json = description(light_object, color, settings["gltf_lighting_mode"])
    if json is None:
        settings["log"].warning(f"blinn: area light '{light_object.name}' has no area; it is not written")
        return
    if getattr(light_object.data, "spread", math.pi) < FULL_SPREAD:
        text = f"blinn: area light '{light_object.name}' shines to all sides: its spread is not written"
        settings["log"].warning(text)
    light = ChildOfRootExtension(path=["lights"], name=EXTENSION, extension=json, required=False)
    node.extensions = {**(node.extensions or {}), EXTENSION: Extension(EXTENSION, {"light": light}, False)}


def description(light_object: bpy.types.Object, color: tuple[float, ...], lighting_mode: str) -> dict[str, Any] | None:
    """Returns the light in the extension's terms; None without area.

    Its size is in metres before the node's scale, of which glTF takes the largest component. Its intensity is its
    radiance in nits, or in W/(m² sr) if the exporter does not convert to lumens.
    """
    light = light_object.data
    has_height = light.shape in {"RECTANGLE", "ELLIPSE"}
    is_disk = light.shape in {"DISK", "ELLIPSE"}
    # Matrices are in single precision: 0.9999999 means 1.
    scale = [float(f"{column.length:.6g}") for column in light_object.matrix_world.to_3x3().col]
    width = light.size * scale[0]
    height = (light.size_y if has_height else light.size) * scale[1]
    area = width * height * (math.pi / 4.0 if is_disk else 1.0)
    if not area > 0.0:
        return None
    power = light_emission.strength(light)
    if not getattr(light, "normalize", True):
        power *= area
    emission = light_emission.product(color, light_emission.tint(light), light_emission.node_emission(light))
    # Colours of glTF are at most 1.
    peak = max(1.0, *emission)
    factor = LUMENS_PER_WATT if lighting_mode == "SPEC" else 1.0
    largest = max(scale)
    json: dict[str, Any] = {
        "name": light.name,
        "type": "disk" if is_disk else "rect",
        "color": [channel / peak for channel in emission],
        "intensity": factor * peak * power / (math.pi * area),
        "size": height / largest,
    }
    if is_disk and not math.isclose(width, height, rel_tol=1e-6):
        # A disk of the extension is round: other readers show one of the same area.
        json["size"] = math.sqrt(width * height) / largest
        set_extras(json, {"aspect": width / height})
    elif not is_disk:
        json["rect"] = {"aspect": width / height}
    return json
