"""Materials with baked images in place of nodes."""

from __future__ import annotations

from typing import Any, Iterable

import bpy
import numpy

from . import material_loss
from .bake_routes import NORMALS, VALUES, Values, connect, is_socket
from .journal import Journal
from .node_links import linked_node

# Images, and the values in their channels.
PACKED = {
    "Metallic Roughness": {"Roughness": "Green", "Metallic": "Blue"},
    "Transmission": {"Transmission Weight": "Red"},
    "Coat": {"Coat Weight": "Red", "Coat Roughness": "Green"},
}
Pixels = dict[str, numpy.ndarray]


class BakedMaterial:
    """A copy of a material whose nodes are replaced."""

    def __init__(self, material: bpy.types.Material, map_name: str, journal: Journal) -> None:
        self.name, self.map_name, self.journal = material.name, map_name, journal
        self.material = journal.add(bpy.data.materials, material.copy())
        self.tree = self.material.node_tree

    def write(self, values: Values, principled: bpy.types.Node | None, baked: Pixels, is_whole: bool) -> None:
        """Replaces what was baked. A whole surface gets a new Principled BSDF, with all its values."""
        shader = self.new_surface(values, principled) if is_whole else material_loss.surface_of(self.material)
        self.write_color(shader, values, baked)
        self.write_emission(shader, baked)
        for name, channels in PACKED.items():
            present = {value: channel for value, channel in channels.items() if value in baked}
            if present:
                self.write_packed(name, shader, present, baked)
        for name in NORMALS:
            if name in baked:
                node = self.tree.nodes.new("ShaderNodeNormalMap")
                node.uv_map = self.map_name
                texture = self.texture(name, baked[name], None)
                self.tree.links.new(texture.outputs["Color"], node.inputs["Color"])
                self.tree.links.new(node.outputs[0], shader.inputs[name])

    def new_surface(self, values: Values, like: bpy.types.Node | None) -> bpy.types.Node:
        """Returns a new Principled BSDF with the numbers of a surface, and others of an old one."""
        shader = self.tree.nodes.new(material_loss.PRINCIPLED)
        if like is not None:
            for old in like.inputs:
                new = shader.inputs.get(old.name)
                if new is not None and not old.is_linked and hasattr(old, "default_value"):
                    new.default_value = old.default_value
        for name in ("Base Color", *VALUES):
            if name in values and not is_socket(values[name]):
                connect(self.tree, values[name], shader.inputs[name])
        emission = values.get("Emission", (0.0, 0.0, 0.0))
        if not is_socket(emission):
            peak = max(emission)
            tint = tuple(channel / peak for channel in emission) if peak > 0.0 else emission
            connect(self.tree, tint, shader.inputs["Emission Color"])
            shader.inputs["Emission Strength"].default_value = peak
        output = self.tree.get_output_node("CYCLES")
        self.tree.links.new(shader.outputs[0], output.inputs["Surface"])
        return shader

    def write_color(self, shader: bpy.types.Node, values: Values, baked: Pixels) -> None:
        """Writes base colour and alpha into one image."""
        if "Base Color" not in baked and "Alpha" not in baked:
            return
        alpha = baked.get("Alpha")
        size = next(iter(baked.values())).shape[0]
        color = baked.get("Base Color")
        if color is None:
            constant = numpy.array(values.get("Base Color", (1.0,) * 3), numpy.float32)
            color = numpy.broadcast_to(constant, (size, size, 3))
        texture = self.texture("Base Color", srgb(color), alpha, is_color=True)
        self.replace(texture.outputs["Color"], shader.inputs["Base Color"])
        if alpha is not None:
            self.replace(texture.outputs["Alpha"], shader.inputs["Alpha"])

    def write_emission(self, shader: bpy.types.Node, baked: Pixels) -> None:
        """Writes an image whose brightest channel is 1, and its strength."""
        if "Emission" not in baked:
            return
        light = numpy.maximum(baked["Emission"], 0.0)
        peak = float(light.max())
        for socket in (shader.inputs["Emission Color"], shader.inputs["Emission Strength"]):
            for link in socket.links:
                self.tree.links.remove(link)
        shader.inputs["Emission Strength"].default_value = peak
        if peak > 0.0:
            texture = self.texture("Emission", srgb(light / peak), None, is_color=True)
            self.tree.links.new(texture.outputs["Color"], shader.inputs["Emission Color"])

    def write_packed(self, name: str, shader: bpy.types.Node, channels: dict[str, str], baked: Pixels) -> None:
        """Writes numbers into channels of an image."""
        some = next(iter(channels))
        values = numpy.ones((*baked[some].shape, 3), numpy.float32)
        split = self.tree.nodes.new("ShaderNodeSeparateColor")
        for value, channel in channels.items():
            values[..., ("Red", "Green", "Blue").index(channel)] = baked[value]
            self.replace(split.outputs[channel], shader.inputs[value])
        texture = self.texture(name, values, None)
        self.tree.links.new(texture.outputs["Color"], split.inputs["Color"])

    def replace(self, output: bpy.types.NodeSocket, target: bpy.types.NodeSocket) -> None:
        """Links an input anew."""
        for link in target.links:
            self.tree.links.remove(link)
        self.tree.links.new(output, target)

    def texture(self, name: str, color: numpy.ndarray, alpha: Any, is_color: bool = False) -> bpy.types.Node:
        """Returns an Image Texture on the map that was baked."""
        height, width = color.shape[:2]
        image = bpy.data.images.new(f"{self.name} {name}", width, height, alpha=alpha is not None, is_data=not is_color)
        self.journal.add(bpy.data.images, image)
        texels = numpy.ones((height, width, 4), dtype=numpy.float32)
        texels[..., :3] = color
        if alpha is not None:
            texels[..., 3] = alpha
        image.pixels.foreach_set(numpy.clip(texels, 0.0, 1.0).ravel())
        image.pack()
        node = self.tree.nodes.new("ShaderNodeTexImage")
        node.image = image
        place = self.tree.nodes.new("ShaderNodeUVMap")
        place.uv_map = self.map_name
        self.tree.links.new(place.outputs[0], node.inputs["Vector"])
        return node


