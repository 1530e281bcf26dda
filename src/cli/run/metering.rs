//! How the pictures of a scene are exposed.

use std::time::Instant;

use anyhow::Result;

use crate::cli::args::values::Exposure;
use crate::cli::plan::natural_size;
use crate::cli::run::framed::looking;
use crate::cli::run::session::{Moment, Studio};
use crate::geometry::Rgb;
use crate::integrator::{Phong, Stage};
use crate::render::{MID_GREY, Metering, meter};
use crate::scene::{Camera, ResolvedLighting, View};

/// How pictures are exposed.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Exposed {
    /// Stops.
    pub ev: f64,
    /// Multiplies the file's lights, where they are in another unit than the usual one.
    pub light_scale: Option<f32>,
}

impl Exposed {
    fn at(ev: f64) -> Exposed {
        Exposed { ev, light_scale: None }
    }
}

/// Stops: as given; 0 where the light is the lecture's own; else metered, once, at `start`, the
/// first moment of the clip, and through the first camera, whatever frame is rendered.
pub(crate) fn expose<'a>(
    studio: &Studio<'a>,
    start: &mut Moment<'a>,
    lit: &ResolvedLighting,
) -> Result<Exposed> {
    let look = studio.look;
    let automatic = match look.exposure {
        Some(Exposure::Stops(ev)) => return Ok(Exposed::at(ev)),
        Some(Exposure::Auto) => true,
        None => lit.uses_file_lights && look.stage != Stage::Color,
    };
    if !automatic {
        return Ok(Exposed::at(0.0));
    }
    let camera = camera(studio, start)?;
    studio.build(start)?;
    let since = Instant::now();
    // What the lights' unit is shows in the lights alone.
    let lights = if lit.assumes_blender_world && look.stage != Stage::Color {
        metered(studio, start, camera, Seen::Lights)?
    } else {
        None
    };
    let metered = match lights {
        Some(lights) if look.exposure.is_none() || !is_usual(&lights) => Some(lights),
        _ => metered(studio, start, camera, Seen::All)?,
    };
    studio.teller.stage("meter", since, "");
    if let Some(lights) = lights.filter(|lights| !is_usual(lights)) {
        // No file says which unit it is. All else that shines — the world, what emits, what is not lit — is
        // in none, and stays what it is beside them.
        let light_scale = look.lighting.scale * libm::exp2(lights.ev) as f32;
        let light_scale = light_scale.clamp(f32::MIN_POSITIVE, f32::MAX);
        studio.teller.note(&format!("exposure: --exposure 0 --light-scale {light_scale}"));
        return Ok(Exposed { ev: 0.0, light_scale: Some(light_scale) });
    }
    let Some(metered) = metered else {
        studio.teller.warn("nothing that the camera sees is lit: exposure 0")?;
        return Ok(Exposed::at(0.0));
    };
    // Blender's files near mid-grey are exposed as their author saw them.
    let keep = look.exposure.is_none() && start.posed.scene.source.is_blender() && is_usual(&metered);
    let ev = if keep { 0.0 } else { (metered.ev * 1e4).round() / 1e4 };
    studio.teller.note(&format!("exposure: --exposure {ev}"));
    Ok(Exposed::at(ev))
}

/// True near mid-grey.
fn is_near(metered: &Metering) -> bool {
    metered.below_mid_grey.abs() <= 4.0
}

/// True of light in the usual unit: near mid-grey, or mid-grey somewhere. A room that is dark but for the pool of a
/// lamp is dark on purpose; in another unit, 54 times too weak at least, the pool would be dark, too.
fn is_usual(light: &Metering) -> bool {
    is_near(light) || light.below_mid_grey > 0.0 && light.percentile_99 >= MID_GREY
}

/// What is metered.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Seen {
    All,
    /// What lights shine on.
    Lights,
}

/// Through which is metered, and the shape of what it sees: the camera's, not the picture's, so that thumbnails
/// are exposed as their originals.
fn camera(studio: &Studio, start: &Moment) -> Result<(Camera, f64)> {
    let scene = start.posed.scene;
    let (width, height) = natural_size(scene, (!scene.cameras.is_empty()).then_some(0));
    let view = if scene.cameras.is_empty() {
        studio.look.view.without_orbit()
    } else {
        View { clip: studio.look.view.clip, ..View::default() }
    };
    let (camera, _) = looking(studio.teller, &start.posed, || view.resolve(&start.posed, width, height))?;
    Ok((camera, f64::from(width) / f64::from(height)))
}

fn metered(
    studio: &Studio,
    start: &Moment,
    (camera, aspect): (Camera, f64),
    seen: Seen,
) -> Result<Option<Metering>> {
    let mut frame = studio.frame(start, camera)?;
    if seen == Seen::Lights {
        frame.ambient = Rgb::ZERO;
        frame.sky = None;
        frame.overrides.k_e = Some(Rgb::ZERO);
    }
    Ok(meter(&frame, &Phong { stage: studio.look.stage }, aspect, &())?)
}
