"""The surface of a material in the terms of a Principled BSDF: each value is a number, or a socket of its nodes."""

from __future__ import annotations

from typing import Any

import bpy

from .material_loss import PRINCIPLED
from .node_links import linked_node

COLORS = ("Base Color", "Emission")
VALUES = ("Alpha", "Metallic", "Roughness", "Transmission Weight", "Coat Weight", "Coat Roughness")
NORMALS = ("Normal", "Coat Normal")

BLACK = (0.0, 0.0, 0.0)
# Of shaders without a value of their own.
MATTE = {
    "Emission": BLACK,
    "Alpha": 1.0,
    "Metallic": 0.0,
    "Roughness": 1.0,
    "Transmission Weight": 0.0,
    "Coat Weight": 0.0,
    "Normal": None,
}
# Rec. 709.
LUMINANCE = (0.2126, 0.7152, 0.0722)
# Specular reflectance of surfaces that are no metal.
DIELECTRIC = 0.04
# As nodes compute them.
OPERATIONS = {
    "SUBTRACT": lambda a, b: a - b,
    "MULTIPLY": lambda a, b: a * b,
    "MULTIPLY_ADD": lambda a, b, c: a * b + c,
    "DIVIDE": lambda a, b: a / b if b != 0.0 else 0.0,
}
GLASS = {"ShaderNodeBsdfGlass", "ShaderNodeBsdfRefraction"}
GLOSSY = {"ShaderNodeBsdfGlossy", "ShaderNodeBsdfAnisotropic"}
MAX_DEPTH = 64

# A number, a colour, an output socket, or None for a normal that nothing changes.
Value = Any
Values = dict[str, Value]


class CannotBake(Exception):
    """A material or an object that cannot be baked."""


def is_socket(value: Value) -> bool:
    """Returns True for a value that is computed by nodes."""
    return isinstance(value, bpy.types.NodeSocket)


class Router:
    """Finds the values of shaders, and adds the nodes that mix them. Changes the tree, and copies its groups."""

    def __init__(self) -> None:
        self.groups: list[bpy.types.NodeTree] = []
        self.known: dict[tuple[str, str], Values] = {}
        # The first Principled BSDF, for values that are not routed.
        self.principled: bpy.types.Node | None = None

    def values(self, tree: bpy.types.NodeTree, node: bpy.types.Node | None, depth: int = 0) -> Values:
        """Returns the values of a shader. Those that a transparent one does not have are missing."""
        if node is None:
            return {"Alpha": 1.0, "Base Color": BLACK, **{k: v for k, v in MATTE.items() if k != "Alpha"}}
        if depth > MAX_DEPTH:
            raise CannotBake("its shaders are nested too deep")
        key = tree.name, node.name
        if key not in self.known:
            self.known[key] = self.new_values(tree, node, depth)
        return self.known[key]

    def new_values(self, tree: bpy.types.NodeTree, node: bpy.types.Node, depth: int) -> Values:
        kind, inputs = node.bl_idname, node.inputs
        if node.mute:
            raise CannotBake(f"its node '{node.name}' is muted")
        if kind == PRINCIPLED:
            self.principled = self.principled or node
            found = {name: source(inputs[name]) for name in ("Base Color", *VALUES) if name in inputs}
            found["Emission"] = product(tree, inputs["Emission Color"], inputs["Emission Strength"])
            found.update({name: bent(tree, inputs[name]) for name in NORMALS if name in inputs})
            return found
        if kind == "ShaderNodeBsdfDiffuse":
            return {**MATTE, "Base Color": source(inputs["Color"]), "Normal": bent(tree, inputs["Normal"])}
        if kind in GLOSSY or kind in GLASS:
            surface = {"Base Color": source(inputs["Color"]), "Roughness": source(inputs["Roughness"])}
            special = {"Metallic": 1.0} if kind in GLOSSY else {"Transmission Weight": 1.0}
            return {**MATTE, **surface, **special, "Normal": bent(tree, inputs["Normal"])}
        if kind == "ShaderNodeEmission":
            return {**MATTE, "Base Color": BLACK, "Emission": product(tree, inputs["Color"], inputs["Strength"])}
        if kind == "ShaderNodeBsdfTransparent":
            return {"Alpha": 0.0}
        if kind == "ShaderNodeMixShader":
            first, second = (self.values(tree, linked_node(inputs[i]), depth + 1) for i in (1, 2))
            factor = source(inputs[0])
            return mix_of(tree, first, second, factor)
        if kind == "ShaderNodeAddShader":
            return self.sum(tree, [linked_node(socket) for socket in inputs], depth)
        if kind == "ShaderNodeGroup" and node.node_tree is not None:
            return self.group(node, tree, depth)
        raise CannotBake(f"of its shader '{node.bl_label}'")

    def sum(self, tree: bpy.types.NodeTree, nodes: list[bpy.types.Node | None], depth: int) -> Values:
        """Returns the values of a shader to which another one adds light."""
        glowing = [node for node in nodes if node is not None and node.bl_idname == "ShaderNodeEmission"]
        others = [node for node in nodes if node not in glowing[:1]]
        if not glowing or len(others) != 1:
            raise CannotBake("of its shader 'Add Shader'")
        added = self.values(tree, glowing[0], depth + 1)["Emission"]
        values = dict(self.values(tree, others[0], depth + 1))
        own = values.get("Emission", BLACK)
        if is_socket(own) or is_socket(added):
            node = tree.nodes.new("ShaderNodeVectorMath")
            connect(tree, own, node.inputs[0])
            connect(tree, added, node.inputs[1])
            values["Emission"] = node.outputs[0]
        else:
            values["Emission"] = tuple(a + b for a, b in zip(own, added))
        return values

    def group(self, node: bpy.types.Node, tree: bpy.types.NodeTree, depth: int) -> Values:
        """Returns the values of a shader inside of a group, whose copy gets an output for each."""
        shaders = [socket for socket in node.outputs if socket.type == "SHADER" and socket.is_linked]
        if not shaders:
            raise CannotBake(f"its group '{node.name}' has no shader")
        index = list(node.outputs).index(shaders[0])
        inner = node.node_tree.copy()
        self.groups.append(inner)
        node.node_tree = inner
        ends = [n for n in inner.nodes if n.bl_idname == "NodeGroupOutput" and n.is_active_output]
        shader = linked_node(ends[0].inputs[index]) if ends else None
        if shader is not None and shader.bl_idname == "NodeGroupInput":
            raise CannotBake(f"its group '{node.name}' has shaders as inputs")
        values = {}
        for name, value in self.values(inner, shader, depth + 1).items():
            if is_socket(value):
                kind = "NodeSocketShader" if name in NORMALS else "NodeSocketColor"
                item = inner.interface.new_socket(name, in_out="OUTPUT", socket_type=kind)
                inner.links.new(value, by_identifier(ends[0].inputs, item.identifier))
                value = by_identifier(node.outputs, item.identifier)
            values[name] = value
        return values


