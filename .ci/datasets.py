#!/usr/bin/env python3
"""Checks blinn's datasets with the readers of their formats, and layers against NumPy.

    datasets.py BLINN

Renders one set of views in the formats of nerfstudio, COLMAP, BOP and COCO. pycolmap and pycocotools read theirs; the rules of
BOP's toolkit and of nerfstudio are checked as documented. Points of the position layer have to project to their pixel centres
through every format. Needs numpy, OpenEXR, pillow, pycolmap and pycocotools.
"""
import contextlib
import io
import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
import OpenEXR
import pycolmap
from PIL import Image
from pycocotools import mask as coco_masks
from pycocotools.coco import COCO

BLINN = os.path.abspath(sys.argv[1])
MODELS = Path(__file__).resolve().parent.parent / "models"
VIEWS, W, H = 6, 160, 120
CROP = (20, 10, 120, 100)  # off-centre: the principal point is not in the middle
X, Y, CW, CH = CROP
ROWS, COLUMNS = np.mgrid[0:CH, 0:CW]
CENTRES = np.stack([COLUMNS + 0.5, ROWS + 0.5], -1)


def blinn(*args):
    subprocess.run([BLINN, *map(str, args), "-q"], check=True)


def read_exr(path):
    with OpenEXR.File(str(path), separate_channels=True) as file:
        return {name: channel.pixels for name, channel in file.channels().items()}


def vectors(channels, name, letters="XYZ"):
    return np.stack([channels[f"{name}.{c}"] for c in letters], -1).astype(np.float64)


def projected(points, k, rotation, translation):
    """Pixels of world points in a camera after OpenCV, and their depths."""
    p = points @ rotation.T + translation
    return p[..., :2] / p[..., 2:] * [k[0][0], k[1][1]] + [k[0][2], k[1][2]], p[..., 2]


def check_projection(name, views, cameras):
    for view, (k, rotation, translation) in zip(views, cameras, strict=True):
        hit = view["mask.A"] > 0
        pixels, depth = projected(vectors(view, "position")[hit], k, rotation, translation)
        off = np.abs(pixels - CENTRES[hit]).max()
        assert off < 1e-3, f"{name}: off by {off} pixels"
        assert np.allclose(depth, view["depth.Z"][hit], rtol=1e-5), name
    print(f"  {name}: positions project to their pixel centres")


def check_nerf(rgb, views):
    """The rules of nerfstudio's documentation for transforms.json."""
    data = json.loads((rgb / "transforms.json").read_text())
    assert (data["w"], data["h"]) == (CW, CH) and data.get("camera_model", "OPENCV") == "OPENCV"
    k = [[data["fl_x"], 0, data["cx"]], [0, data["fl_y"], data["cy"]], [0, 0, 1]]
    cameras = []
    for frame in data["frames"]:
        for key in ("file_path", "depth_file_path", "mask_path"):
            assert (rgb / frame[key]).is_file(), key
        matrix = np.array(frame["transform_matrix"])
        rotation = matrix[:3, :3] @ np.diag([1, -1, -1])
        cameras.append((k, rotation.T, -rotation.T @ matrix[:3, 3]))
    check_projection("nerf", views, cameras)


