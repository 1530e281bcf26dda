"""Rays and shadow segments of arrays."""

from pathlib import Path

import numpy as np
import pytest

import blinn


def test_known_hits(quad: blinn.Scene) -> None:
    origins = [[0.5, 0.25, 3], [0.5, 0.25, -3], [2, 0, 3]]
    directions = [[0, 0, -1], [0, 0, 2], [0, 0, -1]]
    hits = quad.intersect(origins, directions)
    np.testing.assert_allclose(hits.t, [3, 1.5, np.inf])
    np.testing.assert_array_equal(hits.object, [1, 1, 0])
    np.testing.assert_array_equal(hits.triangle, [0, 0, -1])
    corners = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0]])
    np.testing.assert_allclose(hits.barycentrics[0] @ corners, [0.5, 0.25, 0], atol=1e-6)


def test_occlusion(quad: blinn.Scene) -> None:
    blocked = quad.occluded([[0, 0, 1], [2, 0, 1], [0, 0, 1]], [[0, 0, -1], [2, 0, -1], [0, 0, 0.5]])
    np.testing.assert_array_equal(blocked, [True, False, False])


def test_hits_do_not_depend_on_the_batch(lecture: blinn.Scene) -> None:
    rng = np.random.default_rng(1)
    origins = rng.normal(size=(20_000, 3)) * 5
    directions = rng.normal(size=(20_000, 3))
    whole = lecture.intersect(origins, directions)
    part = lecture.intersect(origins[777:800], directions[777:800])
    np.testing.assert_array_equal(whole.t[777:800], part.t)
    np.testing.assert_array_equal(whole.triangle[777:800], part.triangle)
    assert np.isfinite(whole.t).any() and (whole.object[np.isinf(whole.t)] == 0).all()


def test_shapes_are_checked(quad: blinn.Scene) -> None:
    with pytest.raises(ValueError, match="shape"):
        quad.intersect(np.zeros((3, 3)), np.zeros((2, 3)))
    with pytest.raises((ValueError, TypeError)):
        quad.intersect(np.zeros(3), np.zeros(3))
    assert len(quad.intersect(np.zeros((0, 3)), np.zeros((0, 3))).t) == 0


def test_points_on_a_surface_are_not_occluded_by_it_from_outside(quad: blinn.Scene) -> None:
    outside = [[0.1, 0.2, 1], [0.1, 0.2, 1]]
    np.testing.assert_array_equal(quad.occluded(outside, [[0.1, 0.2, 1e-5], [0.1, 0.2, -1e-5]]), [False, True])


def test_rays_use_the_pose(models: Path) -> None:
    scene = blinn.load(models / "figure/figure.glb")
    centre = scene.bounds.mean(axis=0)
    rng = np.random.default_rng(2)
    origins = centre + rng.normal(size=(2_000, 3)) * 3
    now, later = (scene.pose(time=time).intersect(origins, centre - origins) for time in (0, 0.4))
    assert not np.array_equal(now.t, later.t)


def test_hits_equal_embree() -> None:
    """Equal triangles, except where two are equally far."""
    trimesh = pytest.importorskip("trimesh")
    embree = pytest.importorskip("embreex.rtcore_scene")
    mesh = trimesh.creation.icosphere(subdivisions=5)
    mesh.vertices += np.random.default_rng(0).normal(size=mesh.vertices.shape) * 0.002
    vertices = mesh.vertices.astype(np.float32)
    faces = np.asarray(mesh.faces, np.int32)
    scene = blinn.Scene.from_arrays(vertices, faces)
    rng = np.random.default_rng(1)
    origins = (rng.normal(size=(100_000, 3)) * 2).astype(np.float32)
    directions = rng.normal(size=(100_000, 3)).astype(np.float32)
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    hits = scene.intersect(origins, directions)
    peer = embree.EmbreeScene()
    pytest.importorskip("embreex.mesh_construction").TriangleMesh(peer, vertices, faces)
    expected = peer.run(origins, directions, query="INTERSECT", output=True)
    different = hits.triangle != expected["primID"]
    assert different.mean() < 1e-4 and (hits.triangle >= 0).mean() > 0.05
    both = (hits.triangle >= 0) & (expected["primID"] >= 0)
    np.testing.assert_allclose(hits.t[both], expected["tfar"][both], rtol=1e-4, atol=1e-4)


