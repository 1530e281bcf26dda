"""Renders 60 objects from 4 sides, kills the run several times and resumes it: the files must be those of an undisturbed run.
Reads archives of the same images with the package webdataset, and archives of BOP as its toolkit does.

    python .ci/objects.py BLINN
"""

import io
import json
import struct
import subprocess
import sys
import tarfile
import tempfile
import time
from pathlib import Path

import numpy as np
import webdataset
from PIL import Image

OBJECTS = 60
VIEWS = 4
SIZE = 48
KILLS = 6


def write_glb(path: Path, seed: int) -> None:
    """Writes a GLB of random triangles."""
    random = np.random.default_rng(seed)
    points = random.normal(size=(3 * random.integers(5, 40), 3)).astype("<f4")
    document = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "buffers": [{"byteLength": points.nbytes}],
        "bufferViews": [{"buffer": 0, "byteLength": points.nbytes}],
        "accessors": [{
            "bufferView": 0, "componentType": 5126, "count": len(points), "type": "VEC3",
            "min": points.min(0).tolist(), "max": points.max(0).tolist(),
        }],
    }
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", points.nbytes, b"BIN\0") + points.tobytes()
    path.write_bytes(struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks)


def tree(folder: Path) -> dict:
    return {str(file.relative_to(folder)): file.read_bytes() for file in sorted(folder.rglob("*")) if file.is_file()}


def run_killed(command: list, kills: int) -> int:
    """Starts a command, kills it after growing times, and lets it end at last. Returns the number of kills."""
    killed = 0
    for i in range(kills):
        process = subprocess.Popen(command, stderr=subprocess.DEVNULL)
        try:
            process.wait(0.15 + 0.12 * i)
        except subprocess.TimeoutExpired:
            process.kill()
            killed += process.wait() < 0
    subprocess.run(command, check=True)
    return killed


def check_tree(blinn: str, folder: Path) -> None:
    def command(out: str) -> list:
        return [
            blinn, "turntable", folder / "objects", "--views", str(VIEWS), "--on", "random", "--normalize", "unit-sphere",
            "--size", f"{SIZE}x{SIZE}", "-s", "4", "-q", "--resume", "--ledger", folder / f"{out}.jsonl",
            "-o", folder / out / "{stem}/##.png",
        ]

    subprocess.run(command("whole"), check=True)
    killed = run_killed(command("killed"), KILLS)
    assert killed > 0, "no run was killed"
    whole = tree(folder / "whole")
    assert len(whole) == OBJECTS * (4 * VIEWS + 1), len(whole)
    assert tree(folder / "killed") == whole, "the files differ from those of an undisturbed run"
    lines = [json.loads(line) for line in (folder / "killed.jsonl").read_text().splitlines() if line.endswith("}")]
    done = {line["scene"] for line in lines if line["status"] == "done"}
    assert len(done) == OBJECTS, len(done)
    print(f"{len(whole)} files after {killed} kills")


def check_shards(blinn: str, folder: Path) -> None:
    def command(out: str, *more: str) -> list:
        return [
            blinn, "turntable", folder / "objects", "--views", str(VIEWS), "--size", f"{SIZE}x{SIZE}", "-s", "1", "-q",
            "--shard-size", "48", "--resume", "-o", folder / out / "{shard:05}.tar", *more,
        ]

    subprocess.run(command("shards"), check=True)
    run_killed(command("killed-shards"), 3)
    for share in ["1/2", "2/2"]:
        subprocess.run(command("shares", "--chunk", share, "--threads", "1"), check=True)
    whole = tree(folder / "shards")
    assert len(whole) == OBJECTS * VIEWS // 48, list(whole)
    assert tree(folder / "killed-shards") == whole and tree(folder / "shares") == whole

    urls = str(folder / "shards" / f"{{00000..{len(whole) - 1:05}}}.tar")
    samples = list(webdataset.WebDataset(urls, shardshuffle=False))
    assert len(samples) == OBJECTS * VIEWS, len(samples)
    keys = [sample["__key__"] for sample in samples]
    assert keys == sorted(set(keys)), "keys are distinct and in order"
    for sample in samples:
        description = json.loads(sample["json"])
        image, depth, mask = (Image.open(io.BytesIO(sample[name])) for name in ["png", "depth.png", "mask.png"])
        assert image.size == depth.size == mask.size == (description["w"], description["h"])
        matrix = np.array(description["transform_matrix"])
        assert np.allclose(matrix[:3, :3] @ matrix[:3, :3].T, np.eye(3))
        assert ((np.array(depth) > 0) == (np.array(mask) > 0)).all()
    print(f"{len(samples)} samples in {len(whole)} archives")


