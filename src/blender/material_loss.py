"""What glTF has no form for in a material, and so is not in the file."""

from __future__ import annotations

from typing import Iterator

import bpy

from . import principled
from .node_links import linked_node

PRINCIPLED = "ShaderNodeBsdfPrincipled"

# Blender's exporter evaluates none of these: their sockets get the value that they have without a link.
PROCEDURES = {
    f"ShaderNode{name}"
    for name in """
    TexNoise TexVoronoi TexWave TexMagic TexChecker TexBrick TexGradient TexWhiteNoise TexGabor TexSky
    TexEnvironment ValToRGB HueSaturation Invert RGBCurve BrightContrast Gamma Fresnel LayerWeight NewGeometry
    ObjectInfo CameraData LightPath AmbientOcclusion Bevel Wireframe Blackbody Wavelength MapRange FloatCurve
    VectorCurve Script ParticleInfo HairInfo PointInfo
    """.split()
}

# Shaders that become a material without values.
SHADERS = {
    f"ShaderNode{name}"
    for name in """
    BsdfDiffuse BsdfGlass BsdfGlossy BsdfAnisotropic BsdfRefraction BsdfTranslucent BsdfToon BsdfSheen BsdfVelvet
    BsdfMetallic BsdfHair BsdfHairPrincipled BsdfRayPortal SubsurfaceScattering AddShader EeveeSpecular
    """.split()
}

# Those that show in the factor of a mix. Mixes by the kind of a ray are common tricks, which pictures do without.
FACTORS = PROCEDURES - {"ShaderNodeLightPath", "ShaderNodeCameraData"}

# Of their inputs, the exporter keeps an image or a constant at most.
COMBINING = {
    f"ShaderNode{name}"
    for name in "Mix MixRGB Math VectorMath Clamp CombineColor CombineRGB CombineXYZ VectorTransform".split()
}
# Operations on alpha that become a cutoff.
CUTOFFS = {"ROUND", "LESS_THAN", "GREATER_THAN", "SUBTRACT"}

# Nodes of a colour or number, and of the colours of vertices, which the exporter keeps.
CONSTANTS = {"ShaderNodeRGB", "ShaderNodeValue", "ShaderNodeVertexColor", "ShaderNodeAttribute"}

# Sockets of colours. Images of others hold data.
COLORS = {"Base Color", "Emission Color", "Sheen Tint", "Specular Tint"}
SRGB = {"sRGB", "sRGB - Texture", "sRGB Encoded Rec.709"}

# Inputs that become one texture.
STRETCH = {"Anisotropic", "Anisotropic Rotation"}

MAX_LOSSES = 5


def output_of(material: bpy.types.Material | None) -> bpy.types.Node | None:
    """Returns the output of a material's nodes."""
    # Materials have nodes from Blender 5.0 on.
    has_nodes = material is not None and (bpy.app.version >= (5, 0, 0) or material.use_nodes)
    if not has_nodes or material.node_tree is None:
        return None
    return material.node_tree.get_output_node("CYCLES") or material.node_tree.get_output_node("ALL")


def surface_of(material: bpy.types.Material | None) -> bpy.types.Node | None:
    """Returns the shader of a material's surface."""
    output = output_of(material)
    return output and linked_node(output.inputs["Surface"])


def is_volume(material: bpy.types.Material | None) -> bool:
    """Returns True for a material that is a volume without a surface."""
    output = output_of(material)
    has_volume = output is not None and linked_node(output.inputs["Volume"]) is not None
    return has_volume and linked_node(output.inputs["Surface"]) is None


def losses(material: bpy.types.Material | None) -> list[str]:
    """Returns what is lost of a material, each as a part of a sentence."""
    surface = surface_of(material)
    if surface is None:
        return []
    found = [f"the shader '{node.bl_label}'" for node in upstream(surface) if node.bl_idname in SHADERS]
    for node in upstream(surface):
        if node.bl_idname == PRINCIPLED:
            found += losses_of_principled(node)
    if surface.bl_idname == "ShaderNodeMixShader" and sum(n.bl_idname == PRINCIPLED for n in upstream(surface)) > 1:
        found.append(f"the shader '{surface.bl_label}'")
    if surface.bl_idname == "ShaderNodeMixShader":
        factor = linked_node(surface.inputs[0])
        procedures = [n for n in upstream(factor) if n.bl_idname in FACTORS] if factor is not None else []
        found += [f"'{node.bl_label}' in the factor of '{surface.bl_label}'" for node in procedures]
    if has_bump(material):
        found.append("a bump in Displacement")
    return list(dict.fromkeys(found))