def test_faulty_rays_miss(quad: blinn.Scene) -> None:
    origins = np.array([[0, 0, 1], [np.nan, 0, 1], [0, 0, 1], [0, 0, 1e300], [0, 0, 1]])
    directions = np.array([[0, 0, -1], [0, 0, -1], [0, 0, 0], [0, 0, -1], [0, np.inf, -1]])
    np.testing.assert_array_equal(quad.intersect(origins, directions).t, [1, np.inf, np.inf, np.inf, np.inf])
    assert quad.occluded(origins, origins + directions * 2).tolist() == [True, False, False, False, False]


def test_rays_at_the_border_of_the_scene_hit(quad: blinn.Scene) -> None:
    """Rays that only touch the bounds: along their faces, through their corners, from far away."""
    border = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1], [1, 0.3], [-1, 0.3], [0.3, 1], [0.3, -1]]) * (1 - 2**-22)
    for distance in (1e-3, 1, 1e3, 1e6):
        origins = np.c_[border, np.full(len(border), distance)]
        down = np.broadcast_to([0, 0, -1], origins.shape)
        np.testing.assert_allclose(quad.intersect(origins, down).t, distance, rtol=1e-6)
        assert quad.occluded(origins, origins + down * 2 * distance).all()
    flat = [[-3, 0.2, 1e-6], [0.1, 0.2, 5]]
    assert np.isinf(quad.intersect(flat, [[1, 0, 0], [0, 0, 1]]).t).all()


def test_every_ray_towards_a_closed_surface_hits() -> None:
    trimesh = pytest.importorskip("trimesh")
    box = trimesh.creation.box(extents=(1, 2, 3))
    scene = blinn.Scene.from_arrays(box.vertices + 7, box.faces)
    rng = np.random.default_rng(5)
    origins = rng.normal(size=(50_000, 3)) * 10.0 ** rng.integers(-1, 5, (50_000, 1)) + 7
    inside = 7 + (rng.random((50_000, 3)) - 0.5) * [0.99, 1.99, 2.99]
    assert np.isfinite(scene.intersect(origins, inside - origins).t).all()


def sphere(radius: float = 1.0) -> tuple[np.ndarray, np.ndarray]:
    """A ball of 80 × 40 quads as triangles, without trimesh."""
    down, around = np.meshgrid(np.linspace(0, np.pi, 41), np.linspace(0, 2 * np.pi, 81), indexing="ij")
    vertices = np.stack([np.sin(down) * np.cos(around), np.cos(down), np.sin(down) * np.sin(around)], -1)
    i, j = np.meshgrid(np.arange(40), np.arange(80), indexing="ij")
    a = (i * 81 + j).ravel()
    faces = np.concatenate([np.c_[a, a + 1, a + 82], np.c_[a, a + 82, a + 81]])
    return radius * vertices.reshape(-1, 3), faces


