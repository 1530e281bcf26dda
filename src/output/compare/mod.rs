//! Differences of pictures, of scenes, and of their descriptions.

mod canonical_material;
mod canonical_order;
mod element_kind;
mod faces;
mod flip;
mod in_order;
mod json;
mod object_matching;
mod objects;
mod pictures;
mod regions;
mod scene_objects;
mod surface_distance;

pub use canonical_order::CanonicalOrder;
pub use element_kind::ElementKind;
pub use flip::{FLIP_PIXELS_PER_DEGREE, flip};
pub use json::{JsonDifference, json_differences};
pub use objects::{ObjectChange, ObjectComparison, ObjectDifference, compare_objects};
pub use pictures::{DifferenceMap, DifferenceSummary, Mismatch, compare_pictures};
