//! Loads glTF files that are built in memory.

mod accessor;
mod animation;
mod attributes;
mod blender;
mod extensions;
mod graph;
mod loading;
mod malformed;
mod materials;
mod nodes;
mod parse;
mod tangents;
mod validate;
mod variants;
