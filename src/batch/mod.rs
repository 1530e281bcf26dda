//! Rendering of many frames or files: frame lists, output paths, fingerprints, pipelining and dataset formats.

mod bop;
mod bop_models;
mod coco;
mod colmap;
mod fingerprint;
mod frames;
mod path_template;
mod pinhole;
mod pipeline;
mod transforms;
mod world_up;

pub use bop::{BopModel, BopObject, BopScene};
pub use bop_models::{PosedObject, posed_objects};
pub use coco::{CocoDataset, CocoObject};
pub use colmap::{ColmapImage, ColmapModel, ColmapPoint};
pub use fingerprint::{FileDigests, SettingsHash, fingerprint};
pub use frames::{Chunk, FrameList, MAX_FRAMES};
pub use path_template::{PathTemplate, TemplateFields};
pub use pinhole::{Pinhole, RigidPose};
pub use pipeline::run_pipeline;
pub use transforms::{Dataset, DatasetView};
pub use world_up::WorldUp;
