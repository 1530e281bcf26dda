"""Converts scenes of trimesh to the arrays of meshes."""

from __future__ import annotations

import warnings
from typing import Any, Iterator

import numpy as np
import numpy.typing as npt

from ._blinn import SceneWarning
from ._glb import Mesh, Writer

# Normals that trimesh computes are in double precision, those of files in single precision.
_COMPUTED = 1e-10
# Normals turn by about so many roundings of the coordinates over the height of a triangle.
_ROUNDINGS = 4.0
# The diffuse colour of a `SimpleMaterial` that has none.
_DEFAULT_COLOR = (102, 102, 102, 255)


def write_trimesh(source: Any) -> bytes:
    """Return a GLB file of a ``trimesh.Trimesh`` or ``trimesh.Scene``."""
    if not hasattr(source, "metadata"):
        raise TypeError(f"from_trimesh takes a trimesh.Trimesh or trimesh.Scene, not {type(source).__name__}")
    writer = Writer()
    images: dict[int, npt.NDArray[Any]] = {}
    geometries, placements = _contents(source)
    for key, geometry in geometries.items():
        names, transforms = placements.get(key, ([], []))
        if not names:
            continue
        if not hasattr(geometry, "faces"):
            kind = type(geometry).__name__
            warnings.warn(f"trimesh: {key} is a {kind}, of which nothing is shown", SceneWarning, stacklevel=3)
            continue
        for mesh in _meshes(geometry, images):
            mesh.name = key
            mesh.transforms = np.array(transforms)
            writer.mesh(mesh, names)
    if getattr(source, "has_camera", False):
        xfov, yfov = np.radians(source.camera.fov)
        aspect = float(np.tan(xfov / 2) / np.tan(yfov / 2))
        perspective = {"yfov": float(yfov), "aspectRatio": aspect, "znear": float(source.camera.z_near)}
        matrix = np.asarray(source.camera_transform, np.float64)
        writer.camera(matrix, perspective, str(source.camera.name or "camera"))
    return writer.bytes()


def _contents(source: Any) -> tuple[dict[str, Any], dict[str, tuple[list[str], list[Any]]]]:
    """Return geometries by name, and the names and transforms of their nodes."""
    if not hasattr(source, "geometry"):
        name = str(source.metadata.get("name") or "mesh")
        return {name: source}, {name: ([name], [np.eye(4)])}
    placements: dict[str, tuple[list[str], list[Any]]] = {}
    for node in source.graph.nodes_geometry:
        transform, key = source.graph[node]
        names, transforms = placements.setdefault(key, ([], []))
        names.append(str(node))
        transforms.append(transform)
    return dict(source.geometry), placements


def _meshes(geometry: Any, images: dict[int, npt.NDArray[Any]]) -> Iterator[Mesh]:
    """Return the meshes of a geometry: several if its faces have several materials."""
    vertices, faces = np.asarray(geometry.vertices), np.asarray(geometry.faces)
    normals, visual = _given_normals(geometry), geometry.visual
    if visual.kind == "face":
        # Each face has corners of its own, so that its colour ends at its edges.
        corners = faces.ravel()
        yield Mesh(
            vertices=vertices[corners],
            faces=np.arange(len(corners)).reshape(-1, 3),
            normals=None if normals is None else normals[corners],
            colors=np.repeat(np.asarray(visual.face_colors), 3, axis=0),
        )
    elif visual.kind == "vertex":
        yield Mesh(vertices=vertices, faces=faces, normals=normals, colors=np.asarray(visual.vertex_colors))
    elif visual.kind == "texture":
        # Colours beside a texture come from files of glTF, which are linear.
        colors = visual.vertex_attributes.get("color")
        if colors is not None:
            largest = np.iinfo(colors.dtype).max if colors.dtype.kind in "iu" else 1.0
            colors = np.asarray(colors, np.float64) / largest
        parts = getattr(visual.material, "materials", None)
        selected = [(visual.material, faces)]
        if parts and visual.face_materials is not None:
            chosen = np.asarray(visual.face_materials)
            selected = [(part, faces[chosen == i]) for i, part in enumerate(parts) if (chosen == i).any()]
        for material, some in selected:
            yield Mesh(
                vertices=vertices,
                faces=some,
                normals=normals,
                uvs=visual.uv,
                colors=colors,
                material=_material(material, images),
            )
    else:
        yield Mesh(vertices=vertices, faces=faces, normals=normals)