def check_colmap(folder, views):
    model = pycolmap.Reconstruction(str(folder))
    assert model.num_images() == VIEWS and model.num_points3D() > 500, model.summary()
    cameras = []
    for i in range(1, VIEWS + 1):
        image = model.images[i]
        pose = image.cam_from_world() if callable(image.cam_from_world) else image.cam_from_world
        lens = model.cameras[image.camera_id]
        assert (lens.width, lens.height, image.name) == (CW, CH, f"{i:06}.png")
        cameras.append((lens.calibration_matrix(), pose.rotation.matrix(), pose.translation))
    check_projection("colmap", views, cameras)
    worst, observations, on_surface = 0, 0, 0
    for point in model.points3D.values():
        assert point.track.length() >= 2
        for element in point.track.elements:
            seen = model.images[element.image_id].points2D[element.point2D_idx].xy
            pixel, _ = projected(point.xyz, *cameras[element.image_id - 1])
            worst = max(worst, np.abs(pixel - seen).max())
            # The point is on the surface that the view shows there, not behind it; details may miss all pixel centres.
            column, row = np.minimum(seen.astype(int), [CW - 1, CH - 1])
            around = views[element.image_id - 1]["depth.Z"][max(row - 1, 0) : row + 2, max(column - 1, 0) : column + 2]
            depth = projected(point.xyz, *cameras[element.image_id - 1])[1]
            on_surface += around.min() - 0.1 * depth < depth < around.max() + 0.1 * depth
            observations += 1
    assert worst < 1e-3 and on_surface > 0.99 * observations, (worst, on_surface, observations)
    print(f"  colmap: {model.num_points3D()} points, {observations} observations within {worst:.1e} pixels")


def check_coco(rgb, views, info):
    with contextlib.redirect_stdout(io.StringIO()):
        data = COCO(str(rgb / "annotations.json"))
    names = {row["id"]: row["name"] for row in info["object_ids"]}
    categories = {row["id"]: row["name"] for row in data.loadCats(data.getCatIds())}
    count = 0
    for i, view in enumerate(views, 1):
        covered = np.zeros((CH, CW), int)
        for annotation in data.loadAnns(data.getAnnIds(imgIds=[i])):
            mask = data.annToMask(annotation)
            assert (mask == (view["object-id.I"] == annotation["object_id"])).all()
            assert annotation["area"] == mask.sum() == coco_masks.area(annotation["segmentation"])
            assert annotation["bbox"] == coco_masks.toBbox(annotation["segmentation"]).tolist()
            assert categories[annotation["category_id"]] == names[annotation["object_id"]]
            amodal = coco_masks.decode(annotation["amodal_segmentation"])
            assert (amodal >= mask).all() and amodal.sum() == annotation["amodal_area"]
            covered += mask
            count += 1
        assert (covered == (view["mask.A"] > 0)).all(), "the masks partition the image"
    print(f"  coco: {count} annotations, masks partition all images")


def polygon_masks(polygons):
    runs = coco_masks.frPyObjects(polygons, CH, CW)
    masks = coco_masks.decode(runs)
    assert (masks.sum(-1) <= 1).all(), "polygons overlap"
    return masks.max(-1)


def has_hole(mask):
    free = np.pad(mask, 1) == 0
    outside = np.zeros_like(free)
    outside[0, 0] = True
    while True:
        grown = outside.copy()
        for axis in (0, 1):
            for step in (-1, 1):
                grown |= np.roll(outside, step, axis)
        grown &= free
        if (grown == outside).all():
            return (outside != free).any()
        outside = grown


def check_forms(text, other):
    """The binary model of COLMAP has the numbers of the text files; COCO's polygons decode to the pixels of its run lengths."""
    models = [pycolmap.Reconstruction(str(folder / "sparse" / "0")) for folder in (text, other)]
    assert not (other / "sparse" / "0" / "images.txt").exists()
    for name in ("cameras", "images", "points3D"):
        assert sorted(getattr(models[0], name)) == sorted(getattr(models[1], name)), name
    for i, image in models[0].images.items():
        pair = [image, models[1].images[i]]
        poses = [p.cam_from_world() if callable(p.cam_from_world) else p.cam_from_world for p in pair]
        assert np.array_equal(*(pose.matrix() for pose in poses)) and pair[0].name == pair[1].name
        points = [[(*point.xy, point.point3D_id) for point in p.points2D] for p in pair]
        assert points[0] == points[1]
    for i, point in models[0].points3D.items():
        same = models[1].points3D[i]
        assert np.array_equal(point.xyz, same.xyz) and np.array_equal(point.color, same.color)
        assert [(e.image_id, e.point2D_idx) for e in point.track.elements] == [(e.image_id, e.point2D_idx) for e in same.track.elements]
    files = [json.loads((folder / "annotations.json").read_text()) for folder in (text, other)]
    with contextlib.redirect_stdout(io.StringIO()):
        data = COCO(str(other / "annotations.json"))
    count, holes = 0, 0
    for runs, polygons in zip(*(file["annotations"] for file in files), strict=True):
        for key in ("segmentation", "amodal_segmentation"):
            mask = coco_masks.decode(runs[key])
            assert np.array_equal(polygon_masks(polygons[key]), mask), (polygons["name"], key)
            count += len(polygons[key])
            holes += has_hole(mask)
        assert np.array_equal(data.annToMask(polygons), coco_masks.decode(runs["segmentation"]))
        for key in set(runs) - {"segmentation", "amodal_segmentation"}:
            assert runs[key] == polygons[key], key
    assert holes > 0, "no object has a hole"
    print(f"  colmap-bin: the numbers of the text files; coco-polygons: {count} polygons, masks with holes among them, decode to the run lengths' pixels")