def srgb(linear: numpy.ndarray) -> numpy.ndarray:
    """Returns colours as images of bytes store them."""
    linear = numpy.clip(linear, 0.0, 1.0)
    return numpy.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1.0 / 2.4) - 0.055)


def lost_values(material: bpy.types.Material) -> set[str] | None:
    """Returns the values of a Principled BSDF that are to be baked; None for the whole surface."""
    shader = material_loss.surface_of(material)
    if shader is None:
        return set()
    if shader.bl_idname != material_loss.PRINCIPLED:
        return None if is_lost_mix(shader) or material_loss.losses(material) else set()
    lost = set()
    for socket in shader.inputs:
        if any(material_loss.losses_of_socket(socket)):
            lost.add("Emission" if socket.name.startswith("Emission") else socket.name)
    # The exporter writes heights as a normal map.
    bent = {name for name in NORMALS if any(n.bl_idname == "ShaderNodeBump" for n in before(shader.inputs[name]))}
    lost |= bent | ({"Normal"} if material_loss.has_bump(material) else set())
    for pair in (("Metallic", "Roughness"), ("Base Color", "Alpha"), ("Coat Weight", "Coat Roughness")):
        # One image holds both.
        if lost.intersection(pair):
            lost.update(name for name in pair if linked_node(shader.inputs[name]) is not None)
    return lost.intersection({"Base Color", "Emission", *VALUES, *NORMALS})


def is_lost_mix(shader: bpy.types.Node) -> bool:
    """Returns True for several surfaces, or a group, that depend on nodes which the exporter does not evaluate.

    Light alone is not baked: the exporter reads it.
    """
    if shader.bl_idname not in {"ShaderNodeMixShader", "ShaderNodeAddShader", "ShaderNodeGroup"}:
        return False
    nodes = list(material_loss.upstream(shader))
    surfaces = [n for n in nodes if n.bl_idname.startswith("ShaderNodeBsdf")]
    groups = [n for n in nodes if n.bl_idname == "ShaderNodeGroup" and n != shader and has_shader(n)]
    if all(n.bl_idname == "ShaderNodeBsdfTransparent" for n in surfaces):
        return False
    has_procedure = any(n.bl_idname in material_loss.PROCEDURES for n in nodes)
    return has_procedure or shader.bl_idname != "ShaderNodeGroup" and len(surfaces) + len(groups) > 1


def has_shader(group: bpy.types.Node) -> bool:
    """Returns True for a group that is linked as a shader."""
    return any(socket.type == "SHADER" and socket.is_linked for socket in group.outputs)


def before(socket: bpy.types.NodeSocket) -> Iterable[bpy.types.Node]:
    """Returns the nodes that an input depends on."""
    first = linked_node(socket)
    return [] if first is None else material_loss.upstream(first)
