"""Materials, worlds and their nodes, for tests."""

from __future__ import annotations

import bpy


def add_node(tree, kind, **inputs):
    node = tree.nodes.new(f"ShaderNode{kind}")
    for name, value in inputs.items():
        node.inputs[name].default_value = value
    return node


def new_material(name, **inputs):
    """A material, its nodes and its Principled BSDF."""
    material = bpy.data.materials.new(name)
    if bpy.app.version < (5, 0, 0):
        material.use_nodes = True
    tree = material.node_tree
    shader = next(n for n in tree.nodes if n.bl_idname == "ShaderNodeBsdfPrincipled")
    for socket, value in inputs.items():
        shader.inputs[socket.replace("_", " ")].default_value = value
    return material, tree, shader


def new_world(scene):
    """Gives the scene a new world, and returns its Background node."""
    scene.world = bpy.data.worlds.new("World")
    if bpy.app.version < (5, 0, 0):
        scene.world.use_nodes = True
    return next(n for n in scene.world.node_tree.nodes if n.bl_idname == "ShaderNodeBackground")


def add_cube(scene, *materials, location=(0.0, 0.0, 0.0)):
    bpy.ops.mesh.primitive_cube_add(location=location)
    cube = bpy.context.object
    for material in materials:
        cube.data.materials.append(material)
    return cube


def link_noise(tree, socket):
    noise = add_node(tree, "TexNoise")
    tree.links.new(noise.outputs["Fac" if "Fac" in noise.outputs else 0], socket)
    return noise


def link_checker(tree, socket, first, second):
    """Two halves of a cube along x, of two colours."""
    coordinates, split = add_node(tree, "TexCoord"), add_node(tree, "SeparateXYZ")
    step, mix = add_node(tree, "Math"), add_node(tree, "MixRGB")
    step.operation = "GREATER_THAN"
    step.inputs[1].default_value = 0.0
    mix.inputs[1].default_value, mix.inputs[2].default_value = (*first, 1.0), (*second, 1.0)
    tree.links.new(coordinates.outputs["Object"], split.inputs[0])
    tree.links.new(split.outputs[0], step.inputs[0])
    tree.links.new(step.outputs[0], mix.inputs[0])
    tree.links.new(mix.outputs[0], socket)
