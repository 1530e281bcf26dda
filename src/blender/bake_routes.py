"""The surface of a material in the terms of a Principled BSDF."""

from __future__ import annotations

from typing import Any

import bpy

from . import bake_anisotropy, principled
from .bake_mix import mix_of
from .bake_values import BLACK, NORMALS, PLAIN_VALUES, CannotBake
from .bake_values import Value, Values, color_mix, connect, is_socket, product, source
from .material_loss import PRINCIPLED
from .node_links import linked_node

# Of shaders without a value of their own.
BODY = {"Emission": BLACK, "Alpha": 1.0, "Metallic": 0.0, "Transmission Weight": 0.0, "Coat Weight": 0.0}
MATTE = {**BODY, "Roughness": 1.0, "Sheen Color": BLACK, "Specular IOR Level": 0.0, "Normal": None}
GLASS = {"ShaderNodeBsdfGlass", "ShaderNodeBsdfRefraction"}
GLOSSY = {"ShaderNodeBsdfGlossy", "ShaderNodeBsdfAnisotropic"}
MAX_DEPTH = 64


class Router:
    """Finds the values of shaders, and adds the nodes that mix them. Changes the tree, and copies its groups."""

    def __init__(self, map_name: str) -> None:
        # Of the map that is baked.
        self.map_name = map_name
        self.groups: list[bpy.types.NodeTree] = []
        self.known: dict[tuple[str, str], Values] = {}
        # The first Principled BSDF, for values that are not routed.
        self.principled: bpy.types.Node | None = None
        self.bends: dict[tuple[str, ...], Value] = {}

    def values(self, tree: bpy.types.NodeTree, node: bpy.types.Node | None, depth: int = 0) -> Values:
        """Returns the values of a shader. Those that a transparent one does not have are missing."""
        if node is None:
            return {**MATTE, "Base Color": BLACK}
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
            return self.principled_values(tree, node)
        if kind == "ShaderNodeBsdfDiffuse":
            return {**MATTE, "Base Color": source(inputs["Color"]), "Normal": self.bent(tree, inputs["Normal"])}
        if kind == "ShaderNodeBsdfSheen":
            sheen = {"Sheen Color": source(inputs["Color"]), "Sheen Roughness": source(inputs["Roughness"])}
            return {**MATTE, "Base Color": BLACK, **sheen, "Normal": self.bent(tree, inputs["Normal"])}
        if kind in GLOSSY or kind in GLASS:
            surface = {"Base Color": source(inputs["Color"]), "Roughness": source(inputs["Roughness"])}
            surface["Normal"] = self.bent(tree, inputs["Normal"])
            if kind in GLASS:
                return {**BODY, "Sheen Color": BLACK, **surface, "Transmission Weight": 1.0}
            strength = bake_anisotropy.glossy_strength(tree, source(inputs["Anisotropy"]))
            rotation, tangent = source(inputs["Rotation"]), inputs["Tangent"]
            stretched = bake_anisotropy.stretch(tree, strength, rotation, tangent, self.map_name)
            return {**BODY, "Sheen Color": BLACK, **surface, **stretched, "Metallic": 1.0}
        if kind == "ShaderNodeEmission":
            emission = product(tree, source(inputs["Color"]), source(inputs["Strength"]))
            return {**MATTE, "Base Color": BLACK, "Emission": emission}
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

    def principled_values(self, tree: bpy.types.NodeTree, node: bpy.types.Node) -> Values:
        """Returns the values of a Principled BSDF."""
        inputs = node.inputs
        names = [name for name in ("Base Color", "Specular Tint", *PLAIN_VALUES) if name in inputs]
        found = {name: source(inputs[name]) for name in names}
        found["Emission"] = product(tree, source(inputs["Emission Color"]), source(inputs["Emission Strength"]))
        found["Sheen Color"] = product(tree, source(inputs["Sheen Tint"]), source(inputs["Sheen Weight"]))
        strength, rotation = source(inputs["Anisotropic"]), source(inputs["Anisotropic Rotation"])
        found |= bake_anisotropy.stretch(tree, strength, rotation, inputs["Tangent"], self.map_name)
        found.update({name: self.bent(tree, inputs[name]) for name in NORMALS if name in inputs})
        if principled.has_coat_tint(node):
            deep = tree.nodes.new("ShaderNodeGamma")
            connect(tree, source(inputs["Coat Tint"]), deep.inputs["Color"])
            deep.inputs["Gamma"].default_value = principled.COAT_DEPTH
            tint = color_mix(tree, principled.WHITE, deep.outputs[0], source(inputs["Coat Weight"]))
            for name in principled.BELOW_COAT:
                found[name] = product(tree, found[name], tint)
        return found

    def bent(self, tree: bpy.types.NodeTree, socket: bpy.types.NodeSocket) -> Value:
        """Returns a matte shader with the normal of an input; None if nothing is linked to it."""
        if not socket.is_linked:
            return None
        source = socket.links[0].from_socket
        key = tree.name, source.node.name, source.identifier
        if key not in self.bends:
            shader = tree.nodes.new("ShaderNodeBsdfDiffuse")
            tree.links.new(source, shader.inputs["Normal"])
            self.bends[key] = shader.outputs[0]
        return self.bends[key]

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
