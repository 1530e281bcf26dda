"""Mitsuba 3, direct light with shadows, one sample: 12 views of each file:
`objects_mitsuba.py LIST FOLDER SIDE VARIANT`. Base colours alone; the files are read with numpy and pillow."""

import glob
import io
import os
import sys
from pathlib import Path

llvm = sorted(glob.glob("/usr/lib/x86_64-linux-gnu/libLLVM*.so*"))
if llvm:
    os.environ.setdefault("DRJIT_LIBLLVM_PATH", llvm[-1])

import mitsuba as mi
import numpy as np
from PIL import Image

from read_glb import Glb

files, folder, side = Path(sys.argv[1]).read_text().split(), Path(sys.argv[2]), int(sys.argv[3])
mi.set_variant(sys.argv[4])


def bsdf(glb, material):
    pbr = glb.json["materials"][material]["pbrMetallicRoughness"]
    color = {"type": "rgb", "value": pbr.get("baseColorFactor", [1, 1, 1])[:3]}
    if "baseColorTexture" in pbr:
        pixels = np.array(Image.open(io.BytesIO(glb.image(pbr["baseColorTexture"]))).convert("RGB"))
        color = {"type": "bitmap", "bitmap": mi.Bitmap(pixels)}
    return mi.load_dict({"type": "twosided", "bsdf": {"type": "diffuse", "reflectance": color}})


def mesh(glb, bsdfs, p, n, uv, faces, material):
    if material not in bsdfs:
        bsdfs[material] = bsdf(glb, material)
    properties = mi.Properties()
    properties["bsdf"] = bsdfs[material]
    made = mi.Mesh("part", len(p), len(faces), has_vertex_normals=True, has_vertex_texcoords=True, props=properties)
    values = mi.traverse(made)
    for name, array in (("vertex_positions", p), ("vertex_normals", n), ("vertex_texcoords", uv), ("faces", faces)):
        values[name] = array.ravel()
    values.update()
    return made


for file in files:
    glb, bsdfs = Glb(file), {}
    parts = list(glb.primitives())
    low = np.min([p.min(0) for p, *_ in parts], 0)
    high = np.max([p.max(0) for p, *_ in parts], 0)
    centre, radius = (low + high) / 2, float(np.linalg.norm(high - low)) / 2
    scene = {f"part{i}": mesh(glb, bsdfs, *part) for i, part in enumerate(parts)}
    lamp = (centre + radius * np.array([3, 4, 2])).tolist()
    scene["lamp"] = {"type": "point", "position": lamp, "intensity": 60.0 * radius ** 2}
    scene = mi.load_dict({"type": "scene", "integrator": {"type": "direct", "emitter_samples": 1, "bsdf_samples": 0},
                          **scene})
    for view in range(12):
        azimuth, elevation, distance = np.radians(30 * view), np.radians(22), radius / np.sin(np.radians(15))
        direction = np.array([np.cos(elevation) * np.sin(azimuth), np.sin(elevation), np.cos(elevation) * np.cos(azimuth)])
        eye = (centre + distance * direction).tolist()
        sensor = mi.load_dict({
            "type": "perspective", "fov": 30, "to_world": mi.ScalarTransform4f().look_at(eye, centre.tolist(), [0, 1, 0]),
            "film": {"type": "hdrfilm", "width": side, "height": side, "rfilter": {"type": "box"}},
            "sampler": {"type": "independent", "sample_count": 1},
        })
        mi.util.write_bitmap(str(folder / f"{Path(file).stem}-{view + 1:02}.png"), mi.render(scene, sensor=sensor))
