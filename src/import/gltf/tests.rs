//! Whole files, in memory, to whole scenes.
