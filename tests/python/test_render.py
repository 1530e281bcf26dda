"""Cameras, layers, sequences, progress and interruption."""

import inspect
import json
import os
import signal
import threading
import time
from pathlib import Path

import numpy as np
import pytest

import blinn
from blinn._progress import shown_progress


def test_arrays_are_contiguous_and_shaped(lecture: blinn.Scene) -> None:
    names = ["depth", "normal", "uv", "mask", "object-id", "material-id"]
    picture = lecture.render(size=(40, 30), layers=names)
    assert picture.rgba.shape == (30, 40, 4) and picture.rgba.dtype == np.uint8
    assert picture.linear.shape == (30, 40, 4) and picture.linear.dtype == np.float32
    assert picture["depth"].shape == (30, 40) and picture["normal"].shape == (30, 40, 3)
    assert picture["object-id"].dtype == np.uint32
    assert picture.layers == names
    for array in [picture.rgba, picture.linear, picture["depth"], picture["normal"]]:
        assert array.flags.c_contiguous
    with pytest.raises(KeyError, match="layers="):
        picture["albedo"]
    with pytest.raises(KeyError, match="there is no layer 'normals'; the picture has depth, .*did you mean 'normal'?"):
        picture["normals"]
    assert (np.asarray(picture) == picture.rgba).all() and np.asarray(picture, dtype=float).dtype == float


def test_sizes_may_be_one_number(quad: blinn.Scene) -> None:
    for size in [24, [24, 24], np.array([24, 24]), np.int64(24)]:
        assert quad.render(size=size).rgba.shape == (24, 24, 4)


def test_misspelt_keywords_are_suggested(quad: blinn.Scene) -> None:
    with pytest.raises(TypeError, match="did you mean 'layers'"):
        quad.render(layer="depth")
    with pytest.raises(TypeError, match="did you mean 'background'"):
        quad.render(backgruond="white")
    with pytest.raises(ValueError, match="did you mean 'orange'"):
        quad.render(background="ornage")


def test_exceptions_have_the_names_that_they_are_imported_by() -> None:
    for name in ["Error", "LoadError", "LimitError", "UnsupportedError", "RenderError", "SceneWarning"]:
        exception = getattr(blinn, name)
        assert (exception.__module__, exception.__name__) == ("blinn", name)


def test_progress_is_a_bar(quad: blinn.Scene, capsys: pytest.CaptureFixture[str]) -> None:
    quad.render(size=16, progress=True)
    quad.render(size=16, progress=False)
    shown = capsys.readouterr().err
    assert "100" in shown and "\r" in shown and shown.count("\n") == 1 and shown.endswith("\n")


def test_bars_end_their_line_once(lecture: blinn.Scene, capsys: pytest.CaptureFixture[str]) -> None:
    pictures = lecture.render_many([blinn.Camera.look_at((0, 1, 4), (0, 0, 0))] * 3, size=16, progress=True)
    assert len(list(pictures)) == 3
    shown = capsys.readouterr().err
    assert shown.count("\n") == 1 and shown.endswith("\n")
    # A render that fails leaves the cursor on a line of its own.
    with pytest.raises(ValueError, match="layer"):
        lecture.render(size=16, layers=["colour"], progress=True)
    with shown_progress(True) as callback:
        assert callback is not None
        callback(0.25)
    shown = capsys.readouterr().err
    assert "25" in shown and shown.count("\n") == 1 and shown.endswith("\n")


def test_names_of_layers_are_suggested_in_any_case(quad: blinn.Scene) -> None:
    for name, layer in [("Normal", "normal"), ("Z", "depth"), ("CryptoObject", "cryptomatte")]:
        with pytest.raises(ValueError, match=f"for layers: unknown layer '{name}'; did you mean '{layer}'?"):
            quad.render(size=8, layers=[name])
        with pytest.raises(KeyError, match=f"there is no layer '{name}'; .*did you mean '{layer}'?"):
            quad.render(size=8)[name]


