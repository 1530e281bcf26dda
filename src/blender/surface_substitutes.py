"""Materials with one Principled BSDF in place of other shaders, for the time of an export."""

from __future__ import annotations

from typing import Any

import bpy
import numpy

from . import material_loss, panorama
from .gltf_types import Extension
from .journal import Journal
from .node_links import linked_node
from .surface_nodes import Reader
from .surface_values import CannotHold, Mask, Scaled, Surface, Value, is_constant

PASSING = "KHR_materials_diffuse_transmission"
SPECULAR = "KHR_materials_specular"
MAX_TEXELS = 1 << 26


class Substitutes:
    """Gives all users of a material another one, and the material back when the journal is undone."""

    def __init__(self, journal: Journal, can_bake: bool) -> None:
        self.journal, self.can_bake = journal, can_bake
        # By the names of materials.
        self.surfaces: dict[str, Surface] = {}

    def substitute_all(self) -> None:
        """Replaces all materials of this file that need it, and that one Principled BSDF can hold."""
        for material in list(bpy.data.materials):
            shader = material_loss.surface_of(material)
            is_own = material.library is None and material.override_library is None and material.users > 0
            if is_own and shader is not None and is_other(shader):
                try:
                    self.substitute(material)
                except CannotHold:
                    # Named with what materials lose.
                    pass

    def substitute(self, material: bpy.types.Material) -> None:
        """Replaces a material."""
        name = material.name
        journal = Journal()
        try:
            copy = journal.add(bpy.data.materials, material.copy())
            output = material_loss.output_of(copy)
            surface = Reader(copy.node_tree).surface(output.inputs["Surface"])
            if surface.is_rough and self.can_bake:
                raise CannotHold("a surface that is baked")
            write(copy.node_tree, output, surface, journal)
        except CannotHold:
            journal.restore()
            raise
        # The name is free again when the copy is removed.
        self.journal.set(material, "name", f"{name} of blinn")
        self.journal.undo.extend(journal.undo)
        journal.undo.clear()
        journal.restore()
        copy.name = name
        material.user_remap(copy)
        self.journal.undo.append(lambda: copy.user_remap(material))
        self.surfaces[name] = surface

    def write_extensions(self, gltf_material: Any, name: str) -> None:
        """Adds what a Principled BSDF has no input for."""
        surface = self.surfaces.get(name)
        if surface is None:
            return
        present = gltf_material.extensions or {}
        if surface.passing > 0.0 and PASSING not in present:
            values = {"diffuseTransmissionFactor": surface.passing, **self.passing_color(gltf_material, surface)}
            gltf_material.extensions = {**present, PASSING: Extension(PASSING, values, False)}

    def passing_color(self, gltf_material: Any, surface: Surface) -> dict[str, Any]:
        """Returns the colour of the light that passes: a number, or the texture of the base colour."""
        color = surface.passing_color
        if is_constant(color):
            return {"diffuseTransmissionColorFactor": list(color)}
        reflecting = gltf_material.pbr_metallic_roughness
        texture = reflecting and reflecting.base_color_texture
        return {"diffuseTransmissionColorTexture": texture} if texture else {}

    def losses(self, name: str) -> list[str]:
        """Returns what a substitute differs in, each as a part of a sentence."""
        surface = self.surfaces.get(name)
        return list(dict.fromkeys(surface.losses)) if surface is not None else []

    def is_thin(self, name: str) -> bool:
        """Returns True for a substitute that light passes straight."""
        return name in self.surfaces and self.surfaces[name].is_thin


def is_other(shader: bpy.types.Node) -> bool:
    """Returns True for shaders that the exporter does not read as they are."""
    if shader.bl_idname == "ShaderNodeMixShader":
        factor = linked_node(shader.inputs[0])
        if factor is not None and factor.bl_idname == "ShaderNodeLightPath" and is_shadeless(shader):
            return False
    # The exporter reads the keys of an emission, too.
    return shader.bl_idname not in {material_loss.PRINCIPLED, "ShaderNodeEmission", "ShaderNodeGroup"}


