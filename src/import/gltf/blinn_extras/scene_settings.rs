//! Render settings of a scene.

use super::{Members, world};
use crate::error::{LoadError, Warnings};
use crate::gltf::document::Document;
use blinn_scene::UpAxis;
use blinn_scene::{FileEnvironment, FileFrames, FileSettings, GAMMAS, LightUnits, PictureRegion};

/// Sides of pictures, as for the option `size`.
const MAX_SIDE: i64 = 65_536;
/// Pixels of pictures, as for the option `size`.
const MAX_PIXELS: i64 = 1 << 29;
/// Frames of Blender are at most this far from 0.
const MAX_FRAME: i64 = 1_048_574;
/// Stops of exposures.
const MAX_STOPS: f64 = 32.0;
/// Diffuse bounces, as for the option `indirect`.
const MAX_BOUNCES: i64 = 64;

/// `extras.blinn` of a scene.
pub struct SceneExtras(Option<Members>);

impl SceneExtras {
    /// Reads that of scene `index`.
    pub fn of(doc: &Document<'_>, index: Option<usize>, warnings: &mut Warnings) -> SceneExtras {
        let scene = index.and_then(|index| doc.root().scenes.get(index).zip(Some(index)));
        SceneExtras(scene.and_then(|(scene, index)| {
            let extras = scene.extras.as_ref().map(|raw| raw.get());
            Members::of(extras, format_args!("scenes[{index}]"), warnings)
        }))
    }

    /// Returns the unit of the light intensities.
    pub fn light_units(&self, warnings: &mut Warnings) -> Option<LightUnits> {
        self.0.as_ref()?.get("lightUnits", warnings, |value| match value.as_str()? {
            "standard" => Some(LightUnits::Standard),
            "unitless" => Some(LightUnits::Unitless),
            "raw" => Some(LightUnits::Raw),
            _ => None,
        })
    }

    /// Returns the world.
    ///
    /// # Errors
    /// The file exceeds a limit.
    pub fn world(
        &self,
        doc: &Document<'_>,
        up: UpAxis,
        warnings: &mut Warnings,
    ) -> Result<Option<FileEnvironment>, LoadError> {
        match self.0.as_ref().and_then(|members| members.child("world", warnings)) {
            Some(world) => world::read(doc, &world, up, warnings),
            None => Ok(None),
        }
    }

    /// Returns the render settings.
    pub fn settings(&self, warnings: &mut Warnings) -> FileSettings {
        let Some(members) = &self.0 else { return FileSettings::default() };
        let view = members.child("view", warnings);
        let exposure = view.as_ref().and_then(|view| exposure(view, warnings));
        FileSettings {
            size: size(members, warnings),
            pixel_aspect: members.number("pixelAspect", 0.01..=100.0, warnings),
            region: members.child("region", warnings).and_then(|region| picture_region(&region, warnings)),
            frames: members.child("frames", warnings).and_then(|frames| file_frames(&frames, warnings)),
            view_transform: view.as_ref().and_then(|view| view.text("transform", warnings)),
            look: view.as_ref().and_then(|view| view.text("look", warnings)),
            gamma: view.as_ref().and_then(|view| view.number("gamma", GAMMAS, warnings)),
            exposure,
            film_transparent: members.flag("filmTransparent", warnings),
            indirect: members.whole("indirect", 0..=MAX_BOUNCES, warnings).map(|bounces| bounces as u8),
            caustics: members.flag("caustics", warnings),
            camera: None,
        }
    }
}

/// Width and height, of which a percentage is rendered.
fn size(members: &Members, warnings: &mut Warnings) -> Option<(u32, u32)> {
    let [width, height] =
        members.numbers::<2>("resolution", 1.0..=MAX_SIDE as f64, warnings)?.map(|v| v as i64);
    let percentage = members.whole("percentage", 1..=32_767, warnings).unwrap_or(100);
    // Blender rounds down.
    let side = |side: i64| (side * percentage / 100).max(1);
    let (width, height) = (side(width), side(height));
    if width > MAX_SIDE || height > MAX_SIDE || width * height > MAX_PIXELS {
        let message = format!("ignored size of {width}x{height} pixels, which is too large");
        warnings.add(format_args!("{}.resolution", members.place), message);
        return None;
    }
    Some((width as u32, height as u32))
}

fn picture_region(members: &Members, warnings: &mut Warnings) -> Option<PictureRegion> {
    let mut corner =
        |name| Some(members.numbers::<2>(name, 0.0..=1.0, warnings)?.map(|fraction| fraction as f32));
    let (min, max) = (corner("min")?, corner("max")?);
    if min[0] < max[0] && min[1] < max[1] {
        return Some(PictureRegion { min, max });
    }
    warnings.add(&members.place, "ignored region without area: min must be less than max");
    None
}

fn file_frames(members: &Members, warnings: &mut Warnings) -> Option<FileFrames> {
    let mut frame = |name| members.whole(name, -MAX_FRAME..=MAX_FRAME, warnings);
    let (start, end) = (frame("start"), frame("end"));
    let step = members.whole("step", 1..=MAX_FRAME, warnings).unwrap_or(1);
    let rate = members.number("rate", 1e-3..=1e6, warnings)?;
    let (start, end) = start.zip(end)?;
    if end < start {
        warnings.add(&members.place, format_args!("ignored frames {start} to {end}"));
        return None;
    }
    Some(FileFrames { start, end, step, rate })
}

/// The exposure in stops: that of the view and that of the film, a factor.
fn exposure(view: &Members, warnings: &mut Warnings) -> Option<f64> {
    let film = view.number("filmExposure", f64::MIN_POSITIVE..=1e9, warnings).map(libm::log2);
    let stops = view.number("exposure", -MAX_STOPS..=MAX_STOPS, warnings);
    (film.is_some() || stops.is_some()).then(|| film.unwrap_or(0.0) + stops.unwrap_or(0.0))
}
