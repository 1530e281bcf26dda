use glam::Vec3;
use rayon::iter::ParallelIterator;

use super::*;
use crate::build::input_triangles::{InputTriangle, filter_triangles};
use crate::build::morton_clusters::MortonClusters;
use crate::bvh::surface_flags::SurfaceFlags;

fn triangle_refs(triangles: &[[Vec3; 3]]) -> Vec<BuildTriangle> {
    let flags = SurfaceFlags::default();
    filter_triangles(triangles.len(), |i| InputTriangle { vertices: triangles[i], flags }).0
}

/// Makes one cluster of all triangles.
fn single_cluster(all: &[BuildTriangle]) -> ClusterTriangles {
    let clusters = MortonClusters::new(all, usize::MAX);
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
    let all = triangle_refs(&hills(40));
    let cluster = single_cluster(&all);
    let own_box = |i: &u32| all[*i as usize].aabb();
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
    assert!(found.into_iter().eq(0..all.len() as u32));
    assert!(cluster.boxes.len() < all.len() * 6 / 10, "{} of {}", cluster.boxes.len(), all.len());
    let total: f64 = all.iter().map(occluding_area).sum();
    assert!((cluster.areas.iter().sum::<f64>() / total - 1.0).abs() < 1e-12);
}

#[test]
fn distant_triangles_keep_their_own_boxes() {
    let apart = |i: u32| [Vec3::ZERO, Vec3::X, Vec3::Y].map(|p| p + 3.0 * i as f32 * Vec3::X);
    let all = triangle_refs(&(0..50).map(apart).collect::<Vec<_>>());
    assert_eq!(single_cluster(&all).boxes.len(), 50);
    // Areas that overflow promise no gain.
    let huge = |i: u32| [Vec3::ZERO, Vec3::X, Vec3::Y].map(|p| (p - 0.5) * 1e18 + i as f32 * 1e14);
    let all = triangle_refs(&(0..50).map(huge).collect::<Vec<_>>());
    let cluster = single_cluster(&all);
    let entries = (0..cluster.boxes.len() as u32).map(|i| cluster.entry_count(i));
    assert_eq!(entries.sum::<u32>(), 50);
}
