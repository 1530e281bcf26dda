//! Segments: runs of consecutive faces with the same object, smoothing group, material and vertex format.

use std::ops::Range;

use super::chunk::VertexFormat;

/// The state that all faces of a segment share.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) struct SegmentKey {
    /// Index into [`ObjGeometry::objects`](super::geometry::ObjGeometry::objects).
    pub object: u32,
    /// The smoothing group; 0 disables smoothing.
    pub smoothing: u32,
    /// Index into [`ObjGeometry::materials`](super::geometry::ObjGeometry::materials); `None` before any `usemtl`.
    pub material: Option<u32>,
    pub format: VertexFormat,
}

/// Consecutive faces, later triangles, of one chunk that share their state.
#[derive(Clone, Debug)]
pub(super) struct Segment {
    pub key: SegmentKey,
    /// Index of the chunk.
    pub chunk: usize,
    /// Faces of the chunk, and triangles once it is triangulated.
    pub range: Range<usize>,
}
