"""Renders glTF and OBJ mesh scenes on the CPU, without a GPU or a display.

>>> import blinn
>>> scene = blinn.Scene.from_arrays([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
>>> picture = scene.render(size=(64, 48), layers=["depth"])
>>> picture.rgba.shape, picture.rgba.dtype.name
((48, 64, 4), 'uint8')
>>> picture["depth"].shape
(48, 64)

Arrays are C-contiguous. Images have row 0 on top. The world is right-handed with +Y up, in metres. Pictures equal those
of the command ``blinn`` bit for bit.
"""

from ._blinn import (
    Camera,
    Error,
    LimitError,
    LoadError,
    Picture,
    Pictures,
    RenderError,
    SceneWarning,
    UnsupportedError,
    __version__,
    load_cameras,
    render_options,
    set_threads,
)
from ._dataset import write_dataset
from ._glb import Mesh
from ._scene import HitKind, Hits, Scene, load

__all__ = [
    "Camera",
    "Error",
    "HitKind",
    "Hits",
    "LimitError",
    "LoadError",
    "Mesh",
    "Picture",
    "Pictures",
    "RenderError",
    "Scene",
    "SceneWarning",
    "UnsupportedError",
    "__version__",
    "load",
    "load_cameras",
    "render_options",
    "set_threads",
    "write_dataset",
]
