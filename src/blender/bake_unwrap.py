"""Texture coordinates for baking: those of a mesh where no point of a texture is used twice, else new ones."""

from __future__ import annotations

import bpy
import numpy

from .bake_anisotropy import SIDE
from .bake_values import CannotBake

LAYER = "blinn bake"
MAX_LAYERS = 8  # Of a mesh in Blender.
GRID = 512
# Shares of a texture: the least that a usable map covers, and the most that it covers twice.
MIN_COVERED = 0.05
MAX_OVERLAP = 0.002
# Points that are tested at once.
BATCH = 1 << 22
# Texels between islands.
GAP = 4
UNWRAP_ANGLE = 1.15  # Radians.


def coordinates(mesh: bpy.types.Mesh, layer: bpy.types.MeshUVLoopLayer) -> numpy.ndarray:
    """Returns the coordinates of all corners, N x 2."""
    found = numpy.empty(2 * len(mesh.loops), dtype=numpy.float32)
    layer.uv.foreach_get("vector", found)
    return found.reshape(-1, 2)


def slots_of_faces(mesh: bpy.types.Mesh) -> numpy.ndarray:
    """Returns the index of the material of each face."""
    slots = numpy.empty(len(mesh.polygons), dtype=numpy.int32)
    mesh.polygons.foreach_get("material_index", slots)
    return numpy.clip(slots, 0, max(len(mesh.materials) - 1, 0))


def is_usable(mesh: bpy.types.Mesh, uv: numpy.ndarray, slot: int) -> bool:
    """Returns True if the faces of a material are apart and inside of the texture."""
    mesh.calc_loop_triangles()
    count = len(mesh.loop_triangles)
    corners, faces = numpy.empty(3 * count, dtype=numpy.int32), numpy.empty(count, dtype=numpy.int32)
    mesh.loop_triangles.foreach_get("loops", corners)
    mesh.loop_triangles.foreach_get("polygon_index", faces)
    triangles = uv[corners.reshape(-1, 3)[slots_of_faces(mesh)[faces] == slot]]
    if not numpy.isfinite(triangles).all() or triangles.size == 0:
        return False
    if triangles.min() < -1e-4 or triangles.max() > 1.0 + 1e-4:
        return False
    covers = coverage(triangles)
    covered = numpy.count_nonzero(covers)
    twice = numpy.count_nonzero(covers > 1)
    return covered >= MIN_COVERED * covers.size and twice <= MAX_OVERLAP * covered


