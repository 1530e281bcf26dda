//! The state of a view: what the page's controls show.

use serde::{Deserialize, Serialize};

/// The state of a view. Names and numbers are those of the flags of `blinn render`, and so are the defaults.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ViewState {
    pub camera: CameraState,
    /// Indices of hidden objects, from 0.
    #[serde(default)]
    pub hidden: Vec<u32>,
    #[serde(default)]
    pub variant: Option<String>,
    /// Index of the animation; `None` for the rest pose.
    #[serde(default)]
    pub animation: Option<u32>,
    /// In seconds.
    #[serde(default)]
    pub time: f64,
    /// Empty for the default.
    #[serde(default)]
    pub lights: String,
    #[serde(default)]
    pub exposure: ExposureState,
    /// Empty for the default.
    #[serde(default)]
    pub view_transform: String,
    /// `None` for no environment but the file's.
    #[serde(default)]
    pub hdri: Option<String>,
    /// In degrees.
    #[serde(default)]
    pub hdri_rotate: f64,
    /// Empty for the default.
    #[serde(default)]
    pub background: String,
    #[serde(default)]
    pub ground: bool,
    /// Rays of ambient occlusion; 0 turns it off.
    #[serde(default)]
    pub ao: u32,
    #[serde(default = "default_samples")]
    pub samples: u32,
}

fn default_samples() -> u32 {
    4
}

/// A camera. Lengths are in metres, angles in degrees.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "lowercase")]
pub enum CameraState {
    /// On a sphere around a point, as with `--orbit`.
    Orbit(OrbitState),
    /// A camera of the file.
    File { index: u32 },
}

/// A camera on a sphere around a point.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct OrbitState {
    pub target: [f64; 3],
    pub azimuth: f64,
    pub elevation: f64,
    pub distance: f64,
    pub yfov: f64,
    pub projection: ProjectionState,
    /// Height of the view rectangle of an orthographic camera.
    pub height: f64,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum ProjectionState {
    Perspective,
    Orthographic,
}

/// An exposure.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum ExposureState {
    /// In stops.
    Stops(f64),
    /// `auto`: the default of `blinn render`.
    Named(String),
}

impl Default for ExposureState {
    fn default() -> Self {
        ExposureState::Named("auto".into())
    }
}
