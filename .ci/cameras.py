#!/usr/bin/env python3
"""Checks --cameras and --intrinsics against projections in NumPy: points of `position` lie at their pixel centres.

    cameras.py BLINN

Random intrinsics and poses are written in each format, COLMAP's by pycolmap if it is installed. The points that blinn's EXR
holds are projected by the numbers of the file and must land within 1e-3 pixel of the centres of their pixels. Also checks
that a dataset's transforms.json gives the same bytes again, and that memory does not grow with a long list. Needs numpy and
OpenEXR.
"""
import json
import os
import struct
import subprocess
import sys
import tempfile

import numpy as np
import OpenEXR

try:
    import pycolmap
except ImportError:
    pycolmap = None

BLINN = os.path.abspath(sys.argv[1])
rng = np.random.default_rng(45)
checks = 0


def run(*args):
    subprocess.run([BLINN, "render", "cube.obj", "-q", *map(str, args)], check=True)


def rotation_of(q):
    w, x, y, z = q
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


class Camera:
    """K, and the pose from the world to the camera in OpenCV's axes."""

    def __init__(self, size=None, square=False):
        self.size = size or (int(rng.integers(60, 120)), int(rng.integers(50, 100)))
        w, h = self.size
        fx, fy = rng.uniform(80, 200, 2)
        self.k = np.array([[fx, 0, rng.uniform(0.2, 0.8) * w], [0, fx if square else fy, rng.uniform(0.2, 0.8) * h], [0, 0, 1]])
        q = rng.normal(size=4)
        self.q = q / np.linalg.norm(q)
        self.r = rotation_of(self.q)
        self.t = np.array([*rng.uniform(-0.3, 0.3, 2), rng.uniform(3, 6)])

    def to_camera(self):
        return np.vstack([np.column_stack([self.r, self.t]), [0, 0, 0, 1]])

    def opengl_to_world(self):
        return np.linalg.inv(self.to_camera()) @ np.diag([1, -1, -1, 1])

    def check(self, file):
        global checks
        with OpenEXR.File(file, separate_channels=True) as exr:
            channels = exr.channels()
            p = np.stack([channels[f"position.{c}"].pixels for c in "XYZ"], -1).astype(np.float64)
            hit = np.isfinite(channels["depth.Z"].pixels)
        assert p.shape[:2] == self.size[::-1], (file, p.shape, self.size)
        assert hit.sum() > 50, (file, hit.sum())
        c = p[hit] @ self.r.T + self.t
        pixel = (c @ self.k.T)[:, :2] / c[:, 2:]
        rows, columns = np.nonzero(hit)
        off = np.abs(pixel - np.stack([columns + 0.5, rows + 0.5], -1)).max()
        assert off < 1e-3, (file, off)
        checks += 1


LAYERS = ["-s", 1, "--aov", "position,depth"]


def cameras(count=20, **options):
    return [Camera(**options) for _ in range(count)]


def json_lines():
    all = cameras()
    with open("c.jsonl", "w") as file:
        for i, camera in enumerate(all):
            line = {"K": camera.k.tolist(), "width": camera.size[0], "height": camera.size[1], "file": f"{i}.png"}
            if i % 2:
                line |= {"convention": "opengl", "camera_to_world": camera.opengl_to_world().tolist()}
            else:
                line |= {"convention": "opencv", "world_to_camera": camera.to_camera().tolist()}
            file.write(json.dumps(line) + "\n")
    run("--cameras", "c.jsonl", *LAYERS, "-o", "jsonl/{camera}.exr")
    for i, camera in enumerate(all):
        camera.check(f"jsonl/{i}.exr")


def transforms():
    all = cameras()
    frames = [
        {
            "file_path": f"images/{i}.png",
            "transform_matrix": camera.opengl_to_world().tolist(),
            "fl_x": camera.k[0, 0],
            "fl_y": camera.k[1, 1],
            "cx": camera.k[0, 2],
            "cy": camera.k[1, 2],
            "w": camera.size[0],
            "h": camera.size[1],
        }
        for i, camera in enumerate(all)
    ]
    with open("transforms.json", "w") as file:
        json.dump({"camera_model": "OPENCV", "k1": 0.0, "frames": frames}, file, indent=2)
    run("--cameras", "transforms.json", *LAYERS, "-o", "nerf/{camera}.exr")
    for i, camera in enumerate(all):
        camera.check(f"nerf/images/{i}.exr")


def bop():
    all = cameras(size=(100, 80))
    entries = {
        str(7 * i): {
            "cam_K": camera.k.ravel().tolist(),
            "cam_R_w2c": camera.r.ravel().tolist(),
            "cam_t_w2c": (1000 * camera.t).tolist(),
            "depth_scale": 0.1,
        }
        for i, camera in enumerate(all)
    }
    with open("scene_camera.json", "w") as file:
        json.dump(entries, file)
    run("--cameras", "scene_camera.json", "--size", "100x80", *LAYERS, "-o", "bop/{camera}.exr")
    for i, camera in enumerate(all):
        camera.check(f"bop/{7 * i:06}.exr")


def colmap_files(all):
    """A model written here, as text and binary."""
    os.makedirs("model-text")
    os.makedirs("model-binary")
    with open("model-text/cameras.txt", "w") as lenses, open("model-text/images.txt", "w") as images:
        for i, camera in enumerate(all, 1):
            k = camera.k
            print(i, "PINHOLE", *camera.size, k[0, 0], k[1, 1], k[0, 2], k[1, 2], file=lenses)
            print(i, *camera.q, *camera.t, i, f"{i - 1}.png\n", file=images)
    with open("model-binary/cameras.bin", "wb") as lenses, open("model-binary/images.bin", "wb") as images:
        lenses.write(struct.pack("<Q", len(all)))
        images.write(struct.pack("<Q", len(all)))
        for i, camera in enumerate(all, 1):
            k = camera.k
            lenses.write(struct.pack("<IiQQ4d", i, 1, *camera.size, k[0, 0], k[1, 1], k[0, 2], k[1, 2]))
            images.write(struct.pack("<I7dI", i, *camera.q, *camera.t, i) + f"{i - 1}.png\0".encode())
            images.write(struct.pack("<Q", 2) + bytes(48))
    return ["model-text", "model-binary"]


