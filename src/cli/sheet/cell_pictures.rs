//! Renders the pictures of a scene on a sheet.

use anyhow::{Context, Result};

use super::cell::SheetCell;
use super::empty_views::EmptyViews;
use crate::plan::RenderPlan;
use crate::run::progress::{ImageMonitor, SceneLog};
use blinn_core::cancellation::CancelToken;
use blinn_scene::{PosedScene, Scene};
use blinn_session::{PlannedFrame, PosedFrame, SceneRenderer, SessionLog};

/// The frame that all pictures show, unless the camera of a list has a time of its own.
///
/// # Errors
/// The plan has none.
pub fn planned_frame(plan: &RenderPlan) -> Result<PlannedFrame> {
    let frames = plan.frames.resolve(0.0, None)?;
    frames.first().copied().context("there is no frame")
}

/// The pictures of a scene.
pub struct CellPictures<'a> {
    /// The plan, with the camera that lights without a place stand by.
    pub plan: RenderPlan,
    pub scene: &'a Scene,
    pub log: &'a SceneLog<'a>,
    pub cancel: &'a CancelToken,
}

impl<'a> CellPictures<'a> {
    /// Renders the picture of each cell and passes it to `add` as displayed, row-major, row 0 on top. `posed` is the scene at the
    /// time of `planned`. Returns the exposure of all pictures in stops.
    ///
    /// # Errors
    /// A picture cannot be rendered, or `cancel` was cancelled; with --strict, the first warning.
    pub fn render(
        &self,
        cells: &[SheetCell],
        posed: PosedScene<'a>,
        planned: &PlannedFrame,
        mut add: impl FnMut(&SheetCell, Vec<[u8; 4]>),
    ) -> Result<f64> {
        let mut time = planned.time;
        let mut frame = PosedFrame { time, posed, accel: None };
        let renderer =
            SceneRenderer::from_start(&self.plan.session, self.scene, self.log, &mut frame, self.cancel)?;
        renderer.setup.build(&mut frame)?;
        let mut empty_views = EmptyViews::default();
        self.log.begin_frames(cells.len());
        for cell in cells {
            if cell.time != time {
                let reusable = frame.accel.take();
                frame = renderer.setup.pose_at(cell.time, &frame, reusable)?;
                time = cell.time;
            }
            let (width, height) = cell.view.size;
            let pixels = u64::from(width) * u64::from(height);
            let monitor = ImageMonitor::new(self.log, pixels, &renderer.setup.cancel);
            let image = renderer.render_camera(&cell.view, planned, &frame, &monitor)?;
            monitor.finish();
            add(cell, image.picture.display.to_rgba8(&image.picture.pixels));
            if let Some(reason) = image.empty {
                empty_views.add(reason, &cell.name);
            }
        }
        if let Some(notice) = empty_views.summary() {
            self.log.warn(notice)?;
        }
        Ok(renderer.exposure.ev)
    }
}
