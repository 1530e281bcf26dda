"""The direction of stretched highlights beside the UV map that is baked, as glTF stores it."""

from __future__ import annotations

import math

import bpy

from .bake_values import DIRECTION, Value, Values, connect, is_socket, math_node

# An attribute of faces: -1 where the map is mirrored, else 1.
SIDE = "blinn bake side"


def stretch(
    tree: bpy.types.NodeTree, strength: Value, rotation: Value, tangent: bpy.types.NodeSocket, map_name: str
) -> Values:
    """Returns the strength of an anisotropy, and its direction unless it is 0.

    A tangent is turned around the normal by a share of a full turn. Without one, Cycles has circles around the z axis.
    """
    if not is_socket(strength) and strength == 0.0:
        return {"Anisotropic": 0.0}
    normal = tree.nodes.new("ShaderNodeNewGeometry").outputs["Normal"]
    if tangent.is_linked:
        along = tangent.links[0].from_socket
    else:
        circles = tree.nodes.new("ShaderNodeTangent")
        circles.direction_type, circles.axis = "RADIAL", "Z"
        along = circles.outputs[0]
    turned = tree.nodes.new("ShaderNodeVectorRotate")
    turned.rotation_type = "AXIS_ANGLE"
    for value, name in ((along, "Vector"), (normal, "Axis"), (angle(tree, rotation), "Angle")):
        connect(tree, value, turned.inputs[name])
    right = tree.nodes.new("ShaderNodeTangent")
    right.direction_type, right.uv_map = "UV_MAP", map_name
    up = vector_node(tree, "CROSS_PRODUCT", normal, right.outputs[0])
    side = tree.nodes.new("ShaderNodeAttribute")
    side.attribute_name = SIDE
    cosine = vector_node(tree, "DOT_PRODUCT", turned.outputs[0], right.outputs[0])
    # The output of numbers, whose name is not the same in all versions.
    number = side.outputs[2]
    sine = math_node(tree, "MULTIPLY", vector_node(tree, "DOT_PRODUCT", turned.outputs[0], up), number)
    halves = [math_node(tree, "MULTIPLY_ADD", value, 0.5, 0.5) for value in (cosine, sine)]
    return {"Anisotropic": strength, **dict(zip(DIRECTION, halves))}


def angle(tree: bpy.types.NodeTree, rotation: Value) -> Value:
    """Returns an angle in radians."""
    return math_node(tree, "MULTIPLY", rotation, 2.0 * math.pi)


def glossy_strength(tree: bpy.types.NodeTree, anisotropy: Value) -> Value:
    """Returns the strength that gives a Principled BSDF the widths of a Glossy BSDF: 0.9 s = 1 - (1 - a)²."""
    rest = math_node(tree, "SUBTRACT", 1.0, anisotropy)
    square = math_node(tree, "MULTIPLY", rest, rest)
    return math_node(tree, "MULTIPLY_ADD", square, -1.0 / 0.9, 1.0 / 0.9)


def vector_node(tree: bpy.types.NodeTree, operation: str, a: Value, b: Value) -> bpy.types.NodeSocket:
    """Returns the result of an operation on two vectors."""
    node = tree.nodes.new("ShaderNodeVectorMath")
    node.operation = operation
    connect(tree, a, node.inputs[0])
    connect(tree, b, node.inputs[1])
    return node.outputs["Value" if operation == "DOT_PRODUCT" else "Vector"]
