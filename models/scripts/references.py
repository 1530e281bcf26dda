"""Renders reference buffers of the models with Blender's Cycles, to compare with the renderer's own buffers.

    PYTHON references.py ROOT OUT [NAME…]     ROOT: the repository; OUT: cases.json and NAME.exr are written there

PYTHON has `bpy==5.0.1` (Python 3.11) and `OpenEXR`. Every case is imported by Blender's own importer, posed, and
rendered by Cycles with one sample through each pixel's centre (a box filter 0.01 pixels wide), no light, no bounce.
Made twice, the files are the same to the byte.

cases.json: `file` is relative to ROOT/models; without `time` it is the stored pose (`--animation none`), with it
`animation` or all; file cameras keep their clip planes, the others have none (`--clip off`); `twins` must look the
same as the file.

An EXR holds half floats (depth: floats), row 0 at the top, 0 where nothing is hit:

  mask.A        1 where something is hit
  depth.Z       distance along the viewing axis (a float, rounded to 1.2e-4 of its value)
  normal.X/Y/Z  shading normal, with smoothing and normal map, in the file's world space (y up), facing the viewer
  albedo.R/G/B  base colour, linear: factor × texture × vertex colour; no metallic factor, no alpha

Normals and colours are rounded to 1/512, to keep the files small.

Surfaces cut away by MASK are not hit; BLEND surfaces are, whatever their alpha. All faces are double-sided.

Not compared, because Blender's importer is wrong or has no answer:

  * Textures: Cycles filters sRGB bytes before it decodes them. That is expected of files by Blender; for others each
    picture is decoded to linear floats here first, as glTF requires. Wrap modes, transforms and the filter stay the
    importer's and Cycles'. (The importer also reads a picture as data if it is used as occlusion, roughness or normal
    too, as in `torus`.)
  * Skins and morph targets: Blender stores a normal as angles to the mesh's own normal and rotates it
    with that; glTF skins the normal itself, and adds the target's. `patch`, `quantised` and `torus-bent` have
    no normals for this reason; the figure deforms little enough for the median and most of its pixels.
  * CUBICSPLINE: the importer drops the tangents. Times are at keys, where every curve has its value. LINEAR
    rotations are interpolated by component, not along the arc: at keys too (times are multiples of 1/24 s, the scene has 24
    frames/s).
  * map_Bump: the OBJ importer reads a normal map's bytes as sRGB colours; the script marks them as data.
  * Smoothing groups of an OBJ: the importer distinguishes smooth and flat only, so groups in `groups` share no vertices; and
    it resets `s` at an `o`, so `lecture-obj`, where `s 1` comes first, has no normals here (its spheres would be
    flat).
  * No material: Blender has no colour for it. White (as in glTF) for glTF; the buffer is left out for OBJ.
  * EXT_mesh_gpu_instancing, meshopt, KHR_texture_basisu: represented by their uncompressed counterparts, like Draco.
  * Vertex colours are kept as sRGB bytes by the importer: 0.004 of difference, nothing above 1.
  * Points and lines: Blender renders none, and blinn must not either.
"""

import json
import os
import sys
from math import radians
from pathlib import Path

import bpy  # isort: skip (bpy provides numpy and mathutils)
import numpy as np
import OpenEXR
from mathutils import Matrix, Vector

FPS = 24
DEPTH_BITS = 12  # of the mantissa: 1.2e-4 of the value at most
STEPS = 512  # of normals and base colours: 0.1° and 0.001 at most
ALL = ["mask", "depth", "normal", "albedo"]


def look(eye, at, yfov=40.0, up=(0, 1, 0)):
    return {"view_point": list(eye), "look_at": list(at), "view_up": list(up), "yfov": yfov}


def parallel(eye, at, height, up=(0, 1, 0)):
    view = look(eye, at, up=up)
    del view["yfov"]
    return {**view, "projection": "orthographic", "view_height": height}


