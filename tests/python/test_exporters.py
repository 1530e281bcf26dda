"""Files as other programs write them: a file is judged as a whole, and by its program."""

from pathlib import Path

import numpy as np
import pytest

import blinn
from gltf_file import CORNERS, SQUARE, Glb

CAMERA = blinn.Camera.look_at((0, 0, 5), (0, 0, 0), yfov=20)
VTK = "# wavefront mtl file written by the visualization toolkit\n\n"


def materials(folder: Path, obj: str = "", **libraries: str) -> tuple[blinn.Scene, list[str]]:
    """Loads an OBJ with a square at x = 0, 3, 6 … for each material of the libraries."""
    obj += "mtllib " + " ".join(f"{name}.mtl" for name in libraries) + "\n"
    names = []
    for library, text in libraries.items():
        (folder / f"{library}.mtl").write_text(text)
        names += [line.split()[1] for line in text.splitlines() if line.startswith("newmtl")]
    for i, name in enumerate(names):
        obj += "".join(f"v {x + 3 * i} {y} {z}\n" for x, y, z in SQUARE) + f"usemtl {name}\nf -4 -3 -2 -1\n"
    (folder / "a.obj").write_text(obj)
    return blinn.load(folder / "a.obj"), names


def in_front(i: int) -> blinn.Camera:
    return blinn.Camera.look_at((3 * i, 0, 5), (3 * i, 0, 0), yfov=10)


def alpha(scene: blinn.Scene, camera: blinn.Camera = CAMERA) -> float:
    return float(scene.render(camera, size=(8, 8), samples=1, background="transparent").rgba[4, 4, 3]) / 255


def albedo(scene: blinn.Scene, camera: blinn.Camera = CAMERA) -> list[float]:
    return scene.render(camera, size=(8, 8), samples=1, layers="albedo")["albedo"][4, 4].tolist()


@pytest.mark.parametrize(
    ("first", "second", "expected"),
    [
        ("Tr .25", "Tr 0", (0.75, 1)),  # the usual meaning
        ("Tr 1", "Tr .3", (1, 0.3)),  # nobody hides a material: the opacity
        ("d .3\nTr .3", "Tr .6", (0.3, 0.6)),  # Tr repeats d: the opacity
        ("d .3\nTr .7", "Tr .6", (0.3, 0.4)),
        ("d 1\nTr 1", "d .25\nTr .25", (1, 0.25)),
        ("Kd 1 1 1 .5\nd 1", "Kd 1 1 1 .25", (1, 0.25)),
        ("Kd 1 1 1 0", "Kd 1 1 1 0", (1, 1)),  # a padding of all colours
    ],
)
def test_opacities_of_a_file_are_judged_together(
    tmp_path: Path, first: str, second: str, expected: tuple[float, float]
) -> None:
    scene, names = materials(tmp_path, a=f"newmtl a\n{first}\nnewmtl b\n{second}\n")
    found = [alpha(scene, in_front(i)) for i in range(len(names))]
    np.testing.assert_allclose(found, expected, atol=1 / 255)


def test_each_library_has_the_colours_of_its_program(tmp_path: Path) -> None:
    color = "Kd .5 .5 2\nTr 1\n"
    blender = "# Blender 4.2.1 LTS MTL File: 'x.blend'\n"
    scene, _ = materials(
        tmp_path,
        a=f"{VTK}newmtl a\nKd .5 .5 .5\nTr 1\nnewmtl bright\n{color}",
        b=f"newmtl b\n{color}",
        c=f"{blender}newmtl c\n{color}",
    )
    found = [albedo(scene, in_front(i))[0] for i in range(4)]
    np.testing.assert_allclose(found, [0.214, 0.5, 0.5, 0.5], atol=1e-3, err_msg="values above 1 are not decoded")


def test_the_obj_names_the_program_of_its_mtl(tmp_path: Path) -> None:
    head = "\ufeff# Model exported from LeoCAD\r\n"
    scene, _ = materials(tmp_path, head, a="newmtl a\r\nKd .5 .25 1\r\nD .5\r\n")
    np.testing.assert_allclose(albedo(scene), [0.214, 0.051, 1], atol=1e-3)
    assert alpha(scene) == pytest.approx(0.5, abs=1 / 255)


