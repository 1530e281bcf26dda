//! Many frames, or many files: which frames there are, and what their files are called.

mod fingerprint;
mod frames;
mod names;
mod pipeline;

pub use fingerprint::{Contents, Key, written_since};
pub use frames::{Chunk, FrameList, MOST_FRAMES};
pub use names::{Name, Template};
pub use pipeline::overlap;