def case(name, file, view, size=(72, 54), time=None, animation=None, without=(), shows="", **limits):
    """Adds a case. `view`: a camera's name, look() or parallel(); `time`: seconds, or None for the rest pose without
    animation; other arguments: tolerances that are wider for this case."""
    return {
        "name": name,
        "file": file,
        "view": {"camera": view} if isinstance(view, str) else view,
        "size": list(size),
        **({} if time is None else {"time": time}),
        **({} if animation is None else {"animation": animation}),
        "buffers": [b for b in ALL if b not in without],
        "exr": f"{name}.exr",
        **({"limits": limits} if limits else {}),
        "shows": shows,
    }


WIDE, SMALL, TALL = (80, 45), (64, 36), (48, 64)
CASES = [
    case("cornell", "cornell/cornell.glb", "Camera", (60, 59), shows="turned planes, a smooth sphere, a file's camera"),
    case(
        "cornell-obj",
        "cornell/cornell.obj",
        look((0.4, 2.4, 7.6), (0, 1.9, 0), 36),
        shows="Blender's OBJ: vn, `s 0` and `s 1`",
    ),
    case(
        "lecture",
        "lecture/lecture.glb",
        "view-1",
        WIDE,
        shows="meshes without normals (flat) beside smooth ones; no far plane",
    ),
    case(
        "lecture-obj",
        "lecture/lecture.obj",
        look((10, 4.2, 6), (0, 0, 0), 30),
        without=["normal"],
        shows="no vn, fans of n-gons, Kd",
    ),
    case(
        "still-life",
        "still-life/still-life.glb",
        "Camera",
        SMALL,
        shows="checkerboard texture, shared meshes, metals (base colour alone)",
    ),
    case("assembly", "assembly/assembly.glb", "Camera", SMALL, shows="instances in a tree of nodes, negative scales"),
    case(
        "textured-gltf",
        "textured/textured.gltf",
        look((-1.8, 2.6, 3.4), (0, 0.8, 0), 34),
        (64, 48),
        shows="separate files, a name with a space",
    ),
    case(
        "textured-obj",
        "textured/textured.obj",
        look((1.6, 2.4, 3.8), (0, 0.8, 0), 34),
        (64, 48),
        shows="map_Kd, map_Bump that is a normal map, V upwards",
    ),
    case("figure-rest", "figure/figure.glb", "Camera", TALL, shows="the stored pose of skin and morph target"),
    case(
        "figure-walk",
        "figure/figure.glb",
        "Camera",
        TALL,
        time=0.5,
        shows="skin with 17 joints at a key, morph at the same time",
        normal_deg_p95=1.2,
    ),
    case(
        "figure-step",
        "figure/figure.glb",
        look((3.2, 1.5, 3.0), (0, 0.95, 0), 32),
        TALL,
        time=1.25,
        animation="Walk",
        shows="one animation of two, by name, later",
        normal_deg_p95=1.2,
    ),
    case(
        "alpha",
        "alpha/alpha.glb",
        "Perspective",
        WIDE,
        shows="MASK leaves with clamped textures, BLEND panes, vertex colours",
    ),
    case("alpha-ortho", "alpha/alpha.glb", "Orthographic", WIDE, shows="a file's orthographic camera"),
    case("triangle", "tests/triangle.gltf", look((0.4, 0.6, 2.2), (0.3, 0.35, 0)), (48, 36), shows="data URI"),
    case(
        "quad",
        "tests/quad_nonindexed.glb",
        look((0.2, 1.6, -1.8), (0.5, 0.5, 0)),
        (48, 36),
        shows="no indices, no normals, no material; seen from behind",
    ),
    case("cube-obj", "tests/cube.obj", look((3, 2.2, 4), (0, 0, 0)), without=["albedo"], shows="no normals: flat"),
    case(
        "negative-obj",
        "tests/negative.obj",
        look((0.3, 0.7, 3), (0, 0.5, 0)),
        shows="negative indices, map_Kd of 4 × 4 pixels magnified",
    ),
    case(
        "closed-sphere",
        "tests/closed_sphere.obj",
        parallel((2, 1, 3), (0, 0, 0), 2.4),
        (48, 48),
        without=["albedo"],
        shows="parallel view of a flat-shaded ball",
    ),
    case(
        "lights-ortho",
        "tests/lights.glb",
        "Orthographic node",
        WIDE,
        shows="an orthographic camera found by its node's name",
    ),
    case(
        "torus",
        "tests/gltf/torus.glb",
        look((1.8, 2.6, 3.0), (0, 0.1, 0)),
        shows="skin at rest, u8 vertex colours × texture × factor",
    ),
    case(
        "torus-bent",
        "tests/gltf/torus.glb",
        look((1.2, 1.6, 4.6), (0, 0.3, 0)),
        time=0.25,
        without=["normal"],
        shows="skin of three joints, LINEAR rotations and a translation",
    ),
    case(
        "ring",
        "tests/gltf/ring.glb",
        look((1.5, 2.2, 2.6), (0, 0, 0)),
        shows="an open patch with a hole, seen partly from behind",
    ),
    case(
        "patch",
        "tests/gltf/patch.glb",
        look((1.2, 1.8, 2.2), (0, 0, 0)),
        without=["normal"],
        shows="stored morph weights (0.25, 0)",
    ),
    case(
        "patch-wave",
        "tests/gltf/patch.glb",
        look((1.2, 1.8, 2.2), (0, 0, 0)),
        time=0.375,
        without=["normal"],
        shows="two morph targets between keys",
    ),
    case(
        "mixed",
        "tests/gltf/mixed.glb",
        look((1.4, 2.4, 2.4), (0, 0, 0)),
        shows="several primitives, VEC3 and VEC4 colours; lines and points unseen",
    ),
    case(
        "band", "tests/gltf/strip_list.glb", look((0.8, 1.6, 2.2), (0, 0.3, -0.5)), (64, 48), shows="twin of the strips"
    ),
    case(
        "instances",
        "tests/gltf/instances.glb",
        look((7.5, 5.5, 8.5), (0, 1.7, 0)),
        shows="nodes under a turned parent, two of them mirrored",
    ),
    case(
        "quantised",
        "tests/gltf/quantised_twin.glb",
        look((3.0, 2.6, 4.8), (1.5, 0, 0)),
        without=["normal"],
        shows="twin of the quantised files: tiny scale, stored morph weight",
    ),
    case(
        "variants", "tests/gltf/variants.glb", look((1.5, 1.6, 5), (0, 0, 0)), (64, 48), shows="the default materials"
    ),
    case(
        "boards",
        "tests/gltf/basisu_twin.glb",
        look((1.1, 3.0, 2.2), (1.1, 0, 0)),
        shows="normal map without tangents, BLEND texture",
    ),
    case(
        "striped",
        "tests/gltf/blender_plain.glb",
        look((1.6, 2.4, 2.6), (0, 0.3, 0)),
        shows="texture × vertex colours; twin of the Draco and WebP files",
    ),
    case(
        "wrap",
        "tests/references/wrap.gltf",
        look((0.3, 0.4, 4.6), (0, 0, 0)),
        (64, 64),
        shows="wrap modes, texture transforms, UV set 1, NEAREST, MASK",
    ),
    case(
        "motion-rest",
        "tests/references/motion.gltf",
        look((0.6, 1.2, 5.0), (0.1, 0.0, 0), 38),
        shows="matrix, mirrored child, shear, without normals",
    ),
    case(
        "motion",
        "tests/references/motion.gltf",
        look((0.6, 1.2, 5.0), (0.1, 0.0, 0), 38),
        time=0.625,
        shows="STEP and LINEAR between keys, CUBICSPLINE at a key",
    ),
    case(
        "groups",
        "tests/references/groups.obj",
        look((0.6, 2.2, 5.4), (0.5, 0.4, 0), 40),
        shows="n-gons, smoothing groups, negative indices, -s and -o",
    ),
]

