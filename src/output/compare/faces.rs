//! Triangles of an object as a set, which does not depend on their order in a file.

use std::cmp::Ordering;

use glam::Vec3;
use rayon::prelude::*;
use twox_hash::XxHash3_128;

/// A triangle, point or line that can be matched with an equal one of another scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Face {
    /// A digest of the corners, whichever of them comes first.
    pub position: u128,
    /// A digest of normals, texture coordinates and colours at the corners.
    attributes: u64,
    /// The material, by a number that both scenes share.
    material: u32,
    /// The instance of the face.
    pub instance: u32,
    /// Its number among the instance's triangles.
    pub triangle: u32,
}

/// Parts of a face, from which its digests are made.
pub struct FaceParts<'a> {
    pub instance: u32,
    pub triangle: u32,
    pub corners: [Vec3; 3],
    pub material: u32,
    /// Appends the attributes of a corner, 0 to 2.
    pub attributes: &'a dyn Fn(usize, &mut Vec<u32>),
}

impl Face {
    /// Makes a face. `scratch` is memory to use.
    pub fn new(parts: &FaceParts, scratch: &mut Vec<u32>) -> Face {
        let (start, position) = digest_corners(parts.corners);
        scratch.clear();
        (0..3).for_each(|i| (parts.attributes)((start + i) % 3, scratch));
        Face {
            position,
            attributes: XxHash3_128::oneshot(bytemuck::cast_slice(scratch)) as u64,
            material: parts.material,
            instance: parts.instance,
            triangle: parts.triangle,
        }
    }
}

/// Returns the first corner of a triangle in an order that does not depend on where it begins, and a digest of the corners from
/// there.
fn digest_corners(corners: [Vec3; 3]) -> (usize, u128) {
    // -0 is 0.
    let bits = corners.map(|corner| (corner + 0.0).to_array().map(f32::to_bits));
    let turned = |start: usize| [0, 1, 2].map(|i| bits[(start + i) % 3]);
    let start = (0..3).min_by_key(|start| turned(*start)).unwrap_or(0);
    (start, XxHash3_128::oneshot(bytemuck::cast_slice(&turned(start))))
}

/// Returns true if the triangles of both lists are the same, and wind the other way.
pub fn are_reversed(old: &[[Vec3; 3]], new: &[[Vec3; 3]]) -> bool {
    let sorted = |digests: &mut dyn Iterator<Item = u128>| {
        let mut digests: Vec<u128> = digests.collect();
        digests.sort_unstable();
        digests
    };
    old.len() == new.len()
        && sorted(&mut old.iter().map(|&[a, b, c]| digest_corners([a, c, b]).1))
            == sorted(&mut new.iter().map(|&corners| digest_corners(corners).1))
}

/// How two sets of faces differ.
#[derive(Debug, Default, PartialEq)]
pub struct FaceDifference {
    /// The faces of each set that the other one lacks.
    pub unmatched: [Vec<Face>; 2],
    /// True if faces in both sets have other attributes.
    pub attributes: bool,
    /// True if faces in both sets have another material.
    pub material: bool,
}

/// Matches faces with equal corners.
pub fn match_faces(mut old: Vec<Face>, mut new: Vec<Face>) -> FaceDifference {
    old.par_sort_unstable();
    new.par_sort_unstable();
    let mut difference = FaceDifference::default();
    let (mut a, mut b) = (old.into_iter().peekable(), new.into_iter().peekable());
    loop {
        let order = match (a.peek(), b.peek()) {
            (Some(x), Some(y)) => x.position.cmp(&y.position),
            (Some(_), None) => Ordering::Less,
            (None, Some(_)) => Ordering::Greater,
            (None, None) => break,
        };
        let x = if order.is_le() { a.next() } else { None };
        let y = if order.is_ge() { b.next() } else { None };
        match (x, y) {
            (Some(x), Some(y)) => {
                difference.attributes |= x.attributes != y.attributes;
                difference.material |= x.material != y.material;
            }
            (x, y) => {
                difference.unmatched[0].extend(x);
                difference.unmatched[1].extend(y);
            }
        }
    }
    // Back to the order of the files.
    let place = |face: &Face| (face.instance, face.triangle);
    difference.unmatched.iter_mut().for_each(|faces| faces.sort_unstable_by_key(place));
    difference
}

#[cfg(test)]
mod tests {
    use super::*;

    fn face(corners: [Vec3; 3], values: [u32; 3], material: u32, triangle: u32) -> Face {
        let attributes = |corner: usize, out: &mut Vec<u32>| out.push(values[corner]);
        let parts = FaceParts { instance: 0, triangle, corners, material, attributes: &attributes };
        Face::new(&parts, &mut Vec::new())
    }

    #[test]
    fn turned_triangles_match_and_mirrored_ones_do_not() {
        let (a, b, c) = (Vec3::ZERO, Vec3::X, Vec3::Y);
        let one = vec![face([a, b, c], [1, 2, 3], 0, 0)];
        let difference = match_faces(one.clone(), vec![face([c, -a, b], [3, 1, 2], 0, 5)]);
        assert_eq!(difference, FaceDifference::default());
        let difference = match_faces(one, vec![face([a, c, b], [1, 3, 2], 0, 0)]);
        assert_eq!(difference.unmatched.map(|faces| faces.len()), [1, 1]);
        let d = Vec3::Z;
        assert!(are_reversed(&[[a, b, c], [a, b, d]], &[[d, b, -a], [a, c, b]]));
        assert!(!are_reversed(&[[a, b, c]], &[[b, c, a]]) && !are_reversed(&[[a, b, c]], &[[a, d, b]]));
        assert!(!are_reversed(&[[a, b, c]], &[[a, c, b], [a, c, b]]));
    }

    #[test]
    fn coincident_faces_match_in_any_order() {
        let corners = [Vec3::ZERO, Vec3::X, Vec3::Y];
        let old = vec![face(corners, [1; 3], 0, 0), face(corners, [2; 3], 1, 1)];
        let new = vec![face(corners, [2; 3], 1, 0), face(corners, [1; 3], 0, 1)];
        assert_eq!(match_faces(old.clone(), new), FaceDifference::default());
        let painted = vec![face(corners, [1; 3], 0, 0), face(corners, [2; 3], 0, 1)];
        let difference = match_faces(old, painted);
        assert!(difference.material && !difference.attributes, "{difference:?}");
    }

    #[test]
    fn faces_that_only_one_set_has_are_listed_in_the_order_of_the_file() {
        let at = |x: f32, triangle| face([Vec3::ZERO, Vec3::X, Vec3::new(x, 1.0, 0.0)], [0; 3], 0, triangle);
        let old: Vec<Face> = (0..9u8).map(|i| at(f32::from(i), u32::from(i))).collect();
        let new: Vec<Face> = (0..9u8).filter(|i| *i != 7 && *i != 2).map(|i| at(f32::from(i), 0)).collect();
        let difference = match_faces(old, new);
        let missing: Vec<u32> = difference.unmatched[0].iter().map(|face| face.triangle).collect();
        assert_eq!((missing, difference.unmatched[1].len()), (vec![2, 7], 0));
    }
}