def by_identifier(sockets: Any, identifier: str) -> bpy.types.NodeSocket:
    """Returns the socket with an identifier."""
    return next(socket for socket in sockets if socket.identifier == identifier)


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


def product(tree: bpy.types.NodeTree, color: bpy.types.NodeSocket, strength: bpy.types.NodeSocket) -> Value:
    """Returns a colour times a strength."""
    tint, factor = source(color), source(strength)
    if not is_socket(factor) and (factor == 0.0 or not is_socket(tint)):
        return tuple(factor * channel for channel in (BLACK if factor == 0.0 else tint))
    node = tree.nodes.new("ShaderNodeVectorMath")
    node.operation = "MULTIPLY"
    connect(tree, tint, node.inputs[0])
    connect(tree, factor if is_socket(factor) else (factor,) * 3, node.inputs[1])
    return node.outputs[0]


def bent(tree: bpy.types.NodeTree, socket: bpy.types.NodeSocket) -> Value:
    """Returns a matte shader with the normal of an input; None if nothing is linked to it."""
    if not socket.is_linked:
        return None
    shader = tree.nodes.new("ShaderNodeBsdfDiffuse")
    tree.links.new(socket.links[0].from_socket, shader.inputs["Normal"])
    return shader.outputs[0]


def mix_of(tree: bpy.types.NodeTree, first: Values, second: Values, factor: Value) -> Values:
    """Returns the values of a mix.

    A Mix Shader adds light. So a value counts by the light that it concerns: metallic and normals by the base colour,
    roughness by the specular reflectance.
    """
    factors = {}
    if "Base Color" in first and "Base Color" in second:
        by_color = skewed(tree, factor, *(luminance(tree, values) for values in (first, second)))
        by_gloss = skewed(tree, factor, *(reflectance(tree, values) for values in (first, second)))
        factors = {"Metallic": by_color, "Roughness": by_gloss, **dict.fromkeys(NORMALS, by_color)}
    names = [name for name in (*COLORS, *VALUES, *NORMALS) if name in first or name in second]
    return {name: mixed(tree, name, first, second, factors.get(name, factor)) for name in names}


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
    excess = math_node(tree, "SUBTRACT", luminance(tree, values), DIELECTRIC)
    return math_node(tree, "MULTIPLY_ADD", metallic, excess, DIELECTRIC)


def skewed(tree: bpy.types.NodeTree, factor: Value, first: Value, second: Value) -> Value:
    """Returns the factor of a mix of which one part counts more."""
    if not is_socket(first) and first == second:
        return factor
    share = math_node(tree, "MULTIPLY", factor, second)
    rest = math_node(tree, "SUBTRACT", 1.0, factor)
    return math_node(tree, "DIVIDE", share, math_node(tree, "MULTIPLY_ADD", rest, first, share))


def math_node(tree: bpy.types.NodeTree, operation: str, *values: Value) -> Value:
    """Returns the result of an operation: a number, or the output of a new node."""
    if not any(is_socket(value) for value in values):
        return OPERATIONS[operation](*values)
    node = tree.nodes.new("ShaderNodeMath")
    node.operation = operation
    for value, socket in zip(values, node.inputs):
        connect(tree, value, socket)
    return node.outputs[0]


def mixed(tree: bpy.types.NodeTree, name: str, first: Values, second: Values, factor: Value) -> Value:
    """Returns the mix of two values. A shader without the value leaves the other's."""
    if name not in first or name not in second:
        return first[name] if name in first else second[name]
    a, b = first[name], second[name]
    if not is_socket(a) and not is_socket(b):
        if a == b:
            return a
        if not is_socket(factor):
            share = min(max(factor, 0.0), 1.0)
            if isinstance(a, tuple):
                return tuple((1.0 - share) * x + share * y for x, y in zip(a, b))
            return (1.0 - share) * a + share * b
    if name in NORMALS:
        node = tree.nodes.new("ShaderNodeMixShader")
        for value, socket in ((a, node.inputs[1]), (b, node.inputs[2])):
            value = tree.nodes.new("ShaderNodeBsdfDiffuse").outputs[0] if value is None else value
            tree.links.new(value, socket)
        connect(tree, factor, node.inputs[0])
        return node.outputs[0]
    node = tree.nodes.new("ShaderNodeMix")
    node.data_type = "RGBA"
    # Sockets of a type follow those of the types before it.
    connect(tree, factor, node.inputs[0])
    connect(tree, a, node.inputs[6])
    connect(tree, b, node.inputs[7])
    return node.outputs[2]
