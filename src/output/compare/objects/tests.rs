use glam::{DAffine3, DVec3, Vec3, Vec4};

use super::*;
use blinn_core::geometry::Rgb;
use blinn_scene::{ColorInput, Instance, LocalTransform, Material, Mesh, Node, PoseSettings, Scene, pose};

/// Objects of one triangle each, at these places.
fn scene(objects: &[(&str, f64)]) -> Scene {
    let mut scene = Scene { materials: vec![Material::default()], ..Scene::default() };
    for (i, (name, x)) in objects.iter().enumerate() {
        let i = i as u32;
        let local = LocalTransform::Matrix(DAffine3::from_translation(DVec3::new(*x, 0.0, 0.0)));
        scene.nodes.push(Node { local, visible: true, ..Node::default() });
        let positions = vec![Vec3::ZERO, Vec3::X, Vec3::Y];
        scene.meshes.push(Mesh { positions, triangles: vec![[0, 1, 2]], ..Mesh::default() });
        scene.instances.push(Instance { node: i, mesh: i, object: i + 1, ..Instance::default() });
        scene.objects.push(name.to_string());
    }
    scene
}

fn compare(old: &Scene, new: &Scene) -> Vec<ObjectDifference> {
    let settings = PoseSettings { centre: Some(DVec3::ZERO), ..PoseSettings::default() };
    compare_objects(&pose(old, &settings).unwrap(), &pose(new, &settings).unwrap(), None).differences
}

#[test]
fn reordered_objects_are_equal() {
    let old = scene(&[("a", 0.0), ("b", 1.0), ("b", 2.0)]);
    assert!(compare(&old, &scene(&[("b", 1.0), ("b", 2.0), ("a", 0.0)])).is_empty());
}

#[test]
fn reversed_triangles_are_told_from_moved_ones() {
    let old = scene(&[("a", 0.0), ("b", 5.0)]);
    let mut new = old.clone();
    new.meshes[1].triangles[0] = [2, 1, 0];
    let found = compare(&old, &new);
    let [ObjectDifference { name, change, bounds, .. }] = &found[..] else { panic!("{found:?}") };
    assert_eq!(*change, ObjectChange::Reversed { triangles: 1, attributes: false, material: false });
    assert_eq!((name.as_str(), bounds.min.x, bounds.max.x), ("b", 5.0, 6.0));
    // One that also moved is another triangle.
    new.meshes[1].positions[2].z = 0.5;
    let found = compare(&old, &new);
    assert!(found.len() == 1 && !matches!(found[0].change, ObjectChange::Reversed { .. }), "{found:?}");
}

#[test]
fn one_moved_corner_is_found_with_its_distance_and_bounds() {
    let old = scene(&[("a", 0.0), ("b", 5.0)]);
    let mut new = old.clone();
    new.meshes[1].positions[2].z = 0.001;
    let found = compare(&old, &new);
    let [ObjectDifference { name, change, bounds, .. }] = &found[..] else { panic!("{found:?}") };
    let ObjectChange::Changed { moved: 1, max_distance, attributes: false, material: false } = change else {
        panic!("{change:?}")
    };
    assert_eq!(name, "b");
    assert!((max_distance - 0.001).abs() < 1e-9);
    assert_eq!((bounds.min.x, bounds.max.x, bounds.max.z), (5.0, 6.0, f64::from(0.001f32)));
}

#[test]
fn added_removed_rebuilt_and_repainted_objects_are_told_apart() {
    let old = scene(&[("a", 0.0), ("b", 1.0), ("c", 2.0)]);
    let mut new = scene(&[("a", 0.0), ("c", 2.0), ("d", 3.0)]);
    new.meshes[1].triangles.push([2, 1, 0]);
    new.materials[0].base_color = ColorInput::new(Rgb::splat(0.5));
    let found = compare(&old, &new);
    let changes: Vec<_> = found.iter().map(|d| (d.name.as_str(), &d.change)).collect();
    let rebuilt = ObjectChange::Rebuilt {
        counts: [1, 2],
        differing: [0, 1],
        surface_distance: 0.0,
        attributes: false,
        material: true,
    };
    let material = ObjectChange::Changed { moved: 0, max_distance: 0.0, attributes: false, material: true };
    assert_eq!(
        changes,
        [
            ("a", &material),
            ("b", &ObjectChange::Removed { count: 1 }),
            ("c", &rebuilt),
            ("d", &ObjectChange::Added { count: 1 }),
        ]
    );
}

