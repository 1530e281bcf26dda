//! Turntables: which frames there are, and how far round each is.

use std::f64::consts::TAU;

use glam::DVec3;

use crate::batch::FrameList;
use crate::cli::Usage;
use crate::cli::args::{DirectionArg, EaseArg, TurnArg, TurnArgs};
use crate::cli::plan::{Look, Series, Shot, Shots, dataset};
use crate::scene::{DEFAULT_VIEW_DIR, Orbit};

/// What a turntable turns.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Turning {
    /// The axis, of unit length.
    pub axis: DVec3,
    /// True: the camera goes around the scene. False: the scene turns in front of camera and lights.
    pub camera: bool,
}

pub fn turning(args: &TurnArgs) -> Turning {
    Turning { axis: args.axis.unwrap_or(DVec3::Y), camera: args.turn == TurnArg::Camera }
}

/// Places the camera at its elevation, on the side that framed views look from.
pub fn place_camera(args: &TurnArgs, look: &mut Look) -> Result<(), Usage> {
    let upright = args.axis.unwrap_or(DVec3::Y).abs() == DVec3::Y;
    if look.ground.is_some() && !upright && args.turn == TurnArg::Model {
        return Err(Usage(
            "--ground: a model that turns about this --axis would go through it: take --turn camera".into(),
        ));
    }
    if let Some(elevation) = args.elevation {
        let azimuth = libm::atan2(-DEFAULT_VIEW_DIR.x, -DEFAULT_VIEW_DIR.z);
        look.view.orbit = Some(Orbit { azimuth, elevation, distance: None });
    }
    Ok(())
}

/// The frames of a turn, at one moment of the scene.
pub fn shots(args: &TurnArgs, time: f64) -> Result<Shots, Usage> {
    let count = args.views.unwrap_or(args.count);
    let frames = args.only.clone().unwrap_or_else(|| FrameList::up_to(count));
    let frames = frames.frames();
    if let Some(beyond) = frames.iter().find(|f| !(1..=i64::from(count)).contains(f)) {
        return Err(Usage(format!("--only {beyond}: the frames are 1 to {count}")));
    }
    let share = args.chunk.map_or(0..frames.len(), |chunk| chunk.range(frames.len()));
    let shot = |&frame: &i64| match args.views {
        Some(count) => dataset::shot(frame, count, time),
        None => Shot { angle: angle(args, frame), ..Shot::at(frame, time) },
    };
    Ok(Shots::These(frames[share].iter().map(shot).collect()))
}

/// What its files depend on.
pub fn series(args: &TurnArgs) -> Series {
    let share = args.only.as_ref().map(|_| "--only").or(args.chunk.map(|_| "--chunk"));
    // A camera that goes one way sees the scene go the other.
    let turns = [
        args.turn == TurnArg::Camera,
        args.direction == DirectionArg::Cw,
        args.axis.is_some_and(|axis| axis.y < 0.0),
    ];
    let clockwise = turns.into_iter().fold(false, |clockwise, other| clockwise != other);
    Series { many: true, fps: args.fps, share, clockwise }
}

fn angle(args: &TurnArgs, frame: i64) -> f64 {
    let s = (frame - 1) as f64 / f64::from(args.count);
    let s = match args.ease {
        EaseArg::None => s,
        EaseArg::InOut => s * s * (3.0 - 2.0 * s),
    };
    let turned = match args.direction {
        DirectionArg::Ccw => TAU * s,
        DirectionArg::Cw => -TAU * s,
    };
    args.start + turned
}
