"""Texture coordinates that materials need and meshes lack.

Without a map, Cycles shows an image at the origin of its texture space. glTF demands the attribute.
"""

from __future__ import annotations

from typing import Any, Iterator

import numpy

from .gltf_types import new_vectors

TRANSFORM = "KHR_texture_transform"
# Of Blender's origin, which is the lower left corner of an image. That of glTF is the upper left corner.
ORIGIN = (0.0, 1.0)


def write(gltf_mesh: Any) -> list[str]:
    """Gives the primitives of a mesh all maps that textures of their materials name.

    Returns the names of materials whose normal maps have no direction there.
    """
    flat = []
    # Primitives that share positions share new maps, too.
    origins: dict[int, Any] = {}
    for primitive in gltf_mesh.primitives or []:
        known = primitive.attributes
        textures = list(textures_of(primitive))
        needed = 1 + max(map(map_of, textures), default=-1)
        missing = [name for name in map(name_of, range(needed)) if name not in known]
        positions = known.get("POSITION")
        if not missing or positions is None:
            continue
        if id(positions) not in origins:
            origins[id(positions)] = new_vectors(numpy.tile(ORIGIN, (positions.count, 1)))
        # Other primitives may have the same dictionary.
        primitive.attributes = {**known, **dict.fromkeys(missing, origins[id(positions)])}
        if any(hasattr(texture, "scale") and name_of(map_of(texture)) in missing for texture in textures):
            flat.append(primitive.material.name)
    return flat


def name_of(index: int) -> str:
    """Returns the attribute of a map."""
    return f"TEXCOORD_{index}"


def map_of(texture: Any) -> int:
    """Returns the index of a texture's map, which a transform may replace."""
    transform = (texture.extensions or {}).get(TRANSFORM)
    values = getattr(transform, "extension", transform) or {}
    return values.get("texCoord", texture.tex_coord or 0)


def textures_of(primitive: Any) -> Iterator[Any]:
    """Yields the references to textures of all materials of a primitive, those of variants included."""
    waiting, seen = [primitive.material, primitive.extensions], set()
    while waiting:
        value = waiting.pop()
        if id(value) in seen:
            continue
        seen.add(id(value))
        if hasattr(value, "tex_coord"):
            yield value
        elif isinstance(value, dict):
            waiting.extend(value.values())
        elif isinstance(value, (list, tuple)):
            waiting.extend(value)
        elif hasattr(value, "extension"):
            waiting.append(value.extension)
        elif hasattr(value, "to_dict"):
            waiting.extend(vars(value).values())
