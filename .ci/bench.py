#!/usr/bin/env python3
"""Checks the results of `blinn bench` and its bounds of traces against their JSON Schemas, hashes across threads and SIMD
levels, and the rays of `blinn rays` in NumPy.

    bench.py BLINN

Needs jsonschema and numpy.
"""
import copy
import json
import os
import subprocess
import sys
import tempfile

import jsonschema
import numpy as np

BLINN = os.path.abspath(sys.argv[1])
ROOT = os.path.abspath(os.path.join(os.path.dirname(__file__), ".."))
RAYS = ["eye", "shadow", "sun", "ao", "reflection", "bounce1", "bounce2", "bounce3", "bounce4"]
SCENE = os.path.join(ROOT, "models/still-life/still-life.glb")
SMALL = [SCENE, *"--size 64x36,48x48 -q".split()]


def run(*command, code=0, **environment):
    done = subprocess.run(command, capture_output=True, env={**os.environ, **environment})
    assert done.returncode == code, f"{command}: exit code {done.returncode}: {done.stderr.decode()[-2000:]}"
    return done.stdout


def read(file):
    with open(file, encoding="utf-8") as text:
        return json.load(text)


def schema():
    """Every field of real results is described and has its type; the schema is not so wide that it accepts anything."""
    schema = read(os.path.join(ROOT, "docs/reference/bench-schema.json"))
    jsonschema.Draft202012Validator.check_schema(schema)
    validator = jsonschema.Draft202012Validator(schema)
    run(BLINN, "bench", *SMALL, "--rounds", "2", "--threads", "1,2", "--json", "a.json")
    results = read("a.json")
    validator.validate(results)
    stages = results["scenes"][0]["stages"]
    assert len(stages) == 2 * (2 + 2 * (len(RAYS) + 3)), len(stages)
    for path, value in ((("format",), "blinn bench 1"), (("scenes", 0, "stages", 0, "threads"), 0),
                        (("scenes", 0, "stages", 2, "hash"), "short"), (("machine", "cores"), "two")):
        wrong = copy.deepcopy(results)
        parent = wrong
        for key in path[:-1]:
            parent = parent[key]
        parent[path[-1]] = value
        assert not validator.is_valid(wrong), path
    for parent in (results, results["program"], results["machine"], results["settings"], results["scenes"][0], stages[0]):
        for key in list(parent):
            value = parent.pop(key)
            assert not validator.is_valid(results), f"{key} is optional"
            parent[key] = value
            parent["undescribed"] = 1
            assert not validator.is_valid(results)
            del parent["undescribed"]
    print(f"bench-schema.json: {len(stages)} stages")


def traces():
    """Bounds of a job by its traces have all fields of their schema, and are in order."""
    schema = read(os.path.join(ROOT, "docs/reference/trace-bound-schema.json"))
    jsonschema.Draft202012Validator.check_schema(schema)
    validator = jsonschema.Draft202012Validator(schema)
    for threads in "12":
        run(BLINN, "turntable", SCENE, *"--views 3 --size 64x36 -q -o turn/#.png".split(), "--threads", threads,
            "--trace", f"trace{threads}.json")
    for files in (["trace1.json"], ["trace2.json", "trace1.json"]):
        run(BLINN, "bench", "--trace-bound", *files, "--json", "bound.json", "-q")
        bound = read("bound.json")
        validator.validate(bound)
        assert bound["threads"] == [1, 2][:len(files)]
        least, most, work = bound["span_seconds"]["least"], bound["span_seconds"]["most"], bound["work_seconds"]
        assert 0 < least <= most <= work * (1 + 1e-9), bound
        stages = {s["stage"]: s for s in bound["stages"]}
        assert (stages["load"]["count"], stages["render"]["count"], stages["save"]["count"]) == (1, 3, 3), stages
        assert abs(sum(s["work_seconds"] for s in bound["stages"]) + bound["outside_seconds"] - work) < 1e-6 * work
        for s in bound["speed_ups"]:
            assert 1 - 1e-9 <= s["at_least"] <= s["at_most"] + 1e-9 <= s["cores"] + 2e-9, s
    for parent in (bound, bound["span_seconds"], bound["stages"][0], bound["speed_ups"][0]):
        for key in list(parent):
            value = parent.pop(key)
            assert not validator.is_valid(bound), f"{key} is optional"
            parent[key] = value
    print(f"trace-bound-schema.json: {len(stages)} stages")


