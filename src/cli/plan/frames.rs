//! The frames to render of each scene.

use std::sync::Arc;

use anyhow::{Result, anyhow, bail};

use super::inputs::check_only;
use crate::args::{CameraListArgs, FrameArgs, TimeArgs};
use crate::usage::UsageError;
use blinn_core::worded;
use blinn_scene::{FileFrames, Scene};
use blinn_session::{CameraList, Chunk, DEFAULT_FPS, FrameList, FrameNeighbours, MAX_FRAMES, PlannedFrame};

/// The frames before and after those of `render`, for layers of flow.
pub fn neighbours(args: &FrameArgs) -> FrameNeighbours {
    match (&args.frames, args.frame) {
        (None, None) => FrameNeighbours::None,
        _ => FrameNeighbours::Animation { fps: args.fps },
    }
}

/// The frames of each scene.
#[derive(Clone, Debug, serde::Serialize)]
pub enum FrameSet {
    /// A single image.
    Single(PlannedFrame),
    /// The same frames for every scene.
    List(Vec<PlannedFrame>),
    /// Frames of an animation.
    Clip {
        /// `None` for the file's, or the whole clip.
        frames: Option<FrameList>,
        /// Frames per second. `None` for the file's, or [`DEFAULT_FPS`].
        fps: Option<f64>,
        /// The part of the frames to render.
        chunk: Option<Chunk>,
    },
    /// The cameras of a list, numbered from 1.
    Cameras {
        cameras: Arc<CameraList>,
        /// Time in seconds of cameras without a time.
        time: f64,
        /// The numbers of the cameras to render, from --only; `None` for all.
        only: Option<FrameList>,
        /// The part of these to render.
        chunk: Option<Chunk>,
    },
}

impl FrameSet {
    /// The cameras of a list. `chunk` is the part of them to render.
    pub fn of_cameras(
        args: &CameraListArgs,
        time: &TimeArgs,
        cameras: &Arc<CameraList>,
        chunk: Option<Chunk>,
    ) -> Result<FrameSet, UsageError> {
        check_only(args.only.as_ref(), cameras.len())?;
        let time = time.time.unwrap_or(0.0);
        Ok(FrameSet::Cameras { cameras: cameras.clone(), time, only: args.only.clone(), chunk })
    }

    /// Resolves frames or times. `chunk` is the part of them to render.
    pub fn from_args(
        frames: &FrameArgs,
        time: &TimeArgs,
        chunk: Option<Chunk>,
    ) -> Result<FrameSet, UsageError> {
        let fps = frames.fps;
        match (&frames.frames, frames.frame) {
            (Some(list), _) => Ok(FrameSet::Clip { frames: list.clone(), fps, chunk }),
            (None, Some(frame)) => Ok(FrameSet::Single(frame_at(frame, fps))),
            (None, None) if frames.fps.is_some() => Err(UsageError(worded!(
                "`fps` applies only to `frame` and `frames`; add one of them or remove `fps`"
            ))),
            (None, None) => Ok(FrameSet::Single(PlannedFrame::at(1, time.time.unwrap_or(0.0)))),
        }
    }

    /// True if output files are numbered.
    pub fn is_sequence(&self) -> bool {
        !matches!(self, FrameSet::Single(_))
    }

    /// True if the length of a scene's clip, or its file, says which frames there are.
    pub fn depend_on_scene(&self) -> bool {
        matches!(self, FrameSet::Clip { frames: None, .. })
    }

    /// The frames, if they do not depend on the length of a scene's clip.
    pub fn known(&self) -> Option<Vec<PlannedFrame>> {
        if self.depend_on_scene() { None } else { self.resolve(0.0, None).ok() }
    }

    /// The frames of a scene that has `count` of them, which are `clip` if they depend on the scene. Their times are not known.
    pub fn with_count(&self, count: u64, clip: ClipFrames) -> Vec<PlannedFrame> {
        let count = i64::try_from(count).unwrap_or(i64::MAX).min(MAX_FRAMES as i64);
        let number = |i: i64| clip.first.saturating_add(clip.step.saturating_mul(i));
        self.known().unwrap_or_else(|| (0..count).map(|i| PlannedFrame::at(number(i), 0.0)).collect())
    }

    /// The frames of a scene whose clip takes `clip_duration` seconds. `file` has those of its file.
    ///
    /// # Errors
    /// More frames than a list holds.
    pub fn resolve(&self, clip_duration: f64, file: Option<&FileFrames>) -> Result<Vec<PlannedFrame>> {
        Ok(match self {
            FrameSet::Single(frame) => vec![*frame],
            FrameSet::List(frames) => frames.clone(),
            FrameSet::Clip { frames, fps, chunk } => {
                let list = match (frames, file) {
                    (Some(list), _) => list.clone(),
                    (None, Some(file)) => file_frames(file)?,
                    (None, None) => clip_frames(clip_duration, fps.unwrap_or(DEFAULT_FPS))?,
                };
                let numbers = list.frames();
                let part = chunk.map_or(0..numbers.len(), |chunk| chunk.range(numbers.len()));
                let frame = |&number: &i64| frame_at(number as f64, *fps);
                numbers[part].iter().map(frame).collect()
            }
            FrameSet::Cameras { cameras, time, only, chunk } => {
                let count = only.as_ref().map_or(cameras.len(), |list| list.frames().len());
                let part = chunk.map_or(0..count, |chunk| chunk.range(count));
                let frame = |index: usize| PlannedFrame {
                    camera: Some(index),
                    ..PlannedFrame::at(index as i64 + 1, cameras.time(index).unwrap_or(*time))
                };
                match only {
                    None => part.map(frame).collect(),
                    // Their range was checked.
                    Some(list) => {
                        list.frames()[part].iter().map(|number| frame(*number as usize - 1)).collect()
                    }
                }
            }
        })
    }
}