def test_defaults_are_shown_as_values() -> None:
    for make in [blinn.Camera.look_at, blinn.Camera.from_matrix, blinn.Camera.from_intrinsics]:
        defaults = [parameter.default for parameter in inspect.signature(make).parameters.values()]
        assert Ellipsis not in defaults and np.inf in defaults


def test_mattes_cover_what_the_mask_covers(quad: blinn.Scene) -> None:
    picture = quad.render(size=(40, 30), samples=4, layers=["cryptomatte", "mask", "object-id"])
    for kind in ["object", "material"]:
        ids, coverage = picture.matte(kind)
        assert ids.shape == coverage.shape == (30, 40, 6)
        assert ids.dtype == np.uint32 and coverage.dtype == np.float32
        assert ((coverage > 0) == (ids > 0)).all() and coverage.sum(axis=2).max() <= 1 + 1e-6
        assert (ids[..., 0][coverage[..., 0] == 1] == 1).all() and (coverage[..., 0] == 1).any()
    with pytest.raises(ValueError, match="kind must be"):
        picture.matte("colour")
    with pytest.raises(KeyError, match="cryptomatte"):
        quad.render(size=(4, 3)).matte("object")


def test_intrinsics_and_matrices_agree(quad: blinn.Scene) -> None:
    size = (64, 48)
    K = np.array([[60.0, 0, 40], [0, 55, 20], [0, 0, 1]])
    to_world = np.array([[1.0, 0, 0, 0.2], [0, -1, 0, 0.1], [0, 0, -1, 4], [0, 0, 0, 1]])
    camera = blinn.Camera.from_intrinsics(K, size, to_world, convention="opencv")
    np.testing.assert_allclose(camera.intrinsics(), K)
    picture = quad.render(camera, layers=["position", "mask", "depth"])
    assert (picture.width, picture.height) == size
    rows, columns = np.nonzero(picture["mask"])
    points = picture["position"][rows, columns]
    local = (np.linalg.inv(to_world) @ np.c_[points, np.ones(len(points))].T)[:3]
    pixels = (K @ (local / local[2]))[:2].T
    # The centre of pixel (i, j) is (i + 0.5, j + 0.5).
    np.testing.assert_allclose(pixels, np.c_[columns + 0.5, rows + 0.5], atol=1e-3)
    np.testing.assert_allclose(picture["depth"][rows, columns], local[2], rtol=1e-5)


def test_lists_of_cameras_are_loaded(quad: blinn.Scene, tmp_path: Path) -> None:
    K = np.array([[60.0, 0, 40], [0, 55, 20], [0, 0, 1]])
    to_world = np.array([[1.0, 0, 0, 0.2], [0, -1, 0, 0.1], [0, 0, -1, 4], [0, 0, 0, 1]])
    line = {"K": K.tolist(), "camera_to_world": to_world.tolist(), "convention": "opencv"}
    path = tmp_path / "cameras.jsonl"
    path.write_text(json.dumps(line | {"width": 64, "height": 48}) + "\n" + json.dumps(line))
    with pytest.raises(ValueError, match="has no size"):
        blinn.load_cameras(path)
    cameras = blinn.load_cameras(path, size=(64, 48))
    assert [camera.size for camera in cameras] == [(64, 48)] * 2
    np.testing.assert_allclose(cameras[0].intrinsics(), K)
    expected = blinn.Camera.from_intrinsics(K, (64, 48), to_world, convention="opencv")
    np.testing.assert_array_equal(quad.render(cameras[1]).rgba, quad.render(expected).rgba)
    path.write_text("{}")
    with pytest.raises(blinn.LoadError, match="no cameras"):
        blinn.load_cameras(path)


