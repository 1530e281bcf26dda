"""Types of options, for editors and type checkers. Generated from the table of options; `just pytest` compares it.

Rewrite it with ``GOLDEN=update just pytest -k test_options``.
"""

from __future__ import annotations

import os
from typing import Literal, Sequence, TypedDict, Union

Path = Union[str, "os.PathLike[str]"]
Number = Union[float, str]
Vector = Union[Sequence[float], str]
Names = Union[str, Sequence[str]]


class LoadOptions(TypedDict, total=False):
    """Options of `load` and of the constructors of `Scene`."""

    format: Literal["gltf", "glb", "obj", "stl", "ply"] | None
    """Format of the scene files, which is otherwise detected."""

    blender: Path | None
    """Program that converts .blend files: Blender 4.2 or later, or a Python with the module bpy [default: $BLINN_BLENDER, or the newest on PATH]"""

    bake: Literal["never", "auto"] | None
    """Nodes of materials in .blend files that glTF has no form for: auto bakes them to images with Cycles, never leaves them out with a warning [default: the scene's setting, or never]"""

    bake_size: Number | None
    """Texels on a side of baked images [default: the scene's setting, or 1024]"""

    scene: Union[str, int] | None
    """Scene within the file, by name or index."""

    variant: str | None
    """Material variant of a glTF file, by name; none for the default materials."""

    up: Literal["y", "z"] | None
    """Up axis of the file [default: z for STL and PLY, y for others]"""

    scale: Number | None
    """Multiply all lengths of the file, such as 0.001 for millimetres that are written as metres [default: 1]"""

    mtl_colors: Literal["auto", "srgb", "linear"] | None
    """Encoding of the colours in MTL files: srgb, linear, or auto to decide by the exporter."""

    glass: Literal["auto", "thin", "solid"] | None
    """Transmissive meshes: thin walls, solid bodies that refract, or auto to decide by volumes, exporter and closed surfaces."""

    smooth: Number | None
    """Recompute normals: smooth across edges below ANGLE degrees, or flat (off); file keeps the file's, and auto too, except for programs that smooth-shade everything."""

    only_objects: Names | None
    """Render only the objects that match GLOB, and their children (repeatable)."""

    hide: Names | None
    """Hide the objects and lights that match GLOB (repeatable)."""

    allow_outside: bool | None
    """Allow files outside the scene's folder."""

    max_memory: Union[int, str] | None
    """Memory limit, such as 4GiB or a number of bytes."""


