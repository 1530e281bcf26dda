//! Turns the state of a view into options of `blinn render` by name. The picture is made from them, and a copied command
//! has them as flags.

use anyhow::{Context, Result, bail};
use glam::DVec3;

use super::start_flags::StartFlags;
use super::state::{CameraState, ExposureState, OrbitState, ProjectionState, ViewState};
use super::visibility::HidePatterns;
use crate::args::ExplicitFlags;
use blinn_scene::{Orbit, Scene};
use blinn_session::{ResolvedExposure, camera_name};

/// Minimum number of samples for adaptive sampling.
const ADAPTIVE_SAMPLES: u32 = 5;

/// The scene and the command line, which flags depend on beside the state.
pub struct FlagContext<'a> {
    pub start: &'a StartFlags,
    pub scene: &'a Scene,
    pub patterns: &'a HidePatterns,
    /// Diameter of the scene's bounding sphere in metres.
    pub scene_diameter: f64,
}

impl FlagContext<'_> {
    /// The flags that select and pose what is shown, without camera.
    pub fn scene_flags(&self, state: &ViewState) -> Result<ExplicitFlags> {
        let mut flags = self.start_flags(state);
        let mut push = |name: &str, value: &str| flags.push(name, value);
        for pattern in self.patterns.patterns(&state.hidden) {
            push("hide", &pattern);
        }
        if let Some(variant) = &state.variant {
            push("variant", variant);
        }
        if !self.scene.animations.is_empty() {
            push("animation", &self.animation(state.animation)?);
        }
        if state.time != 0.0 {
            push("time", &number(state.time));
        }
        for (name, text) in [("lights", &state.lights), ("background", &state.background)] {
            if !text.is_empty() {
                push(name, text);
            }
        }
        if !["", "auto"].contains(&state.view_transform.as_str()) {
            push("view", &state.view_transform);
        }
        if let Some(hdri) = self.hdri(state)? {
            push("hdri", &hdri);
        }
        if state.hdri_rotate != 0.0 && (state.hdri.is_some() || self.scene.environment.is_some()) {
            push("hdri-rotate", &number(state.hdri_rotate));
        }
        if state.ground && !self.start.kept.contains("ground") {
            push("ground", "plane");
        }
        if state.ao > 0 {
            push("ao", &self.occlusion(state.ao));
        }
        match &state.exposure {
            ExposureState::Stops(ev) => push("exposure", &number(*ev)),
            // A forced metering stays one.
            ExposureState::Named(_) => {
                if self.start.all.value("exposure").is_some_and(|value| value == "auto") {
                    push("exposure", "auto");
                }
            }
        }
        Ok(flags)
    }

    /// All flags of a picture. `exposure` is that of the flags above if it is metered: metering depends on the camera,
    /// and the picture should not change its brightness while the camera moves.
    pub fn picture_flags(
        &self,
        scene_flags: &ExplicitFlags,
        state: &ViewState,
        size: (u32, u32),
        exposure: Option<&ResolvedExposure>,
    ) -> Result<ExplicitFlags> {
        let mut flags = scene_flags.clone();
        if let Some(exposure) = exposure {
            flags = flags.without(&["exposure"]);
            flags.push("exposure", exposure.ev.to_string());
            if let Some(scale) = exposure.light_scale {
                flags = flags.without(&["light-scale"]);
                flags.push("light-scale", scale.to_string());
            }
        }
        for (name, value) in self.camera_flags(&state.camera)? {
            flags.push(name, value);
        }
        flags.push("size", format!("{}x{}", size.0, size.1));
        flags.push("samples", state.samples.to_string());
        if let Some(threshold) =
            self.start.all.value("adaptive").filter(|_| state.samples >= ADAPTIVE_SAMPLES)
        {
            flags.push("adaptive", threshold);
        }
        Ok(flags)
    }

    /// The flags of the command line, without those that have no effect in this state, and would be errors.
    fn start_flags(&self, state: &ViewState) -> ExplicitFlags {
        let kept = &self.start.kept;
        let mut dropped = Vec::new();
        if state.background != "hdri" {
            dropped.push("background-blur");
        }
        if !state.ground {
            dropped.push("ground");
        }
        if state.hdri.is_some() {
            dropped.push("ambient");
        }
        if !["", "file"].contains(&state.lights.as_str()) && !state.lights.starts_with("file,") {
            dropped.push("light-scale");
        }
        if state.lights == "none" && !kept.contains("point-light") && !kept.contains("sun") {
            dropped.push("light-radius");
        }
        kept.clone().without(&dropped)
    }

    fn animation(&self, index: Option<u32>) -> Result<String> {
        let Some(index) = index else { return Ok("none".into()) };
        let animations = &self.scene.animations;
        let animation = animations.get(index as usize).context("there is no such animation")?;
        // A name takes precedence over an index.
        let number = index.to_string();
        if !animations.iter().any(|other| other.name == number) {
            return Ok(number);
        }
        Ok(animation.name.clone())
    }

    /// The environment: one of the program, or that of the command line.
    fn hdri(&self, state: &ViewState) -> Result<Option<String>> {
        let Some(name) = &state.hdri else { return Ok(None) };
        let is_own = self.start.hdri().is_some_and(|own| own == *name);
        if !is_own && !["studio", "sky"].contains(&name.as_str()) {
            bail!("--hdri {name}: start blinn view with this file");
        }
        Ok(Some(name.clone()))
    }

    /// The value of --ao, with the distance of the command line.
    fn occlusion(&self, samples: u32) -> String {
        let given = self.start.all.value("ao").and_then(|value| value.to_str());
        match given.and_then(|value| value.split_once(',')) {
            Some((_, distance)) => format!("{samples},{distance}"),
            None => samples.to_string(),
        }
    }

    fn camera_flags(&self, camera: &CameraState) -> Result<Vec<(&'static str, String)>> {
        match camera {
            CameraState::File { index } => {
                let index = *index as usize;
                if index >= self.scene.cameras.len() {
                    bail!("the file has no camera {index}");
                }
                Ok(vec![("camera", camera_name(self.scene, index))])
            }
            CameraState::Orbit(orbit) => Ok(orbit_flags(orbit, self.scene_diameter)),
        }
    }
}

/// The flags of a camera on a sphere.
fn orbit_flags(orbit: &OrbitState, scene_diameter: f64) -> Vec<(&'static str, String)> {
    let OrbitState { target, azimuth, elevation, distance, yfov, projection, height } = orbit;
    match projection {
        ProjectionState::Perspective => vec![
            ("orbit", vector([*azimuth, *elevation, *distance])),
            ("look-at", vector(*target)),
            ("yfov", number(*yfov)),
            ("projection", "perspective".into()),
        ],
        ProjectionState::Orthographic => {
            let angles =
                Orbit { azimuth: azimuth.to_radians(), elevation: elevation.to_radians(), distance: None };
            let basis = angles.basis();
            // An eye inside of the scene would not see what is behind it.
            let eye = DVec3::from_array(*target) + basis.w * distance.max(scene_diameter);
            vec![
                ("view-point", vector(eye.to_array())),
                ("view-dir", vector((-basis.w).to_array())),
                ("view-up", vector(basis.v.to_array())),
                ("view-height", number(*height)),
                ("projection", "orthographic".into()),
            ]
        }
    }
}

/// A number as short as it can be without a change.
fn number(value: f64) -> String {
    // Neither is there a negative zero.
    (value + 0.0).to_string()
}

fn vector(values: [f64; 3]) -> String {
    values.map(number).join(",")
}
