"""Mitsuba 3, direct light of a point light with shadows: `with_mitsuba.py SCENE.obj OUT SAMPLES VARIANT`."""

import glob
import os
import sys

llvm = glob.glob("/usr/lib/x86_64-linux-gnu/libLLVM*19*.so*")
if llvm:
    os.environ.setdefault("DRJIT_LIBLLVM_PATH", llvm[0])

import mitsuba as mi

path, out, samples, variant = sys.argv[1:5]
mi.set_variant(variant)
view = mi.ScalarTransform4f().look_at([0.62, 0.42, 1.75], [0, 0, 0], [0, 1, 0])
scene = mi.load_dict({
    "type": "scene",
    "integrator": {"type": "direct", "emitter_samples": 1, "bsdf_samples": 0},
    "sensor": {
        "type": "perspective", "fov": 42, "fov_axis": "y", "to_world": view,
        "film": {"type": "hdrfilm", "width": 1280, "height": 720},
        "sampler": {"type": "independent", "sample_count": int(samples)},
    },
    "lamp": {"type": "point", "position": [3, 4, 2], "intensity": 60.0},
    "mesh": {"type": "obj", "filename": path, "bsdf": {"type": "twosided", "bsdf": {"type": "diffuse"}}},
})
mi.util.write_bitmap(out, mi.render(scene))
