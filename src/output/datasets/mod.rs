//! Dataset formats: `transforms.json` of NeRF, COCO, COLMAP and BOP.

mod bop;
mod bop_models;
mod coco;
mod coco_merge;
mod colmap;
mod colmap_binary;
mod colmap_tables;
mod colmap_text;
mod pinhole;
mod transforms;
mod world_up;

pub use bop::{BopImage, BopModel, BopObject, BopScene, MODELS_INFO, bop_sample_masks};
pub use bop_models::{PosedObject, posed_objects};
pub use coco::{CocoCategory, CocoDataset, CocoMasks, CocoObject};
pub use coco_merge::{CocoMerge, CocoPart, CocoPartError};
pub use colmap::{ColmapForm, ColmapImage, ColmapModel, ColmapPoint};
pub use pinhole::{Pinhole, RigidPose};
pub use transforms::{Dataset, DatasetView};
pub use world_up::WorldUp;
