//! Many frames, or many files: which frames there are, what their files are called, and where they
//! were seen from.

mod fingerprint;
mod frames;
mod names;
mod pipeline;
mod transforms;

pub use fingerprint::{Contents, Key, stamp};
pub use frames::{Chunk, FrameList, MOST_FRAMES};
pub use names::{Name, Template};
pub use pipeline::overlap;
pub use transforms::{Dataset, DatasetView, WorldUp};
