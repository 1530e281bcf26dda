"""Processes and threads: fork, spawn, pickles and memory."""

import hashlib
import multiprocessing
import os
import pickle
import resource
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest

import blinn


def digest(path: str) -> str:
    picture = blinn.load(path).render(size=(48, 32), layers=["depth"])
    return hashlib.sha256(picture.rgba.tobytes() + picture["depth"].tobytes()).hexdigest()


@pytest.mark.parametrize("method", ["fork", "spawn"])
def test_workers_render_equal_pictures(method: str, models: Path) -> None:
    path = str(models / "cornell/cornell.glb")
    expected = digest(path)
    with multiprocessing.get_context(method).Pool(8) as pool:
        results = pool.map_async(digest, [path] * 8).get(timeout=120)
    assert results == [expected] * 8


def render_from(camera: blinn.Camera) -> bytes:
    quad = blinn.Scene.from_arrays([[-1, -1, 0], [1, -1, 0], [1, 1, 0]], [[0, 1, 2]])
    return quad.render(camera, size=(24, 24)).rgba.tobytes()


def test_cameras_are_sent_to_workers() -> None:
    behind = np.eye(4)
    behind[2, 3] = -4
    cameras = [
        blinn.Camera.look_at((1, 2, 3), (0, 0, 0), yfov=30, near=0.1),
        blinn.Camera.look_at((1, 2, 3), (0, 0, 0), height=4),
        blinn.Camera.from_intrinsics([[20, 0, 11], [0, 20, 13], [0, 0, 1]], (24, 24), behind),
    ]
    assert [pickle.loads(pickle.dumps(camera)) for camera in cameras] == cameras
    assert pickle.loads(pickle.dumps(cameras[2])).size == (24, 24)
    with multiprocessing.get_context("spawn").Pool(1) as pool:
        assert pool.map(render_from, cameras) == [render_from(camera) for camera in cameras]


def test_threads_share_a_scene(models: Path) -> None:
    scene = blinn.load(models / "tower/tower.glb")
    camera = blinn.Camera.look_at((0, 10, 30), (0, 4, 0))
    expected = scene.render(camera, size=(48, 48)).rgba
    with ThreadPoolExecutor(4) as executor:
        futures = [executor.submit(scene.render, camera, size=(48, 48)) for _ in range(16)]
        for future in futures:
            np.testing.assert_array_equal(future.result().rgba, expected)


def test_the_number_of_threads_does_not_change_pixels(models: Path) -> None:
    scene = blinn.load(models / "tower/tower.glb")
    pictures = []
    for count in (1, 3, 0):
        blinn.set_threads(count)
        pictures.append(scene.render(size=(48, 48)).rgba)
    np.testing.assert_array_equal(pictures[0], pictures[1])
    np.testing.assert_array_equal(pictures[0], pictures[2])
    with pytest.raises(ValueError, match="1024"):
        blinn.set_threads(100_000)


def test_a_changed_environment_map_is_read_again(quad: blinn.Scene, tmp_path: Path) -> None:
    file = tmp_path / "sky.hdr"
    camera = blinn.Camera.look_at((0, 0, 4), (0, 0, 0))

    def render(level: int) -> np.ndarray:
        rows = bytes([level, level, level, 129]) * 8
        file.write_bytes(b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 2 +X 4\n" + rows)
        os.utime(file, (level, level))
        return quad.render(camera, size=(8, 8), hdri=file).rgba

    dark, light = render(20), render(120)
    assert light[4, 4, 0] > dark[4, 4, 0] > 0


def test_memory_stays_flat(quad: blinn.Scene) -> None:
    camera = blinn.Camera.look_at((0, 0, 4), (0, 0, 0))

    def render(count: int) -> int:
        for _ in range(count):
            quad.render(camera, size=(16, 16), samples=1, layers=["depth"]).rgba
        return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss

    before = render(500)
    after = render(2_000)
    assert after - before < 4 * 1024, f"{after - before} KiB more after 2,000 renders"
