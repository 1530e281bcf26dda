//! Loads glTF files that are built in memory.

mod accessor;
mod animation;
mod area_light;
mod attributes;
mod blender;
mod blinn_extras;
mod exporters;
mod extensions;
mod graph;
mod image_based_light;
mod image_formats;
mod json_text;
mod loading;
mod lost_lights;
mod malformed;
mod materials;
mod morph_targets;
mod nodes;
mod null_values;
mod parse;
mod photometric_light;
mod ranges;
mod scale;
mod tangents;
mod validate;
mod variants;
