"""Radii and angles of point lights, spots and suns, and the true strength of suns, as ``extras.blinn`` of the light."""

from __future__ import annotations

import math
from typing import Any

import bpy

from . import light_emission
from .export_options import is_driven
from .gltf_types import set_extras

EXTENSION = "KHR_lights_punctual"
# Intensity of 1 W, by the exporter's lighting mode.
UNITS = {"SPEC": 683.0 / (4.0 * math.pi), "COMPAT": 1.0 / (4.0 * math.pi), "RAW": 1.0}


def write(node: Any, light_object: bpy.types.Object, color: tuple[float, ...], settings: dict[str, Any]) -> None:
    """Adds to the light of a node. ``color`` is the light's own colour, without temperature."""
    extension = (node.extensions or {}).get(EXTENSION)
    if extension is None:
        return
    json, light = extension.extension["light"].extension, light_object.data
    set_extras(json, extras(light, color))
    has_nodes = light.type != "SUN" and light_emission.emission_node(light) is not None
    is_static = not any(is_driven(owner) for owner in (light, light.node_tree) if owner is not None)
    if has_nodes and is_static and getattr(light, "normalize", True):
        # The exporter leaves the strength of the nodes out.
        emission = light_emission.product(color, light_emission.tint(light), light_emission.node_emission(light))
        peak = max(1.0, *emission)
        json["color"] = [channel / peak for channel in emission]
        json["intensity"] = peak * light_emission.strength(light) * UNITS[settings["gltf_lighting_mode"]]


def extras(light: bpy.types.Light, color: tuple[float, ...]) -> dict[str, Any]:
    """Returns the radius in metres; of a sun its angle in radians, strength in W/m² and linear colour."""
    if light.type != "SUN":
        return {"radius": light.shadow_soft_size}
    emission = light_emission.product(color, light_emission.tint(light), light_emission.node_emission(light))
    return {"angle": light.angle, "strength": light_emission.strength(light), "color": emission}
