//! The frames before and after a frame, to which layers of flow lead.

use crate::camera_list::CameraList;
use crate::error::SessionError;
use crate::options::Options;
use crate::planned_frame::{DEFAULT_FPS, PlannedFrame};
use blinn_core::worded;

/// The frames before and after each frame, whichever frames are rendered.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub enum FrameNeighbours {
    /// A single time, or views that follow no order.
    None,
    /// Frames of an animation.
    Animation {
        /// Frames per second. `None` for those of the file, or [`DEFAULT_FPS`].
        fps: Option<f64>,
    },
    /// Frames of a turntable, which starts again after the last frame.
    Turntable {
        /// The rotation of each frame in radians.
        angles: Vec<f64>,
    },
    /// The cameras of a list in the order of their times, which ends with the last.
    Cameras {
        /// The time of each in seconds.
        times: Vec<f64>,
    },
}

impl FrameNeighbours {
    /// Those of a list of cameras. They matter only to layers of flow, for which every camera needs a later time than the
    /// one before, and all the same size.
    ///
    /// # Errors
    /// The cameras of `options` with layers of flow have other times or sizes, or cannot be read.
    pub fn of_cameras(cameras: &CameraList, options: &Options) -> Result<FrameNeighbours, SessionError> {
        let Some(aov) = options.aovs.aovs.iter().find(|aov| aov.is_flow()) else {
            return Ok(FrameNeighbours::None);
        };
        let error = |text: &str| {
            let (aov, file) = (aov.name(), cameras.path().display());
            SessionError::Option(worded!(
                "`aov {}`: flow leads from camera to camera, but in `cameras {}` {}",
                aov,
                file,
                text
            ))
        };
        let times: Option<Vec<f64>> = (0..cameras.len()).map(|index| cameras.time(index)).collect();
        let times = times
            .filter(|times| times.windows(2).all(|pair| pair[0] < pair[1]))
            .ok_or_else(|| error("not every camera has a later time than the one before; add times"))?;
        let mut first = None;
        for index in 0..cameras.len() {
            let listed = cameras.listed(index)?;
            let size = cameras.size_of(&listed);
            if *first.get_or_insert(size) != size {
                return Err(error(&worded!("the images have different sizes; add `size WxH`")));
            }
        }
        Ok(FrameNeighbours::Cameras { times })
    }

    /// The frame `step` frames later, or earlier if it is negative.
    pub fn frame(&self, frame: &PlannedFrame, step: i64) -> Option<PlannedFrame> {
        let number = frame.number.saturating_add(step);
        match self {
            FrameNeighbours::None => None,
            FrameNeighbours::Animation { fps } => {
                let fps = fps.unwrap_or(DEFAULT_FPS);
                // A whole frame has exactly the time of the frame list.
                let is_whole = frame.time == frame.number as f64 / fps;
                let time = if is_whole { number as f64 / fps } else { frame.time + step as f64 / fps };
                Some(PlannedFrame { number, time, ..*frame })
            }
            FrameNeighbours::Turntable { angles } => {
                let count = i64::try_from(angles.len()).ok().filter(|&count| count > 0)?;
                let number = (number - 1).rem_euclid(count) + 1;
                let angle = *angles.get(usize::try_from(number - 1).ok()?)?;
                Some(PlannedFrame { number, angle, ..*frame })
            }
            FrameNeighbours::Cameras { times } => {
                let index = i64::try_from(frame.camera?).ok()?.checked_add(step)?;
                let camera = usize::try_from(index).ok()?;
                Some(PlannedFrame { number, time: *times.get(camera)?, camera: Some(camera), ..*frame })
            }
        }
    }

    /// Returns an error if `options` have layers of flow, and there are no frames before and after.
    ///
    /// # Errors
    /// As described.
    pub fn check(&self, options: &Options) -> Result<(), SessionError> {
        let flow = options.aovs.aovs.iter().find(|aov| aov.is_flow());
        match (self, flow) {
            (FrameNeighbours::None, Some(aov)) => Err(SessionError::Option(worded!(
                "`aov {}`: flow leads from frame to frame; set `frame` or `frames`, `cameras` with times, or use turntable without `views`",
                aov.name()
            ))),
            _ => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn neighbours_are_the_frames_of_the_complete_sequence() {
        let clip = FrameNeighbours::Animation { fps: Some(24.0) };
        let seventh = PlannedFrame::at(7, 7.0 / 24.0);
        assert_eq!(clip.frame(&seventh, 1), Some(PlannedFrame::at(8, 8.0 / 24.0)));
        assert_eq!(clip.frame(&seventh, -1), Some(PlannedFrame::at(6, 6.0 / 24.0)));
        let between = PlannedFrame::at(7, 7.5 / 24.0);
        assert_eq!(clip.frame(&between, 1).map(|f| f.time), Some(7.5 / 24.0 + 1.0 / 24.0));
        let turn = FrameNeighbours::Turntable { angles: vec![0.0, 1.0, 2.0] };
        let at = |number: i64, angle: f64| PlannedFrame { angle, ..PlannedFrame::at(number, 0.5) };
        assert_eq!(turn.frame(&at(3, 2.0), 1), Some(at(1, 0.0)));
        assert_eq!(turn.frame(&at(1, 0.0), -1), Some(at(3, 2.0)));
        assert_eq!(FrameNeighbours::None.frame(&seventh, 1), None);
        let list = FrameNeighbours::Cameras { times: vec![0.5, 1.5] };
        let camera = |index: usize, time: f64| PlannedFrame {
            camera: Some(index),
            ..PlannedFrame::at(index as i64 + 1, time)
        };
        assert_eq!(list.frame(&camera(0, 0.5), 1), Some(camera(1, 1.5)));
        assert_eq!((list.frame(&camera(0, 0.5), -1), list.frame(&camera(1, 1.5), 1)), (None, None));
    }
}
