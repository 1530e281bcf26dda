"""Traces the closest-hit rays of `blinn rays --dump rays.npz --triangles` with Embree and compares the hits.

    pip install embreex==4.4.0.post1 numpy==2.4.6
    python embree_rays.py rays.npz

Embree's f32 hits miss at edges that blinn's do not, so a few of a million rays differ. Alpha masks, and back faces that
blinn culls, are hit. embreex has no start of the ray, and no robust mode.
"""
import sys
import time

import numpy as np
from embreex import rtcore_scene
from embreex.mesh_construction import TriangleMesh

rays = np.load(sys.argv[1])
scene = rtcore_scene.EmbreeScene()
TriangleMesh(scene, np.ascontiguousarray(rays["triangle_vertices"], np.float32))
for kind, name in enumerate(rays["kinds"]):
    of_kind = rays["kind"] == kind
    if not of_kind.any() or name in (b"shadow", b"sun", b"ao"):
        continue
    origin, direction, t = (np.ascontiguousarray(rays[array][of_kind]) for array in ("origin", "direction", "t"))
    start = time.perf_counter()
    hits = scene.run(origin, direction, query="INTERSECT", output=True)
    seconds = time.perf_counter() - start
    is_hit, expected = hits["primID"] >= 0, np.isfinite(t)
    both = is_hit & expected
    far = np.abs(hits["tfar"][both] - t[both]) > 1e-4 * t[both]
    print(f"{name.decode()}: {len(t)} rays, {1e-6 * len(t) / seconds:.2f} Mray/s on one thread; "
          f"{(is_hit != expected).sum()} hit only in one, {far.sum()} at another t")
