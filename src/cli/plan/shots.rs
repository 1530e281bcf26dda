//! Which pictures are made of each scene.

use anyhow::{Result, bail};

use crate::batch::{Chunk, FrameList, MAX_FRAMES};
use crate::cli::Usage;
use crate::cli::args::{MomentArgs, TimeArgs};
use crate::scene::Orbit;

/// Frames a second, where nothing else is said.
pub const USUAL_FPS: f64 = 24.0;

/// One picture of a scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shot {
    /// Its number.
    pub frame: i64,
    /// The moment that it shows, in seconds.
    pub time: f64,
    /// How far a turntable has turned, in radians.
    pub angle: f64,
    /// From where around the scene it is seen, in a dataset.
    pub orbit: Option<Orbit>,
}

impl Shot {
    /// A frame at a moment, of nothing that turns.
    pub fn at(frame: i64, time: f64) -> Shot {
        Shot { frame, time, angle: 0.0, orbit: None }
    }
}

/// The pictures of each scene.
#[derive(Clone, Debug)]
pub enum Shots {
    /// One.
    One(Shot),
    /// Those, of every scene.
    These(Vec<Shot>),
    /// One for each frame of an animation.
    Clip {
        /// Which; `None` for all of the clip.
        frames: Option<FrameList>,
        /// Frames a second.
        fps: f64,
        /// Which share of them.
        chunk: Option<Chunk>,
    },
}

impl Shots {
    pub fn of_clip(time: &TimeArgs, moment: &MomentArgs) -> std::result::Result<Shots, Usage> {
        let fps = time.fps.unwrap_or(USUAL_FPS);
        match (&time.frames, time.frame) {
            (Some(frames), _) => Ok(Shots::Clip { frames: frames.clone(), fps, chunk: time.chunk }),
            (None, Some(frame)) => Ok(Shots::One(Shot::at(frame as i64, frame / fps))),
            (None, None) if time.fps.is_some() => {
                Err(Usage("--fps counts frames: add --frame N or --frames, or leave it out".into()))
            }
            (None, None) => Ok(Shots::One(Shot::at(1, moment.time.unwrap_or(0.0)))),
        }
    }

    /// Whether files are numbered.
    pub fn are_many(&self) -> bool {
        !matches!(self, Shots::One(_))
    }

    /// The pictures, if that needs no look at the scene.
    pub fn known(&self) -> Option<Vec<Shot>> {
        match self {
            Shots::Clip { frames: None, .. } => None,
            _ => self.of(0.0).ok(),
        }
    }

    /// The pictures of a scene whose clip ends after so many seconds.
    ///
    /// # Errors
    /// More frames than a list holds.
    pub fn of(&self, clip_duration: f64) -> Result<Vec<Shot>> {
        Ok(match self {
            Shots::One(shot) => vec![*shot],
            Shots::These(shots) => shots.clone(),
            Shots::Clip { frames, fps, chunk } => {
                let whole = frames.clone().map_or_else(|| whole_clip(clip_duration, *fps), Ok)?;
                let frames = whole.frames();
                let share = chunk.map_or(0..frames.len(), |chunk| chunk.range(frames.len()));
                let shot = |&frame: &i64| Shot::at(frame, frame as f64 / fps);
                frames[share].iter().map(shot).collect()
            }
        })
    }
}

/// Frames from 1 until the clip has ended; one where nothing moves.
fn whole_clip(end: f64, fps: f64) -> Result<FrameList> {
    // Key times are f32: the last frame's may lie a little late.
    let last = (end * fps - 1e-3).ceil().max(1.0);
    if last > MAX_FRAMES as f64 {
        bail!("--frames: {end} seconds at --fps {fps} are more than {MAX_FRAMES} frames: list some of them");
    }
    Ok(FrameList::up_to(last as u32))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_clip_is_all_frames_up_to_its_end() {
        let last = |end: f64| whole_clip(end, 24.0).unwrap().frames().len();
        assert_eq!((last(0.0), last(1.0), last(f64::from(10f32 / 24.0)), last(0.43)), (1, 24, 10, 11));
        assert_eq!(last(1e6 / 24.0), MAX_FRAMES);
        for (end, fps) in [(1e6 / 24.0 + 0.1, 24.0), (1.0, 1e9), (1.0, 1e300), (f64::INFINITY, 24.0)] {
            let told = whole_clip(end, fps).unwrap_err().to_string();
            assert!(told.contains("more than 1000000 frames"), "{told}");
        }
    }

    #[test]
    fn shares_are_of_the_list_as_given() {
        let shots = Shots::Clip {
            frames: Some(FrameList::parse("10-1:-3").unwrap()),
            fps: 10.0,
            chunk: Some(Chunk::parse("2/2").unwrap()),
        };
        let shots = shots.known().unwrap();
        assert_eq!(shots, [Shot::at(4, 0.4), Shot::at(1, 0.1)]);
    }
}
