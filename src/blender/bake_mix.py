"""Mixes of surfaces, value by value."""

from __future__ import annotations

import bpy

from .bake_values import COLORS, DIRECTION, NORMAL_MIX, NORMALS, VALUES
from .bake_values import Value, Values, color_mix, connect, is_socket, math_node

# Rec. 709.
LUMINANCE = (0.2126, 0.7152, 0.0722)
# Specular reflectance of surfaces that are no metal, at the specular level 1.
DIELECTRIC = 0.08


def mix_of(tree: bpy.types.NodeTree, first: Values, second: Values, factor: Value) -> Values:
    """Returns the values of a mix.

    A Mix Shader adds light. So a value counts by the light that it concerns: metallic and normals by the base colour,
    roughness by the specular reflectance.
    """
    factors = {}
    by_color = factor
    if "Base Color" in first and "Base Color" in second:
        by_color = skewed(tree, factor, *(luminance(tree, values) for values in (first, second)))
        by_gloss = skewed(tree, factor, *(reflectance(tree, values) for values in (first, second)))
        factors = {"Metallic": by_color, **dict.fromkeys(NORMALS, by_color)}
        factors |= dict.fromkeys(("Roughness", "Anisotropic", *DIRECTION), by_gloss)
    present = first.keys() | second.keys()
    found = {
        name: mixed(tree, name, first, second, factors.get(name, factor))
        for name in (*COLORS, *VALUES, *NORMALS)
        if name in present
    }
    if "Normal" in first and "Normal" in second and first["Normal"] != second["Normal"]:
        found[NORMAL_MIX] = by_color
    return found


def luminance(tree: bpy.types.NodeTree, values: Values) -> Value:
    """Returns the luminance of a base colour."""
    color = values["Base Color"]
    if not is_socket(color):
        return sum(weight * channel for weight, channel in zip(LUMINANCE, color))
    node = tree.nodes.new("ShaderNodeRGBToBW")
    tree.links.new(color, node.inputs[0])
    return node.outputs[0]


def reflectance(tree: bpy.types.NodeTree, values: Values) -> Value:
    """Returns the specular reflectance of a surface that is seen from the front."""
    metallic = values.get("Metallic", 0.0)
    dielectric = math_node(tree, "MULTIPLY", DIELECTRIC, values.get("Specular IOR Level", 0.5))
    excess = math_node(tree, "SUBTRACT", luminance(tree, values), dielectric)
    return math_node(tree, "MULTIPLY_ADD", metallic, excess, dielectric)


def skewed(tree: bpy.types.NodeTree, factor: Value, first: Value, second: Value) -> Value:
    """Returns the factor of a mix of which one part counts more."""
    if not is_socket(first) and first == second:
        return factor
    share = math_node(tree, "MULTIPLY", factor, second)
    rest = math_node(tree, "SUBTRACT", 1.0, factor)
    return math_node(tree, "DIVIDE", share, math_node(tree, "MULTIPLY_ADD", rest, first, share))


def mixed(tree: bpy.types.NodeTree, name: str, first: Values, second: Values, factor: Value) -> Value:
    """Returns the mix of two values. A shader without the value leaves the other's."""
    if name not in first or name not in second:
        return first[name] if name in first else second[name]
    a, b = first[name], second[name]
    if a == b:
        return a
    if name in NORMALS:
        node = tree.nodes.new("ShaderNodeMixShader")
        for value, socket in ((a, node.inputs[1]), (b, node.inputs[2])):
            value = tree.nodes.new("ShaderNodeBsdfDiffuse").outputs[0] if value is None else value
            tree.links.new(value, socket)
        connect(tree, factor, node.inputs[0])
        return node.outputs[0]
    return color_mix(tree, a, b, factor)
