"""Scenes: from files, bytes, arrays and trimesh; rendered and traced."""

from __future__ import annotations

import os
from enum import IntEnum
from typing import TYPE_CHECKING, Any, Callable, Iterable, Mapping, NamedTuple, Sequence, Union

import numpy as np
import numpy.typing as npt

from . import _blinn
from ._blinn import Camera, Picture, Pictures
from ._glb import Mesh, write_glb
from ._progress import Progress, progress_callback, shown_progress
from ._trimesh import write_trimesh

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from ._options import LoadOptions, RenderOptions

Source = Union[str, "os.PathLike[str]", bytes, bytearray, memoryview]
Size = Union[int, Sequence[int]]


class HitKind(IntEnum):
    """Kinds of primitives that rays hit."""

    MISS = 0
    TRIANGLE = 1
    POINT = 2
    LINE = 3


class Hits(NamedTuple):
    """The closest hits of n rays. Rays that miss have t = inf, object = 0 and triangle = -1."""

    t: npt.NDArray[np.float32]
    """Distances in lengths of the directions, shape (n,)."""
    object: npt.NDArray[np.uint32]
    """Object ids from 1, as in the layer "object-id", shape (n,)."""
    instance: npt.NDArray[np.int32]
    """Indices of the mesh instances, shape (n,)."""
    triangle: npt.NDArray[np.int32]
    """Indices of the triangles, points or lines in their meshes, shape (n,)."""
    barycentrics: npt.NDArray[np.float32]
    """Weights of the triangles' corners, shape (n, 3). For lines, those of the two ends and 0."""
    points: npt.NDArray[np.float64]
    """The points that are hit, shape (n, 3), metres; NaN for misses. They lie just in front of their triangles, on the
    side of the ray: rays that start there do not hit their own triangle, and `occluded` takes them."""
    kind: npt.NDArray[np.uint8]
    """Kinds of primitives, as `HitKind`, shape (n,)."""


class SceneSource(NamedTuple):
    """The file or bytes that a scene is loaded from, for `pickle` and `write_dataset`."""

    source: str | bytes
    """An absolute path, or the content of a file."""
    name: str | os.PathLike[str] | None
    options: dict[str, Any]

    def load(self) -> "Scene":
        """Load the scene."""
        return Scene(_blinn.Scene.load(self.source, name=self.name, **self.options), self)


def load(
    source: Source, *, name: str | os.PathLike[str] | None = None, **options: Unpack[LoadOptions]
) -> "Scene":
    """Load a .gltf, .glb, .obj, .stl, .ply or .blend file, or the bytes of one of the first five.

    ``name`` is the path that bytes were read from: messages show it, and its folder has the files that the scene
    refers to. Other options are those of the command with underscores: ``format``, ``scene``, ``variant``,
    ``up`` ("y" or "z"), ``scale``, ``mtl_colors``, ``glass``, ``smooth``, ``hide``, ``only_objects``,
    ``allow_outside``, ``max_memory``, ``blender`` (the Blender, or the Python with ``bpy``, that converts .blend files),
    ``bake`` ("auto" or "never") and ``bake_size`` for materials of .blend files that glTF has no form for.

    Defects that do not prevent rendering are issued as `SceneWarning` and listed in ``Scene.warnings``.

    Raises FileNotFoundError, `LoadError`, `LimitError` or `UnsupportedError`.
    """
    if isinstance(source, (bytearray, memoryview)):
        source = bytes(source)
    scene = _blinn.Scene.load(source, name=name, **options)
    # A pickled scene may be loaded in another folder. Messages of this one show the path as it is given.
    kept = source if isinstance(source, bytes) else os.path.abspath(source)
    return Scene(scene, SceneSource(kept, name, dict(options)))


def _restore(source: SceneSource, time: float, animation: str | int | None) -> "Scene":
    """Load a pickled scene."""
    return source.load().pose(time, animation=animation)