@pytest.mark.parametrize("offset", [(0, 0, 0), (500000.25, 4500000.37, 300.1)])
@pytest.mark.parametrize("radius", [1e-3, 1.0, 1e4])
def test_surface_points_are_not_occluded_by_their_surface(radius: float, offset: tuple[float, ...]) -> None:
    centre = np.array(offset)
    vertices, faces = sphere(radius)
    scene = blinn.Scene.from_arrays(vertices + centre, faces)
    directions = np.random.default_rng(0).normal(size=(5_000, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    hits = scene.intersect(centre + directions * radius * 3, -directions)
    far = centre + directions * radius * 50
    assert not scene.occluded(hits.points, far).any()
    assert not scene.occluded(hits.points, far, from_hits=hits).any()
    # Through the ball, even if the triangle of the hit does not count.
    assert scene.occluded(hits.points, 2 * centre - far, from_hits=hits).all()
    computed = centre + directions * radius * 3 - hits.t[:, None].astype(float) * directions
    assert scene.occluded(computed, far).mean() < 0.001
    # Points inside of the ball are still closed in.
    assert scene.occluded(centre + directions * radius * 0.99, far).all()


def test_points_of_hits_lie_before_their_triangles(quad: blinn.Scene) -> None:
    hits = quad.intersect([[0.5, 0.25, 3], [0.5, 0.25, -3], [2, 0, 3]], [[0, 0, -1], [0, 0, 2], [0, 0, -1]])
    np.testing.assert_allclose(hits.points[:2], [[0.5, 0.25, 0]] * 2, atol=1e-5)
    # Coordinates of 0 have no error.
    assert 0 <= hits.points[0, 2] < 1e-5 and -1e-5 < hits.points[1, 2] <= 0
    assert np.isnan(hits.points[2]).all()
    with pytest.raises(ValueError, match="from_hits"):
        quad.occluded([[0, 0, 1]], [[0, 0, 2]], from_hits=hits)


def test_back_faces_are_culled_whatever_the_material(quad: blinn.Scene) -> None:
    origins, directions = [[0.3, 0.2, -2], [0.3, 0.2, 2]], [[0, 0, 1], [0, 0, -1]]
    single = blinn.Scene.from_arrays(
        [[-1, -1, 0], [1, -1, 0], [1, 1, 0]], [[0, 1, 2]], material={"double_sided": False}
    )
    for scene in (quad, single):
        np.testing.assert_array_equal(scene.intersect(origins, directions, cull_back_faces=True).t, [np.inf, 2])
        np.testing.assert_array_equal(scene.intersect(origins, directions).t, [2, 2])


def test_points_and_lines_are_hit() -> None:
    obj = "".join(f"v {x} {y} 0\n" for y in range(3) for x in range(3)) + "p 1 2 3 4 5 6 7 8 9\nv 0 0 -2\nv 2 0 -2\nl 10 11\n"
    scene = blinn.load(obj.encode(), name="cloud.obj")
    origins = [[0.1, 0, 3], [1.0, 1, 3], [5, 5, 3], [0.45, 0.02, 3]]
    directions = [[0, 0, -1]] * 4
    hits = scene.intersect(origins, directions, point_size=0.5, line_width=0.2)
    kinds = [blinn.HitKind.POINT, blinn.HitKind.POINT, blinn.HitKind.MISS, blinn.HitKind.LINE]
    np.testing.assert_array_equal(hits.kind, kinds)
    np.testing.assert_array_equal(hits.triangle, [0, 4, -1, 0])
    np.testing.assert_allclose(hits.t[1], 2.75, rtol=1e-6)
    np.testing.assert_allclose(hits.points[0], [0.1, 0, (0.25**2 - 0.1**2) ** 0.5], atol=1e-5)
    np.testing.assert_allclose(hits.barycentrics[3], [0.775, 0.225, 0], atol=1e-5)
    # By default points close the gaps of their cloud: a ray between four hits. Lines have no width.
    kinds = scene.intersect([[0.5, 0.5, 3]], [[0, 0, -1]]).kind
    np.testing.assert_array_equal(kinds, [blinn.HitKind.POINT])
    off = scene.intersect(origins, directions, point_size="off")
    assert (off.kind == blinn.HitKind.MISS).all()
    with pytest.raises(ValueError, match="rays have no pixels"):
        scene.intersect(origins, directions, point_size="3px")


def test_points_occlude_with_a_size() -> None:
    scene = blinn.load(b"v 0 0 0\nv 1 0 0\np 1 2\n", name="dots.obj")
    ways = [[0.1, 0, 1]], [[0.1, 0, -1]]
    assert not scene.occluded(*ways).any()
    assert scene.occluded(*ways, point_size=0.5).all()
    hits = scene.intersect([[0, 0, 3]], [[0, 0, -1]], point_size=0.5)
    assert not scene.occluded(hits.points, [[0, 0, 9]], from_hits=hits, point_size=0.5).any()


def test_triangles_have_their_kind(quad: blinn.Scene) -> None:
    kinds = quad.intersect([[0.5, 0.25, 3], [2, 0, 3]], [[0, 0, -1], [0, 0, -1]]).kind
    np.testing.assert_array_equal(kinds, [blinn.HitKind.TRIANGLE, blinn.HitKind.MISS])


def test_points_of_mirrored_and_flattened_instances_are_not_occluded() -> None:
    """The octahedron is convex: nothing lies between its surface and a point straight outwards."""
    vertices = [[1, 0, 0], [0, 1, 0], [-1, 0, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]]
    faces = [face for i in range(4) for face in ([i, (i + 1) % 4, 4], [(i + 1) % 4, i, 5])]
    radii, centre = np.array([3e3, 1, 0.2]), np.array([1e3, -50, 7])
    matrix = np.diag([*(radii * [-1, 1, 1]), 1])
    matrix[:3, 3] = centre
    scene = blinn.Scene.from_arrays(vertices, faces, transforms=matrix)
    outwards = np.random.default_rng(3).normal(size=(2000, 3)) * radii
    hits = scene.intersect(centre + 9 * outwards, -outwards)
    assert np.isfinite(hits.points).all()
    far = hits.points + 9 * outwards
    assert not scene.occluded(hits.points, far).any()
    assert not scene.occluded(hits.points, far, from_hits=hits).any()
    assert scene.occluded(hits.points, hits.points - 9 * outwards, from_hits=hits).all()
