//! Whole files, in memory, to whole scenes.

mod attributes;
mod blender;
mod hostile;
mod loading;
mod looks;
mod motion;
mod placing;
