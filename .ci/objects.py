"""Renders 60 objects from 4 sides, kills the run several times and resumes it: the files must be those of an undisturbed run.
Reads archives of the same images with the package webdataset.

    python .ci/objects.py BLINN
"""

import io
import json
import struct
import subprocess
import sys
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
    print(f"{time.time() - start:.1f} s")


if __name__ == "__main__":
    main()
