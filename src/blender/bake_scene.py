"""A temporary scene of one object, in which Cycles bakes emission and normals into pictures of floats."""

from __future__ import annotations

from typing import Any

import bpy
import numpy

from .bake_values import BLACK, CannotBake, connect, is_socket
from .journal import Journal

NAME = "blinn bake"
# Of each texel. Procedures without shadows need no more than smooth edges.
SAMPLES = 4
MARGIN = 8  # Texels around islands.


class BakeScene:
    """The active scene of the window until it is closed."""

    def __init__(self, frame: int, subframe: float) -> None:
        self.journal = Journal()
        window = bpy.context.window or bpy.data.window_managers[0].windows[0]
        scene = bpy.data.scenes.new(NAME)
        self.journal.undo.append(lambda: bpy.data.scenes.remove(scene))
        shown = window.scene, window.view_layer
        self.journal.undo.append(lambda: restore_window(window, *shown))
        window.scene = scene
        scene.render.engine = "CYCLES"
        if not hasattr(scene, "cycles"):
            self.close()
            raise CannotBake("Cycles is disabled")
        settings = scene.cycles
        settings.device, settings.seed, settings.samples = "CPU", 0, SAMPLES
        settings.use_denoising = settings.use_adaptive_sampling = False
        scene.render.use_simplify = False
        scene.tool_settings.mesh_select_mode = (False, False, True)
        scene.frame_set(frame, subframe=subframe)
        self.scene, self.layer, self.window = scene, scene.view_layers[0], window

    def context(self, item: bpy.types.Object) -> Any:
        """Returns the context of operators on an object."""
        selected = {"selected_objects": [item], "selected_editable_objects": [item]}
        shown = {"window": self.window, "scene": self.scene, "view_layer": self.layer}
        return bpy.context.temp_override(**shown, object=item, active_object=item, **selected)

    def close(self) -> None:
        """Shows the user's scene again, and removes this one."""
        self.journal.restore()

    def add(self, mesh: bpy.types.Mesh, like: bpy.types.Object) -> bpy.types.Object:
        """Returns the active object, with a mesh at the place of another object."""
        item = self.journal.add(bpy.data.objects, bpy.data.objects.new(NAME, mesh))
        self.scene.collection.objects.link(item)
        item.matrix_world = like.matrix_world
        item.color, item.pass_index = like.color, like.pass_index
        for other in self.layer.objects:
            other.select_set(other == item, view_layer=self.layer)
        self.layer.objects.active = item
        self.layer.update()
        return item


def restore_window(window: bpy.types.Window, scene: bpy.types.Scene, layer: bpy.types.ViewLayer) -> None:
    """Shows a scene."""
    window.scene = scene
    window.view_layer = layer


class Target:
    """A material that is baked: a copy whose nodes are routed, and the picture."""

    def __init__(self, material: bpy.types.Material, size: int, journal: Journal) -> None:
        self.tree = material.node_tree
        nodes = self.tree.nodes
        self.output = self.tree.get_output_node("CYCLES")
        self.emission = nodes.new("ShaderNodeEmission")
        image = bpy.data.images.new(NAME, size, size, float_buffer=True, is_data=True)
        self.image = journal.add(bpy.data.images, image)
        node = nodes.new("ShaderNodeTexImage")
        node.image = image
        for each in nodes:
            each.select = each == node
        nodes.active = node

    def show_color(self, value: Any) -> None:
        """Makes the surface glow in a colour or number."""
        socket = self.emission.inputs["Color"]
        for link in socket.links:
            self.tree.links.remove(link)
        connect(self.tree, value, socket)
        self.tree.links.new(self.emission.outputs[0], self.output.inputs["Surface"])

    def show_numbers(self, values: list[Any]) -> None:
        """Makes the surface glow with three numbers."""
        node = self.tree.nodes.new("ShaderNodeCombineColor")
        for value, socket in zip(values, node.inputs):
            connect(self.tree, value, socket)
        self.show_color(node.outputs[0])

    def show_shader(self, value: Any) -> None:
        """Gives the surface a shader; black without one."""
        if is_socket(value):
            self.tree.links.new(value, self.output.inputs["Surface"])
        else:
            self.show_color(BLACK)

    def pixels(self) -> numpy.ndarray:
        """Returns what was baked, the lowest row first, height x width x 3."""
        width, height = self.image.size
        texels = numpy.empty(4 * width * height, dtype=numpy.float32)
        self.image.pixels.foreach_get(texels)
        return numpy.nan_to_num(texels.reshape(height, width, 4)[..., :3], posinf=65504.0, neginf=0.0)


def bake(kind: str) -> None:
    """Bakes the active object, ``EMIT`` or ``NORMAL``."""
    options = {"margin": MARGIN, "margin_type": "EXTEND", "use_clear": True, "use_selected_to_active": False}
    options |= {"target": "IMAGE_TEXTURES", "save_mode": "INTERNAL", "normal_space": "TANGENT"}
    axes = {"normal_r": "POS_X", "normal_g": "POS_Y", "normal_b": "POS_Z"}
    try:
        result = bpy.ops.object.bake(type=kind, **options, **axes)
    except RuntimeError as error:
        lines = str(error).strip().splitlines() or ["unknown error"]
        raise CannotBake(f"Cycles failed: {lines[-1]}") from error
    if result != {"FINISHED"}:
        raise CannotBake("Cycles was cancelled")