@pytest.mark.parametrize(
    ("mode", "diffuse", "base", "expected"),
    [
        ("BLEND", 1, 0.75, 0.75),  # assimp
        ("BLEND", 0.4, 1, 0.4),
        ("BLEND", 0.4, 0.75, 0.4),
        ("BLEND", None, 0.75, 0.75),
        ("OPAQUE", 1, 0.75, 1),
    ],
)
def test_specular_glossiness_has_one_alpha(mode: str, diffuse: float | None, base: float, expected: float) -> None:
    file = Glb()
    factors = {} if diffuse is None else {"diffuseFactor": [1, 1, 1, diffuse]}
    material = file.add(
        "materials",
        alphaMode=mode,
        pbrMetallicRoughness={"baseColorFactor": [1, 1, 1, base]},
        extensions={"KHR_materials_pbrSpecularGlossiness": factors},
    )
    scene = blinn.load(file.bytes(file.node(mesh=file.mesh(material=material))))
    assert alpha(scene) == pytest.approx(expected, abs=1 / 255)


@pytest.mark.parametrize("indices", [CORNERS, None])
def test_colours_of_triangles_are_flat(indices: np.ndarray | None) -> None:
    file = Glb()
    positions = SQUARE if indices is not None else SQUARE[CORNERS]
    mesh = file.mesh(positions, indices, COLOR_0=np.float32([[1, 0, 0], [0, 0, 1]]))
    with pytest.warns(blinn.SceneWarning, match="a colour for each of the 2 triangles"):
        scene = blinn.load(file.bytes(file.node(mesh=mesh)))
    found = scene.render(CAMERA, size=(16, 16), samples=1, layers="albedo")["albedo"].reshape(-1, 3)
    assert np.unique(found[found.sum(-1) > 0], axis=0).tolist() == [[0, 0, 1], [1, 0, 0]]


def test_elements_numbered_by_vertices_are_found_beside_objects_without(tmp_path: Path) -> None:
    squares = ["".join(f"v {x + 3 * i} {y} {z}\n" for x, y, z in SQUARE) for i in range(3)]
    attributes = "vt .25 .5\n" * 4 + "vn 0 1 0\n" * 4
    first = f"g a\n{squares[0]}{attributes}f 1/1/1 2/2/2 3/3/3 4/4/4\n"
    third = f"g c\n{squares[2]}{attributes}f 9/9/9 10/10/10 11/11/11 12/12/12\n"
    (tmp_path / "a.obj").write_text(f"{first}g b\n{squares[1]}f 5 6 7 8\n{third}")
    with pytest.warns(blinn.SceneWarning, match="texture coordinates and normals by vertices"):
        scene = blinn.load(tmp_path / "a.obj")
    layers = scene.render(in_front(2), size=(8, 8), samples=1, layers=["uv", "normal"])
    assert layers["uv"][4, 4].tolist() == [0.25, 0.5] and layers["normal"][4, 4].tolist() == [0, 1, 0]


@pytest.mark.parametrize(("version", "view"), [("1.6.16", "filmic"), ("3.6.28", "filmic"), ("4.0.44", "agx")])
def test_blenders_view_transform_is_that_of_its_version(version: str, view: str) -> None:
    file = Glb(f"Khronos glTF Blender I/O v{version}")
    material = file.add("materials", pbrMetallicRoughness={"baseColorFactor": [0.05, 0.5, 0.05, 1], "metallicFactor": 0})
    file.lights({"type": "directional", "intensity": 2000})
    scene = blinn.load(file.bytes(file.node(mesh=file.mesh(material=material)), file.light_node(0)))
    shown = lambda **options: scene.render(CAMERA, size=(8, 8), samples=1, exposure=0, **options).rgba
    assert len(np.unique(shown())) > 2
    np.testing.assert_array_equal(shown(), shown(view=view))
