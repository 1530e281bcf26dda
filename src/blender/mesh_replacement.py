"""Meshes that are exported in place of what objects have, for the time of an export."""

from __future__ import annotations

from typing import Any

import bpy

from .gltf_types import gather_mesh
from .journal import Journal
from .mesh_evaluation import new_mesh

Materials = tuple["bpy.types.Material | None", ...]


class Replacements:
    """Gives objects other meshes, and has them written for objects that cannot have one."""

    def __init__(self, settings: dict[str, Any]) -> None:
        self.settings, self.journal = settings, Journal()
        # Names of meshes that are exported in place of others.
        self.names: dict[str, str] = {}
        self.written: dict[str, tuple[bpy.types.Mesh, Materials]] = {}

    def restore(self) -> None:
        """Gives everything back."""
        self.journal.restore()

    def change(
        self, item: bpy.types.Object, mesh: bpy.types.Mesh, materials: dict[int, bpy.types.Material], applied: bool
    ) -> None:
        """Gives an object a mesh and materials, by index, and hides modifiers that are applied to the mesh."""
        links = [(slot.link, slot.material) for slot in item.material_slots]
        old = item.data

        def restore() -> None:
            item.data = old
            for slot, (link, material) in zip(item.material_slots, links):
                slot.link = link
                if link == "OBJECT":
                    slot.material = material

        self.journal.undo.append(restore)
        self.names[mesh.name] = old.name
        item.data = mesh
        for slot in range(len(mesh.materials)):
            if slot < len(item.material_slots):
                item.material_slots[slot].link = "DATA"
            mesh.materials[slot] = materials.get(slot) or mesh.materials[slot]
        if applied:
            for modifier in item.modifiers:
                if modifier.type != "ARMATURE" or not self.settings["gltf_skins"]:
                    self.journal.set(modifier, "show_viewport", False)

    def write_instead(
        self, item: bpy.types.Object, mesh: bpy.types.Mesh, materials: dict[int, bpy.types.Material]
    ) -> None:
        """Has a mesh written for an object that stays as it is: one of another file, or no mesh."""
        self.names[mesh.name] = item.data.name
        for slot, material in materials.items():
            mesh.materials[slot] = material
        self.written[item.name_full] = mesh, tuple(mesh.materials)

    def convert_metaballs(self) -> None:
        """Has meshes written for metaballs, which the exporter leaves out. One of each family has the mesh of all."""
        for item in bpy.context.scene.objects:
            if item.type == "META" and item.name_full not in self.written:
                mesh = self.journal.add(bpy.data.meshes, new_mesh(item, []))
                if len(mesh.polygons) > 0:
                    self.write_instead(item, mesh, {})

    def write(self, node: Any, item: bpy.types.Object, settings: dict[str, Any]) -> None:
        """Gives a node of the exporter the mesh that is written for its object."""
        if item.name_full in self.written:
            mesh, materials = self.written[item.name_full]
            identifiers = settings.setdefault("material_identifiers", {})
            identifiers.update({id(material): material for material in materials if material is not None})
            node.mesh = gather_mesh(mesh, materials, settings)