# The same scenes in other encodings, in the same folder, compared with the same reference. Their quantization adds to
# the difference; gltfpack resamples keys and drops attributes that no texture uses.
TWINS = {
    "torus": "torus_draco_eb torus_draco_eb_fast torus_draco_partial torus_draco_seq torus_meshopt_filters"
    " torus_meshopt_khr_filters torus_meshopt_khr_raw torus_meshopt_raw torus_pack_cc torus_pack_khr_cz",
    "ring": "ring_draco_valence ring_meshopt_khr_filters",
    "patch": "patch_draco_fallback patch_draco_morph patch_meshopt_filters patch_pack_cf.gltf patch_pack_quantised",
    "mixed": "mixed_draco_one mixed_meshopt_khr_filters",
    "band": "strip strip_draco strip_draco_fallback",
    "instances": "instances_gpu instances_pack_khr_mi",
    "quantised": "quantised quantised_draco",
    "striped": "blender_draco",
}
for c in CASES:
    names = TWINS.get(c["name"].removesuffix("-bent").removesuffix("-wave"), "").split()
    if names:
        c["twins"] = [f"tests/gltf/{n}" if "." in n else f"tests/gltf/{n}.glb" for n in names]


def to_blender(p):
    return Vector((p[0], -p[2], p[1]))


