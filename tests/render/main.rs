//! Pictures and rays against known answers: formulas, brute force, reference images, and each other. Nearly all
//! tests call the library.
//!
//! - `antialiasing`: sampling error of pictures that are formulas
//! - `area_lights`: area lights, glowing surfaces and bounced light against closed forms
//! - `bump_maps`: bump maps of MTL against closed forms
//! - `bvh`: every BVH query against brute force, bit for bit; refit against rebuild
//! - `depth_of_field`: thin lenses against closed forms
//! - `determinism`: the same bytes on any number of threads, tile size, BVH preset and SIMD level
//! - `empty_tile_culling`: tiles that no ray can hit trace none
//! - `environment`: environments as the background, and as light that ambient occlusion finds
//! - `environment_sources`: light and shadows of the sun of an environment
//! - `ggx_materials`: physical materials against the GGX surface that they stand for
//! - `golden`: reference images of each shading term and each model
//! - `lecture`: every row of the lecture's formulas
//! - `light_layers`: layers of light add up to the picture
//! - `lights_in_reflections`: lights seen in mirrors and behind rough glass
//! - `morphed_attributes`: morph targets of colours and texture coordinates
//! - `object_masks`: masks of objects, alone and hidden, and tracks of surface points
//! - `reflections`: white furnaces of metals, plastics and clear coats, and what stays matte
//! - `scale_invariance`: pictures at other scales and far from the origin
//! - `secondary_rays`: mirrors and glass
//! - `self_shadowing`: offset ray origins, at every scale
//! - `shadow_terminator`: smooth surfaces cast no faceted shadows on themselves
//! - `soft_lighting`: lights with a radius, ambient occlusion, ground
//! - `texture_filtering`: ray differentials, mip maps, alpha masks, specular antialiasing
//! - `transmission`: blended panes, and the light that falls through them
//! - `watertight`: no ray passes between adjacent triangles

#[path = "../common/mod.rs"]
mod common;

mod antialiasing;
mod area_lights;
mod bounced_light;
mod bump_maps;
mod bvh;
mod denoise;
mod depth_of_field;
mod determinism;
mod diffuse_transmission;
mod dispersion;
mod empty_tile_culling;
mod environment;
mod environment_sources;
mod ggx_materials;
mod golden;
mod layers;
mod lecture;
mod light_layers;
mod lights_in_reflections;
mod morphed_attributes;
mod object_masks;
mod reflections;
mod scale_invariance;
mod secondary_rays;
mod self_shadowing;
mod shadow_terminator;
mod soft_lighting;
mod texture_filtering;
mod transmission;
mod watertight;
