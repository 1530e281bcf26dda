"""Lists the content of every glTF and OBJ of models/, and fails if a scene lacks a feature that it is meant to show."""

import json
import struct
import sys
from pathlib import Path

MODELS = Path(__file__).resolve().parent.parent
failures = []


def load(path):
    data = path.read_bytes()
    if data[:4] != b"glTF":
        return json.loads(data)
    assert struct.unpack("<I", data[8:12])[0] == len(data), path
    return json.loads(data[20 : 20 + struct.unpack("<I", data[12:16])[0]])


def triangles(doc, mesh):
    total = 0
    for p in doc["meshes"][mesh]["primitives"]:
        if p.get("mode", 4) == 4:
            total += doc["accessors"][p.get("indices", p["attributes"]["POSITION"])]["count"] // 3
    return total


def facts(path):
    doc = load(path)
    nodes, materials = doc["nodes"], doc.get("materials", [])
    used = [n["mesh"] for n in nodes if "mesh" in n]
    lights = doc.get("extensions", {}).get("KHR_lights_punctual", {}).get("lights", [])
    return {
        "bytes": path.stat().st_size,
        "unique": sum(triangles(doc, m) for m in set(used)),
        "expanded": sum(triangles(doc, m) for m in used),
        "meshes": len(doc["meshes"]),
        "mesh nodes": len(used),
        "deepest": depth(nodes, doc["scenes"][0]["nodes"]),
        "mirrored": sum(1 for n in nodes if "scale" in n and n["scale"][0] * n["scale"][1] * n["scale"][2] < 0),
        "lights": sorted(light["type"] for light in lights),
        "cameras": sorted(c["type"] for c in doc.get("cameras", [])),
        "materials": len(materials),
        "metals": sum(1 for m in materials if m.get("pbrMetallicRoughness", {}).get("metallicFactor", 1) == 1),
        "alpha": sorted({m["alphaMode"] for m in materials if "alphaMode" in m}),
        "images": len(doc.get("images", [])),
        "normal maps": sum("normalTexture" in m for m in materials),
        "colours": any("COLOR_0" in p["attributes"] for m in doc["meshes"] for p in m["primitives"]),
        "joints": [len(s["joints"]) for s in doc.get("skins", [])],
        "morphs": sum(len(p.get("targets", [])) for m in doc["meshes"] for p in m["primitives"]),
        "animations": {
            a["name"]: {
                "channels": len(a["channels"]),
                "paths": sorted({c["target"]["path"] for c in a["channels"]}),
                "seconds": [
                    min(doc["accessors"][s["input"]]["min"][0] for s in a["samplers"]),
                    max(doc["accessors"][s["input"]]["max"][0] for s in a["samplers"]),
                ],
            }
            for a in doc.get("animations", [])
        },
        "modes": sorted({p.get("mode", 4) for m in doc["meshes"] for p in m["primitives"]}),
        "extensions": doc.get("extensionsUsed", []),
        "required": doc.get("extensionsRequired", []),
    }


def depth(nodes, roots):
    return max((1 + depth(nodes, nodes[n].get("children", [])) for n in roots), default=0)


def expect(name, condition, what):
    if not condition:
        failures.append(f"{name}: {what}")


def main():
    found = {}
    for path in sorted([*MODELS.glob("*/*.glb"), *MODELS.glob("*/*.gltf")]):
        name = str(path.relative_to(MODELS))
        found[name] = facts(path)
        print(name, json.dumps({k: v for k, v in found[name].items() if v}))
    for path in sorted(MODELS.glob("*/*.obj")):
        faces = [line.split() for line in path.read_text().splitlines() if line.startswith("f ")]
        print(
            path.relative_to(MODELS),
            json.dumps(
                {"bytes": path.stat().st_size, "faces": len(faces), "triangles": sum(len(f) - 3 for f in faces)}
            ),
        )

    get = found.__getitem__
    expect("cornell", get("cornell/cornell.glb")["lights"] == ["point"], "one point light")
    f = get("still-life/still-life.glb")
    expect("still-life", f["lights"] == ["directional", "point", "spot"], "a point, a spot and a sun light")
    expect(
        "still-life", 10_000 <= f["expanded"] <= 60_000 and f["images"] == 1, "10,000 to 60,000 triangles, one image"
    )
    f = get("bar/bar.glb")
    expect("bar", f["metals"] == 4 and f["images"] == 1, "four metals, one image")
    expect(
        "bar",
        {"KHR_materials_transmission", "KHR_materials_ior", "KHR_materials_clearcoat"} <= set(f["extensions"]),
        "glass and varnish",
    )
    f = get("assembly/assembly.glb")
    expect(
        "assembly",
        75_000 <= f["expanded"] <= 77_500 and f["unique"] * 2 < f["expanded"],
        "some 76,000 triangles, shared",
    )
    expect("assembly", f["mirrored"] >= 3 and f["deepest"] >= 4, "mirrored nodes in a hierarchy")
    for name in ("textured/textured.glb", "textured/textured.gltf"):
        f = get(name)
        expect(name, f["images"] == 4 and f["normal maps"] == 1, "four images, one of them a normal map")
    f = get("figure/figure.glb")
    expect(
        "figure",
        f["joints"] and f["joints"][0] >= 10 and f["morphs"] >= 1,
        "a skin of 10 joints or more, a morph target",
    )
    paths = {p for a in f["animations"].values() for p in a["paths"]}
    expect("figure", {"rotation", "weights"} <= paths, "rotations and weights animated")
    f = get("alpha/alpha.glb")
    expect("alpha", f["alpha"] == ["BLEND", "MASK"] and f["colours"], "MASK, BLEND and vertex colours")
    expect("alpha", f["cameras"] == ["orthographic", "perspective"], "both kinds of camera")
    f = get("tower/tower.glb")
    expect("tower", f["materials"] == 7 and f["lights"] == ["point"], "seven materials, a lamp")
    expect("tower", f["cameras"] == ["perspective"], "a camera")
    f = get("reconstruction/reconstruction.glb")
    expect("reconstruction", f["modes"] == [0, 1, 2, 3] and f["colours"], "coloured points and three kinds of lines")
    expect("reconstruction", len(f["cameras"]) == 4 and f["bytes"] < 200_000, "four cameras, less than 200 kB")
    expect("lecture", get("lecture/lecture.glb")["cameras"] == ["perspective"] * 2, "two views")
    f = get("tests/lights.glb")
    expect("lights", len(f["lights"]) == 3 and len(f["cameras"]) == 2, "three lights, two cameras")
    size = sum(p.stat().st_size for p in MODELS.rglob("*") if p.is_file())
    print(f"{size / 1e6:.1f} MB in all")
    expect("models", size < 8e6, "less than 8 MB")
    if failures:
        sys.exit("\n".join(failures))


main()