class RenderOptions(TypedDict, total=False):
    """Options of `Scene.render` and `Scene.render_many`, but for size and samples."""

    max_size: Number | None
    """Longer side in pixels, for thumbnails: the image has the aspect ratio of the file's camera, or is square."""

    quality: Literal["draft", "standard", "final"] | None
    """Samples and bounced light together: draft (samples='4', indirect='2'), standard (samples='16', indirect='4') or final (samples='128', indirect='8')."""

    adaptive: Number | None
    """Adaptive sampling: use all samples only where neighbouring pixels differ by more than THRESHOLD (0–1), 4 elsewhere."""

    denoise: Literal["auto", "on", "off"] | None
    """Remove the noise of light that few samples find: of area lights, soft shadows, ambient occlusion, indirect light and rough metals (auto), the last with the slower, better filter (on), or of none (off)."""

    filter: Literal["box", "tent", "gaussian", "blackman-harris"] | None
    """Reconstruction filter."""

    background: Union[float, Vector] | None
    """Background: a colour, none (transparent), or the environment of hdri or the file (hdri) [default: .05]"""

    background_blur: Number | None
    """Blur background='hdri': from 0 (sharp) to 1, like the reflection of a surface of that roughness [default: 0]"""

    no_background: bool | None
    """Same as background='transparent'."""

    exposure: Number | None
    """Exposure in stops (EV), or auto to meter the scene."""

    view: Literal["auto", "standard", "agx", "filmic", "pbr-neutral", "raw"] | None
    """View transform from linear light to display colours; auto is agx for Blender's glTF files, filmic before Blender 4.0, else standard."""

    look: Literal["none", "very-low-contrast", "low-contrast", "medium-low-contrast", "medium-contrast", "base-contrast", "medium-high-contrast", "high-contrast", "very-high-contrast", "punchy", "greyscale"] | None
    """Look of the view transform, as in Blender: all but medium-contrast with agx; those named by contrast, except base-contrast, with filmic, standard and pbr-neutral [default: that of the file, else none]"""

    gamma: Number | None
    """Gamma of the display: encoded colours are raised to the power 1/F, backgrounds are not [default: that of the file, else 1]"""

    depth_unit: Number | None
    """Unit of the 16-bit depth beside images, for layers='depth': mm, m or metres per step."""

    crop: Vector | None
    """Render only a region: left, top, width and height in pixels."""

    seed: Number | None
    """Seed of the sample positions."""

    view_point: Vector | None
    """Eye position e."""

    view_dir: Vector | None
    """View direction −w."""

    look_at: Vector | None
    """Point to look at, instead of a view direction."""

    view_up: Vector | None
    """Up direction."""

    proj_distance: Number | None
    """Distance d of the view rectangle from the eye."""

    view_width: Number | None
    """Width of the view rectangle."""

    view_height: Number | None
    """Height of the view rectangle."""

    yfov: Number | None
    """Vertical field of view, instead of a height."""

    view_rect: Vector | None
    """View rectangle at distance d, instead of a width and height; off-centre unless L = −R and B = −T."""

    intrinsics: Vector | None
    """View rectangle in pixels of size, instead of a width and height: focal lengths and principal point."""

    shift: Vector | None
    """Move the view rectangle to the right and up, in units of its larger side: Blender's lens shift."""

    aperture_radius: Number | None
    """Radius of the lens's aperture in metres, for a depth of field; 0: all is sharp [default: that of the file's camera, else 0]"""

    focus: Vector | None
    """What is sharp in a depth of field: a distance along the view direction in metres, or a point [default: as for the file's camera, else the point of look_at or the centre of the scene]"""

    aperture_blades: Number | None
    """Number of corners of the aperture, 3 or more, which out-of-focus highlights show; 0: a disc."""

    projection: Literal["perspective", "orthographic"] | None
    """Projection [default: perspective, or that of the file's camera]"""

    camera_orthographic: bool | None
    """Same as projection='orthographic'."""

    orbit: Union[float, Vector] | None
    """Place the camera on a sphere around the scene's centre or look_at."""

    zoom: Number | None
    """Magnify the image by F: divides the size of the view rectangle."""

    camera_azimuth_angle: Number | None
    """Rotate the camera to the right around the point it looks at, in degrees."""

    camera_elevation_angle: Number | None
    """Rotate the camera upwards around the point it looks at, in degrees."""

    camera_xml: Path | None
    """Read the camera from the lecture's <camera> XML block."""

    clip: Vector | None
    """Near and far plane [default: those of the file's camera; off with orbit]"""

    fit: Literal["auto", "horizontal", "vertical"] | None
    """Field of view that the file's camera keeps if the image has another aspect ratio."""

    lights: Names | None
    """Light sources: file, headlight, three-point (a list), or none [default: file, else three-point]"""

    point_light: Union[Vector, Sequence[Vector]] | None
    """Add a point light at X,Y,Z with intensity I (repeatable)."""

    sun: Union[Vector, Sequence[Vector]] | None
    """Add a directional light that travels along DX,DY,DZ with irradiance E (repeatable)."""

    area_light: Union[Vector, Sequence[Vector]] | None
    """Add an area light at X,Y,Z that faces DX,DY,DZ, W by H metres, with radiance L (repeatable)."""

    light_units: Literal["auto", "standard", "unitless", "raw"] | None
    """Unit of the file's light intensities, named as Blender's glTF export names them: standard is candela, lux and nits (683 lm/W), unitless W/sr and W/m², raw Blender's watts. auto takes the unit that the file names, else standard for files from Blender and unitless for others."""

    light_scale: Number | None
    """Multiply the intensity of the file's lights by F [default: 1]"""

    ambient: Union[float, Vector] | None
    """Ambient light I_a: R,G,B or one number, linear; or a displayed colour, as for background."""

    light_radius: Number | None
    """Soft shadows: radius of the lights in metres, 0 for hard shadows [default: that of the file's lights, else 0]"""

    ao: Union[float, Vector] | None
    """Ambient occlusion with SAMPLES rays per pixel, up to DISTANCE metres or inf [default DISTANCE: a quarter of the scene's diagonal]"""

    indirect: Number | None
    """Trace up to N diffuse bounces of light between surfaces, in place of the ambient light."""

    caustics: bool | None
    """With indirect light, add the light that mirrors and glass send to matte surfaces."""

    ground: Literal["shadow", "plane"] | None
    """Add a ground below the scene: a grey plane, or a shadow catcher (shadow)."""

    hdri: Path | None
    """Light the scene with an environment map: .hdr or .exr, twice as wide as high; or with soft boxes (studio) or a clear sky (sky)."""

    hdri_rotate: Number | None
    """Turn the environment about the vertical: counterclockwise seen from above [default: 0]"""

    hdri_strength: Number | None
    """Multiply the light of the environment by X [default: 1]"""

    no_shadows: bool | None
    """Disable shadows."""

    integrator: Literal["phong", "shadow", "diffuse", "color"] | None
    """Terms of the lecture's shading: color (unlit), diffuse (Lambert), shadow (Lambert with shadows), phong (all)."""

    kd: Union[float, Vector] | None
    """Diffuse coefficient k_d of all materials: R,G,B or one number, linear; or a displayed colour, as for background. Unlit materials, points and lines show it."""

    ks: Union[float, Vector] | None
    """Specular coefficient k_s of all materials: as kd."""

    shininess: Number | None
    """Specular exponent p of all materials."""

    bounces: Number | None
    """Maximum reflections along a path, and three times as many surfaces of glass; 0 disables reflections and refraction."""

    point_size: Number | None
    """Diameter of points: pixels such as 3px, metres such as .01, auto for what closes the gaps of the cloud, or off."""

    line_width: Number | None
    """Width of lines: pixels such as 2px, metres such as .01, auto for a pixel, or off."""

    edges: Names | None
    """Draw edges over the picture: feature (sharp edges and borders), silhouette, boundary (borders of open surfaces), all (of polygons), or several as a list."""

    edge_angle: Number | None
    """Angle by which the surface turns at sharp edges, at least; 30 by default."""

    edge_color: Union[float, Vector] | None
    """Colour of edges: as for background; by default the colour that a glTF file has for them, or black."""

    edge_width: Number | None
    """Width of edges: pixels such as 2px, metres such as .01, or auto (the default) for a pixel; at most 100 pixels."""

    hidden_edges: Literal["off", "dashed", "faint"] | None
    """Edges behind surfaces: not drawn (off, the default), as dashes (dashed), or transparent (faint)."""

    edges_only: bool | None
    """Draw the edges alone, on a transparent background unless background sets one."""

    cull: Literal["auto", "back", "off"] | None
    """Back faces that the camera sees through: those of single-sided materials (auto), of all materials (back), or none (off)."""

    animation: Union[str, int] | None
    """Animation by name or index, all, or none for the rest pose."""
