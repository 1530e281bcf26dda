"""Emission of a light in Blender: strength, colour and the light's nodes."""

from __future__ import annotations

from typing import Any

import bpy

from .engine_settings import ENGINE
from .export_options import is_driven
from .material_loss import PROCEDURES, upstream
from .node_links import linked_node
from .surface_nodes import Reader
from .surface_values import CannotHold, is_constant

WHITE = (1.0, 1.0, 1.0)
# Nodes with other values in each direction.
VARYING = {"ShaderNodeTexIES", "ShaderNodeTexImage"}


def strength(light: bpy.types.Light) -> float:
    """Returns the strength with its exposure: W/m² of a sun, else W."""
    return light.energy * 2.0 ** getattr(light, "exposure", 0.0)


def tint(light: bpy.types.Light) -> tuple[float, float, float]:
    """Returns the colour of the light's temperature, linear; white without one."""
    if not getattr(light, "use_temperature", False):
        return WHITE
    return tuple(light.temperature_color)


def emission_node(light: bpy.types.Light) -> bpy.types.Node | None:
    """Returns the Emission of the light's nodes, which Cycles evaluates, and so blinn; None without one."""
    if bpy.context.scene.render.engine not in {"CYCLES", ENGINE} or not light.use_nodes or light.node_tree is None:
        return None
    output = light.node_tree.get_output_node("CYCLES")
    emission = output and linked_node(output.inputs["Surface"])
    return emission if emission is not None and emission.bl_idname == "ShaderNodeEmission" else None


def node_emission(light: bpy.types.Light) -> tuple[float, float, float]:
    """Returns the factor of the light's nodes. What is not constant counts as 1."""
    emission = emission_node(light)
    if emission is None:
        return WHITE
    color, power = (constant(emission.inputs[name]) for name in ("Color", "Strength"))
    return tuple(product(*(value if isinstance(value, tuple) else (value,) * 3 for value in (color, power))))


def constant(socket: bpy.types.NodeSocket) -> Any:
    """Returns the number or the colour of an input; 1 for one that is not constant."""
    try:
        value = Reader(socket.id_data).value(socket)
    except CannotHold:
        return 1.0
    if is_constant(value):
        return value
    node = value.node
    if node.bl_idname == "ShaderNodeBlackbody":
        return blackbody(constant(node.inputs[0]))
    if node.bl_idname == "ShaderNodeLightFalloff":
        return constant(node.inputs["Strength"])
    return 1.0


def blackbody(temperature: float) -> tuple[float, ...]:
    """Returns the colour of a black body; white in versions of Blender whose lights have no temperature."""
    light = bpy.data.lights.new("blinn", "POINT")
    try:
        if not hasattr(light, "temperature_color"):
            return WHITE
        light.temperature = temperature
        return tuple(light.temperature_color)
    finally:
        bpy.data.lights.remove(light)


def lost_nodes(light: bpy.types.Light) -> list[str]:
    """Returns the names of nodes that are not written, such as IES textures."""
    emission = emission_node(light)
    if emission is None:
        return []
    lost = [node for node in upstream(emission) if node.bl_idname in PROCEDURES | VARYING]
    kept = {"ShaderNodeBlackbody", "ShaderNodeLightPath"} if hasattr(light, "temperature_color") else set()
    is_falloff = lambda node: node.bl_idname == "ShaderNodeLightFalloff"  # noqa: E731
    bent = [n for n in upstream(emission) if is_falloff(n) and any(n.outputs[i].is_linked for i in (1, 2))]
    return list(dict.fromkeys(f"'{node.bl_label}'" for node in [*lost, *bent] if node.bl_idname not in kept))


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
