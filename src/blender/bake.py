"""Bakes what glTF cannot hold of materials to images, for the time of an export."""

from __future__ import annotations

from typing import Any, Callable, Iterable, NamedTuple

import bpy
import numpy

from . import bake_material, bake_scene, bake_unwrap, material_loss
from .bake_routes import COLORS, NORMALS, VALUES, CannotBake, Router, Values, is_socket
from .bake_scene import BakeScene, Target
from .journal import Journal
from .mesh_evaluation import evaluate, undeformed

MAX_BAKES = 1024  # Materials of objects.
MAX_TEXELS = 1 << 27
MIN_SIZE = 64
# Images of a material, about.
IMAGES = 3

# Nodes, and outputs of texture coordinates, whose values differ or do not differ between objects with the same mesh.
OF_OBJECTS = {f"ShaderNode{name}" for name in ("ObjectInfo", "NewGeometry", "ParticleInfo", "VectorTransform")}
OF_MESHES = {"UV", "Generated", "Object"}

Warn = Callable[[str], None]


class Job(NamedTuple):
    """An object, and the values to bake of each of its materials, by their index; None for all."""

    item: bpy.types.Object
    lost: dict[int, set[str] | None]


class Baker:
    """Bakes the materials of the objects of a scene, and gives them back what they had."""

    def __init__(self, settings: dict[str, Any], size: int, warn: Warn) -> None:
        self.settings, self.size, self.warn = settings, size, warn
        self.journal = Journal()
        # Names of materials and meshes that are exported in place of others.
        self.names: dict[str, str] = {}
        self.mesh_names: dict[str, str] = {}
        self.reported: set[str] = set()
        self.shared: dict[Any, tuple[bpy.types.Mesh, dict[int, bpy.types.Material]]] = {}

    def restore(self) -> None:
        """Undoes everything."""
        self.journal.restore()

    def bake(self) -> None:
        """Replaces meshes and materials of all objects that need it."""
        jobs = self.jobs()
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
            names = [material.name for material in materials_of(job.item, job.lost)]
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

    def jobs(self) -> list[Job]:
        """Returns the objects with materials that need it."""
        graph = bpy.context.evaluated_depsgraph_get()
        items, instancers = {}, set()
        for instance in graph.object_instances:
            items.setdefault(instance.object.original.name_full, instance.object.original)
            if instance.is_instance and instance.parent is not None:
                instancers.add(instance.parent.original.name_full)
        found = []
        known: dict[str, set[str] | None] = {}
        for name in sorted(items):
            item = items[name]
            if item.type not in {"MESH", "CURVE", "SURFACE", "FONT"}:
                continue
            lost = {}
            for slot, material in enumerate(final_materials(item, graph, self.settings)):
                if material is None:
                    continue
                if material.name_full not in known:
                    known[material.name_full] = bake_material.lost_values(material)
                values = known[material.name_full]
                if values is None or values:
                    lost[slot] = values
            names = [material.name for material in materials_of(item, lost)]
            if lost and self.can_bake(item, names, name in instancers):
                found.append(Job(item, lost))
        return found

    def can_bake(self, item: bpy.types.Object, names: list[str], is_instancer: bool) -> bool:
        """Returns True for an object that is exported and whose mesh may be replaced; else, warns."""
        is_left_out = self.settings["gltf_selected"] and not item.select_get()
        if is_left_out and item.name in bpy.context.view_layer.objects:
            return False
        if self.settings["gltf_renderable"] and item.hide_render:
            return False
        reason = None
        if item.type != "MESH":
            reason = f"'{item.name}' is not a mesh"
        elif item.library is not None or item.data.library is not None or item.override_library is not None:
            reason = f"'{item.name}' belongs to another file"
        elif item.particle_systems or is_instancer:
            reason = f"'{item.name}' makes instances"
        if reason is not None:
            self.fail(names, reason)
        return reason is None

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
        if not applied and not any(depends_on_object(m) for m in materials.values()):
            key = item.data.name_full, tuple(m and m.name_full for m in mesh.materials)
        if key is None or key not in self.shared:
            found = self.bake_mesh(job, mesh, materials, scene, journal)
            if key is not None:
                self.shared[key] = mesh, found
        else:
            mesh, found = self.shared[key]
        self.replace(item, mesh, found, applied)

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
            if rest is not None:
                deform(item, rest)
            plans = {}
            targets = {}
            for slot in range(len(mesh.materials)):
                routed = journal.add(bpy.data.materials, routed_copy(materials.get(slot)))
                if slot in materials:
                    plans[slot] = plan(routed, job.lost[slot], journal)
                targets[slot] = Target(routed, self.size if slot in materials else 1, journal)
                copy.materials[slot] = routed
            with studio.context(item):
                baked = bake_passes(plans, targets)
        finally:
            studio.close()
        found = {}
        for slot, material in materials.items():
            result = bake_material.BakedMaterial(material, name, self.journal)
            values, principled = plans[slot].values, plans[slot].principled
            result.write(values, principled, baked[slot], job.lost[slot] is None)
            self.names[result.material.name] = material.name
            found[slot] = result.material
        return found

    def replace(
        self, item: bpy.types.Object, mesh: bpy.types.Mesh, materials: dict[int, bpy.types.Material], applied: bool
    ) -> None:
        """Gives an object the mesh and the materials that were baked."""
        links = [(slot.link, slot.material) for slot in item.material_slots]
        old = item.data

        def restore() -> None:
            item.data = old
            for slot, (link, material) in zip(item.material_slots, links):
                slot.link = link
                if link == "OBJECT":
                    slot.material = material

        self.journal.undo.append(restore)
        self.mesh_names[mesh.name] = old.name
        item.data = mesh
        for slot in range(len(mesh.materials)):
            if slot < len(item.material_slots):
                item.material_slots[slot].link = "DATA"
            mesh.materials[slot] = materials.get(slot) or mesh.materials[slot]
        if applied:
            for modifier in item.modifiers:
                if modifier.type != "ARMATURE" or not self.settings["gltf_skins"]:
                    self.journal.set(modifier, "show_viewport", False)


