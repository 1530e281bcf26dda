"""The camera of a viewport in the terms of blinn."""

from __future__ import annotations

from typing import Any

import numpy
from mathutils import Matrix, Vector

# From Blender's axes to those of glTF: (x, y, z) becomes (x, z, -y).
TO_GLTF = Matrix(((1, 0, 0, 0), (0, 0, 1, 0), (0, -1, 0, 0), (0, 0, 0, 1)))


def camera(blinn: Any, view: Matrix, projection: Matrix, size: tuple[int, int]) -> Any:
    """Returns the ``blinn.Camera`` of a view: from the world to it, and from it to OpenGL's clip space."""
    width, height = size
    to_world = TO_GLTF @ view.inverted()
    is_orthographic = projection[3][3] == 1.0
    if is_orthographic:
        # An off-centre view is one from beside it.
        middle = Vector((-projection[0][3] / projection[0][0], -projection[1][3] / projection[1][1], 0.0))
        to_world = to_world @ Matrix.Translation(middle)
        return blinn.Camera.from_matrix(numpy.array(to_world), height=2.0 / projection[1][1])
    # Pixels are counted from the upper left corner.
    intrinsics = [
        [projection[0][0] * width / 2.0, 0.0, (1.0 - projection[0][2]) * width / 2.0],
        [0.0, projection[1][1] * height / 2.0, (1.0 + projection[1][2]) * height / 2.0],
        [0.0, 0.0, 1.0],
    ]
    return blinn.Camera.from_intrinsics(numpy.array(intrinsics), size, numpy.array(to_world), convention="opengl")