def import_file(path, animated, temporary):
    """Imports a file. For the stored pose, removes animations, because the importer would apply their start."""
    if path.endswith(".obj"):
        bpy.ops.wm.obj_import(filepath=path, forward_axis="NEGATIVE_Z", up_axis="Y")
        return
    with open(path, "rb") as f:
        data = f.read()
    still = not animated and b'"animations"' in data
    if still:  # the same length keeps a GLB valid; such a file must contain its images and its buffer
        path = temporary + os.path.splitext(path)[1]
        with open(path, "wb") as f:
            f.write(data.replace(b'"animations"', b'"-nimations"', 1))
    bpy.ops.import_scene.gltf(filepath=path, import_pack_images=True, merge_vertices=False, disable_bone_shape=True)
    if still:
        os.remove(path)


def pose(time, animation):
    """Plays the animation of that name, or all of them, at `time` seconds; with None, none: the stored pose."""
    owners = [*bpy.data.objects, *bpy.data.shape_keys]
    for owner in owners:
        data = owner.animation_data
        if not data:
            continue
        tracks = [t for t in data.nla_tracks if time is not None and animation in (None, t.name)]
        if len(tracks) > 1:
            sys.exit(f"{owner.name}: {[t.name for t in tracks]} all move it; name one")
        if tracks:
            strip = tracks[0].strips[0]
            data.action, data.action_slot = strip.action, strip.action_slot
        elif data.action:
            data.action = None
    frame = (time or 0) * FPS
    bpy.context.scene.frame_set(int(frame), subframe=frame - int(frame))


def is_by_blender(path):
    """Returns true if Blender wrote the file, by its generator or an OBJ's first line, as the renderer decides."""
    head = Path(path).read_bytes()
    if path.endswith(".obj"):
        return b"Blender" in head.split(b"\n")[0]
    if head[:4] == b"glTF":
        head = head[20 : 20 + int.from_bytes(head[12:16], "little")]
    return "Blender" in json.loads(head)["asset"].get("generator", "")


LINEAR = {}


def linear(image):
    """Returns the image as linear floats, so that Cycles filters linear light, not sRGB codes."""
    if image.name not in LINEAR:
        pixels = np.empty(len(image.pixels), np.float32)
        image.pixels.foreach_get(pixels)
        pixels = pixels.reshape(-1, 4).astype(np.float64)
        colour = pixels[:, :3]
        pixels[:, :3] = np.where(colour <= 0.04045, colour / 12.92, ((colour + 0.055) / 1.055) ** 2.4)
        new = bpy.data.images.new(f"{image.name} linear", *image.size, alpha=True, float_buffer=True, is_data=True)
        new.alpha_mode = "CHANNEL_PACKED"
        new.pixels.foreach_set(pixels.astype(np.float32).ravel())
        new.update()
        new.pack()
        LINEAR[image.name] = new
    return LINEAR[image.name]


