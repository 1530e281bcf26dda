use glam::Vec3;
use rayon::iter::ParallelIterator;

use super::*;
use crate::build::morton_clusters::MortonClusters;
use crate::bvh::surface_flags::SurfaceFlags;

/// Returns triangles for a build and their keys.
fn build_triangles(
    triangles: &[[Vec3; 3]],
) -> (BuildTriangles<impl Fn(usize) -> InputTriangle + Sync>, Vec<MortonKey>) {
    let flags = SurfaceFlags::default();
    let (all, keys, _) =
        BuildTriangles::new(triangles.len(), move |i| InputTriangle { vertices: triangles[i], flags });
    (all, keys)
}

/// Makes one cluster of all triangles.
fn single_cluster<I: Fn(usize) -> InputTriangle + Sync>(
    all: &BuildTriangles<I>,
    keys: Vec<MortonKey>,
) -> ClusterTriangles {
    let clusters = MortonClusters::new(keys, |i| all.bounds(i as u32).into(), usize::MAX);
    let mut made: Vec<ClusterTriangles> =
        clusters.par_iter().map(|keys| ClusterTriangles::new(all, keys)).collect();
    assert_eq!(made.len(), 1);
    made.remove(0)
}

/// A hilly height field of `quads` × `quads` quads, each of two triangles.
fn hills(quads: u32) -> Vec<[Vec3; 3]> {
    let height = |x: u32, y: u32| (x as f32 * 0.7).sin() + (y as f32 * 0.4).cos();
    let at = |x: u32, y: u32| Vec3::new(x as f32, y as f32, height(x, y));
    let quad = |i: u32| {
        let x = i % quads;
        let y = i / quads;
        let [a, b, c, d] = [at(x, y), at(x + 1, y), at(x + 1, y + 1), at(x, y + 1)];
        [[a, b, c], [a, c, d]]
    };
    (0..quads * quads).flat_map(quad).collect()
}

#[test]
fn halves_of_quads_share_a_box_and_each_triangle_is_in_one_box() {
    let hills = hills(40);
    let (all, keys) = build_triangles(&hills);
    let count = keys.len();
    let cluster = single_cluster(&all, keys);
    let own_box = |&i: &u32| ObvhsAabb::from(all.bounds(i));
    let mut found = Vec::new();
    for (bounds, box_contents) in cluster.boxes.iter().zip(&cluster.box_contents) {
        match box_contents {
            BoxContents::One(i) => {
                assert_eq!(*bounds, own_box(i));
                found.push(*i);
            }
            BoxContents::Two(triangles) => {
                let [a, b] = triangles.each_ref().map(own_box);
                assert_eq!(*bounds, a.union(&b));
                assert!(bounds.half_area() < a.half_area() + b.half_area());
                found.extend(triangles);
            }
            BoxContents::Many(i) => {
                found.extend(cluster.equal_boxes[*i as usize].iter().map(|triangle| triangle.index));
            }
        }
    }
    found.sort_unstable();
    assert!(found.into_iter().eq(0..count as u32));
    assert!(cluster.boxes.len() < count * 6 / 10, "{} of {}", cluster.boxes.len(), count);
    let total: f64 = (0..count as u32).map(|i| occluding_area(&all.get(i))).sum();
    assert!((cluster.areas.iter().sum::<f64>() / total - 1.0).abs() < 1e-12);
}

#[test]
fn distant_triangles_keep_their_own_boxes() {
    let apart = |i: u32| [Vec3::ZERO, Vec3::X, Vec3::Y].map(|p| p + 3.0 * i as f32 * Vec3::X);
    let triangles: Vec<_> = (0..50).map(apart).collect();
    let (all, keys) = build_triangles(&triangles);
    assert_eq!(single_cluster(&all, keys).boxes.len(), 50);
    // Areas that overflow promise no gain.
    let huge = |i: u32| [Vec3::ZERO, Vec3::X, Vec3::Y].map(|p| (p - 0.5) * 1e18 + i as f32 * 1e14);
    let triangles: Vec<_> = (0..50).map(huge).collect();
    let (all, keys) = build_triangles(&triangles);
    let cluster = single_cluster(&all, keys);
    let entries = (0..cluster.boxes.len() as u32).map(|i| cluster.entry_count(i));
    assert_eq!(entries.sum::<u32>(), 50);
}
