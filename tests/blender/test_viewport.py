"""The preview in viewports, without a window: cameras of viewports, and the thread that renders."""

from __future__ import annotations

import tempfile
import time

import pytest

bpy = pytest.importorskip("bpy")
np = pytest.importorskip("numpy")
blinn = pytest.importorskip("blinn")

SIZE = (40, 30)


@pytest.fixture()
def cube(small_picture, add_light):
    """A cube before a camera that looks down on it from the side."""
    scene = small_picture
    scene.camera.location, scene.camera.rotation_euler = (3.0, -5.0, 4.0), (0.9, 0.1, 0.5)
    bpy.ops.mesh.primitive_cube_add()
    add_light("SUN", energy=3.0).rotation_euler = (0.5, 0.2, 0.0)
    bpy.context.view_layer.update()
    return scene


def matrices(scene):
    """View and projection of the scene's camera, which a viewport has when it looks through it."""
    depsgraph = bpy.context.evaluated_depsgraph_get()
    projection = scene.camera.calc_matrix_camera(depsgraph, x=SIZE[0], y=SIZE[1])
    return scene.camera.matrix_world.inverted(), projection


@pytest.mark.parametrize("kind", ["PERSP", "ORTHO"])
def test_views_through_a_camera_equal_those_of_the_file(cube, export, tmp_path, kind):
    import blinn_extension.viewport_camera as viewport_camera

    data = cube.camera.data
    data.type, data.ortho_scale, data.shift_x, data.shift_y = kind, 5.0, 0.1, -0.05
    bpy.context.view_layer.update()
    export(export_apply=True)
    scene = blinn.load(tmp_path / "scene.glb")
    expected = scene.render(samples=4).linear
    picture = scene.render(viewport_camera.camera(blinn, *matrices(cube), SIZE), size=SIZE, samples=4).linear
    assert picture.shape == expected.shape and 0.05 < expected[..., 3].mean() < 0.95
    assert np.abs(picture - expected).mean() < 2e-3


@pytest.fixture()
def renderer():
    from blinn_extension.viewport_render import Renderer

    renderer = Renderer(blinn)
    yield renderer
    renderer.close()
    renderer.thread.join(60.0)
    assert not renderer.thread.is_alive()


def export_of(scene):
    from pathlib import Path

    from blinn_extension import engine_export, engine_settings
    from blinn_extension.viewport_render import Export

    folder = tempfile.TemporaryDirectory()
    engine_export.save_copy(scene, Path(folder.name))
    choice = engine_export.choice_of(bpy.context.evaluated_depsgraph_get())
    return Export(folder, choice, engine_settings.load_options(scene), engine_settings.render_options(scene))


def view_of(scene, size=SIZE):
    import blinn_extension.viewport_camera as viewport_camera
    from blinn_extension.viewport_render import View

    view, projection = matrices(scene)
    key = (size, *(value for matrix in (view, projection) for row in matrix for value in row))
    return View(lambda size: viewport_camera.camera(blinn, view, projection, size), key, size)


def wait_for(renderer, is_finished):
    deadline = time.monotonic() + 120.0
    while not is_finished():
        assert time.monotonic() < deadline and renderer.thread.is_alive(), renderer.status
        time.sleep(0.01)


def test_a_thread_refines_and_follows_view_and_scene(cube, renderer, monkeypatch):
    from blinn_extension import engine_export

    exports = []
    convert = engine_export.convert
    monkeypatch.setattr(engine_export, "convert", lambda *words: exports.append(words) or convert(*words))
    renderer.show(view_of(cube))
    renderer.replace_scene(export_of(cube))
    wait_for(renderer, lambda: renderer.count >= 4)
    first = renderer.picture
    assert first.shape == (SIZE[1], SIZE[0], 4) and renderer.status == ""
    # Another view: from the same export.
    cube.camera.location.x += 1.0
    bpy.context.view_layer.update()
    renderer.show(view_of(cube))
    wait_for(renderer, lambda: renderer.count >= 8)
    second = renderer.picture
    assert len(exports) == 1 and np.abs(first - second).mean() > 0.01
    # Another scene: the view stays.
    bpy.data.objects.remove(bpy.data.objects["Cube"])
    renderer.replace_scene(export_of(cube))
    wait_for(renderer, lambda: renderer.count >= 12)
    assert len(exports) == 2 and not renderer.picture[..., 3].any()


def test_errors_are_shown_and_the_thread_lives_on(cube, renderer):
    bad = export_of(cube)
    bad.choice[0] = "--scene=Missing"
    renderer.show(view_of(cube))
    renderer.replace_scene(bad)
    wait_for(renderer, lambda: "no scene 'Missing'" in renderer.status)
    renderer.replace_scene(export_of(cube))
    wait_for(renderer, lambda: renderer.count >= 4)


def test_only_changes_that_pictures_show_are_exported(cube):
    from blinn_extension.engine_viewport import is_changed

    depsgraph = bpy.context.evaluated_depsgraph_get()
    seen = []
    handler = lambda scene, graph: seen.append(is_changed(graph))  # noqa: E731
    bpy.app.handlers.depsgraph_update_post.append(handler)
    try:
        cube.camera.location.x += 1.0
        depsgraph.update()
        bpy.data.objects["Cube"].location.x += 1.0
        depsgraph.update()
    finally:
        bpy.app.handlers.depsgraph_update_post.remove(handler)
    assert seen == [False, True]


def test_settings_that_pictures_depend_on_are_noticed(cube):
    from blinn_extension.engine_viewport import settings_of

    def settings():
        depsgraph = bpy.context.evaluated_depsgraph_get()
        depsgraph.update()
        return settings_of(depsgraph)

    seen = [settings(), settings()]
    assert seen[0] == seen[1]
    cube.render.film_transparent = False
    seen.append(settings())
    cube.blinn.samples = 7
    seen.append(settings())
    cube.frame_set(3)
    seen.append(settings())
    assert all(a != b for a, b in zip(seen[1:], seen[2:]))
