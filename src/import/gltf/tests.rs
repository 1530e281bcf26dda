//! Whole files, in memory, to whole scenes.

mod attributes;
mod blender;
mod hostile;
mod looks;
mod motion;
mod placing;
