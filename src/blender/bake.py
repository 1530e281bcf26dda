"""Bakes what glTF cannot hold of materials to images, for the time of an export."""

from __future__ import annotations

from typing import Any, Callable

import bpy

from . import bake_jobs, bake_losses, bake_material, bake_unwrap
from .bake_jobs import Job
from .bake_passes import Plan, bake_passes, plan, routed_copy
from .bake_scene import BakeScene, Target
from .bake_values import CannotBake
from .journal import Journal
from .mesh_evaluation import deform, evaluate, undeformed
from .mesh_replacement import Replacements

MAX_BAKES = 1024  # Materials of objects.
MAX_TEXELS = 1 << 27
MIN_SIZE = 64
# Images of a material, about.
IMAGES = 3

Warn = Callable[[str], None]


class Baker:
    """Bakes the materials of the objects of a scene, and gives them back what they had."""

    def __init__(self, settings: dict[str, Any], size: int, warn: Warn, replacements: Replacements) -> None:
        self.settings, self.size, self.warn = settings, size, warn
        self.journal, self.replacements = replacements.journal, replacements
        # Names of materials that are exported in place of others.
        self.names: dict[str, str] = {}
        self.reported: set[str] = set()
        self.shared: dict[Any, tuple[bpy.types.Mesh, dict[int, bpy.types.Material]]] = {}

    def bake(self) -> None:
        """Replaces meshes and materials of all objects that need it."""
        jobs = bake_jobs.find_jobs(self.settings, self.fail)
        count = sum(len(job.lost) for job in jobs)
        if count == 0:
            return
        size = self.size
        while count * IMAGES * size * size > MAX_TEXELS and size > MIN_SIZE:
            size //= 2
        if size < self.size:
            text = f"baked images have {size} texels a side instead of {self.size}: {count} materials are baked"
            self.warn(f"blinn: {text}")
            self.size = size
        scene = bpy.context.scene
        room = MAX_BAKES
        for job in jobs:
            names = [material.name for material in bake_jobs.materials_of(job.item, job.lost)]
            if room < len(job.lost):
                self.fail(names, "there are too many")
                continue
            room -= len(job.lost)
            journal = Journal()
            try:
                self.bake_object(job, scene, journal)
            except CannotBake as reason:
                self.fail(names, str(reason))
            except Exception as error:
                self.fail(names, f"{type(error).__name__}: {error}")
            finally:
                journal.restore()

    def fail(self, names: list[str], reason: str) -> None:
        """Warns once of each material."""
        for name in names:
            if name not in self.reported:
                self.reported.add(name)
                self.warn(f"blinn: material '{name}' is not baked: {reason}")

    def bake_object(self, job: Job, scene: bpy.types.Scene, journal: Journal) -> None:
        """Bakes the materials of an object, and gives it the result."""
        item = job.item
        mesh, applied = evaluate(item, self.settings, self.journal)
        if not applied:
            # Slots may have materials of their object in place of those of its mesh.
            for index, slot in enumerate(item.material_slots):
                mesh.materials[index] = slot.material
        used = job.lost.keys() & set(bake_unwrap.slots_of_faces(mesh).tolist())
        found = [(slot, mesh.materials[slot]) for slot in sorted(used) if slot < len(mesh.materials)]
        materials = {slot: material for slot, material in found if material is not None}
        if not materials:
            return
        key = None
        if not applied and not any(bake_losses.depends_on_object(m) for m in materials.values()):
            key = item.data.name_full, tuple(m and m.name_full for m in mesh.materials)
        if key is None or key not in self.shared:
            found = self.bake_mesh(job, mesh, materials, scene, journal)
            if key is not None:
                self.shared[key] = mesh, found
        else:
            mesh, found = self.shared[key]
        if bake_jobs.can_change(item):
            self.replacements.change(item, mesh, found, applied)
        else:
            self.replacements.write_instead(item, mesh, found)

    def bake_mesh(
        self,
        job: Job,
        mesh: bpy.types.Mesh,
        materials: dict[int, bpy.types.Material],
        scene: bpy.types.Scene,
        journal: Journal,
    ) -> dict[int, bpy.types.Material]:
        """Returns the materials of a mesh with images, by index. Adds the map of these images to the mesh."""
        rest = undeformed(job.item, mesh, self.settings, journal)
        studio = BakeScene(scene.frame_current, scene.frame_subframe)
        try:
            copy = journal.add(bpy.data.meshes, mesh.copy())
            item = studio.add(copy, job.item)
            with studio.context(item):
                name = bake_unwrap.unwrap(mesh, item, list(materials), self.size)
            copy.uv_layers.active = copy.uv_layers[name]
            bake_unwrap.mark_mirrored(copy, name)
            if rest is not None:
                deform(item, rest)
            plans: dict[int, Plan] = {}
            targets = {}
            for slot in range(len(mesh.materials)):
                routed = journal.add(bpy.data.materials, routed_copy(materials.get(slot)))
                if slot in materials:
                    plans[slot] = plan(routed, job.lost[slot], name, journal)
                targets[slot] = Target(routed, self.size if slot in materials else 1, journal)
                copy.materials[slot] = routed
            with studio.context(item):
                baked = bake_passes(plans, targets)
        finally:
            studio.close()
        found = {}
        for slot, material in materials.items():
            result = bake_material.BakedMaterial(material, name, self.journal)
            result.write(plans[slot], baked[slot], job.lost[slot])
            self.names[result.material.name] = material.name
            found[slot] = result.material
            if bake_material.has_soft_mix(plans[slot], baked[slot]) and material.name not in self.reported:
                self.reported.add(material.name)
                text = "has parts with different normals that show through each other: they share one normal map"
                self.warn(f"blinn: material '{material.name}' {text}")
        return found