/// The numbers of the frames of a clip, or of a share of them: in equal steps.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ClipFrames {
    pub first: i64,
    pub step: i64,
}

impl ClipFrames {
    /// Those of a clip without frames of its own.
    pub const FROM_ONE: ClipFrames = ClipFrames { first: 1, step: 1 };

    /// The numbers of these frames.
    pub fn of(frames: &[PlannedFrame]) -> ClipFrames {
        match frames {
            [] => ClipFrames::FROM_ONE,
            [only] => ClipFrames { first: only.number, step: 1 },
            [first, second, ..] => {
                ClipFrames { first: first.number, step: second.number.saturating_sub(first.number) }
            }
        }
    }
}

/// The frame at `position`, with a rate from --fps.
fn frame_at(position: f64, fps: Option<f64>) -> PlannedFrame {
    match fps {
        Some(fps) => PlannedFrame::at(position as i64, position / fps),
        None => PlannedFrame::at_file_rate(position),
    }
}

/// The frames that a file gives for its animation; `None` for a scene without animation.
pub fn frames_of_file(scene: &Scene) -> Option<&FileFrames> {
    scene.settings.frames.as_ref().filter(|_| !scene.animations.is_empty())
}

fn file_frames(file: &FileFrames) -> Result<FrameList> {
    let FileFrames { start, end, step, .. } = file;
    FrameList::parse(&format!("{start}..{end}:{step}")).map_err(|text| {
        anyhow!(worded!(
            "`frames`: the file has the frames {} to {} in steps of {}: {}; list some",
            start,
            end,
            step,
            text
        ))
    })
}

/// All frames of a clip from 1; a single one for a scene without animation.
fn clip_frames(end: f64, fps: f64) -> Result<FrameList> {
    // Key times are f32: the time of the last frame may be slightly late.
    let last = (end * fps - 1e-3).ceil().max(1.0);
    if last > MAX_FRAMES as f64 {
        bail!(worded!(
            "`frames`: {} seconds at `fps` {} are more than {} frames; list some of them",
            end,
            fps,
            MAX_FRAMES
        ));
    }
    Ok(FrameList::up_to(last as u32))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_clip_has_all_frames_up_to_its_end() {
        let last = |end: f64| clip_frames(end, 24.0).unwrap().frames().len();
        assert_eq!((last(0.0), last(1.0), last(f64::from(10f32 / 24.0)), last(0.43)), (1, 24, 10, 11));
        assert_eq!(last(1e6 / 24.0), MAX_FRAMES);
        for (end, fps) in [(1e6 / 24.0 + 0.1, 24.0), (1.0, 1e9), (1.0, 1e300), (f64::INFINITY, 24.0)] {
            let error = clip_frames(end, fps).unwrap_err().to_string();
            assert!(error.contains("more than 1000000 frames"), "{error}");
        }
    }

    #[test]
    fn the_numbers_of_a_clip_follow_from_its_first_frames() {
        let clip = |chunk: Option<&str>| FrameSet::Clip {
            frames: None,
            fps: None,
            chunk: chunk.map(|chunk| Chunk::parse(chunk).unwrap()),
        };
        let file = FileFrames { start: 10, end: 24, step: 2, rate: 24.0 };
        for chunk in [None, Some("2/3"), Some("3/9"), Some("1/9")] {
            let set = clip(chunk);
            let frames = set.resolve(1.0, Some(&file)).unwrap();
            let numbers =
                |frames: &[PlannedFrame]| frames.iter().map(|frame| frame.number).collect::<Vec<_>>();
            let again = set.with_count(frames.len() as u64, ClipFrames::of(&frames));
            assert_eq!(numbers(&again), numbers(&frames), "{chunk:?}");
        }
        assert!(clip(None).with_count(u64::MAX, ClipFrames { first: i64::MAX, step: i64::MAX }).len() > 1);
    }

    #[test]
    fn chunks_keep_the_order_of_the_list() {
        let frames = FrameSet::Clip {
            frames: Some(FrameList::parse("10-1:-3").unwrap()),
            fps: Some(10.0),
            chunk: Some(Chunk::parse("2/2").unwrap()),
        };
        let frames = frames.known().unwrap();
        assert_eq!(frames, [PlannedFrame::at(4, 0.4), PlannedFrame::at(1, 0.1)]);
    }
}
