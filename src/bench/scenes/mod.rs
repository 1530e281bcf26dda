//! Generated benchmark scenes: procedural, so that no download is needed, and the same bytes on every machine.
//!
//! Random numbers are hashes; sines and roots are libm's or IEEE's. The scenes do not depend on the renderer:
//! measurements compare only if their scenes are bit-identical.

mod forest;
mod glb;
mod interior;
mod kind;
mod mesh;
pub(super) mod noise;
mod obj;
mod scan;
mod scene;
mod shapes;
mod stadium;
mod stress;
mod triangle_count;
mod vector;

pub use glb::write_glb;
pub use kind::SceneKind;
pub use mesh::GeneratedMesh;
pub use obj::write_obj;
pub use scene::{GeneratedInstance, GeneratedScene};
pub use triangle_count::{format_triangle_count, parse_triangle_count};
