"""What the extension names as lost: nodes of lights, objects and effects that glTF has no form for."""

from __future__ import annotations

import math

import pytest

bpy = pytest.importorskip("bpy")

from node_trees import add_cube, add_node, new_material  # noqa: E402

LUMENS_PER_WATT = 683.0


def warnings_of(capfd):
    return [line.split("blinn: ", 1)[1] for line in capfd.readouterr().out.splitlines() if "blinn: " in line]


def nodes_of(light):
    """The nodes of a light, and its Emission."""
    light.use_nodes = True
    return light.node_tree, next(n for n in light.node_tree.nodes if n.bl_idname == "ShaderNodeEmission")


@pytest.mark.parametrize("kind", ["POINT", "SPOT"])
def test_nodes_of_lights_count(scene, add_light, export, capfd, kind):
    scene.render.engine = "CYCLES"
    light = add_light(kind, energy=4.0 * math.pi).data
    tree, emission = nodes_of(light)
    emission.inputs["Color"].default_value = (1.0, 0.5, 0.25, 1.0)
    strength = add_node(tree, "Value")
    strength.outputs[0].default_value = 3.0
    tree.links.new(strength.outputs[0], emission.inputs["Strength"])
    (written,) = export().lights
    found = [written["intensity"] * channel for channel in written["color"]]
    assert found == pytest.approx([3.0 * LUMENS_PER_WATT * channel for channel in (1.0, 0.5, 0.25)], rel=1e-5)
    assert warnings_of(capfd) == []


def test_black_bodies_of_lights_count(scene, add_light, export):
    scene.render.engine = "CYCLES"
    light = add_light("POINT", energy=4.0 * math.pi).data
    if not hasattr(light, "temperature_color"):
        pytest.skip("lights of this Blender have no temperature")
    tree, emission = nodes_of(light)
    tree.links.new(add_node(tree, "Blackbody", Temperature=2000.0).outputs[0], emission.inputs["Color"])
    (written,) = export().lights
    light.temperature = 2000.0
    found = [written["intensity"] * channel for channel in written["color"]]
    assert found == pytest.approx([LUMENS_PER_WATT * channel for channel in light.temperature_color], rel=1e-4)
    assert [light.name for light in bpy.data.lights] == ["Point"]


def test_other_nodes_of_lights_are_named_once(scene, add_light, export, capfd):
    scene.render.engine = "CYCLES"
    light = add_light("POINT", energy=4.0 * math.pi).data
    tree, emission = nodes_of(light)
    tree.links.new(add_node(tree, "TexIES").outputs[0], emission.inputs["Strength"])
    (written,) = export().lights
    assert written["intensity"] == pytest.approx(LUMENS_PER_WATT)
    assert warnings_of(capfd) == ["light 'Point' loses 'IES Texture' of its nodes"]


def test_surfaces_that_only_glow_have_no_gloss(scene, export):
    material, tree, _ = new_material("Lamp")
    glow = add_node(tree, "Emission", Strength=3.0)
    tree.links.new(glow.outputs[0], tree.nodes["Material Output"].inputs["Surface"])
    add_cube(scene, material)
    (written,) = export().json["materials"]
    assert written["pbrMetallicRoughness"]["baseColorFactor"][:3] == [0, 0, 0]
    assert written["extensions"]["KHR_materials_specular"] == {"specularFactor": 0}
    assert written["extensions"]["KHR_materials_emissive_strength"] == {"emissiveStrength": 3}


def test_objects_and_effects_without_a_form_are_named_once(scene, export, capfd):
    for kind in ("volumes", "hair_curves"):
        for name in ("A", "B", "Hidden"):
            data = getattr(bpy.data, kind).new(f"{kind} {name}")
            item = bpy.data.objects.new(f"{kind} {name}", data)
            item.hide_render = name == "Hidden"
            scene.collection.objects.link(item)
    export()
    assert warnings_of(capfd) == [
        "volumes of 2 object(s) cannot be written: 'volumes A', 'volumes B'",
        "hair of 2 object(s) cannot be written: 'hair_curves A', 'hair_curves B'",
    ]
    for item in list(scene.collection.objects):
        if item != scene.camera:
            bpy.data.objects.remove(item)
    scene.render.use_motion_blur = scene.render.use_freestyle = True
    export()
    assert warnings_of(capfd) == ["motion blur is not written", "Freestyle is not written"]
    scene.render.use_motion_blur = scene.render.use_freestyle = False
    scene.view_settings.use_curve_mapping = True
    expected = ["the curve mapping of the view is not written"]
    if hasattr(scene.view_settings, "use_white_balance"):
        scene.view_settings.use_white_balance = True
        expected.append("white balance is not written")
    export()
    assert warnings_of(capfd) == expected
    # Blender itself adds effects to pictures of this engine.
    scene.render.engine = "BLINN"
    export()
    assert warnings_of(capfd) == []
