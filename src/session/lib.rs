//! From options to pictures: [`Scene::load`], [`Scene::render`] with [`Options`], [`Picture::save`]. A [`Session`] holds a
//! scene with everything that its images share (camera, lights, exposure, acceleration structure) and renders any of them.
//!
//! A program makes [`Options`] from what its users write, and messages name options as they write them
//! ([`set_option_word`]). Whichever program makes them, the same options give the same bytes.
//!
//! Beside pictures, this package has what batches share: lists of frames and files, output names, fingerprints of images,
//! cameras and views of datasets, and limits of memory.
#![deny(unsafe_code)]
#![warn(missing_docs)]

mod blend;
mod camera_list;
mod camera_name;
mod clip_bounds;
mod dataset_plan;
mod dataset_views;
mod depth_range;
mod edge_memory;
mod edge_options;
mod empty_images;
mod empty_reason;
mod environment_cache;
mod error;
mod error_text;
mod exposure;
mod file_settings;
mod fingerprint;
mod frame_neighbours;
mod frames;
mod framing;
mod identity;
mod idle_animations;
mod image_size;
mod light_advice;
mod light_hints;
mod log;
pub mod memory;
mod memory_estimate;
mod memory_limit;
mod named_options;
mod near_plane;
mod neighbour_frames;
mod noise_sources;
mod notice;
mod option_files;
mod option_remarks;
mod option_table;
mod options;
mod path_list;
mod path_template;
mod picture;
mod picture_edges;
mod picture_layers;
mod pipeline;
mod plan;
mod planned_frame;
mod posed_frame;
mod round_sizes;
mod scene;
mod scene_claim;
mod scene_folder;
mod scene_lighting;
mod scene_renderer;
mod scheduler;
mod session;
mod settings_hash;
mod shared_memory;
mod simd_level;
mod surroundings;
pub mod values;

pub use blend::load_scene;
pub use blinn_core::option_words::{OptionWord, set_option_word, word_options};
pub use blinn_import::SCENE_EXTENSIONS;
pub use camera_list::{CameraList, ImageCamera, ReplacedCameraFields};
pub use camera_name::camera_name;
pub use dataset_plan::DatasetPlan;
pub use dataset_views::DatasetViews;
pub use edge_options::EdgeOptions;
pub use empty_images::{EmptyImages, empty_reason};
pub use empty_reason::EmptyReason;
pub use error::SessionError;
pub use error_text::without_error_codes;
pub use exposure::ResolvedExposure;
pub use fingerprint::{FileDigests, fingerprint, has_settings, is_marked_empty, mark_empty};
pub use frame_neighbours::FrameNeighbours;
pub use frames::{Chunk, FrameList, MAX_FRAMES};
pub use framing::Framing;
pub use image_size::{natural_size, scaled_to};
pub use log::{NoticeLog, SessionLog};
pub use memory_estimate::{check_memory, format_bytes};
pub use memory_limit::load_limits;
pub use named_options::NamedOptions;
pub use notice::{DepthOverflow, EnclosedLight, LackOfLight, Notice, pictures_without_pose};
pub use option_table::{Effect, Heading, OptionDef, option_defs};
pub use options::{
    AovSelection, BackFaceCulling, CRYPTOMATTE, DEFAULT_BACKGROUND, EnvironmentSource, Exposure,
    ImageBackground, OcclusionSampling, Options, TurntableRotation,
};
pub use path_list::{PathList, PathListBuilder, decode as decode_path};
pub use path_template::{PathTemplate, TemplateFields, folder_name};
pub use picture::{ImageKind, Picture};
pub use pipeline::run_pipeline;
pub use plan::SessionPlan;
pub use planned_frame::{DEFAULT_FPS, FrameRate, PlannedFrame};
pub use posed_frame::{PosedFrame, SceneSetup, ignored_primitives};
pub use round_sizes::{RoundWidth, default_round_sizes, ray_sizes};
pub use scene::{Scene, prepare_scene};
pub use scene_folder::{ForeignModels, has_scene_extension, visit_scenes};
pub use scene_renderer::{RenderedImage, SceneRenderer};
pub use scheduler::{Capacity, Claim, Deferred, Finished, Job, Permit, Scheduler, run_scheduled};
pub use session::{Request, Session};
pub use settings_hash::SettingsHash;
pub use simd_level::simd_level;