class Scene:
    """A scene at a time. It never changes; `pose` returns it at another time.

    Scenes of files are pickled by their paths, others with their data, which they therefore keep.
    """

    def __init__(
        self, scene: _blinn.Scene, source: SceneSource | None = None, animation: str | int | None = None
    ) -> None:
        """Wrap a scene of the extension module. Use `load` or `from_arrays` instead."""
        if not isinstance(scene, _blinn.Scene):
            raise TypeError(
                f"Scene is not made from {type(scene).__name__}: use blinn.load(path or bytes), Scene.from_arrays, "
                "Scene.from_meshes or Scene.from_trimesh"
            )
        self._scene = scene
        self._source = source
        self._animation = animation
        self._info: dict[str, Any] | None = None

    @classmethod
    def from_arrays(
        cls,
        vertices: npt.ArrayLike,
        faces: npt.ArrayLike,
        *,
        normals: npt.ArrayLike | None = None,
        uvs: npt.ArrayLike | None = None,
        colors: npt.ArrayLike | None = None,
        material: Mapping[str, Any] | None = None,
        transforms: npt.ArrayLike | None = None,
        name: str = "mesh",
        **options: Unpack[LoadOptions],
    ) -> "Scene":
        """Build a scene of one mesh. `from_meshes` builds scenes of several.

        - ``vertices``: shape (n, 3), metres. They may be far from the origin.
        - ``faces``: shape (m, 3), indices of vertices, counter-clockwise seen from the front.
        - ``normals``: shape (n, 3), unit length. Without them, faces are flat; ``smooth=60`` makes smooth ones.
        - ``uvs``: shape (n, 2). v runs up, as in OBJ files and trimesh: row 0 of a texture is at v = 1.
        - ``colors``: shape (n, 3) or (n, 4): sRGB in integers from 0 to 255 or uint16, or float linear RGB.
        - ``material``: see `from_meshes`.
        - ``transforms``: shape (4, 4) or (k, 4, 4): places the mesh once or k times.

        >>> quad = Scene.from_arrays([[0, 0, 0], [2, 0, 0], [2, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]])
        >>> quad.triangle_count, quad.bounds.tolist()
        (2, [[0.0, 0.0, 0.0], [2.0, 1.0, 0.0]])
        """
        only = Mesh(
            vertices=vertices,
            faces=faces,
            normals=normals,
            uvs=uvs,
            colors=colors,
            material=material,
            transforms=transforms,
            name=name,
        )
        source = SceneSource(write_glb([only]), "arrays", dict(options))
        return Scene(_blinn.Scene.load(source.source, name=source.name, **options), source)

    @classmethod
    def from_meshes(cls, meshes: Iterable[Mesh | Mapping[str, Any]], **options: Unpack[LoadOptions]) -> "Scene":
        """Build a scene of several meshes: `Mesh` objects, or mappings with the arguments of `from_arrays`.

        A material is a mapping. Colours are linear RGB, images are uint8 or uint16 arrays of shape (height, width, 3 or
        4) with row 0 on top:

        - ``base_color`` (3 or 4 numbers; by default 0.8, and 1 beside a texture or colours of vertices, which it
          multiplies), ``base_color_texture`` (sRGB)
        - ``metallic`` (default 0), ``roughness`` (default 0.6), ``metallic_roughness_texture`` (green: roughness, blue:
          metallic; beside it both are 1 by default)
        - ``normal_texture``, ``occlusion_texture`` (red)
        - ``emissive`` (3 numbers), ``emissive_strength``, ``emissive_texture`` (sRGB)
        - ``specular`` (0 to 1), ``specular_color`` (3 numbers): reflection of what is not metal
        - ``alpha_mode`` ("OPAQUE", "MASK", "BLEND"; by default "BLEND" if a colour or texel is translucent),
          ``alpha_cutoff``
        - ``clearcoat``, ``clearcoat_roughness`` (0 to 1), ``clearcoat_normal_texture``
        - ``sheen_color`` (3 numbers), ``sheen_roughness`` (0 to 1)
        - ``anisotropy`` (0 to 1), ``anisotropy_rotation`` (radians); the mesh needs texture coordinates
        - ``iridescence`` (0 to 1), ``iridescence_ior``, ``iridescence_thickness`` (nanometres): a thin film
        - ``diffuse_transmission`` (0 to 1), ``diffuse_transmission_color`` (3 numbers): paper, leaves
        - ``thickness`` (metres): closed meshes are solid glass or wax; ``dispersion`` of glass (20 over the Abbe number)
        - ``attenuation_color`` (3 numbers), ``attenuation_distance`` (metres): light that the inside absorbs
        - ``double_sided`` (default True), ``ior``, ``transmission`` (0 to 1), ``name``
        """
        converted = [mesh if isinstance(mesh, Mesh) else Mesh(**mesh) for mesh in meshes]
        source = SceneSource(write_glb(converted), "arrays", dict(options))
        return Scene(_blinn.Scene.load(source.source, name=source.name, **options), source)

    @classmethod
    def from_trimesh(cls, mesh: Any, **options: Unpack[LoadOptions]) -> "Scene":
        """Build a scene of a ``trimesh.Trimesh`` or ``trimesh.Scene``, with textures, colours and instances.

        Colours of vertices and faces are sRGB; those with alpha are translucent. Normals of a file, or that were set,
        smooth a mesh; those that trimesh computes do not: use ``smooth=60``.
        """
        source = SceneSource(write_trimesh(mesh), "trimesh", dict(options))
        return Scene(_blinn.Scene.load(source.source, name=source.name, **options), source)

    def pose(self, time: float = 0.0, *, animation: str | int | None = None) -> "Scene":
        """Return the scene at a time in seconds, 0 or later. It shares the data of this one.

        ``animation`` is a name or an index, "all" or "none" (the rest pose).
        """
        kept = self._animation if animation is None else animation
        return Scene(self._scene.pose(time, animation=animation), self._source, kept)

    def __reduce__(self) -> tuple[Callable[..., "Scene"], tuple[Any, ...]]:
        if self._source is None:
            raise TypeError("only scenes of load() and of the constructors from_… can be pickled")
        return _restore, (self._source, self.time, self._animation)

    @property
    def time(self) -> float:
        """Time in seconds."""
        return self._scene.time

    @property
    def duration(self) -> float:
        """Length of the animation in seconds."""
        return self._scene.duration

    @property
    def warnings(self) -> list[str]:
        """Warnings of the import."""
        return self._scene.warnings

    @property
    def triangle_count(self) -> int:
        """Number of triangles, those of shared meshes counted once for each instance."""
        return self._scene.triangle_count

    @property
    def bounds(self) -> npt.NDArray[np.float64]:
        """The lowest and the highest corner of all that can be seen, shape (2, 3), metres; NaN if that is nothing."""
        return self._scene.bounds

    @property
    def cameras(self) -> list[Camera]:
        """The file's cameras at this time."""
        return self._scene.cameras

    @property
    def info(self) -> dict[str, Any]:
        """All that ``blinn info --json`` prints."""
        if self._info is None:
            self._info = self._scene.info()
        return self._info

    @property
    def lights(self) -> list[dict[str, Any]]:
        """The file's lights: name, node, kind, linear colour and intensity."""
        return list(self.info["lights"])

    @property
    def materials(self) -> list[dict[str, Any]]:
        """The materials. Number i of the layer "material-id" is ``materials[i - 1]``."""
        return list(self.info["materials"])

    @property
    def objects(self) -> list[str]:
        """The names of the objects. Number i of the layer "object-id" is ``objects[i - 1]``."""
        return [entry["name"] for entry in self.info["object_ids"]]

    @property
    def animations(self) -> list[dict[str, Any]]:
        """The animations: name, number of channels and length in seconds."""
        return list(self.info["animations"])

    def render(
        self,
        camera: Camera | str | int | None = None,
        size: Size | None = None,
        samples: int = 4,
        layers: str | Sequence[str] = (),
        progress: Progress | None = None,
        **options: Unpack[RenderOptions],
    ) -> Picture:
        """Render a picture.

        - ``camera``: a `Camera`, or name or index of one of the file's; by default the file's first, else a view of all.
        - ``size``: (width, height), or one number for both; by default the camera's.
        - ``samples``: per pixel.
        - ``layers``: a name or several of "depth" (metres along the view direction, inf where nothing is), "normal",
          "vertex-normal", "geometric-normal", "position", "albedo", "uv", "mask", "object-id", "material-id", "steps",
          "distance", "camera-normal", "camera-position", "nocs", "barycentric", "triangle-id", "cryptomatte" for
          ``Picture.matte``, and the light of the picture in layers that add up to it: "diffuse-direct",
          "diffuse-indirect", "specular-direct", "specular-indirect", "emission", "environment". Flow leads from frame to
          frame, so only the command has it.
        - ``progress``: called with the finished fraction, 0 to 1, in this thread; True shows a bar, of tqdm if it is
          installed.
        - ``options``: those of the command with underscores, such as ``lights="headlight"``, ``hdri="studio.hdr"``,
          ``exposure=0``, ``background="transparent"``, ``ao=16``; `render_options` lists them. True stands for a flag
          without value, a tuple of numbers for a vector, a list for a flag that is repeated.

        Raises ValueError for values that the command would not take, TypeError for unknown options and `RenderError`.
        """
        with shown_progress(progress) as callback:
            return self._scene.render(camera, size, samples, _names(layers), callback, **options)

    def render_many(
        self,
        cameras: Iterable[Camera],
        size: Size | None = None,
        samples: int = 4,
        layers: str | Sequence[str] = (),
        progress: Progress | None = None,
        **options: Unpack[RenderOptions],
    ) -> Pictures:
        """Render a picture from each camera on all cores, and yield them in order as they finish.

        Exposure and lights are resolved once, for the first camera. Other arguments are those of `render`. Rendering
        goes on while the pictures are used, at most a few pictures ahead. ``close()`` ends it early.

        >>> triangle = Scene.from_arrays([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
        >>> cameras = [Camera.look_at((x, 0, 4), (0.3, 0.3, 0)) for x in (-1, 0, 1)]
        >>> [int(picture["mask"].sum() > 0) for picture in triangle.render_many(cameras, (32, 32), layers="mask")]
        [1, 1, 1]
        """
        callback = progress_callback(progress)
        return self._scene.render_many(list(cameras), size, samples, _names(layers), callback, **options)

    def intersect(
        self,
        origins: npt.ArrayLike,
        directions: npt.ArrayLike,
        *,
        cull_back_faces: bool = False,
        point_size: float | str = "auto",
        line_width: float | str = "auto",
    ) -> Hits:
        """Find the closest hits of rays.

        ``origins`` and ``directions`` have shape (n, 3). Directions may have any length; t counts in it.
        ``point_size`` and ``line_width`` are the diameter of points and the width of lines in metres, or "off".
        "auto" makes points as large as closes the gaps of their cloud; lines without a width are not hit.

        >>> triangle = Scene.from_arrays([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
        >>> hits = triangle.intersect([[0.25, 0.25, 2], [5, 5, 2]], [[0, 0, -1], [0, 0, -1]])
        >>> hits.t.tolist(), hits.triangle.tolist(), hits.barycentrics[0].tolist()
        ([2.0, inf], [0, -1], [0.5, 0.25, 0.25])
        """
        hits = self._scene.intersect(
            np.asarray(origins, np.float64),
            np.asarray(directions, np.float64),
            cull_back_faces=cull_back_faces,
            point_size=str(point_size),
            line_width=str(line_width),
        )
        return Hits(**hits)

    def occluded(
        self,
        from_points: npt.ArrayLike,
        to_points: npt.ArrayLike,
        *,
        from_hits: Hits | None = None,
        point_size: float | str = "off",
        line_width: float | str = "off",
    ) -> npt.NDArray[np.bool_]:
        """Find whether something blocks the way between two points, for each row of arrays of shape (n, 3).

        The points themselves may lie on surfaces: what is nearer to an end than the rounding of single precision does
        not count. ``from_hits`` are the hits that the ways start at, whose triangles do not block them.
        Translucent surfaces block nothing. Points and lines block with ``point_size`` and ``line_width`` in metres.

        >>> triangle = Scene.from_arrays([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
        >>> hits = triangle.intersect([[0.25, 0.25, 2]], [[0, 0, -1]])
        >>> triangle.occluded(hits.points, [[0, 0, 9]], from_hits=hits).tolist()
        [False]
        """
        sources = None if from_hits is None else (from_hits.instance, from_hits.triangle)
        return self._scene.occluded(
            np.asarray(from_points, np.float64),
            np.asarray(to_points, np.float64),
            sources=sources,
            point_size=str(point_size),
            line_width=str(line_width),
        )

    def __repr__(self) -> str:
        return repr(self._scene)


def _names(layers: str | Sequence[str]) -> list[str]:
    """Return the names of layers as a list."""
    return [layers] if isinstance(layers, str) else list(layers)
