"""Lights of files: what `area_light` and `punctual_light` write, the other way round."""

from __future__ import annotations

import math
from typing import Any

import bpy

from .area_light import LUMENS_PER_WATT
from .import_values import members, number, numbers, set_number
from .scene_settings import LIGHT_UNITS

# Of the extension.
DEFAULT_INTENSITY = 1000.0
DEFAULT_SIZE = 1.0


def factor_of(scene: dict[str, Any], lighting_mode: str) -> float:
    """Returns the units of the file in a watt. The file's own unit wins over the importer's option."""
    modes = {unit: mode for mode, unit in LIGHT_UNITS.items()}
    unit = scene.get("lightUnits")
    mode = modes.get(unit, lighting_mode) if isinstance(unit, str) else lighting_mode
    return LUMENS_PER_WATT if mode == "SPEC" else 1.0


def read_area(item: bpy.types.Object, json: dict[str, Any], factor: float) -> None:
    """Gives an area light its shape, colour and power. The object has its final transform."""
    light = item.data
    is_disk = json.get("type") == "disk"
    of_aspect = members(members(json, "extras"), "blinn") if is_disk else members(json, "rect")
    aspect = number(of_aspect, "aspect", 1e-6, 1e6) or 1.0
    size = number(json, "size", 0.0) if "size" in json else DEFAULT_SIZE
    if size is None:
        return
    # glTF scales lights by the largest component, and Blender their axes.
    scale = [float(f"{column.length:.6g}") for column in item.matrix_world.to_3x3().col]
    height = size * max(scale)
    if is_disk:
        # An ellipse of the same area.
        height /= math.sqrt(aspect)
    width = height * aspect
    area = width * height * (math.pi / 4.0 if is_disk else 1.0)
    if scale[0] > 0.0 and scale[1] > 0.0:
        light.size, light.size_y = width / scale[0], height / scale[1]
    is_round = math.isclose(light.size, light.size_y, rel_tol=1e-5)
    shapes = ("DISK", "ELLIPSE") if is_disk else ("SQUARE", "RECTANGLE")
    light.shape = shapes[0] if is_round else shapes[1]
    light.color = numbers(json, "color", 3) or (1.0, 1.0, 1.0)
    intensity = number(json, "intensity", 0.0) if "intensity" in json else DEFAULT_INTENSITY
    light.energy = (intensity or 0.0) * math.pi * area / factor


def read_punctual(light: bpy.types.Light, values: dict[str, Any]) -> None:
    """Gives a light its radius or angle, and a sun its strength and colour."""
    if light.type != "SUN":
        set_number(light, "shadow_soft_size", number(values, "radius", 0.0))
        return
    set_number(light, "angle", number(values, "angle", 0.0, math.pi))
    set_number(light, "energy", number(values, "strength"))
    color = numbers(values, "color", 3)
    if color is not None:
        # Colours of Blender's lights are at most 1.
        peak = max(1.0, *color)
        light.color = [channel / peak for channel in color]
        light.energy *= peak
