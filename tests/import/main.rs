//! Files against what other programs see in them: Blender's buffers, Cycles' radiance, an independent glTF reader,
//! and the glTF specification where loaders are known to fail. What unit tests hold stands beside src/import.
//!
//! - `blender_references`: mask, depth, normal and base colour of our models against Blender's
//! - `compressed_assets`: Draco, meshopt and quantised files against their uncompressed twins
//! - `gltf_regressions`: one test for each known pitfall of glTF loaders, from file to picture
//! - `light_units`: the lighting modes of Blender's exporter against Cycles

#[path = "../common/mod.rs"]
mod common;

mod blender_references;
mod compressed_assets;
mod gltf_regressions;
mod light_units;
