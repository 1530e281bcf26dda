"""Processes: fork, spawn and memory."""

import hashlib
import multiprocessing
import resource
from pathlib import Path

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


def test_memory_stays_flat(quad: blinn.Scene) -> None:
    camera = blinn.Camera.look_at((0, 0, 4), (0, 0, 0))

    def render(count: int) -> int:
        for _ in range(count):
            quad.render(camera, size=(16, 16), samples=1, layers=["depth"]).rgba
        return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss

    before = render(500)
    after = render(2_000)
    assert after - before < 4 * 1024, f"{after - before} KiB more after 2,000 renders"