def colmap_model(all):
    """A model written by pycolmap, as text and binary."""
    model = pycolmap.Reconstruction()
    for i, camera in enumerate(all, 1):
        k, (w, h) = camera.k, camera.size
        params = [k[0, 0], k[1, 1], k[0, 2], k[1, 2]]
        lens = pycolmap.Camera(camera_id=i, model="PINHOLE", width=w, height=h, params=params)
        w_q, x, y, z = camera.q
        pose = pycolmap.Rigid3d(pycolmap.Rotation3d(np.array([x, y, z, w_q])), camera.t)
        image = pycolmap.Image(name=f"{i - 1}.png", camera_id=i, image_id=i)
        if hasattr(model, "add_camera_with_trivial_rig"):
            model.add_camera_with_trivial_rig(lens)
            model.add_image_with_trivial_frame(image, pose)
        else:
            model.add_camera(lens)
            image.cam_from_world = pose
            model.add_image(image)
            model.register_image(i)
    folders = ["pycolmap-text", "pycolmap-binary"]
    for folder in folders:
        os.makedirs(folder)
    model.write_text(folders[0])
    model.write_binary(folders[1])
    return folders


def colmap():
    all = cameras()
    folders = colmap_files(all)
    if pycolmap:
        folders += colmap_model(all)
    for folder in folders:
        run("--cameras", folder, *LAYERS, "-o", f"{folder}/out/{{camera}}.exr")
        for i, camera in enumerate(all):
            camera.check(f"{folder}/out/{i}.exr")


def intrinsics():
    """The flags, and crops of them."""
    for i, camera in enumerate(cameras(5)):
        to_world = np.linalg.inv(camera.to_camera())
        vector = lambda v: ",".join(f"{x:.17g}" for x in v)
        k, (w, h) = camera.k, camera.size
        lens = vector([k[0, 0], k[1, 1], k[0, 2], k[1, 2]])
        pose = [f"--view-point={vector(to_world[:3, 3])}", f"--view-dir={vector(to_world[:3, 2])}", f"--view-up={vector(-to_world[:3, 1])}"]
        flags = [f"--intrinsics={lens}", "--size", f"{w}x{h}", *pose, *LAYERS]
        run(*flags, "-o", f"flags-{i}.exr")
        camera.check(f"flags-{i}.exr")
        x, y = w // 4, h // 5
        camera.size = (w // 2, h // 2)
        camera.k[0, 2] -= x
        camera.k[1, 2] -= y
        run(*flags, "--crop", f"{x},{y},{w // 2},{h // 2}", "-o", f"crop-{i}.exr")
        camera.check(f"crop-{i}.exr")


def own_dataset():
    flags = ["--size", "64x48", "-s", "4", "-q"]
    subprocess.run([BLINN, "turntable", "cube.obj", "--views", "6", *flags, "-o", "own/#.png"], check=True)
    run("--cameras", "own/transforms.json", "-s", 4, "--aov", "depth,normal,mask", "-o", "again/{camera}.png")
    names = sorted(os.listdir("again"))
    assert len(names) == 24, names
    for name in names:
        with open(f"own/{name}", "rb") as a, open(f"again/{name}", "rb") as b:
            assert a.read() == b.read(), name


def long_list():
    """100,000 lines, of which few are rendered."""
    camera = Camera(size=(8, 8))
    line = {"K": camera.k.tolist(), "width": 8, "height": 8, "world_to_camera": camera.to_camera().tolist()}
    peaks = []
    for count in [100, 100_000]:
        with open("long.jsonl", "w") as file:
            for i in range(count):
                file.write(json.dumps(line | {"time": i / 10, "file": f"{i}.png"}) + "\n")
        args = [BLINN, "render", "cube.obj", "--cameras", "long.jsonl", "-s", "1", "-q", "-o", f"long-{count}/{{camera}}.png"]
        part = ["--chunk", f"1/{count // 10}"]
        pid = os.spawnv(os.P_NOWAIT, BLINN, args + part)
        _, status, usage = os.wait4(pid, 0)
        assert status == 0 and len(os.listdir(f"long-{count}")) == 10
        peaks.append(usage.ru_maxrss / 1024)
    print(f"peak memory: {peaks[0]:.1f} MiB for 100 lines, {peaks[1]:.1f} MiB for 100,000")
    assert peaks[1] < peaks[0] + 16, peaks


with tempfile.TemporaryDirectory() as folder:
    os.chdir(folder)
    corners = [(x, y, z) for x in (-1, 1) for y in (-0.6, 0.6) for z in (-0.8, 0.8)]
    faces = ["1 2 4 3", "5 7 8 6", "1 5 6 2", "3 4 8 7", "1 3 7 5", "2 6 8 4"]
    with open("cube.obj", "w") as file:
        file.writelines(f"v {x} {y} {z}\n" for x, y, z in corners)
        file.writelines(f"f {face}\n" for face in faces)
    for check in [json_lines, transforms, bop, colmap, intrinsics, own_dataset, long_list]:
        check()
    print(f"{checks} pictures agree with NumPy" + ("" if pycolmap else "; pycolmap is not installed"))