def textures(socket):
    """Yields the texture nodes upstream of a socket."""
    for link in socket.links:
        if link.from_node.type == "TEX_IMAGE" and link.from_node.image:
            yield link.from_node
        for before in link.from_node.inputs:
            yield from textures(before)


def show_buffers(material, by_blender):
    """Replaces the shader by emission of the base colour and a white diffuse surface with the normal."""
    tree = material.node_tree
    principled = [n for n in tree.nodes if n.type == "BSDF_PRINCIPLED"]
    if len(principled) != 1:
        sys.exit(f"{material.name}: not one Principled BSDF")
    inputs = principled[0].inputs
    for node in textures(inputs["Normal"]):
        node.image.colorspace_settings.is_data = True
    for node in textures(inputs["Base Color"]):
        if by_blender:
            node.image.colorspace_settings.name = "sRGB"
        else:
            node.image = linear(node.image)
    light, diffuse, both = (tree.nodes.new(f"ShaderNode{n}") for n in ("Emission", "BsdfDiffuse", "AddShader"))
    diffuse.inputs["Color"].default_value = (1, 1, 1, 1)
    for source, target in ((inputs["Base Color"], light.inputs["Color"]), (inputs["Normal"], diffuse.inputs["Normal"])):
        if source.is_linked:
            tree.links.new(source.links[0].from_socket, target)
        elif source.name == "Base Color":
            target.default_value = source.default_value
    tree.links.new(light.outputs[0], both.inputs[0])
    tree.links.new(diffuse.outputs[0], both.inputs[1])
    end = both.outputs[0]
    alpha = inputs["Alpha"]
    # The importer writes MASK as 1 − (alpha < cutoff), BLEND as the alpha itself or its product with the factor.
    if alpha.is_linked and alpha.links[0].from_node.type == "MATH" and alpha.links[0].from_node.operation != "MULTIPLY":
        nothing, mix = (tree.nodes.new(f"ShaderNode{n}") for n in ("BsdfTransparent", "MixShader"))
        tree.links.new(alpha.links[0].from_socket, mix.inputs[0])
        tree.links.new(nothing.outputs[0], mix.inputs[1])
        tree.links.new(end, mix.inputs[2])
        end = mix.outputs[0]
    output = next(n for n in tree.nodes if n.type == "OUTPUT_MATERIAL" and n.is_active_output)
    tree.links.new(end, output.inputs["Surface"])
    material.cycles.emission_sampling = "NONE"


def materials(by_blender):
    for material in list(bpy.data.materials):
        if material.users and material.node_tree:
            show_buffers(material, by_blender)
    white = bpy.data.materials.new("No material")
    white.use_nodes = True
    white.node_tree.nodes["Principled BSDF"].inputs["Base Color"].default_value = (1, 1, 1, 1)
    show_buffers(white, by_blender)
    for obj in bpy.data.objects:
        if obj.type == "MESH":
            if not obj.material_slots:
                obj.data.materials.append(white)
            for slot in obj.material_slots:
                slot.material = slot.material or white
        if obj.type == "LIGHT":
            obj.hide_render = True


def camera(view, size):
    scene = bpy.context.scene
    scene.render.resolution_x, scene.render.resolution_y = size
    scene.render.resolution_percentage = 100
    if "camera" in view:
        scene.camera = bpy.data.objects[view["camera"]]
        return
    data = bpy.data.cameras.new("Reference")
    data.sensor_fit = "VERTICAL"
    if view.get("projection") == "orthographic":
        data.type, data.ortho_scale = "ORTHO", view["view_height"]
    else:
        data.angle_y = radians(view["yfov"])
    data.clip_start, data.clip_end = 1e-3, 1e6
    scene.camera = bpy.data.objects.new("Reference", data)
    scene.collection.objects.link(scene.camera)
    eye = to_blender(view["view_point"])
    w = (eye - to_blender(view["look_at"])).normalized()
    u = to_blender(view["view_up"]).cross(w).normalized()
    v = w.cross(u)
    scene.camera.matrix_world = Matrix.Translation(eye) @ Matrix((u, v, w)).transposed().to_4x4()