def hashes():
    """Hashes are equal across threads and SIMD levels, and a comparison of other work fails."""
    def of(results):
        found = {}
        for scene in results["scenes"]:
            for s in scene["stages"]:
                if s["hash"]:
                    key = (scene["name"], s["stage"], s["width"])
                    assert found.setdefault(key, s["hash"]) == s["hash"], f"{key} differs between numbers of threads"
        return found

    first = of(read("a.json"))
    run(BLINN, "bench", *SMALL, "--threads", "1", "--rounds", "1", "--compare", "a.json", "--json", "b.json",
        BLINN_SIMD="portable")
    assert of(read("b.json")) == first
    assert len(first) == 2 * (len(RAYS) + 2) == len(set(first.values())), first
    other = read("a.json")
    for s in other["scenes"][0]["stages"]:
        s["hash"] = s["hash"] and "0" * 32
    with open("other.json", "w", encoding="utf-8") as text:
        json.dump(other, text)
    run(BLINN, "bench", "--from", "b.json", "--compare", "other.json", code=1)
    print(f"{len(first)} hashes agree across threads and SIMD levels")


def brute_force(origin, direction, vertices):
    """Distances of the closest hits by Möller and Trumbore's test of all triangles, in f64."""
    closest = np.full(len(origin), np.inf)
    for a, b, c in vertices:
        p = np.cross(direction, c - a)
        determinant = p @ (b - a)
        with np.errstate(all="ignore"):
            s = origin - a
            u = np.einsum("ij,ij->i", s, p) / determinant
            q = np.cross(s, b - a)
            v = np.einsum("ij,ij->i", direction, q) / determinant
            t = q @ (c - a) / determinant
        hit = (u >= 0) & (v >= 0) & (u + v <= 1) & (t > 0)
        closest = np.where(hit & (t < closest), t, closest)
    return closest


def rays():
    """NumPy reads the rays; brute force finds the same hits."""
    scene = os.path.join(ROOT, "models/cornell/cornell.obj")
    run(BLINN, "rays", scene, "--dump", "rays.npz", "--size", "48x48", "--triangles", "-q")
    arrays = np.load("rays.npz")
    kinds = [name.decode() for name in arrays["kinds"]]
    assert [kinds[k] for k in np.unique(arrays["kind"])] == RAYS
    n = len(arrays["kind"])
    for name, kind, shape in (("origin", "f4", (n, 3)), ("direction", "f4", (n, 3)), ("t", "f4", (n,)), ("id", "u4", (n, 2)),
                              ("barycentrics", "f4", (n, 2)), ("pixel", "u4", (n, 2)), ("occluded", "b1", (n,)),
                              ("source", "u4", (n, 2)), ("t_max", "f4", (n,)), ("tile", "u4", (n,))):
        assert arrays[name].dtype == np.dtype(kind) and arrays[name].shape == shape, (name, arrays[name].dtype)
    vertices = arrays["triangle_vertices"].astype(float)
    closest = np.isin(arrays["kind"], [kinds.index(k) for k in ("reflection", "bounce1", "bounce2", "bounce3", "bounce4")])
    origin, direction, t = (arrays[name][closest].astype(float) for name in ("origin", "direction", "t"))
    expected = brute_force(origin, direction, vertices)
    agree = np.isclose(t, expected, rtol=1e-4, atol=1e-6) | (np.isinf(t) & np.isinf(expected))
    assert agree.mean() > 0.999, f"{(~agree).sum()} of {len(t)} hits differ"
    print(f"rays.npz: {n} rays, {agree.sum()} of {len(t)} closest hits as by brute force")


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        schema()
        traces()
        hashes()
        rays()