def test_conventions_are_the_same_camera(quad: blinn.Scene) -> None:
    look = blinn.Camera.look_at((1, 2, 5), (0, 0, 0), yfov=40)
    flipped = look.camera_to_world @ np.diag([1.0, -1, -1, 1])
    opencv = blinn.Camera.from_matrix(flipped, convention="opencv", yfov=40)
    a, b = (quad.render(camera, size=(32, 32)).rgba for camera in (look, opencv))
    np.testing.assert_array_equal(a, b)
    # A uniform scale is that of camera space.
    scaled = blinn.Camera.from_matrix(look.camera_to_world @ np.diag([2.0, 2, 2, 1]), yfov=40)
    np.testing.assert_allclose(quad.render(scaled, size=(32, 32)).rgba, a, atol=1e-4)
    with pytest.raises(ValueError, match="rotation"):
        blinn.Camera.from_matrix(np.diag([2.0, 1, 1, 1]))
    with pytest.raises(ValueError, match="parallel"):
        blinn.Camera.look_at((0, 1, 0), (0, 0, 0))


def test_orthographic_cameras_have_a_height(quad: blinn.Scene) -> None:
    camera = blinn.Camera.look_at((0, 0, 5), (0, 0, 0), height=4)
    mask = quad.render(camera, size=(40, 40), layers=["mask"])["mask"]
    assert mask.sum() == 400
    assert camera.orthographic


def test_many_pictures_equal_single_ones(lecture: blinn.Scene) -> None:
    cameras = [blinn.Camera.look_at((10 * np.sin(a), 4, 10 * np.cos(a)), (0, 0, 0)) for a in range(5)]
    many = list(lecture.render_many(cameras, size=(32, 24), exposure=0, layers=["depth"]))
    assert len(many) == 5
    for camera, picture in zip(cameras, many):
        single = lecture.render(camera, size=(32, 24), exposure=0, layers=["depth"])
        np.testing.assert_array_equal(picture.rgba, single.rgba)
        np.testing.assert_array_equal(picture["depth"], single["depth"])


def test_an_iterator_may_be_dropped(lecture: blinn.Scene) -> None:
    camera = blinn.Camera.look_at((0, 4, 10), (0, 0, 0))
    pictures = lecture.render_many([camera] * 50, size=(64, 48))
    next(pictures)
    pictures.close()
    assert lecture.render(camera, size=(8, 8)).width == 8


def test_progress_reaches_one(lecture: blinn.Scene) -> None:
    seen: list[float] = []
    lecture.render(size=(320, 240), samples=16, progress=seen.append)
    assert seen == sorted(seen) and 0 <= seen[0] and seen[-1] == 1.0


def test_an_error_in_the_callback_ends_the_render(lecture: blinn.Scene) -> None:
    def fail(fraction: float) -> None:
        raise RuntimeError("stop")

    with pytest.raises(RuntimeError, match="stop"):
        lecture.render(size=(640, 480), samples=64, progress=fail)


def test_ctrl_c_interrupts(lecture: blinn.Scene) -> None:
    # A process in the background of a shell ignores the signal.
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    timer = threading.Timer(0.3, lambda: os.kill(os.getpid(), signal.SIGINT))
    timer.start()
    start = time.monotonic()
    try:
        with pytest.raises(KeyboardInterrupt):
            lecture.render(size=(4096, 4096), samples=4096)
    finally:
        signal.signal(signal.SIGINT, before)
    assert time.monotonic() - start < 20


def test_other_threads_run_while_rendering(lecture: blinn.Scene) -> None:
    counts: list[int] = []
    done = threading.Event()

    def count() -> None:
        n = 0
        while not done.is_set():
            n += 1
            time.sleep(0.001)
        counts.append(n)

    thread = threading.Thread(target=count)
    thread.start()
    lecture.render(size=(640, 480), samples=64)
    done.set()
    thread.join()
    assert counts[0] > 5


def test_notebooks_show_a_png(lecture: blinn.Scene) -> None:
    assert lecture.render(size=(8, 8))._repr_png_().startswith(b"\x89PNG")
