"""Materials other than one Principled BSDF, and what is no surface."""

from __future__ import annotations

import pytest

bpy = pytest.importorskip("bpy")
np = pytest.importorskip("numpy")

from node_trees import add_cube, add_node, new_material  # noqa: E402


def close(a, b):
    return a == pytest.approx(b, rel=1e-4, abs=1e-5)


def link_surface(tree, shader, name="Surface"):
    tree.links.new(shader.outputs[0], tree.nodes["Material Output"].inputs[name])


def volume(name):
    material, tree, shader = new_material(name)
    tree.nodes.remove(shader)
    link_surface(tree, add_node(tree, "VolumePrincipled"), "Volume")
    return material


def warnings_of(capfd):
    return [line.split("blinn: ", 1)[1] for line in capfd.readouterr().out.splitlines() if "blinn: " in line]


@pytest.mark.parametrize("applied", [False, True])
def test_volumes_without_a_surface_are_left_out(scene, export, capfd, applied):
    add_cube(scene, volume("Fog")).name = "Domain"
    mixed = add_cube(scene, new_material("Plain")[0], volume("Smoke"))
    mixed.name = "Mixed"
    mixed.data.polygons[0].material_index = 1
    result = export(export_apply=applied)
    assert [material["name"] for material in result.json["materials"]] == ["Plain"]
    nodes = {node["name"]: node for node in result.json["nodes"]}
    assert "mesh" not in nodes["Domain"]
    (mesh,) = result.json["meshes"]
    (part,) = mesh["primitives"]
    assert result.json["accessors"][part["indices"]]["count"] == 5 * 6
    assert warnings_of(capfd) == ["volumes are not written, nor the faces around them: 'Fog', 'Smoke'"]
