"""Hooks that Blender's glTF exporter calls. The exporter logs an exception in a hook and goes on without it."""

from __future__ import annotations

from typing import Any

import bpy

from . import area_light, bake, camera, engine_settings, journal, light_emission, lost_objects, material_extensions
from . import material_loss, punctual_light, scene_settings, texture_coordinates, unused_alpha, world
from .gltf_types import add_extras
from .mesh_replacement import Replacements
from .surface_substitutes import Substitutes

ENABLED = "blinn_export"


class glTF2ExportUserExtension:
    """Made by the exporter at the start of an export."""

    is_critical = False
    baker: bake.Baker | None = None
    replacements: Replacements | None = None
    substitutes: Substitutes | None = None

    def __init__(self) -> None:
        self.is_enabled = getattr(bpy.context.scene, ENABLED, True)
        journal.restore_all()
        self.colors: dict[str, tuple[float, ...]] = {}
        # Materials and lights whose losses are named. The exporter gathers some more than once.
        self.reported: set[str] = set()
        # Names of materials without a surface.
        self.volumes: set[str] = set()
        # Of scenes by name.
        self.worlds: dict[str, dict[str, Any] | None] = {}
        # The exporter goes to frame 0, or to each frame of an animation in turn.
        self.current_frames = {scene.name: scene.frame_current for scene in bpy.data.scenes}

    def replace(self, settings: dict[str, Any]) -> None:
        """Takes worlds, and replaces metaballs and materials for the export, at the frame of static values."""
        if not self.is_enabled:
            return
        self.take_worlds(settings)
        for text in lost_objects.losses(bpy.context.scene, bpy.context.view_layer):
            settings["log"].warning(f"blinn: {text}")
        self.replacements = Replacements(settings)
        if not bpy.app.background:
            bpy.app.timers.register(journal.restore_all, first_interval=0.0)
        try:
            if settings["gltf_materials"] == "EXPORT":
                options = getattr(bpy.context.scene, engine_settings.PROPERTY)
                self.substitutes = Substitutes(self.replacements.journal, options.bake != "never")
                self.substitutes.substitute_all()
            self.bake(settings, self.replacements)
            self.replacements.convert_metaballs()
        except Exception as error:
            settings["log"].error(f"blinn: materials are not replaced: {type(error).__name__}: {error}")
            self.replacements.restore()

    def take_worlds(self, settings: dict[str, Any]) -> None:
        """Takes the worlds of the scenes that are exported. Some are rendered, for which no other time is right."""
        scenes = [bpy.context.scene] if settings["gltf_active_scene"] else list(bpy.data.scenes)
        for scene in scenes:
            try:
                self.worlds[scene.name] = world.extras(scene.world, settings)
            except Exception as error:
                settings["log"].error(f"blinn: the world is not written: {type(error).__name__}: {error}")

    def bake(self, settings: dict[str, Any], replacements: Replacements) -> None:
        """Bakes materials if the scene asks for it."""
        options = getattr(bpy.context.scene, engine_settings.PROPERTY)
        if options.bake == "never" or settings["gltf_materials"] != "EXPORT":
            return
        self.baker = bake.Baker(settings, options.bake_size, settings["log"].warning, replacements)
        self.baker.bake()

    def restore(self) -> None:
        """Gives the scene back what it had."""
        if self.replacements is not None:
            self.replacements.restore()

    def vtree_before_filter_hook(self, tree: Any, settings: dict[str, Any]) -> None:
        """Remembers the colours of lights at the frame of static values, before some versions change them."""
        for light in bpy.data.lights:
            self.colors.setdefault(light.name_full, tuple(light.color))

    def gather_node_hook(self, node: Any, blender_object: bpy.types.Object | None, settings: dict[str, Any]) -> None:
        """Adds what a light, a camera or a mesh lacks. Objects that the exporter leaves out never come here."""
        if not self.is_enabled:
            return
        if blender_object is not None and self.replacements is not None:
            self.replacements.write(node, blender_object, settings)
        if node.mesh is not None and not node.mesh.primitives:
            # All its faces are borders of volumes.
            node.mesh = node.skin = None
        if blender_object is None:
            return
        if blender_object.type == "LIGHT" and settings["gltf_lights"]:
            self.warn_of_lost_keys(blender_object, settings)
            self.warn_of_lost_nodes(blender_object.data, settings)
            color = self.colors.get(blender_object.data.name_full, tuple(blender_object.data.color))
            if blender_object.data.type == "AREA":
                area_light.write(node, blender_object, color, settings)
            else:
                punctual_light.write(node, blender_object, color, settings)
        elif blender_object.type == "CAMERA" and node.camera is not None:
            add_extras(node.camera, camera.extras(blender_object))
            if any(scene.camera == blender_object for scene in bpy.data.scenes):
                add_extras(node, {"activeCamera": True})

    def warn_of_lost_keys(self, light_object: bpy.types.Object, settings: dict[str, Any]) -> None:
        """Warns once of each light that does not change over time in the file."""
        light = light_object.data
        if settings["gltf_animations"] and light.name_full not in self.reported and light_emission.loses_keys(light):
            self.reported.add(light.name_full)
            text = f"blinn: the keys of light '{light.name}' are not written: it is the same in all frames"
            settings["log"].warning(text)

    def warn_of_lost_nodes(self, light: bpy.types.Light, settings: dict[str, Any]) -> None:
        """Warns once of each light with nodes that are not written."""
        lost = light_emission.lost_nodes(light)
        key = f"nodes of {light.name_full}"
        if lost and key not in self.reported:
            self.reported.add(key)
            text = f"blinn: light '{light.name}' loses {material_loss.listed(lost)} of its nodes"
            settings["log"].warning(text)

    def gather_material_hook(self, gltf_material: Any, material: bpy.types.Material | None, settings: dict) -> None:
        """Marks thin walls, and warns once of what a material loses."""
        if not self.is_enabled or not isinstance(material, bpy.types.Material):
            return
        if material_loss.is_volume(material):
            self.volumes.add(gltf_material.name)
            return
        shader = material_loss.surface_of(material)
        is_unlit = "KHR_materials_unlit" in (gltf_material.extensions or {})
        if shader is not None and shader.bl_idname == material_loss.PRINCIPLED and not is_unlit:
            material_extensions.write(gltf_material, shader)
        if shader is not None and shader.bl_idname == "ShaderNodeEmission" and not is_unlit:
            material_extensions.write_glow(gltf_material)
        name = material.name
        if self.baker is not None:
            name = gltf_material.name = self.baker.names.get(name, name)
        is_thin, losses = material_loss.is_thin_wall(material), material_loss.losses(material)
        if self.substitutes is not None:
            self.substitutes.write_extensions(gltf_material, name)
            is_thin = is_thin or self.substitutes.is_thin(name)
            losses = self.substitutes.losses(name) + losses
        if is_thin:
            add_extras(gltf_material, {"thinWall": True})
        if losses and name not in self.reported:
            self.reported.add(name)
            settings["log"].warning(material_loss.message(name, losses, self.baker is None))

    def warn_of_volumes(self, settings: dict[str, Any]) -> None:
        """Warns once of all materials without a surface."""
        if self.volumes:
            names = material_loss.listed([f"'{name}'" for name in sorted(self.volumes)])
            text = f"blinn: volumes are not written, nor the faces around them: {names}"
            settings["log"].warning(text)

    def gather_mesh_hook(self, gltf_mesh: Any, mesh: bpy.types.Mesh, *others: Any) -> None:
        """Changes a mesh that the exporter has written.

        One that replaces another gets its name. Faces that are borders of volumes are taken away, and any mesh gets the
        maps that its materials need.
        """
        is_kept = lambda part: part.material is None or part.material.name not in self.volumes  # noqa: E731
        gltf_mesh.primitives = [part for part in gltf_mesh.primitives if is_kept(part)]
        if self.replacements is not None:
            gltf_mesh.name = self.replacements.names.get(mesh.name, gltf_mesh.name)
        if self.is_enabled:
            settings = others[-1]
            for material in texture_coordinates.write(gltf_mesh):
                text = f"mesh '{gltf_mesh.name}' has no UV map for the normal map of '{material}', which bends nothing"
                settings["log"].warning(f"blinn: {text}; unwrap the mesh")

    def gather_image_hook(self, gltf_image: Any, export_image: Any, sockets: tuple, settings: dict[str, Any]) -> None:
        """Gives an image the colours that Blender shows if nothing uses its alpha."""
        if self.is_enabled:
            unused_alpha.write(gltf_image, sockets)

    def gather_scene_hook(self, gltf_scene: Any, scene: bpy.types.Scene, settings: dict[str, Any]) -> None:
        """Adds render settings and the world. Animations, which change the frame, are gathered later."""
        if self.is_enabled:
            current = self.current_frames.get(scene.name, scene.frame_current)
            add_extras(gltf_scene, scene_settings.extras(scene, current, settings))
            if self.worlds.get(scene.name):
                add_extras(gltf_scene, {"world": self.worlds[scene.name]})


def own_extensions(settings: dict[str, Any]) -> list[glTF2ExportUserExtension]:
    """Returns the extensions of an export that are of this package."""
    return [each for each in settings["gltf_user_extensions"] if isinstance(each, glTF2ExportUserExtension)]


def glTF2_pre_export_callback(settings: dict[str, Any]) -> None:
    """Called by the exporter, at the frame of static values and in object mode, where exceptions would end it."""
    for extension in own_extensions(settings):
        extension.replace(settings)


def glTF2_post_export_callback(settings: dict[str, Any]) -> None:
    """Called by the exporter before it writes the file."""
    for extension in own_extensions(settings):
        extension.restore()
        extension.warn_of_volumes(settings)
