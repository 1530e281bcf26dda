//! Polygons, as OBJ, PLY and STL files have them, to triangle meshes.

mod ear_clipping;
pub(crate) mod far_centre;
mod interned;
mod loose_edges;
pub(crate) mod meshes_bytes;
pub(crate) mod polygon_mesh;
pub(crate) mod polygon_scene;
pub(crate) mod triangulator;
pub(crate) mod used_vertices;
pub(crate) mod vertex_dedup;
