//! Imported files against other programs: Blender's render passes, Cycles' radiance, an independent glTF
//! reader, and the glTF specification where loaders are known to fail. Unit tests of importers are in
//! src/import.
//!
//! - `blender_references`: mask, depth, normal and base colour of our models against Blender's
//! - `compressed_assets`: Draco, meshopt and quantised files against their uncompressed twins
//! - `gltf_regressions`: one test for each known pitfall of glTF loaders, from file to picture
//! - `light_units`: the lighting modes of Blender's exporter against Cycles
//! - `scene_quirks`: a file of our own for each quirk of the public scenes of `blinn bench --scenes`

#[path = "../common/mod.rs"]
mod common;

mod blender_references;
mod compressed_assets;
mod gltf_regressions;
mod light_units;
mod scene_quirks;
