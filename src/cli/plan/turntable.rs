//! The frames and the rotation of a turntable.

use std::f64::consts::TAU;

use glam::DVec3;

use super::frames::FrameSet;
use super::sequence_info::SequenceInfo;
use crate::args::{DirectionArg, EaseArg, TurnArg, TurnArgs};
use crate::usage::UsageError;
use blinn_core::worded;
use blinn_scene::{DEFAULT_VIEW_DIR, Orbit};
use blinn_session::{
    Chunk, DatasetPlan, FrameList, FrameNeighbours, Options, PlannedFrame, TurntableRotation,
};

pub fn rotation(args: &TurnArgs) -> TurntableRotation {
    TurntableRotation { axis: args.axis.unwrap_or(DVec3::Y), rotates_camera: args.turn == TurnArg::Camera }
}

/// Places the camera at --elevation, with the azimuth of framed views.
pub fn place_camera(args: &TurnArgs, options: &mut Options) -> Result<(), UsageError> {
    let is_upright = args.axis.unwrap_or(DVec3::Y).abs() == DVec3::Y;
    if options.ground.is_some() && !is_upright && args.turn == TurnArg::Model {
        return Err(UsageError(worded!(
            "`ground`: a model that rotates about this `axis` would go through the ground; use `turn` camera"
        )));
    }
    if let Some(elevation) = args.elevation {
        let azimuth = libm::atan2(-DEFAULT_VIEW_DIR.x, -DEFAULT_VIEW_DIR.z);
        options.view.orbit = Some(Orbit { azimuth, elevation, distance: None });
    }
    Ok(())
}

/// Returns an error for an option of datasets without --views. The parser would let them pass beside --count and others that
/// exclude --views.
pub fn check_dataset_options(args: &TurnArgs) -> Result<(), UsageError> {
    let sampling = &args.sampling;
    let options = [
        ("dataset", args.dataset.is_some()),
        ("world-up", args.world_up.is_some()),
        ("on", sampling.on.is_some()),
        ("elevation-range", sampling.elevation_range.is_some()),
        ("distance-range", sampling.distance_range.is_some()),
        ("roll", sampling.roll.is_some()),
        ("look-at-jitter", sampling.look_at_jitter.is_some()),
        ("random-lights", sampling.random_lights),
        ("random-hdri", sampling.random_hdri),
        ("random-per-scene", sampling.random_per_scene),
        ("normalize", sampling.normalize.is_some()),
    ];
    match options.iter().find(|(_, is_given)| *is_given && args.views.is_none()) {
        Some((option, _)) => Err(UsageError(worded!("`{}` applies only to datasets; add `views` N", option))),
        None => Ok(()),
    }
}

/// The frames of a turn, all at the same time of the animation. `chunk` is the part of them to render.
pub fn frames(
    args: &TurnArgs,
    time: f64,
    dataset: Option<&DatasetPlan>,
    chunk: Option<Chunk>,
) -> Result<FrameSet, UsageError> {
    let count = args.views.unwrap_or(args.count);
    let list = args.only.clone().unwrap_or_else(|| FrameList::up_to(count));
    let numbers = list.frames();
    if let Some(outside) = numbers.iter().find(|n| !(1..=i64::from(count)).contains(n)) {
        return Err(UsageError(worded!("`only` {}: the frames are 1 to {}", outside, count)));
    }
    let part = chunk.map_or(0..numbers.len(), |chunk| chunk.range(numbers.len()));
    if let Some(dataset) = dataset {
        return Ok(FrameSet::List(dataset.views(numbers[part].iter().copied()).collect()));
    }
    let frame = |&number: &i64| PlannedFrame { angle: angle(args, number), ..PlannedFrame::at(number, time) };
    Ok(FrameSet::List(numbers[part].iter().map(frame).collect()))
}

/// The frames before and after each frame. The views of a dataset follow no order.
pub fn neighbours(args: &TurnArgs) -> FrameNeighbours {
    match args.views {
        Some(_) => FrameNeighbours::None,
        None => FrameNeighbours::Turntable {
            angles: (1..=i64::from(args.count)).map(|number| angle(args, number)).collect(),
        },
    }
}

pub fn sequence_info(args: &TurnArgs, chunk: Option<Chunk>) -> SequenceInfo {
    let subset_option = args.only.as_ref().map(|_| "only").or(chunk.map(|_| "chunk"));
    // A camera that rotates one way sees the scene rotate the other way.
    let reversals = [
        args.turn == TurnArg::Camera,
        args.direction == DirectionArg::Cw,
        args.axis.is_some_and(|axis| axis.y < 0.0),
    ];
    let clockwise = reversals.into_iter().fold(false, |clockwise, reversed| clockwise != reversed);
    SequenceInfo { is_sequence: true, fps: args.fps, subset_option, clockwise, ..SequenceInfo::default() }
}

/// Rotation of a frame in radians.
fn angle(args: &TurnArgs, number: i64) -> f64 {
    let s = (number - 1) as f64 / f64::from(args.count);
    let s = match args.ease {
        EaseArg::None => s,
        EaseArg::InOut => s * s * (3.0 - 2.0 * s),
    };
    let rotation = match args.direction {
        DirectionArg::Ccw => TAU * s,
        DirectionArg::Cw => -TAU * s,
    };
    args.start + rotation
}
