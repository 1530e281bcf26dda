"""The values of a surface in the terms of a Principled BSDF: each is a number, a colour, or a socket of its nodes."""

from __future__ import annotations

from typing import Any

import bpy

# Inputs of the shader, or the products of two: a sheen's tint and weight are one colour in glTF.
COLORS = ("Base Color", "Emission", "Sheen Color", "Specular Tint")
# The direction of stretched highlights beside the map that is baked: cosine and sine of the angle, from 0 to 1.
DIRECTION = ("Anisotropic Cosine", "Anisotropic Sine")
# How much the second of two different normals counts, which is not written.
NORMAL_MIX = "Normal Mix"
# In the order in which three share a picture.
VALUES = (
    *("Alpha", "Metallic", "Roughness"),
    *("Transmission Weight", "Coat Weight", "Coat Roughness"),
    *("Sheen Roughness", "Specular IOR Level", NORMAL_MIX),
    *("Anisotropic", *DIRECTION),
)
# Those that are an input of the same name.
PLAIN_VALUES = tuple(name for name in VALUES if name not in {"Anisotropic", *DIRECTION, NORMAL_MIX})
NORMALS = ("Normal", "Coat Normal")

BLACK = (0.0, 0.0, 0.0)

# As nodes compute them.
OPERATIONS = {
    "SUBTRACT": lambda a, b: a - b,
    "MULTIPLY": lambda a, b: a * b,
    "MULTIPLY_ADD": lambda a, b, c: a * b + c,
    "DIVIDE": lambda a, b: a / b if b != 0.0 else 0.0,
}

# A number, a colour, an output socket, or None for a normal that nothing changes.
Value = Any
Values = dict[str, Value]


class CannotBake(Exception):
    """A material or an object that cannot be baked."""


def is_socket(value: Value) -> bool:
    """Returns True for a value that is computed by nodes."""
    return isinstance(value, bpy.types.NodeSocket)


def source(socket: bpy.types.NodeSocket) -> Value:
    """Returns what an input is linked to, or its number or colour."""
    if socket.is_linked:
        return socket.links[0].from_socket
    return tuple(socket.default_value[:3]) if socket.type == "RGBA" else socket.default_value


def connect(tree: bpy.types.NodeTree, value: Value, socket: bpy.types.NodeSocket) -> None:
    """Gives an input a value."""
    if is_socket(value):
        tree.links.new(value, socket)
    elif socket.type == "RGBA":
        color = value if isinstance(value, tuple) else (value,) * 3
        socket.default_value = (*color, 1.0)
    else:
        socket.default_value = value


def product(tree: bpy.types.NodeTree, tint: Value, factor: Value) -> Value:
    """Returns a colour times a number or a colour."""
    if factor == 0.0 or tint == BLACK:
        return BLACK
    if not is_socket(factor) and not is_socket(tint):
        factors = factor if isinstance(factor, tuple) else (factor,) * 3
        return tuple(a * b for a, b in zip(tint, factors))
    node = tree.nodes.new("ShaderNodeVectorMath")
    node.operation = "MULTIPLY"
    for value, socket in zip((tint, factor), node.inputs):
        connect(tree, value if is_socket(value) or isinstance(value, tuple) else (value,) * 3, socket)
    return node.outputs[0]


def math_node(tree: bpy.types.NodeTree, operation: str, *values: Value) -> Value:
    """Returns the result of an operation: a number, or the output of a new node."""
    if not any(is_socket(value) for value in values):
        return OPERATIONS[operation](*values)
    node = tree.nodes.new("ShaderNodeMath")
    node.operation = operation
    for value, socket in zip(values, node.inputs):
        connect(tree, value, socket)
    return node.outputs[0]


def color_mix(tree: bpy.types.NodeTree, a: Value, b: Value, factor: Value) -> Value:
    """Returns the mix of two numbers or colours."""
    if not any(is_socket(value) for value in (a, b, factor)):
        share = min(max(factor, 0.0), 1.0)
        if isinstance(a, tuple):
            return tuple((1.0 - share) * x + share * y for x, y in zip(a, b))
        return (1.0 - share) * a + share * b
    node = tree.nodes.new("ShaderNodeMix")
    node.data_type = "RGBA"
    # Sockets of a type follow those of the types before it.
    connect(tree, factor, node.inputs[0])
    connect(tree, a, node.inputs[6])
    connect(tree, b, node.inputs[7])
    return node.outputs[2]
