//! The scene in the frames before and after a frame, for layers of flow.

use crate::error::SessionError;
use crate::planned_frame::PlannedFrame;
use crate::posed_frame::{PosedFrame, SceneSetup};
use crate::scene_renderer::SceneRenderer;
use blinn_render::integrator::{Aov, Frame};
use blinn_scene::Camera;

/// A frame before or after another one.
pub(crate) struct NeighbourFrame<'p, 'a> {
    planned: PlannedFrame,
    camera: Camera,
    posed: NeighbourPose<'p, 'a>,
}

/// The scene in a neighbouring frame.
enum NeighbourPose<'p, 'a> {
    /// Nothing moves: it is that of the frame itself.
    Same(&'p PosedFrame<'a>),
    Other(Box<PosedFrame<'a>>),
}

impl NeighbourFrame<'_, '_> {
    /// The frame to trace rays in.
    pub fn frame<'m>(&'m self, setup: &SceneSetup) -> Result<Frame<'m>, SessionError> {
        let posed = match &self.posed {
            NeighbourPose::Same(posed) => posed,
            NeighbourPose::Other(posed) => posed.as_ref(),
        };
        setup.rotated_frame(self.planned.angle, posed, self.camera)
    }
}

impl<'a> SceneRenderer<'a> {
    /// The frames before and after a frame to which its layers of flow lead. Other frames are not posed.
    pub(crate) fn neighbour_frames<'p>(
        &self,
        planned: &PlannedFrame,
        posed_frame: &'p PosedFrame<'a>,
    ) -> Result<[Option<NeighbourFrame<'p, 'a>>; 2], SessionError> {
        let aovs = &self.setup.plan.options.aovs.aovs;
        let neighbour = |aov: Aov, step: i64| -> Result<Option<NeighbourFrame<'p, 'a>>, SessionError> {
            let Some(planned) =
                self.setup.plan.neighbours.frame(planned, step).filter(|_| aovs.contains(&aov))
            else {
                return Ok(None);
            };
            let posed = if self.setup.is_at(posed_frame, planned.time) {
                NeighbourPose::Same(posed_frame)
            } else {
                NeighbourPose::Other(Box::new(self.setup.pose_at(planned.time, posed_frame, None)?))
            };
            let at = match &posed {
                NeighbourPose::Same(frame) => &frame.posed,
                NeighbourPose::Other(frame) => &frame.posed,
            };
            let camera = self.camera(&planned, at)?;
            Ok(Some(NeighbourFrame { planned, camera, posed }))
        };
        Ok([neighbour(Aov::FlowBackward, -1)?, neighbour(Aov::FlowForward, 1)?])
    }
}
