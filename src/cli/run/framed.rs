//! What all pictures of a scene have from how the start of its clip is seen, and from how large the scene is
//! all through it.

use std::time::Instant;

use anyhow::Result;
use glam::DVec3;

use crate::cli::args::values::Ao;
use crate::cli::plan::Job;
use crate::cli::run::dataset::depth_step;
use crate::cli::run::progress::Teller;
use crate::integrator::AmbientOcclusion;
use crate::scene::{Camera, Ground, PosedScene, ViewNotes};

/// Does what may ask for all that a clip takes up, and tells how long it was looked through if it did.
pub(crate) fn looking<T>(teller: &Teller, posed: &PosedScene, what: impl FnOnce() -> T) -> T {
    let (since, known) = (Instant::now(), posed.clip_sample_count().is_some());
    let done = what();
    if let Some(moments @ 1..) = posed.clip_sample_count().filter(|_| !known) {
        teller.stage("clip", since, &format!("{moments} moments"));
    }
    done
}

/// What all pictures have in common.
pub(crate) struct Framed {
    /// What sees the clip's start.
    pub camera: Camera,
    pub notes: ViewNotes,
    /// What a turntable turns about.
    pub pivot: DVec3,
    pub occlusion: Option<AmbientOcclusion>,
    pub ground: Option<Ground>,
    /// Where lights that are fixed to the camera stand in a dataset: what its views show is lit alike.
    pub rest: Option<Camera>,
    /// What a dataset's depth is counted in.
    pub depth_step: Option<f64>,
}

impl Framed {
    /// Share of the scene's diagonal that occlusion looks for things in the way.
    const NEAR: f64 = 0.25;

    pub fn of(job: &Job, posed: &PosedScene, size @ (width, height): (u32, u32)) -> Result<Framed> {
        let look = &job.look;
        let (camera, notes) = look.view.resolve(posed, width, height)?;
        // Views from all around may be framed where this one is not.
        if let Some(shot) = job.views.and_then(|views| views.shots().next()) {
            look.camera(&shot, posed, size)?;
        }
        // What is sized by the scene is so over the whole clip: no frame differs.
        let occlusion = |ao: Ao| AmbientOcclusion {
            samples: ao.samples,
            distance: ao.distance.unwrap_or_else(|| Framed::NEAR * posed.clip_bounds().extent().length()),
        };
        Ok(Framed {
            camera,
            notes,
            // What framed views are framed about, so that they hold all the way round.
            pivot: look.turning.map_or(DVec3::ZERO, |_| posed.clip_sphere().centre),
            occlusion: look.ao.map(occlusion),
            ground: look.ground.map(|kind| Ground::under(&posed.clip_bounds(), kind)),
            rest: match job.views {
                Some(_) => Some(look.view.without_orbit().resolve(posed, width, height)?.0),
                None => None,
            },
            depth_step: depth_step(job, posed, size)?,
        })
    }
}
