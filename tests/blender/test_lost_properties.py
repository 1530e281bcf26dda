"""What glTF has no field for, against Blender's own render: the picture of an exported file needs no options."""

from __future__ import annotations

import math

import pytest

bpy = pytest.importorskip("bpy")
np = pytest.importorskip("numpy")
blinn = pytest.importorskip("blinn")

from mathutils import Vector  # noqa: E402
from node_trees import new_world  # noqa: E402

# Mean difference of 255, where Cycles' grain and filter are left. Without the property it is several times as large.
CLOSE = 2.5


@pytest.fixture()
def stage(cycles_scene, add_light):
    """Two cubes on the ground below a sun."""
    scene = cycles_scene
    scene.camera.location = (0.0, -6.0, 3.2)
    scene.camera.rotation_euler = (Vector((0.0, 0.0, 0.8)) - scene.camera.location).to_track_quat("-Z", "Y").to_euler()
    new_world(scene).inputs["Color"].default_value = (0.1, 0.1, 0.1, 1.0)
    add_object("plane", (0.0, 0.0, 0.0), 12.0, (0.5, 0.45, 0.4))
    add_object("cube", (-0.9, 0.0, 0.7), 1.3, (0.7, 0.15, 0.1))
    add_object("cube", (0.9, 0.8, 0.7), 1.3, (0.1, 0.3, 0.7))
    add_light("SUN", energy=2.0, angle=0.02).rotation_euler = (-0.8, 0.4, 0.0)
    return scene


def add_object(kind, location, size, color):
    getattr(bpy.ops.mesh, f"primitive_{kind}_add")(size=size, location=location)
    material = bpy.data.materials.new(kind)
    if bpy.app.version < (5, 0, 0):
        material.use_nodes = True
    shader = next(n for n in material.node_tree.nodes if n.bl_idname == "ShaderNodeBsdfPrincipled")
    shader.inputs["Base Color"].default_value = (*color, 1.0)
    shader.inputs["Roughness"].default_value = 1.0
    shader.inputs["Specular IOR Level"].default_value = 0.0
    bpy.context.object.data.materials.append(material)


def shift(scene):
    scene.camera.data.shift_x, scene.camera.data.shift_y = 0.2, -0.1


def exposure(scene):
    scene.view_settings.exposure = 1.0


def film_exposure(scene):
    scene.cycles.film_exposure = 2.0


def view_transform(scene):
    scene.view_settings.view_transform = "AgX"


def look(scene):
    view_transform(scene)
    scene.view_settings.look = "AgX - Punchy"


def filmic(scene):
    scene.view_settings.view_transform = "Filmic"


def look_of_filmic(scene):
    filmic(scene)
    scene.view_settings.look = "Very High Contrast"


def look_of_standard(scene):
    scene.view_settings.view_transform = "Standard"
    scene.view_settings.look = "High Contrast"


def gamma(scene):
    scene.view_settings.gamma = 1.6


def depth_of_field(scene):
    dof = scene.camera.data.dof
    dof.use_dof = True
    dof.aperture_fstop, dof.focus_distance, dof.aperture_blades = 0.04, 4.0, 5


def light_radius(scene):
    bpy.data.lights["Sun"].angle = 1.0


def point_radius(scene):
    light = point(scene)
    light.shadow_soft_size = 1.0


def point(scene):
    light = bpy.data.lights.new("Lamp", "POINT")
    light.energy, light.shadow_soft_size = 600.0, 0.0
    lamp = bpy.data.objects.new("Lamp", light)
    lamp.location = (0.5, 3.5, 4.0)
    bpy.data.objects.remove(bpy.data.objects["Sun"])
    scene.collection.objects.link(lamp)
    return light