def read_ply(path):
    header, body = path.read_bytes().split(b"end_header\n", 1)
    assert header.startswith(b"ply\nformat binary_little_endian 1.0\n")
    counts = [int(line.split()[2]) for line in header.decode().splitlines() if line.startswith("element")]
    vertices = np.frombuffer(body, "<f4", counts[0] * 3).reshape(-1, 3)
    faces = np.frombuffer(body[vertices.nbytes :], np.dtype([("n", "u1"), ("v", "<i4", 3)]), counts[1])
    assert (faces["n"] == 3).all() and faces["v"].max() < counts[0]
    return vertices.astype(float)


def toolkit_box(mask):
    """Left, top, and the distances to the last column and row, as BOP's toolkit computes them."""
    rows, columns = np.nonzero(mask)
    return [columns.min(), rows.min(), columns.max() - columns.min(), rows.max() - rows.min()]


def check_bop(root, views):
    """The rules of BOP's documentation, docs/bop_datasets_format.md in its toolkit."""
    scene = root / "train" / "000001"
    files = {name: json.loads((scene / f"{name}.json").read_text()) for name in ("scene_camera", "scene_gt", "scene_gt_info")}
    info = json.loads((root / "models" / "models_info.json").read_text())
    models = {int(i): read_ply(root / "models" / f"obj_{int(i):06}.ply") for i in info}
    for i, model in models.items():
        for axis, name in enumerate("xyz"):
            assert np.isclose(model[:, axis].min(), info[str(i)][f"min_{name}"], atol=1e-3)
            assert np.isclose(np.ptp(model[:, axis]), info[str(i)][f"size_{name}"], atol=1e-3)
        assert info[str(i)]["diameter"] <= np.linalg.norm([info[str(i)][f"size_{c}"] for c in "xyz"]) + 1e-6
    cameras = []
    for i, view in enumerate(views, 1):
        camera, poses, details = (files[name][str(i)] for name in ("scene_camera", "scene_gt", "scene_gt_info"))
        k = np.reshape(camera["cam_K"], (3, 3))
        cameras.append((k, np.reshape(camera["cam_R_w2c"], (3, 3)), np.array(camera["cam_t_w2c"]) / 1000))
        depth = np.array(Image.open(scene / "depth" / f"{i:06}.png"), float) * camera["depth_scale"]
        hit = view["mask.A"] > 0
        assert (hit == (depth > 0)).all()
        assert np.abs(depth - view["depth.Z"] * 1000)[hit].max() <= 0.51 * camera["depth_scale"]
        shown = set(np.unique(view["object-id.I"])) - {0}
        assert shown <= {pose["obj_id"] for pose in poses}
        covered = np.zeros((CH, CW), int)
        for gt, (pose, detail) in enumerate(zip(poses, details, strict=True)):
            visible, mask = (np.array(Image.open(scene / f / f"{i:06}_{gt:06}.png")) > 0 for f in ("mask_visib", "mask"))
            assert (visible == (view["object-id.I"] == pose["obj_id"])).all() and (mask >= visible).all()
            covered += visible
            assert detail["px_count_visib"] == visible.sum() and detail["px_count_valid"] == mask.sum() <= detail["px_count_all"]
            assert detail["visib_fract"] == visible.sum() / detail["px_count_all"]
            assert detail["bbox_visib"] == (toolkit_box(visible) if visible.any() else [-1] * 4)
            rotation = np.reshape(pose["cam_R_m2c"], (3, 3))
            assert np.allclose(rotation @ rotation.T, np.eye(3), atol=1e-9) and np.linalg.det(rotation) > 0
            # The box is that of the projected model, up to thin parts that cover no pixel's centre.
            pixels, _ = projected(models[pose["obj_id"]], k, rotation, np.array(pose["cam_t_m2c"]))
            low, high = pixels.min(0), pixels.max(0)
            x, y, w, h = detail["bbox_obj"]
            assert (low <= [x + 0.5, y + 0.5]).all() and (high >= [x + w + 0.5, y + h + 0.5]).all()
            gap = max((np.array([x, y]) - low).max(), (high - [x + w + 1, y + h + 1]).max())
            assert gap < 5 or detail["px_count_all"] < 100, (low, high, detail)
        assert (covered == hit).all()
    check_projection("bop", views, cameras)


