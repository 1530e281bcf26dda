//! Rendering of many frames or files: frame lists, output paths, fingerprints, pipelining and dataset formats.

mod bop;
mod bop_models;
mod coco;
mod colmap;
mod colmap_binary;
mod colmap_tables;
mod colmap_text;
mod fingerprint;
mod frames;
mod path_list;
mod path_template;
mod pinhole;
mod pipeline;
mod scene_folder;
mod transforms;
mod world_up;

pub use bop::{BopModel, BopObject, BopScene};
pub use bop_models::{PosedObject, posed_objects};
pub use coco::{CocoDataset, CocoMasks, CocoObject};
pub use colmap::{ColmapForm, ColmapImage, ColmapModel, ColmapPoint};
pub use fingerprint::{FileDigests, SettingsHash, fingerprint, is_marked_empty, mark_empty};
pub use frames::{Chunk, FrameList, MAX_FRAMES};
pub use path_list::{PathList, PathListBuilder, decode as decode_path};
pub use path_template::{PathTemplate, TemplateFields};
pub use pinhole::{Pinhole, RigidPose};
pub use pipeline::run_pipeline;
pub use scene_folder::{SCENE_EXTENSIONS, has_scene_extension, visit_scenes};
pub use transforms::{Dataset, DatasetView};
pub use world_up::WorldUp;