def coverage(triangles: numpy.ndarray) -> numpy.ndarray:
    """Returns for each point of a grid how many triangles contain it."""
    points = triangles.astype(numpy.float64) * GRID - 0.5
    low = numpy.ceil(points.min(axis=1)).astype(numpy.int64)
    width = (numpy.floor(points.max(axis=1)).astype(numpy.int64) - low + 1).max(axis=1)
    counts = numpy.zeros(GRID * GRID, dtype=numpy.int64)
    side = 1
    while side < 2 * GRID:
        # Triangles of about the same size have the same number of points around them.
        chosen = numpy.flatnonzero((width > side // 2) & (width <= side))
        step = max(1, BATCH // (side * side))
        offsets = numpy.stack(numpy.meshgrid(numpy.arange(side), numpy.arange(side)), axis=-1).reshape(1, -1, 2)
        for start in range(0, len(chosen), step):
            part = chosen[start : start + step]
            at = low[part][:, None, :] + offsets
            inside = contains(points[part], at) & ((at >= 0) & (at < GRID)).all(axis=2)
            index = (at[..., 1] * GRID + at[..., 0])[inside]
            counts += numpy.bincount(index, minlength=GRID * GRID)
        side *= 2
    return counts


def contains(triangles: numpy.ndarray, points: numpy.ndarray) -> numpy.ndarray:
    """Returns which points lie inside of their triangle, edges excluded."""
    signs = []
    for i in range(3):
        start, end = triangles[:, i, None, :], triangles[:, (i + 1) % 3, None, :]
        edge, to = end - start, points - start
        signs.append(edge[..., 0] * to[..., 1] - edge[..., 1] * to[..., 0])
    return ((signs[0] > 0) & (signs[1] > 0) & (signs[2] > 0)) | ((signs[0] < 0) & (signs[1] < 0) & (signs[2] < 0))


def unwrap(mesh: bpy.types.Mesh, item: bpy.types.Object, slots: list[int], size: int) -> str:
    """Returns the name of a map in which the faces of each of the materials are apart.

    ``item`` is a temporary object of the active scene, whose mesh is a copy of ``mesh``.
    """
    layer = next((layer for layer in mesh.uv_layers if layer.active_render), None)
    uv = numpy.zeros((len(mesh.loops), 2), numpy.float32) if layer is None else coordinates(mesh, layer)
    missing = [slot for slot in slots if layer is None or not is_usable(mesh, uv, slot)]
    if not missing:
        return layer.name
    if len(mesh.uv_layers) >= MAX_LAYERS:
        raise CannotBake("its mesh has no room for another UV map")
    copy = item.data
    new = copy.uv_layers.new(name=LAYER)
    copy.uv_layers.active = new
    name = new.name
    faces = slots_of_faces(mesh)
    corners = numpy.empty(len(mesh.polygons), dtype=numpy.int32)
    mesh.polygons.foreach_get("loop_total", corners)
    for slot in missing:
        mine = numpy.repeat(faces == slot, corners)
        project(item, faces == slot, size)
        found = coordinates(copy, copy.uv_layers[name])
        if not same_corners(mesh, copy):
            raise CannotBake("its mesh is not valid")
        uv[mine] = found[mine]
    mesh.uv_layers.new(name=name, do_init=False).uv.foreach_set("vector", uv.ravel())
    copy.uv_layers[name].uv.foreach_set("vector", uv.ravel())
    return name


def project(item: bpy.types.Object, is_chosen: numpy.ndarray, size: int) -> None:
    """Unwraps faces of the active object by projections."""
    mesh = item.data
    for elements in (mesh.polygons, mesh.edges, mesh.vertices):
        elements.foreach_set("hide", numpy.zeros(len(elements), dtype=bool))
        elements.foreach_set("select", numpy.zeros(len(elements), dtype=bool))
    mesh.polygons.foreach_set("select", is_chosen)
    bpy.ops.object.mode_set(mode="EDIT")
    try:
        bpy.ops.uv.smart_project(angle_limit=UNWRAP_ANGLE, island_margin=GAP / size, margin_method="FRACTION")
    finally:
        bpy.ops.object.mode_set(mode="OBJECT")


def same_corners(mesh: bpy.types.Mesh, copy: bpy.types.Mesh) -> bool:
    """Returns True if two meshes have the same vertices at the same corners."""
    indices = []
    for each in (mesh, copy):
        found = numpy.empty(len(each.loops), dtype=numpy.int32)
        each.loops.foreach_get("vertex_index", found)
        indices.append(found)
    return numpy.array_equal(*indices)


def mark_mirrored(mesh: bpy.types.Mesh, map_name: str) -> None:
    """Gives each face -1 where a map shows it mirrored, else 1."""
    mesh.calc_loop_triangles()
    count = len(mesh.loop_triangles)
    corners, faces = numpy.empty(3 * count, dtype=numpy.int32), numpy.empty(count, dtype=numpy.int32)
    mesh.loop_triangles.foreach_get("loops", corners)
    mesh.loop_triangles.foreach_get("polygon_index", faces)
    a, b, c = coordinates(mesh, mesh.uv_layers[map_name])[corners.reshape(-1, 3)].transpose(1, 0, 2)
    areas = (b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (b[:, 1] - a[:, 1]) * (c[:, 0] - a[:, 0])
    totals = numpy.bincount(faces, weights=areas, minlength=len(mesh.polygons))
    sides = numpy.where(totals < 0.0, -1.0, 1.0).astype(numpy.float32)
    mesh.attributes.new(SIDE, "FLOAT", "FACE").data.foreach_set("value", sides)