def message(name: str, found: list[str], can_bake: bool) -> str:
    """Returns the warning that names what a material loses."""
    advice = "; `bake` makes images of it" if can_bake and any(" in " in loss for loss in found) else ""
    return f"blinn: material '{name}' loses what glTF cannot hold: {listed(found)}{advice}"


def listed(names: list[str]) -> str:
    """Returns the first names of a list, and the number of the others."""
    more = [f"{len(names) - MAX_LOSSES} more"] if len(names) > MAX_LOSSES else []
    return ", ".join(names[:MAX_LOSSES] + more)


def is_thin_wall(material: bpy.types.Material | None) -> bool:
    """Returns True for a surface whose shader is a thin wall, which Blender has from version 5.2 on."""
    surface = surface_of(material)
    wall = surface.inputs.get("Thin Wall") if surface is not None and surface.bl_idname == PRINCIPLED else None
    return wall is not None and not wall.is_linked and bool(wall.default_value)


def losses_of_principled(shader: bpy.types.Node) -> Iterator[str]:
    """Yields what is lost of the inputs of a Principled BSDF."""
    if principled.is_used(shader.inputs.get("Subsurface Weight")):
        yield "Subsurface Weight"
    for _, loss in principled.misread(shader):
        yield loss
    for socket in shader.inputs:
        yield from losses_of_socket(socket)


def losses_of_socket(socket: bpy.types.NodeSocket) -> Iterator[str]:
    """Yields what is lost of an input of a Principled BSDF."""
    if socket.name in STRETCH and principled.has_stretch_image(socket.node):
        return
    first = linked_node(socket)
    for node in upstream(first) if first is not None else []:
        if node.bl_idname in PROCEDURES or node.bl_idname in COMBINING and not is_factor(node, socket):
            yield f"'{node.bl_label}' in {socket.name}"
        elif node.bl_idname == "ShaderNodeTexImage" and node.image is not None:
            if not has_map(node):
                yield f"the coordinates of image '{node.image.name}' in {socket.name}"
            space = node.image.colorspace_settings.name
            if socket.name in COLORS and space not in SRGB and not node.image.is_float:
                yield f"the colour space '{space}' of image '{node.image.name}'"


def is_factor(node: bpy.types.Node, socket: bpy.types.NodeSocket) -> bool:
    """Returns True for a node that the exporter reads: a product with one image, or a cutoff of alpha."""
    if node.bl_idname == "ShaderNodeMath" and socket.name == "Alpha" and node.operation in CUTOFFS:
        return True
    is_product = getattr(node, "operation" if node.bl_idname == "ShaderNodeMath" else "blend_type", "") == "MULTIPLY"
    if node.bl_idname in {"ShaderNodeVectorMath", "ShaderNodeClamp"} or not is_product:
        return False
    links = [linked_node(s) for s in node.inputs if s.enabled and s.is_linked]
    sources = [link for link in links if link is not None and link.bl_idname not in CONSTANTS]
    return len(sources) <= 1


def has_map(texture: bpy.types.Node) -> bool:
    """Returns True for an image that is laid out by a UV map."""
    if texture.projection != "FLAT":
        return False
    socket = texture.inputs["Vector"]
    for _ in range(MAX_LOSSES):
        node = linked_node(socket)
        if node is None or node.bl_idname != "ShaderNodeMapping":
            break
        socket = node.inputs["Vector"]
    if node is None or node.bl_idname != "ShaderNodeTexCoord":
        # Without coordinates, an image has those of the map, unless a mapping is between them.
        return node is not None or socket.node == texture
    return all(link.from_socket.name == "UV" for link in socket.links if link.from_node == node)


def has_bump(material: bpy.types.Material) -> bool:
    """Returns True if the displacement of a material changes its normals alone."""
    output = material.node_tree.get_output_node("CYCLES") or material.node_tree.get_output_node("ALL")
    is_linked = output is not None and linked_node(output.inputs["Displacement"]) is not None
    return is_linked and getattr(material, "displacement_method", "BUMP") == "BUMP"


def upstream(start: bpy.types.Node) -> Iterator[bpy.types.Node]:
    """Yields a node and all that it depends on, each once, with the nodes of groups."""
    waiting, seen = [start], set()
    while waiting:
        node = waiting.pop()
        if node.as_pointer() in seen or node.mute:
            continue
        seen.add(node.as_pointer())
        yield node
        if node.bl_idname == "ShaderNodeGroup" and node.node_tree is not None:
            outputs = [n for n in node.node_tree.nodes if n.bl_idname == "NodeGroupOutput"]
            waiting.extend(outputs)
        waiting.extend(link.from_node for socket in node.inputs for link in socket.links)
