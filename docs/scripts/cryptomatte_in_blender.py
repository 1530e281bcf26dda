"""Checks Cryptomattes with Blender's compositor: the matte of every object and material against the picture's ids.

    PYTHON cryptomatte_in_blender.py BLINN SCENE     PYTHON has `bpy==5.0.1` and `OpenEXR`

SCENE is rendered twice into EXRs: with one sample through each pixel's centre, where a matte must be 1 exactly where the
id AOV has the id, and with 16 samples, where it must equal the coverages in the file. The Cryptomatte node selects
objects by name, so Blender must understand names, hashes and manifest.
"""

import json
import os
import subprocess
import sys
import tempfile

import bpy  # isort: skip (bpy provides numpy)
import numpy as np
import OpenEXR

BLINN, SCENE = (os.path.abspath(p) for p in sys.argv[1:3])
SIZE = (160, 120)


def read(path):
    with OpenEXR.File(path, separate_channels=True) as file:
        header = {k: v for k, v in file.header().items() if isinstance(v, str)}
        return header, {name: c.pixels.copy() for name, c in file.channels().items()}


def compositor(image, folder):
    """Returns a function from a layer and a name to that matte, rendered by Blender."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.render.engine = "BLENDER_WORKBENCH" if "BLENDER_WORKBENCH" in dir(bpy.types) else "CYCLES"
    if scene.render.engine == "CYCLES":
        scene.cycles.samples, scene.cycles.device = 1, "CPU"
    scene.render.resolution_x, scene.render.resolution_y = SIZE
    scene.render.resolution_percentage = 100
    scene.render.image_settings.file_format, scene.render.image_settings.color_depth = "OPEN_EXR", "32"
    scene.camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    scene.collection.objects.link(scene.camera)
    tree = bpy.data.node_groups.new("mattes", "CompositorNodeTree")
    scene.compositing_node_group = tree
    tree.interface.new_socket("Image", in_out="OUTPUT", socket_type="NodeSocketColor")
    node, output = tree.nodes.new("CompositorNodeCryptomatteV2"), tree.nodes.new("NodeGroupOutput")
    node.source, node.image = "IMAGE", bpy.data.images.load(image)
    tree.links.new(node.outputs["Matte"], output.inputs[0])
    scene.render.filepath = os.path.join(folder, "matte.exr")

    def matte(layer, name):
        node.layer_name, node.matte_id = layer, name
        bpy.ops.render.render(write_still=True)
        return read(scene.render.filepath)[1]["R"]

    return matte


def render(path, samples):
    aov = "cryptomatte,object-id,material-id"
    size = f"{SIZE[0]}x{SIZE[1]}"
    subprocess.run([BLINN, "render", SCENE, "-o", path, "-s", samples, "--size", size, "--aov", aov, "-q"], check=True)
    return read(path)


def names(header, layer):
    key = next(k for k, v in header.items() if k.startswith("cryptomatte/") and v == layer)
    return json.loads(header[key.replace("/name", "/manifest")])


def coverage(channels, layer, bits):
    """Returns the coverage of an id in the file."""
    total = np.zeros(SIZE[::-1], np.float32)
    for rank in range(6):
        id_channel, cover = ("R", "G") if rank % 2 == 0 else ("B", "A")
        ids = channels[f"{layer}{rank // 2:02}.{id_channel}"].view(np.uint32)
        total += np.where(ids == bits, channels[f"{layer}{rank // 2:02}.{cover}"], 0)
    return total


def main(folder):
    checked = 0
    for samples in ("1", "16"):
        path = os.path.join(folder, f"s{samples}.exr")
        header, channels = render(path, samples)
        matte = compositor(path, folder)
        for layer, ids in (("crypto_object", "object-id.I"), ("crypto_material", "material-id.I")):
            for i, (name, bits) in enumerate(names(header, layer).items()):
                ours = coverage(channels, layer, int(bits, 16))
                if not ours.any():
                    continue
                theirs = matte(layer, name)
                assert np.abs(theirs - ours).max() < 1e-6, f"{layer} {name}: {np.abs(theirs - ours).max()}"
                if samples == "1":
                    own = channels[ids] == i + 1
                    assert ((theirs > 0.5) == own).all(), f"{layer} {name}: {((theirs > 0.5) != own).sum()} differ"
                checked += 1
    assert checked > 4, "nothing was checked"
    print(f"Blender {bpy.app.version_string}: {checked} mattes of {os.path.basename(SCENE)} agree", file=sys.stderr)


with tempfile.TemporaryDirectory() as folder:
    main(folder)