def check_merged(folder):
    """One dataset of two scenes: ids differ, names lead to images, and the masks of COCO and BOP are the same."""
    root = folder / "merged"
    scenes = [MODELS / "assembly" / "assembly.glb", MODELS / "tower" / "tower.glb"]
    size = ["--size", f"{W}x{H}", "-s", 1]
    blinn("turntable", *scenes, "--views", 2, *size, "--dataset", "coco,bop,colmap", "--category", "scene", "--merge", "-o", f"{root}/")
    with contextlib.redirect_stdout(io.StringIO()):
        data = COCO(str(root / "annotations.json"))
    assert [row["name"] for row in data.loadCats(data.getCatIds())] == ["assembly", "tower"]
    assert sorted(data.getImgIds()) == [1, 2, 3, 4]
    info = json.loads((root / "models" / "models_info.json").read_text())
    count = 0
    for image in data.loadImgs(data.getImgIds()):
        scene, view = divmod(image["id"] - 1, 2)
        folder, name = root / "train" / f"{scene + 1:06}", f"{view + 1:06}"
        assert image["file_name"] == f"train/{scene + 1:06}/rgb/{name}.png"
        assert Image.open(root / image["file_name"]).size == (W, H)
        poses = json.loads((folder / "scene_gt.json").read_text())[str(view + 1)]
        masks = {
            pose["obj_id"]: np.array(Image.open(folder / "mask_visib" / f"{name}_{gt:06}.png")) > 0
            for gt, pose in enumerate(poses)
        }
        assert all(str(i) in info and (root / "models" / f"obj_{i:06}.ply").is_file() for i in masks)
        for annotation in data.loadAnns(data.getAnnIds(imgIds=[image["id"]])):
            assert annotation["category_id"] == scene + 1
            mask = masks[1000 * (scene + 1) + annotation["object_id"]]
            assert (data.annToMask(annotation) == mask).all()
            count += 1
    ids = [set(pycolmap.Reconstruction(str(root / "sparse" / str(k))).images) for k in (0, 1)]
    names = [image.name for k in (0, 1) for image in pycolmap.Reconstruction(str(root / "sparse" / str(k))).images.values()]
    assert ids == [{1, 2}, {3, 4}] and all((root / name).is_file() for name in names)
    print(f"  merged: {count} annotations of two scenes have the masks of BOP")


def bilinear(image, x, y):
    x, y = x - 0.5, y - 0.5
    i, j = (np.clip(np.floor(v).astype(int), 0, n - 2) for v, n in ((x, image.shape[1]), (y, image.shape[0])))
    u, v = (x - i)[..., None], (y - j)[..., None]
    top = image[j, i] * (1 - u) + image[j, i + 1] * u
    return top * (1 - v) + (image[j + 1, i] * (1 - u) + image[j + 1, i + 1] * u) * v


