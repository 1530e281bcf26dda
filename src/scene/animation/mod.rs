//! Animation: keyframes, poses, morph targets and skinning, and bounds over a clip.

pub(super) mod animated_properties;
pub(super) mod bounds_cache;
mod clip;
mod clip_alpha;
mod clip_bounds;
mod deform;
mod drawn_triangles;
mod extremes;
pub(super) mod keyframes;
mod light_nodes;
mod node_transforms;
pub(super) mod object_space;
pub(super) mod playback;
pub(super) mod pose;
mod pose_bounds;
pub(super) mod posed_scene;
mod skinned_cluster_bounds;
mod tangent_frames;
mod turned_tangents;
mod vertex_clusters;
