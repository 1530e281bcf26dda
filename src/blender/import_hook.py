"""Hooks that Blender's glTF importer calls. The importer logs an exception in a hook and goes on without it."""

from __future__ import annotations

from typing import Any

import bpy

from . import import_camera, import_lights, import_scene
from .area_light import EXTENSION as AREA
from .gltf_types import KEY
from .punctual_light import EXTENSION as PUNCTUAL

SCENE_SETTINGS = "blinn_import_scene"


class glTF2ImportUserExtension:
    """Made by the importer at the start of an import."""

    def __init__(self) -> None:
        # Values of `extras.blinn`, by the kind and the index of what has them.
        self.extras: dict[tuple[str, int], dict[str, Any]] = {}
        # Area lights by the index of the light that stands for them.
        self.areas: dict[int, dict[str, Any]] = {}
        self.area_objects: list[tuple[bpy.types.Object, dict[str, Any]]] = []
        self.cameras: list[tuple[bpy.types.Object, dict[str, Any]]] = []

    def gather_import_gltf_before_hook(self, gltf: Any) -> None:
        """Takes the extension's values from the file, so that they do not become custom properties."""
        self.extras, self.areas, self.area_objects, self.cameras = {}, {}, [], []
        data = gltf.data
        for kind in ("scenes", "nodes", "cameras", "materials"):
            for index, holder in enumerate(getattr(data, kind) or []):
                self.take(kind, index, holder.extras)
        extensions = data.extensions or {}
        for index, light in enumerate(list_of(extensions.get(PUNCTUAL))):
            self.take("lights", index, light.get("extras"))
        areas = list_of(extensions.get(AREA))
        for node in data.nodes or []:
            self.stand_in(data, node, areas)

    def take(self, kind: str, index: int, extras: Any) -> None:
        """Moves `extras.blinn`."""
        if isinstance(extras, dict):
            values = extras.pop(KEY, None)
            if isinstance(values, dict):
                self.extras[kind, index] = values

    def stand_in(self, data: Any, node: Any, areas: list[Any]) -> None:
        """Gives a node with an area light a point light: the importer turns it as Blender's lights are."""
        index = ((node.extensions or {}).get(AREA) or {}).get("light")
        if not isinstance(index, int) or not 0 <= index < len(areas) or PUNCTUAL in node.extensions:
            return
        data.extensions.setdefault(PUNCTUAL, {"lights": []})
        lights = data.extensions[PUNCTUAL]["lights"]
        self.areas[len(lights)] = areas[index]
        node.extensions[PUNCTUAL] = {"light": len(lights)}
        lights.append({"type": "point", "name": areas[index].get("name") or "Area"})

    def gather_import_light_after_hook(self, vnode: Any, item: Any, light: bpy.types.Light, gltf: Any) -> None:
        """Completes a light."""
        index = gltf.data.nodes[vnode.light_node_idx].extensions[PUNCTUAL]["light"]
        if index in self.areas:
            light.type = "AREA"
            # Its size depends on the scale of objects that do not exist yet.
            self.area_objects.append((item, self.areas[index]))
        elif ("lights", index) in self.extras:
            import_lights.read_punctual(light, self.extras["lights", index])

    def gather_import_camera_after_hook(self, vnode: Any, item: Any, camera: bpy.types.Camera, gltf: Any) -> None:
        """Remembers a camera, whose shift depends on the size of pictures."""
        index = vnode.camera_node_idx
        values = self.extras.get(("cameras", gltf.data.nodes[index].camera), {})
        self.cameras.append((item, {**values, **self.extras.get(("nodes", index), {})}))

    def gather_import_material_after_hook(
        self, gltf_material: Any, _: Any, material: bpy.types.Material, gltf: Any
    ) -> None:
        """Marks thin walls, where Blender has them."""
        index = gltf.data.materials.index(gltf_material)
        if self.extras.get(("materials", index), {}).get("thinWall") is True:
            for node in material.node_tree.nodes:
                socket = node.inputs.get("Thin Wall")
                if socket is not None:
                    socket.default_value = True

    def gather_import_scene_after_nodes_hook(self, gltf_scene: Any, scene: bpy.types.Scene, gltf: Any) -> None:
        """Completes area lights and cameras, and on request the scene."""
        values = self.extras.get(("scenes", gltf.data.scene), {})
        factor = import_lights.factor_of(values, gltf.import_settings["export_import_convert_lighting_mode"])
        bpy.context.view_layer.update()
        for item, light in self.area_objects:
            import_lights.read_area(item, light, factor)
        if getattr(scene, SCENE_SETTINGS, False):
            import_scene.read(scene, values, gltf)
        for item, camera in self.cameras:
            import_camera.read(item, camera, scene)


def list_of(extension: Any) -> list[Any]:
    """Returns the lights of an extension."""
    lights = extension.get("lights") if isinstance(extension, dict) else None
    return lights if isinstance(lights, list) else []