def render(path):
    scene, layer = bpy.context.scene, bpy.context.view_layer
    scene.render.engine = "CYCLES"
    cycles = scene.cycles
    cycles.device, cycles.samples, cycles.use_adaptive_sampling, cycles.use_denoising = "CPU", 1, False, False
    cycles.pixel_filter_type, cycles.filter_width = "BOX", 0.01
    cycles.max_bounces, cycles.transparent_max_bounces = 0, 256
    scene.render.film_transparent = True
    scene.render.use_compositing = scene.render.use_sequencer = scene.render.use_motion_blur = False
    scene.render.dither_intensity = 0
    layer.use_pass_combined = layer.use_pass_z = layer.use_pass_normal = layer.use_pass_emit = True
    layer.pass_alpha_threshold = 0.5
    settings = scene.render.image_settings
    settings.media_type = "MULTI_LAYER_IMAGE"
    settings.file_format, settings.color_depth, settings.exr_codec = "OPEN_EXR_MULTILAYER", "32", "NONE"
    scene.render.use_file_extension = False
    scene.render.filepath = path
    bpy.ops.render.render(write_still=True)
    channels = {}
    for part in OpenEXR.File(path, separate_channels=True).parts:
        for name, channel in part.channels.items():
            channels[".".join(name.split(".")[-2:])] = np.array(channel.pixels, np.float32)
    os.remove(path)
    return channels


def buffers(channels, wanted):
    mask = channels["Combined.A"] > 0.5
    z = channels.get("Depth.V", channels.get("Depth.Z")).copy()
    out = {"mask.A": mask.astype(np.float16)}
    z[~mask] = 0
    # Rounded for better compression.
    drop = 23 - DEPTH_BITS
    bits = ((z.view(np.uint32).astype(np.uint64) + (1 << drop - 1)) >> drop << drop).astype(np.uint32)
    out["depth.Z"] = bits.view(np.float32)
    n = np.stack([channels[f"Normal.{a}"] for a in "XYZ"], -1)
    n = np.stack([n[..., 0], n[..., 2], -n[..., 1]], -1)
    n /= np.maximum(np.linalg.norm(n, axis=-1, keepdims=True), 1e-9)
    n[~mask] = 0
    n = np.round(n * STEPS) / STEPS + 0.0
    albedo = np.stack(
        [channels[f"Emission.{a}"] if f"Emission.{a}" in channels else channels[f"Emit.{a}"] for a in "RGB"], -1
    )
    albedo[~mask] = 0
    albedo = np.round(albedo * STEPS) / STEPS + 0.0
    for i in range(3):
        out[f"normal.{'XYZ'[i]}"] = n[..., i].astype(np.float16)
        out[f"albedo.{'RGB'[i]}"] = albedo[..., i].astype(np.float16)
    return {k: np.ascontiguousarray(v) for k, v in out.items() if k.split(".")[0] in wanted}


def write(path, channels):
    OpenEXR.File({"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}, channels).write(path)
    return os.path.getsize(path)


def make(c, root, out):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    LINEAR.clear()
    scene = bpy.context.scene
    scene.render.fps, scene.render.fps_base = FPS, 1
    import_file(os.path.join(root, "models", c["file"]), "time" in c, os.path.join(out, "still.tmp"))
    pose(c.get("time"), c.get("animation"))
    materials(is_by_blender(os.path.join(root, "models", c["file"])))
    camera(c["view"], c["size"])
    return write(os.path.join(out, c["exr"]), buffers(render(os.path.join(out, "render.tmp.exr")), c["buffers"]))


def main():
    root, out, names = sys.argv[1], sys.argv[2], sys.argv[3:]
    os.makedirs(out, exist_ok=True)
    for c in CASES:
        if not names or c["name"] in names:
            print(f"{c['name']}: {make(c, root, out)} bytes", file=sys.stderr)
    with open(os.path.join(out, "cases.json"), "w", encoding="utf-8") as f:
        f.write("[\n" + ",\n".join(json.dumps(c, ensure_ascii=False) for c in CASES) + "\n]\n")


main()
