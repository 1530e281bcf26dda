//! Whole files, in memory, to whole scenes.

mod attributes;
mod hostile;
mod looks;
mod motion;
mod placing;
