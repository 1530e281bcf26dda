//! A scene at one time with its acceleration structure, in one value that Python can own.

use std::sync::Arc;

use anyhow::Result;

use blinn_accel::{Accel, AccelSettings};
use blinn_scene::{AnimationChoice, PoseSettings, Scene, pose};
use blinn_session::PosedFrame;

self_cell::self_cell!(
    /// A scene that owns its pose.
    pub struct PosedCell {
        owner: Arc<Scene>,
        #[covariant]
        dependent: PosedFrame,
    }
);

impl PosedCell {
    /// Poses `scene` at a time in seconds, without acceleration structure.
    pub fn pose(scene: Arc<Scene>, time: f64, animation: &AnimationChoice) -> Result<PosedCell> {
        PosedCell::try_new(scene, |scene| {
            let settings = PoseSettings { time, animation: animation.clone(), centre: None };
            Ok(PosedFrame { time, posed: pose(scene, &settings)?, accel: None })
        })
    }

    /// Poses `scene` and builds its acceleration structure.
    pub fn build(scene: Arc<Scene>, time: f64, animation: &AnimationChoice) -> Result<PosedCell> {
        let mut cell = PosedCell::pose(scene, time, animation)?;
        cell.with_dependent_mut(|_, frame| {
            frame.accel = Some(Accel::build(&frame.posed, &AccelSettings::default()).0);
        });
        Ok(cell)
    }
}