def _given_normals(mesh: Any) -> npt.NDArray[np.float64] | None:
    """Return the normals of a file or a user. trimesh keeps those that it computes in the same place."""
    if "vertex_normals" not in mesh._cache:
        return None
    normals = np.asarray(mesh.vertex_normals)
    plain = type(mesh)(vertices=mesh.vertices, faces=mesh.faces, process=False)
    computed = np.asarray(plain.vertex_normals)
    if normals.shape != computed.shape:
        return normals
    is_computed = (np.abs(normals - computed) <= _COMPUTED + _rounding(plain)[:, None]).all()
    return None if is_computed else normals


def _rounding(mesh: Any) -> npt.NDArray[np.float64]:
    """Return the most that rounded coordinates turn the normal of each vertex: trimesh moves normals with a mesh, also
    to where its coordinates are coarse."""
    vertices, faces = np.asarray(mesh.vertices), np.asarray(mesh.faces)
    rounding = np.zeros(len(vertices))
    if not len(faces):
        return rounding
    corners = vertices[faces]
    edges = corners - np.roll(corners, 1, axis=1)
    longest = np.linalg.norm(edges, axis=2).max(1)
    double_area = np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        turn = np.spacing(np.abs(corners).max((1, 2))) * longest / double_area
    turn = np.where(np.isfinite(turn), _ROUNDINGS * turn, 0.0)
    np.maximum.at(rounding, faces.ravel(), np.repeat(turn, 3))
    return rounding


def _material(material: Any, images: dict[int, npt.NDArray[Any]]) -> dict[str, Any]:
    """Return a material as `blinn.Scene.from_meshes` has it. What glTF leaves out has the values of glTF."""
    is_physical = hasattr(material, "metallicFactor")
    pbr = material if is_physical else material.to_pbr()
    values: dict[str, Any] = {"double_sided": bool(pbr.doubleSided)}
    name = getattr(material, "name", None)
    if name:
        values["name"] = str(name)
    color = _fractions(pbr.baseColorFactor)
    # The grey of a material that was made of an image alone is no factor.
    is_default = not is_physical and np.array_equal(np.asarray(material.diffuse), _DEFAULT_COLOR)
    if is_default and pbr.baseColorTexture is not None:
        color = None
    values["base_color"] = (1.0, 1.0, 1.0) if color is None else color
    values["metallic"] = _value(pbr.metallicFactor, 1.0 if is_physical else 0.0)
    values["roughness"] = _value(pbr.roughnessFactor, 1.0)
    for key, image in [
        ("base_color_texture", pbr.baseColorTexture),
        ("metallic_roughness_texture", pbr.metallicRoughnessTexture),
        ("normal_texture", pbr.normalTexture),
        ("occlusion_texture", pbr.occlusionTexture),
        ("emissive_texture", pbr.emissiveTexture),
    ]:
        if image is not None:
            values[key] = _pixels(image, images)
    if pbr.emissiveFactor is not None:
        values["emissive"] = np.asarray(pbr.emissiveFactor, np.float64)
    elif "emissive_texture" in values:
        values["emissive"] = (0.0, 0.0, 0.0)
    if pbr.alphaMode is not None:
        values["alpha_mode"] = pbr.alphaMode
    elif is_physical and (color is None or color[-1] >= 1.0):
        values["alpha_mode"] = "OPAQUE"
    if pbr.alphaCutoff is not None:
        values["alpha_cutoff"] = float(pbr.alphaCutoff)
    return values


def _value(value: Any, default: float) -> float:
    return default if value is None else float(value)


def _fractions(color: Any) -> npt.NDArray[np.float64] | None:
    """Return a colour of integers or floats as fractions."""
    if color is None:
        return None
    values = np.asarray(color)
    return values / 255.0 if values.dtype.kind in "iu" else values.astype(np.float64)


def _pixels(image: Any, images: dict[int, npt.NDArray[Any]]) -> npt.NDArray[Any]:
    """Return the pixels of a ``PIL.Image``. Materials that share it share the array."""
    if id(image) not in images:
        images[id(image)] = _converted(image)
    return images[id(image)]


def _converted(image: Any) -> npt.NDArray[Any]:
    """Return pixels of 8 bits, or those of 16 bits and floats in 16, which ``PIL.Image.convert`` would cut off."""
    pixels: npt.NDArray[Any] = np.asarray(image)
    if image.mode.startswith("I"):
        return pixels.clip(0, 65535).astype(np.uint16)
    if image.mode == "F":
        fractions: npt.NDArray[np.float64] = np.nan_to_num(pixels.astype(np.float64))
        return (fractions.clip(0, 1) * 65535).round().astype(np.uint16)
    has_alpha = image.mode in ("RGBA", "LA", "PA") or "transparency" in image.info
    return np.asarray(image.convert("RGBA" if has_alpha else "RGB"))
