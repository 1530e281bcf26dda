//! How the pictures of a scene are exposed.

use std::time::Instant;

use anyhow::Result;

use super::job::natural_size;
use super::studio::{Moment, Studio};
use super::values::Exposure;
use crate::geometry::Rgb;
use crate::integrator::{Frame, Phong, Stage};
use crate::render::{Metering, meter};
use crate::scene::{Lit, View};

/// How pictures are exposed.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Exposed {
    /// Stops.
    pub ev: f64,
    /// Takes the place of the ambient colour.
    pub ambient: Option<Rgb>,
}

impl Exposed {
    fn at(ev: f64) -> Exposed {
        Exposed { ev, ambient: None }
    }
}

/// Stops: as given; 0 where the light is the lecture's own; else metered, once, at `start`, the
/// first moment of the clip, and through the first camera, whatever frame is rendered.
pub(super) fn expose<'a>(studio: &Studio<'a>, start: &mut Moment<'a>, lit: &Lit) -> Result<Exposed> {
    let look = studio.look;
    let automatic = match look.exposure {
        Some(Exposure::Stops(ev)) => return Ok(Exposed::at(ev)),
        Some(Exposure::Auto) => true,
        None => lit.by_file && look.stage != Stage::Color,
    };
    if !automatic {
        return Ok(Exposed::at(0.0));
    }
    studio.build(start)?;
    let since = Instant::now();
    let metered = metered(studio, start, lit.assumed)?;
    studio.teller.stage("meter", since, "");
    let Some(metered) = metered else {
        studio.teller.warn("nothing that the camera sees is lit: exposure 0")?;
        return Ok(Exposed::at(0.0));
    };
    // Blender's files near mid-grey are exposed as their author saw them.
    let near = metered.below_mid_grey.abs() <= 4.0;
    let keep = look.exposure.is_none() && start.posed.scene.source.is_blender() && near;
    let ev = if keep { 0.0 } else { (metered.ev * 1e4).round() / 1e4 };
    if near || !lit.assumed {
        studio.teller.note(&format!("exposure: --exposure {ev}"));
        return Ok(Exposed::at(ev));
    }
    // Far from it, the lights are in another unit than the usual one — no file says which — and the
    // world, which is in none, stays what it is beside them.
    let ambient = lit.rig.ambient * libm::exp2(-ev) as f32;
    let [r, g, b] = ambient.to_array();
    studio.teller.note(&format!("exposure: --exposure {ev} --ambient {r},{g},{b}"));
    Ok(Exposed { ev, ambient: Some(ambient) })
}

/// `assumed`: what the lights' unit is shows in the lights alone.
fn metered(studio: &Studio, start: &Moment, assumed: bool) -> Result<Option<Metering>> {
    let scene = start.posed.scene;
    // The shape is the camera's, not the picture's: thumbnails are exposed as their originals.
    let (width, height) = natural_size(scene, (!scene.cameras.is_empty()).then_some(0));
    let aspect = f64::from(width) / f64::from(height);
    let view = if scene.cameras.is_empty() {
        studio.look.view.at_rest()
    } else {
        View { clip: studio.look.view.clip, ..View::default() }
    };
    let (camera, _) = view.resolve(&start.posed, width, height)?;
    let frame = studio.frame(start, camera)?;
    let integrator = Phong { stage: studio.look.stage };
    if assumed {
        let unlit = Frame { ambient: Rgb::ZERO, ..frame.clone() };
        if let Some(metered) = meter(&unlit, &integrator, aspect, &())? {
            return Ok(Some(metered));
        }
    }
    Ok(meter(&frame, &integrator, aspect, &())?)
}