/// A grid of cells with a height at each of its 9 points, of 8 triangles in this order.
fn grid(heights: [f32; 9], order: [usize; 8]) -> Scene {
    let mut scene = scene(&[("grid", 0.0)]);
    let mesh = &mut scene.meshes[0];
    let place = |i: usize| Vec3::new((i % 3) as f32, (i / 3) as f32, heights[i]);
    mesh.positions = (0..9).map(place).collect();
    mesh.colors = (0..9u8).map(|i| Vec4::splat(f32::from(i) / 9.0)).collect();
    let cells = [0u32, 1, 3, 4].map(|a| [[a, a + 1, a + 4], [a, a + 4, a + 3]]);
    mesh.triangles = order.map(|i| cells[i / 2][i % 2]).to_vec();
    scene
}

const ORDER: [usize; 8] = [0, 1, 2, 3, 4, 5, 6, 7];
const SHUFFLED: [usize; 8] = [5, 2, 7, 0, 1, 6, 3, 4];

#[test]
fn the_order_of_triangles_and_of_their_corners_does_not_count() {
    let old = grid([0.0; 9], ORDER);
    let mut new = grid([0.0; 9], SHUFFLED);
    new.meshes[0].triangles.iter_mut().for_each(|corners| corners.rotate_left(1));
    assert!(compare(&old, &new).is_empty());
    // Differences besides the order are still found.
    new.meshes[0].colors[4] = Vec4::ONE;
    let found = compare(&old, &new);
    let expected = ObjectChange::Changed { moved: 0, max_distance: 0.0, attributes: true, material: false };
    assert_eq!(found.iter().map(|d| &d.change).collect::<Vec<_>>(), [&expected]);
}

#[test]
fn parts_in_another_order_are_equal() {
    let mut old = scene(&[("a", 0.0), ("a", 1.0)]);
    old.instances.iter_mut().for_each(|instance| instance.object = 1);
    let mut new = old.clone();
    new.instances.reverse();
    assert!(compare(&old, &new).is_empty());
}

#[test]
fn in_another_order_the_distance_is_that_of_the_surfaces() {
    let mut heights = [0.0; 9];
    heights[0] = 0.25;
    let found = compare(&grid([0.0; 9], ORDER), &grid(heights, SHUFFLED));
    let [ObjectDifference { change, bounds, .. }] = &found[..] else { panic!("{found:?}") };
    let expected = ObjectChange::Rebuilt {
        counts: [8, 8],
        differing: [2, 2],
        surface_distance: 0.25,
        attributes: false,
        material: false,
    };
    assert_eq!(change, &expected);
    // The sides away from the corner are still in place.
    assert!(
        bounds.min == DVec3::ZERO && (bounds.max - DVec3::new(1.0, 1.0, 0.25)).length() < 1e-3,
        "{bounds:?}"
    );
}

/// Every corner moves by less than `by`, as quantisation does.
fn rounded(mut scene: Scene, by: f32) -> Scene {
    scene.meshes[0].positions.iter_mut().for_each(|p| *p += by * Vec3::new(0.5, 0.25, 1.0));
    scene
}

#[test]
fn triangles_that_moved_and_are_in_another_order_are_not_matched_by_their_place() {
    let heights = [0.0, 0.1, 0.0, 0.3, 0.0, 0.2, 0.0, 0.0, 0.1];
    let old = grid(heights, ORDER);
    let by = 1.0 / 1024.0;
    let found = compare(&old, &rounded(grid(heights, SHUFFLED), by));
    let ObjectChange::Rebuilt { differing: [8, 8], surface_distance, .. } = found[0].change else {
        panic!("{found:?}")
    };
    assert!(surface_distance > 0.0 && surface_distance < 1.2 * f64::from(by), "{surface_distance}");
    // In the same order, corners are matched.
    let found = compare(&old, &rounded(grid(heights, ORDER), by));
    let ObjectChange::Changed { moved: 8, max_distance, .. } = found[0].change else { panic!("{found:?}") };
    assert!((max_distance / f64::from(by) - 1.3125f64.sqrt()).abs() < 1e-3, "{max_distance}");
}