def check_flow(command, frames, flow):
    """Frame t warped by its flow equals frame t + 1 where that sees the point, up to resampling at outlines."""
    aovs = "mask,object-id,nocs,flow-forward,flow-backward"
    blinn(*command, "--size", "320x240", "-s", 1, "--aov", aovs, "-o", f"{flow}/###.exr")
    first, second = (read_exr(f"{flow}/{n:03}.exr") for n in frames)
    for name, (a, b) in {"flow-forward": (first, second), "flow-backward": (second, first)}.items():
        motion = vectors(a, name, "XYV")
        rows, columns = np.mgrid[0:240, 0:320]
        x, y = columns + 0.5 + motion[..., 0], rows + 0.5 + motion[..., 1]
        inside = (x >= 1) & (x <= 319) & (y >= 1) & (y <= 239)
        hit, visible = a["mask.A"] > 0, motion[..., 2] > 0
        off = np.abs(bilinear(vectors(b, "nocs"), x, y) - vectors(a, "nocs")).max(-1)
        assert visible.sum() > 5000 and not (visible & ~hit).any() and not motion[~hit].any()
        assert np.median(off[visible & inside]) < 1e-4 and np.quantile(off[visible & inside], 0.9) < 0.02
        hidden = hit & ~visible & inside
        assert hidden.sum() > 20 and (off[hidden] > 1e-4).mean() > 0.95, "what is hidden is not there"
    print(f"  flow: {command[1].stem}")


def check_ids(folder):
    scene = MODELS / "assembly" / "assembly.glb"
    flags = ["--size", "80x60", "-s", 1, "--aov", "object-id,material-id"]
    blinn("render", scene, *flags, "-o", folder / "a.exr")
    blinn("render", scene, *flags, "-o", folder / "a.png")
    all_ids = read_exr(folder / "a.exr")
    info = json.loads(subprocess.run([BLINN, "info", "--json", scene], check=True, capture_output=True).stdout)
    for kind in ("object", "material"):
        image = Image.open(folder / f"a.{kind}-id.png")
        image.load()
        ids = np.array(image)
        assert image.mode == "P" and (ids == all_ids[f"{kind}-id.I"]).all()
        names = {row["id"]: row["name"] for row in info[f"{kind}_ids"]}
        shown = {int(i): name for i, name in json.loads(image.text["names"]).items()}
        assert shown == {i: names[i] for i in np.unique(ids).tolist() if i}
    print("  ids: palettes hold ids and names")
    return info


def main():
    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder)
        scene = MODELS / "assembly" / "assembly.glb"
        rgb = folder / "set" / "train" / "000001" / "rgb"
        info = check_ids(folder)
        common = ["turntable", scene, "--views", VIEWS, "--size", f"{W}x{H}", "-s", 1, "--crop", ",".join(map(str, CROP))]
        blinn(*common, "--dataset", "nerf,colmap,bop,coco", "-o", rgb / "######.png")
        layers = "depth,mask,position,object-id"
        blinn(*common, "--aov", layers, "-o", folder / "exr" / "######.exr")
        views = [read_exr(folder / "exr" / f"{i:06}.exr") for i in range(1, VIEWS + 1)]
        check_nerf(rgb, views)
        check_colmap(rgb / "sparse" / "0", views)
        check_coco(rgb, views, info)
        forms = folder / "forms"
        blinn(*common, "--dataset", "nerf,colmap-bin,coco-polygons", "-o", forms / "######.png")
        check_forms(rgb, forms)
        check_bop(folder / "set", views)
        check_merged(folder)
        check_flow(["render", MODELS / "figure" / "figure.glb", "--frames=5-6"], (5, 6), folder / "walk")
        check_flow(["turntable", scene, "--count", 36, "--only", "36,1"], (36, 1), folder / "turn")


main()