def decode_mask(runs: dict) -> np.ndarray:
    """The decoder of BOP's toolkit: runs outside and inside of the mask in turn, down the columns."""
    flat = np.zeros(np.prod(runs["size"]), bool)
    ends = np.cumsum(runs["counts"])
    assert ends[-1] == flat.size
    for start, end in zip(ends[0::2], ends[1::2]):
        flat[start:end] = True
    return flat.reshape(*runs["size"], order="F")


def check_bop(blinn: str, folder: Path) -> None:
    """Compares archives of BOP with the folders of the same dataset, read as bop_toolkit_lib/dataset/bop_webdataset.py reads them."""
    views, objects = 2, sorted((folder / "objects").glob("*.glb"))[:5]
    command = [blinn, "turntable", *objects, "--views", str(views), "--size", f"{SIZE}x{SIZE}", "-s", "1", "-q", "--dataset", "bop"]
    web = folder / "bop" / "train_web"
    subprocess.run([*command, "-o", web / "shard-{shard:06}.tar", "--shard-size", "4"], check=True)
    subprocess.run([*command, "--merge", "-o", f"{folder / 'bop-folders'}/"], check=True)
    root = folder / "bop-folders"
    models = sorted(path.name for path in (root / "models").iterdir())
    assert models == sorted(path.name for path in (folder / "bop" / "models").iterdir() if path.is_file())
    for name in models:
        assert (folder / "bop" / "models" / name).read_bytes() == (root / "models" / name).read_bytes(), name
    shards = json.loads((web / "key_to_shard.json").read_text())
    assert len(shards) == len(objects) * views and max(shards.values()) == 2
    masks = 0
    for key, shard in shards.items():
        scene, image = (int(word) for word in key.split("_"))
        whole = root / "train" / f"{scene:06}"
        with tarfile.open(web / f"shard-{shard:06}.tar") as tar:
            def read(extension: str) -> bytes:
                return tar.extractfile(f"{key}.{extension}").read()

            for extension, name in [("camera", "scene_camera"), ("gt", "scene_gt"), ("gt_info", "scene_gt_info")]:
                expected = json.loads((whole / f"{name}.json").read_text())[str(image)]
                assert json.loads(read(f"{extension}.json")) == expected, (key, extension)
            for extension, kind in [("rgb.png", "rgb"), ("depth.png", "depth")]:
                pixels = [np.array(Image.open(file)) for file in (io.BytesIO(read(extension)), whole / kind / f"{image:06}.png")]
                assert pixels[0].dtype == pixels[1].dtype and (pixels[0] == pixels[1]).all(), (key, kind)
            count = len(json.loads(read("gt.json")))
            for kind in ("mask", "mask_visib"):
                runs = json.loads(read(f"{kind}.json"))
                assert sorted(map(int, runs)) == list(range(count)), (key, kind)
                for i in range(count):
                    expected = np.array(Image.open(whole / kind / f"{image:06}_{i:06}.png")) > 0
                    assert (decode_mask(runs[str(i)]) == expected).all(), (key, kind, i)
                    masks += expected.any()
    assert masks >= 2 * len(shards), masks
    print(f"{len(shards)} samples of BOP with {masks} masks equal the folders of the dataset")


def main() -> None:
    blinn = str(Path(sys.argv[1]).resolve())
    start = time.time()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "objects").mkdir()
        for i in range(OBJECTS):
            write_glb(folder / "objects" / f"{i:03}.glb", i)
        check_tree(blinn, folder)
        check_shards(blinn, folder)
        check_bop(blinn, folder)
    print(f"{time.time() - start:.1f} s")


if __name__ == "__main__":
    main()