#[test]
fn triangles_without_shared_corners_are_matched_by_their_surfaces() {
    let apart = |order: [usize; 8], by: f32| {
        let mut scene = grid([0.0; 9], order);
        let mesh = &mut scene.meshes[0];
        let corners = mesh.triangles.concat();
        mesh.positions = corners.iter().map(|&i| mesh.positions[i as usize] * 0.5).collect();
        mesh.positions.chunks_mut(3).enumerate().for_each(|(i, corners)| {
            let place = 4.0 * order[i] as f32 + by;
            corners.iter_mut().for_each(|corner| corner.x += place);
        });
        mesh.colors = Vec::new();
        mesh.triangles = (0..8u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
        scene
    };
    let found = compare(&apart(ORDER, 0.0), &apart(SHUFFLED, 0.125));
    let ObjectChange::Rebuilt { differing: [8, 8], surface_distance, .. } = found[0].change else {
        panic!("{found:?}")
    };
    assert!((surface_distance - 0.125).abs() < 1e-6, "{surface_distance}");
}

/// A plate with a square hole at a place, whose top is made of eight triangles.
fn plate(hole: f32) -> Scene {
    let mut scene = scene(&[("plate", 0.0)]);
    let mesh = &mut scene.meshes[0];
    let outer = [(0.0, 0.0), (100.0, 0.0), (100.0, 100.0), (0.0, 100.0)];
    let inner = [(hole, hole), (hole + 2.0, hole), (hole + 2.0, hole + 2.0), (hole, hole + 2.0)];
    mesh.positions = outer.into_iter().chain(inner).map(|(x, y)| Vec3::new(x, y, 0.0)).collect();
    let side = |i: u32| [[i, (i + 1) % 4, 4 + (i + 1) % 4], [i, 4 + (i + 1) % 4, 4 + i]];
    mesh.triangles = (0..4).flat_map(side).collect();
    scene
}

#[test]
fn bounds_are_those_of_the_places_where_surfaces_are_apart() {
    let mut new = plate(61.0);
    new.meshes[0].triangles.rotate_left(3);
    let found = compare(&plate(60.0), &new);
    let [ObjectDifference { change: ObjectChange::Rebuilt { differing: [8, 8], .. }, bounds, .. }] =
        &found[..]
    else {
        panic!("{found:?}")
    };
    let expected = Aabb { min: DVec3::new(60.0, 60.0, 0.0), max: DVec3::new(63.0, 63.0, 0.0) };
    assert!(
        (bounds.min - expected.min).length() < 0.1 && (bounds.max - expected.max).length() < 0.1,
        "{bounds:?}"
    );
}

#[test]
fn distances_below_the_precision_or_the_tolerance_are_accepted() {
    let settings = PoseSettings { centre: Some(DVec3::ZERO), ..PoseSettings::default() };
    let compare = |old: &Scene, new: &Scene, tolerance| {
        compare_objects(&pose(old, &settings).unwrap(), &pose(new, &settings).unwrap(), tolerance)
    };
    let old = scene(&[("a", 1000.0)]);
    let mut dust = old.clone();
    dust.meshes[0].positions[2].z = 1e-5;
    let found = compare(&old, &dust, None);
    let accepted = Some(f64::from(1e-5f32));
    assert_eq!(found, ObjectComparison { differences: Vec::new(), accepted_distance: accepted });
    let mut moved = old.clone();
    moved.meshes[0].positions[2].z = 0.5;
    assert_eq!(compare(&old, &moved, Some(0.4)).differences.len(), 1);
    assert_eq!(compare(&old, &moved, Some(0.5)).accepted_distance, Some(0.5));
    // A corner that moved far on its own surface is within the tolerance.
    let [flat, mut slid] = [grid([0.0; 9], ORDER), grid([0.0; 9], ORDER)];
    slid.meshes[0].positions[4].x += 0.25;
    assert_eq!(compare(&flat, &slid, None).differences.len(), 1);
    assert!(compare(&flat, &slid, Some(0.001)).differences.is_empty());
    // Other triangles on the same surface differ unless there is a tolerance.
    let [flat, shuffled] = [flat, rounded(grid([0.0; 9], SHUFFLED), 0.01)];
    assert_eq!(compare(&flat, &shuffled, Some(0.001)).differences.len(), 1);
    let found = compare(&flat, &shuffled, Some(0.02));
    assert!(found.differences.is_empty() && found.accepted_distance.is_some_and(|distance| distance > 0.009));
}

#[test]
fn renamed_objects_are_matched_by_their_triangles() {
    let old = scene(&[("a", 0.0), ("b", 5.0), ("c", 10.0)]);
    let found = compare(&old, &scene(&[("c", 10.0), ("b2", 5.0), ("d", 0.125)]));
    let renamed: Vec<_> = found.iter().map(|d| (d.name.as_str(), d.renamed.as_deref(), &d.change)).collect();
    let changed = |moved, max_distance| ObjectChange::Changed {
        moved,
        max_distance,
        attributes: false,
        material: false,
    };
    assert_eq!(renamed, [("a", Some("d"), &changed(1, 0.125)), ("b", Some("b2"), &changed(0, 0.0))]);
    // A file of one object may call it anything.
    let found = compare(&scene(&[("default", 0.0)]), &scene(&[("Flange", 20.0)]));
    assert_eq!((found.len(), found[0].renamed.as_deref()), (1, Some("Flange")));
}
