//! Animation: key frames, poses, skinning and morph targets, bounds over a clip.

pub(crate) mod animated_properties;
pub(crate) mod clip;
pub(crate) mod clip_bounds;
pub(crate) mod deform;
pub(crate) mod keyframes;
pub(crate) mod node_transforms;
pub(crate) mod pose;
pub(crate) mod pose_bounds;
pub(crate) mod skinned_cluster_bounds;
pub(crate) mod tangent_frames;
