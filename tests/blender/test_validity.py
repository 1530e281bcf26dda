"""Files of exports are valid glTF."""

from __future__ import annotations

import json
import shutil
import subprocess
from pathlib import Path
from typing import Any, Iterator

import pytest

bpy = pytest.importorskip("bpy")

from export_subjects import SUBJECTS  # noqa: E402

ROOT = Path(__file__).resolve().parents[2]
# Prints a line of JSON for each file: the messages of errors.
VALIDATE = """
const fs = require("fs"), validator = require("gltf-validator");
(async () => {
    for (const path of process.argv.slice(1)) {
        const report = await validator.validateBytes(new Uint8Array(fs.readFileSync(path)), {maxIssues: 0});
        const errors = report.issues.messages.filter(issue => issue.severity === 0);
        console.log(JSON.stringify(errors.map(issue => `${issue.code} ${issue.pointer}: ${issue.message}`)));
    }
})();
"""


@pytest.fixture(params=SUBJECTS)
def subject(scene, request) -> Any:
    """A scene of each kind."""
    SUBJECTS[request.param](scene)
    scene.blinn.bake_size = 64
    return scene


def textures_of(material: Any) -> Iterator[dict]:
    """Yields all references to textures, of extensions, too."""
    waiting = [material]
    while waiting:
        value = waiting.pop()
        if isinstance(value, dict):
            if "index" in value:
                yield value
            waiting.extend(value.values())
        elif isinstance(value, list):
            waiting.extend(value)


def missing_maps(result: Any) -> list[str]:
    """Returns the maps that textures name and primitives lack."""
    missing = []
    for mesh in result.json.get("meshes", []):
        for primitive in mesh["primitives"]:
            material = result.json["materials"][primitive["material"]] if "material" in primitive else {}
            for texture in textures_of(material):
                transform = texture.get("extensions", {}).get("KHR_texture_transform", {})
                name = f"TEXCOORD_{transform.get('texCoord', texture.get('texCoord', 0))}"
                if name not in primitive["attributes"]:
                    missing.append(f"{mesh['name']}: {material['name']}: {name}")
    return missing


def errors_of(paths: list[Path]) -> list[list[str]]:
    """Returns the errors that Khronos's validator finds in each file. It is the package gltf-validator of Node.js."""
    node = shutil.which("node")
    if node is None or subprocess.run([node, "-e", "require('gltf-validator')"], cwd=ROOT, capture_output=True).returncode:
        pytest.skip("Node.js has no package gltf-validator")
    run = subprocess.run([node, "-e", VALIDATE, *paths], cwd=ROOT, capture_output=True, text=True, check=True)
    return [json.loads(line) for line in run.stdout.splitlines()]


@pytest.mark.parametrize("bake", ["never", "auto"])
def test_files_are_valid(subject, export, tmp_path, bake):
    subject.blinn.bake = bake
    is_whole = {"export_apply": bake == "auto", "export_tangents": bake == "auto"}
    result = export(**is_whole)
    assert "meshes" in result.json or not any(item.type == "MESH" for item in subject.objects)
    assert missing_maps(result) == []
    assert errors_of([tmp_path / "scene.glb"]) == [[]]


def test_normal_maps_without_a_map_are_named(scene, export, capfd):
    SUBJECTS["normals without maps"](scene)
    export()
    assert capfd.readouterr().out.count("mesh 'Cube' has no UV map for the normal map of 'Images'") == 1