class Plan(NamedTuple):
    """The values of a routed material, and those that are baked."""

    values: Values
    principled: bpy.types.Node | None
    wanted: list[str]


def plan(material: bpy.types.Material, lost: set[str] | None, journal: Journal) -> Plan:
    """Returns what is baked of a material whose nodes may be changed."""
    router = Router()
    shader = material_loss.surface_of(material)
    try:
        values = router.values(material.node_tree, shader)
    finally:
        for group in router.groups:
            journal.add(bpy.data.node_groups, group)
    wanted = [n for n in (*COLORS, *VALUES, *NORMALS) if is_socket(values.get(n)) and (lost is None or n in lost)]
    if lost is not None and "Normal" in lost and not is_socket(values.get("Normal")):
        # A bump of the output alone.
        diffuse = material.node_tree.nodes.new("ShaderNodeBsdfDiffuse")
        values = {**values, "Normal": diffuse.outputs[0]}
        wanted.append("Normal")
    return Plan(values, router.principled, wanted)


def routed_copy(material: bpy.types.Material | None) -> bpy.types.Material:
    """Returns a copy of a material, or one that is black, for baking."""
    if material is not None:
        copy = material.copy()
        if not material_loss.has_bump(material):
            for link in copy.node_tree.get_output_node("CYCLES").inputs["Displacement"].links:
                copy.node_tree.links.remove(link)
        return copy
    new = bpy.data.materials.new(bake_scene.NAME)
    if bpy.app.version < (5, 0, 0):
        new.use_nodes = True
    return new


def bake_passes(plans: dict[int, Plan], targets: dict[int, Target]) -> dict[int, dict[str, numpy.ndarray]]:
    """Returns the pixels of each value of each material."""
    found: dict[int, dict[str, numpy.ndarray]] = {slot: {} for slot in plans}
    groups = [[name] for name in COLORS] + [list(VALUES[:3]), list(VALUES[3:])] + [[name] for name in NORMALS]
    for names in groups:
        present = {slot: [n for n in names if n in plan.wanted] for slot, plan in plans.items()}
        if not any(present.values()):
            continue
        is_normal = names[0] in NORMALS
        for slot, target in targets.items():
            mine = [plans[slot].values[name] for name in present.get(slot, [])]
            if not mine:
                target.show_color((0.0, 0.0, 0.0))
            elif is_normal:
                target.show_shader(mine[0])
            elif names[0] in COLORS:
                target.show_color(mine[0])
            else:
                target.show_numbers(mine)
        bake_scene.bake("NORMAL" if is_normal else "EMIT")
        for slot, mine in present.items():
            pixels = targets[slot].pixels() if mine else None
            for channel, name in enumerate(mine):
                found[slot][name] = pixels[..., channel] if name in VALUES else pixels
    return found


def deform(item: bpy.types.Object, rest: numpy.ndarray) -> None:
    """Keeps the shape of an object, and gives it the coordinates that generated textures have before deformations."""
    mesh = item.data
    shape = numpy.empty(3 * len(mesh.vertices), dtype=numpy.float32)
    mesh.vertices.foreach_get("co", shape)
    mesh.vertices.foreach_set("co", rest)
    item.shape_key_add(name="Rest", from_mix=False)
    key = item.shape_key_add(name="Shape", from_mix=False)
    key.data.foreach_set("co", shape)
    key.value = 1.0
    mesh.update()


def depends_on_object(material: bpy.types.Material) -> bool:
    """Returns True for a material that differs between objects with the same mesh."""
    shader = material_loss.surface_of(material)
    for node in material_loss.upstream(shader) if shader is not None else []:
        if node.bl_idname in OF_OBJECTS:
            return True
        used = {output.name for output in node.outputs if output.is_linked}
        if node.bl_idname == "ShaderNodeTexCoord" and (used - OF_MESHES or node.object is not None):
            return True
    return False


def materials_of(item: bpy.types.Object, lost: Iterable[int]) -> list[bpy.types.Material]:
    """Returns the materials of an object that are to be baked."""
    slots = item.material_slots
    return [slots[i].material for i in lost if i < len(slots) and slots[i].material is not None]


def final_materials(
    item: bpy.types.Object, graph: bpy.types.Depsgraph, settings: dict[str, Any]
) -> list[bpy.types.Material | None]:
    """Returns the materials that an object is exported with."""
    own = [slot.material for slot in item.material_slots]
    if item.type == "MESH" and settings["gltf_apply"] and item.modifiers:
        evaluated = item.evaluated_get(graph)
        # Geometry nodes may add some.
        added = [m and m.original for m in evaluated.data.materials[len(own) :]]
        return own + added
    return own