def spot(scene, blend):
    light = point(scene)
    light.type = "SPOT"
    light = bpy.data.lights["Lamp"]
    light.spot_size, light.spot_blend = 0.7, blend
    lamp = bpy.data.objects["Lamp"]
    lamp.rotation_euler = (Vector((0.0, 0.0, 0.7)) - lamp.location).to_track_quat("-Z", "Y").to_euler()


def percentage(scene):
    scene.render.resolution_percentage = 150


def pixel_aspect(scene):
    scene.render.pixel_aspect_x = 1.5


def region(scene):
    render = scene.render
    render.use_border = render.use_crop_to_border = True
    render.border_min_x, render.border_max_x, render.border_min_y, render.border_max_y = 0.25, 0.75, 0.25, 1.0


def sky(scene, strength=1.0, turn=0.0):
    """Half of the sky is blue and bright, half orange and dark."""
    image = bpy.data.images.new("Sky", 64, 32, float_buffer=True)
    texels = np.ones((32, 64, 4), np.float32)
    texels[:, :32, :3] = (0.1, 0.3, 1.0)
    texels[:, 32:, :3] = (0.3, 0.1, 0.02)
    image.pixels.foreach_set(texels.ravel())
    image.pack()
    background = new_world(scene)
    nodes, links = scene.world.node_tree.nodes, scene.world.node_tree.links
    texture, mapping = nodes.new("ShaderNodeTexEnvironment"), nodes.new("ShaderNodeMapping")
    texture.image = image
    links.new(nodes.new("ShaderNodeTexCoord").outputs["Generated"], mapping.inputs["Vector"])
    links.new(mapping.outputs["Vector"], texture.inputs["Vector"])
    links.new(texture.outputs["Color"], background.inputs["Color"])
    mapping.inputs["Rotation"].default_value = (0.0, 0.0, turn)
    background.inputs["Strength"].default_value = strength


def transparent(scene):
    scene.render.film_transparent = True
    bpy.data.objects.remove(bpy.data.objects["Plane"])


# Each property, and the same scene without it.
CASES = {
    "lens shift": (shift, None),
    "exposure": (exposure, None),
    "film exposure": (film_exposure, None),
    "view transform": (view_transform, None),
    "look": (look, view_transform),
    "look of Filmic": (look_of_filmic, filmic),
    "look of Standard": (look_of_standard, None),
    "gamma": (gamma, None),
    "depth of field": (depth_of_field, None),
    "angle of a sun": (light_radius, None),
    "radius of a point light": (point_radius, point),
    "blend of a spot": (lambda scene: spot(scene, 1.0), lambda scene: spot(scene, 0.0)),
    "world": (sky, None),
    "rotation of the world": (lambda scene: sky(scene, turn=math.pi / 2.0), sky),
    "strength of the world": (lambda scene: sky(scene, strength=0.4), sky),
    "transparent film": (transparent, lambda scene: bpy.data.objects.remove(bpy.data.objects["Plane"])),
    "pixel aspect": (pixel_aspect, None),
    "percentage": (percentage, None),
    "render region": (region, None),
}


@pytest.mark.parametrize("name", CASES)
def test_pictures_of_files_are_those_of_cycles(stage, cycles, exported, name):
    change, reference = CASES[name]
    path = bpy.app.tempdir + "stage.blend"
    bpy.ops.wm.save_as_mainfile(filepath=path, copy=True)
    if reference is not None:
        reference(stage)
    without = exported()
    bpy.ops.wm.open_mainfile(filepath=path)
    change(bpy.context.scene)
    expected, picture = cycles(), exported()
    assert picture.shape == expected.shape
    error = np.abs(picture - expected).mean()
    assert error < CLOSE
    if without.shape == expected.shape:
        assert np.abs(without - expected).mean() > 2.0 * error


def test_other_views_are_a_warning(stage, export, tmp_path):
    stage.view_settings.view_transform = "False Color"
    export()
    with pytest.warns(blinn.SceneWarning, match="view transform 'False Color'"):
        blinn.load(tmp_path / "scene.glb").render(samples=1)
