"""Emission of a light in Blender: strength, colour and the light's nodes."""

from __future__ import annotations

import bpy

from .engine_settings import ENGINE
from .export_options import is_driven
from .node_links import linked_node

WHITE = (1.0, 1.0, 1.0)


def strength(light: bpy.types.Light) -> float:
    """Returns the strength with its exposure: W/m² of a sun, else W."""
    return light.energy * 2.0 ** getattr(light, "exposure", 0.0)


def tint(light: bpy.types.Light) -> tuple[float, float, float]:
    """Returns the colour of the light's temperature, linear; white without one."""
    if not getattr(light, "use_temperature", False):
        return WHITE
    return tuple(light.temperature_color)


def node_emission(light: bpy.types.Light) -> tuple[float, float, float]:
    """Returns the factor of the light's nodes, which Cycles evaluates, and so blinn. Linked values count as 1."""
    if bpy.context.scene.render.engine not in {"CYCLES", ENGINE} or not light.use_nodes or light.node_tree is None:
        return WHITE
    output = light.node_tree.get_output_node("CYCLES")
    emission = output and linked_node(output.inputs["Surface"])
    if emission is None or emission.bl_idname != "ShaderNodeEmission":
        return WHITE
    color, factor = emission.inputs["Color"], emission.inputs["Strength"]
    power = 1.0 if factor.is_linked else factor.default_value
    return tuple(power * (1.0 if color.is_linked else channel) for channel in color.default_value[:3])


def loses_keys(light: bpy.types.Light) -> bool:
    """Returns True for a light with animation that is not exported."""
    # From 5.1 on, lights have nodes. For engines that evaluate them, the exporter writes keys of the nodes alone.
    has_nodes = bpy.app.version >= (5, 1, 0) and bpy.context.scene.render.engine != "BLENDER_EEVEE"
    is_lost = light.type == "AREA" or light.type == "SUN" and has_nodes
    return is_lost and (is_driven(light) or is_driven(light.node_tree))


def product(*colors: tuple[float, ...]) -> list[float]:
    """Returns the product of colours by channel."""
    result = [1.0, 1.0, 1.0]
    for color in colors:
        result = [a * b for a, b in zip(result, color)]
    return result
