//! The tables of a COLMAP model, as its files hold them.

use glam::DVec2;

use super::pinhole::Pinhole;

/// The tables of a model, in the order of ids.
pub(super) struct ColmapTables<'m> {
    /// One camera for each set of intrinsics.
    pub cameras: Vec<Pinhole>,
    pub images: Vec<ImageRow<'m>>,
    pub points: Vec<PointRow>,
    /// The id of the first image, and of the first camera.
    pub first_id: u32,
}

/// An image with what it sees.
pub(super) struct ImageRow<'m> {
    pub name: &'m str,
    pub camera_id: u32,
    /// w, x, y and z.
    pub quaternion: [f64; 4],
    pub translation: [f64; 3],
    /// Where it sees which points, in the order of their ids.
    pub points: Vec<(DVec2, u64)>,
}

/// A point with the images that see it.
pub(super) struct PointRow {
    pub position: [f64; 3],
    pub color: [u8; 3],
    /// Ids of images, and indices of the point in their lists.
    pub track: Vec<(u32, u32)>,
}
