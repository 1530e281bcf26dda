"""`write_dataset`."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import blinn

SMALL = {"size": 16, "samples": 1}


def names(folder: Path) -> set[str]:
    return {str(path.relative_to(folder)) for path in folder.rglob("*") if path.is_file()}


def test_formats_choose_their_folders(models: Path, tmp_path: Path) -> None:
    seen: list[float] = []
    written = blinn.write_dataset(
        models / "tests/cube.obj", tmp_path / "a", views=2, formats=["bop", "coco", "nerf"], progress=seen.append, **SMALL
    )
    assert {str(path.relative_to(tmp_path / "a")) for path in written} == names(tmp_path / "a")
    assert {"train/000001/rgb/000002.png", "train/000001/scene_gt.json", "train/000001/rgb/annotations.json"} <= names(
        tmp_path / "a"
    )
    assert seen and seen[-1] == 1 and seen == sorted(seen)


def test_scenes_in_memory_and_of_files_have_folders_of_their_own(
    quad: blinn.Scene, models: Path, tmp_path: Path
) -> None:
    scenes = [quad, models / "tower/tower.glb", blinn.load(models / "tests/cube.obj")]
    blinn.write_dataset(scenes, tmp_path, views=3, layers="object-id", on="ring", seed=3, **SMALL)
    assert {path.split("/")[0] for path in names(tmp_path)} == {"arrays", "tower", "cube"}
    frames = json.loads((tmp_path / "tower/transforms.json").read_text())["frames"]
    assert len(frames) == 3 and (tmp_path / "cube/0003.object-id.png").exists()
    assert blinn.write_dataset(scenes[1:2], tmp_path / "tower", views=1, resume=True, name="x.png", **SMALL)


def test_scenes_are_merged(quad: blinn.Scene, tmp_path: Path) -> None:
    blinn.write_dataset([quad, quad], tmp_path, views=1, formats="coco", merge=True, **SMALL)
    assert {name for name in names(tmp_path) if name.endswith("annotations.json")} == {
        "annotations.json",
        "arrays-00001/annotations.json",
        "arrays-00002/annotations.json",
    }


def test_scenes_in_memory_have_the_same_random_views_again(quad: blinn.Scene, models: Path, tmp_path: Path) -> None:
    def matrices(folder: str, name: str) -> list[object]:
        frames = json.loads((tmp_path / folder / name / "transforms.json").read_text())["frames"]
        return [frame["transform_matrix"] for frame in frames]

    random: dict[str, Any] = {"views": 2, "on": "random", "random_per_scene": True, **SMALL}
    for folder in ("a", "b"):
        blinn.write_dataset([quad, quad], tmp_path / folder, **random)
    first, second = (matrices("a", f"arrays-0000{number}") for number in (1, 2))
    assert first == matrices("b", "arrays-00001") and first != second
    with pytest.raises(ValueError, match="all files or all in memory"):
        blinn.write_dataset([quad, models / "tests/cube.obj"], tmp_path / "c", **random)


def test_resumed_datasets_write_only_what_is_missing(models: Path, tmp_path: Path) -> None:
    def write() -> list[Path]:
        return blinn.write_dataset([models / "tests/cube.obj"], tmp_path, views=2, resume=True, **SMALL)

    assert len(write()) == 9
    (tmp_path / "cube_0002.depth.png").unlink()
    assert Path(tmp_path / "cube_0002.depth.png") in write()


def test_errors_are_exceptions(models: Path, tmp_path: Path, quad: blinn.Scene) -> None:
    cube = models / "tests/cube.obj"
    with pytest.raises(TypeError, match=r"unknown option 'smaples'; did you mean 'samples'\?"):
        blinn.write_dataset(cube, tmp_path, views=1, smaples=3)
    with pytest.raises(TypeError, match="unknown option 'nonsense'; options: .*samples"):
        blinn.write_dataset(cube, tmp_path, views=1, nonsense=3)
    with pytest.raises(TypeError, match="unknown option 'print_paths'"):
        blinn.write_dataset(cube, tmp_path, views=1, print_paths=True)
    with pytest.raises(ValueError, match="'cocoo' for formats: unknown format 'cocoo'; did you mean 'coco'"):
        blinn.write_dataset(cube, tmp_path, views=1, formats="cocoo")
    with pytest.raises(blinn.RenderError, match="missing.glb"):
        blinn.write_dataset([cube, tmp_path / "missing.glb"], tmp_path / "b", views=1, **SMALL)
    assert "cube/0001.png" in names(tmp_path / "b"), "others are written"
    with pytest.raises(TypeError, match="use formats"):
        blinn.write_dataset(cube, tmp_path, views=1, dataset="coco")
    with pytest.raises(ValueError, match="no scenes"):
        blinn.write_dataset([], tmp_path, views=1)
    with pytest.raises(ValueError, match="time 0"):
        blinn.write_dataset(blinn.load(cube, scale=2), tmp_path, views=1)


def test_messages_name_keywords(models: Path, tmp_path: Path) -> None:
    cube = models / "tests/cube.obj"
    with pytest.warns(blinn.SceneWarning) as caught:
        blinn.write_dataset(cube, tmp_path, views=1, caustics=True, look="punchy", **SMALL)
    text = "\n".join(str(warning.message) for warning in caught)
    assert "caustics has no effect without indirect" in text
    assert "add view='agx'" in text
    assert "--" not in text
    with pytest.raises(ValueError, match="name") as error:
        blinn.write_dataset(cube, tmp_path, views=1, name="x.mp4", **SMALL)
    assert "--" not in str(error.value) and "-o" not in str(error.value)
    missing = tmp_path / "a --size `hide` -o.glb"
    with pytest.raises(blinn.RenderError) as failure:
        blinn.write_dataset(missing, tmp_path, views=1, **SMALL)
    assert str(missing) in str(failure.value), "names of files are no options"


def test_depths_of_pictures_are_metric(quad: blinn.Scene, tmp_path: Path) -> None:
    image = pytest.importorskip("PIL.Image")
    picture = quad.render(size=16, layers=["depth", "normal"])
    picture.save(tmp_path / "one.png")
    assert names(tmp_path) == {"one.png"}
    paths = picture.save_all(tmp_path / "all.png")
    assert {Path(path).name for path in paths} == {"all.png", "all.depth.png", "all.normal.png"}
    depth = picture["depth"]
    expected = np.where(np.isinf(depth), 0, np.round(depth * 1000))
    assert np.abs(np.asarray(image.open(tmp_path / "all.depth.png")).astype(int) - expected).max() <= 1
    picture.save_all(tmp_path / "far.png", depth_unit=0.01)
    assert np.asarray(image.open(tmp_path / "far.depth.png")).max() <= expected.max() / 10 + 1
    with pytest.raises(ValueError, match="depth_unit"):
        picture.save_all(tmp_path / "near.png", depth_unit=1e-6)
    with pytest.raises(ValueError, match="depth_unit"):
        picture.save_all(tmp_path / "near.png", depth_unit="inch")
    picture.save_all(tmp_path / "all.exr")
    assert "near.png" not in names(tmp_path) and "all.exr" in names(tmp_path)


@pytest.mark.parametrize("kind", ["png", "jpg", "webp", "exr"])
@pytest.mark.parametrize("damage", ["zeros", "half", "hole"])
def test_resumed_datasets_repair_damaged_pictures(models: Path, tmp_path: Path, kind: str, damage: str) -> None:
    options = {"views": 2, "name": "{frame:04}." + kind, **SMALL}
    blinn.write_dataset(models / "tests/cube.obj", tmp_path, **options)
    picture = sorted(tmp_path.rglob(f"*.{kind}"))[0]
    whole = picture.read_bytes()
    size = len(whole)
    start, end = {"zeros": (size * 6 // 10, size * 6 // 10 + 6), "half": (size // 2, size), "hole": (size * 8 // 10, size)}[
        damage
    ]
    picture.write_bytes(whole[:start] + (b"" if damage == "half" else bytes(end - start) + whole[end:]))
    assert picture.read_bytes() != whole
    blinn.write_dataset(models / "tests/cube.obj", tmp_path, resume=True, **options)
    assert picture.read_bytes() == whole