def is_shadeless(shader: bpy.types.Node) -> bool:
    """Returns True for a mix that shows the camera an emission, which the exporter writes without shading."""
    output = shader.inputs[0].links[0].from_socket
    seen = linked_node(shader.inputs[2])
    return output.name == "Is Camera Ray" and seen is not None and seen.bl_idname == "ShaderNodeEmission"


def write(tree: bpy.types.NodeTree, output: bpy.types.Node, surface: Surface, journal: Journal) -> None:
    """Makes one Principled BSDF the surface of a tree."""
    shader = surface.base or tree.nodes.new(material_loss.PRINCIPLED)
    reader = Reader(tree)
    for name, value in surface.values.items():
        socket = shader.inputs.get(name)
        if socket is not None and (surface.base is None or reader.value(socket) != value):
            write_value(tree, socket, value, journal)
    tree.links.new(shader.outputs[0], output.inputs["Surface"])


def write_value(tree: bpy.types.NodeTree, socket: bpy.types.NodeSocket, value: Value, journal: Journal) -> None:
    """Gives an input a value in place of what it has."""
    for link in list(socket.links):
        tree.links.remove(link)
    if value is None:
        return
    if isinstance(value, Mask):
        tree.links.new(mask_node(tree, value, journal).outputs["Color"], socket)
    elif isinstance(value, Scaled):
        tree.links.new(product_node(tree, value, socket.type == "RGBA"), socket)
    elif not is_constant(value):
        tree.links.new(value, socket)
    elif socket.type == "RGBA":
        color = value if isinstance(value, tuple) else (value,) * 3
        socket.default_value = (*color, 1.0)
    else:
        socket.default_value = sum(value) / 3.0 if isinstance(value, tuple) else value


def product_node(tree: bpy.types.NodeTree, value: Scaled, is_color: bool) -> bpy.types.NodeSocket:
    """Returns the output of a product that the exporter writes as a factor."""
    if not is_color:
        node = tree.nodes.new("ShaderNodeMath")
        node.operation = "MULTIPLY"
        tree.links.new(value.socket, node.inputs[0])
        node.inputs[1].default_value = value.factor
        return node.outputs[0]
    node = tree.nodes.new("ShaderNodeMix")
    node.data_type, node.blend_type = "RGBA", "MULTIPLY"
    node.inputs[0].default_value = 1.0
    tree.links.new(value.socket, node.inputs[6])
    factor = value.factor if isinstance(value.factor, tuple) else (value.factor,) * 3
    node.inputs[7].default_value = (*factor, 1.0)
    return node.outputs[2]


def mask_node(tree: bpy.types.NodeTree, mask: Mask, journal: Journal) -> bpy.types.Node:
    """Returns an Image Texture whose image holds numbers of another one."""
    old = mask.socket.node
    width, height = old.image.size
    if not 0 < width * height <= MAX_TEXELS:
        raise CannotHold(f"the image '{old.image.name}'")
    if mask.socket.name == "Alpha":
        texels = numpy.empty(width * height * old.image.channels, numpy.float32)
        old.image.pixels.foreach_get(texels)
        texels = texels.reshape(height, width, -1)
        numbers = texels[..., 3] if texels.shape[2] == 4 else numpy.ones((height, width), numpy.float32)
    else:
        # The uppermost row first.
        numbers = panorama.linear_texels(old.image)[::-1].mean(axis=2)
    if mask.is_inverted:
        numbers = 1.0 - numbers
    image = journal.add(bpy.data.images, bpy.data.images.new(f"{old.image.name} mask", width, height, is_data=True))
    filled = numpy.ones((height, width, 4), numpy.float32)
    filled[..., :3] = numbers[..., None]
    image.pixels.foreach_set(filled.ravel())
    image.pack()
    node = tree.nodes.new("ShaderNodeTexImage")
    node.image, node.extension, node.interpolation = image, old.extension, old.interpolation
    for link in old.inputs["Vector"].links:
        tree.links.new(link.from_socket, node.inputs["Vector"])
    return node
