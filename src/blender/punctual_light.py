"""Radii and angles of point lights, spots and suns, and the true strength of suns, as ``extras.blinn`` of the light."""

from __future__ import annotations

from typing import Any

import bpy

from . import light_emission
from .gltf_types import set_extras

EXTENSION = "KHR_lights_punctual"


def write(node: Any, light_object: bpy.types.Object, color: tuple[float, ...]) -> None:
    """Adds to the light of a node. ``color`` is the light's own colour, without temperature."""
    extension = (node.extensions or {}).get(EXTENSION)
    if extension is not None:
        set_extras(extension.extension["light"].extension, extras(light_object.data, color))


def extras(light: bpy.types.Light, color: tuple[float, ...]) -> dict[str, Any]:
    """Returns the radius in metres; of a sun its angle in radians, strength in W/m² and linear colour."""
    if light.type != "SUN":
        return {"radius": light.shadow_soft_size}
    emission = light_emission.product(color, light_emission.tint(light), light_emission.node_emission(light))
    return {"angle": light.angle, "strength": light_emission.strength(light), "color": emission}
