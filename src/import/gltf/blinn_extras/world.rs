//! The world: a constant radiance, or an equirectangular picture in a buffer view.

use glam::{DQuat, Vec3};

use super::Members;
use crate::error::{LoadError, Warnings};
use crate::gltf::document::Document;
use crate::image::environment::decode_environment;
use blinn_scene::UpAxis;
use blinn_scene::{FileEnvironment, unit_quaternion};

/// Largest radiance.
const MAX: f64 = f32::MAX as f64;

/// Reads a world; `None`, with a warning, if its picture cannot be read.
///
/// # Errors
/// The file exceeds a limit.
pub fn read(
    doc: &Document<'_>,
    world: &Members,
    up: UpAxis,
    warnings: &mut Warnings,
) -> Result<Option<FileEnvironment>, LoadError> {
    if let Some(color) = world.numbers::<3>("color", 0.0..=MAX, warnings) {
        return Ok(Some(FileEnvironment::uniform(Vec3::from(color.map(|v| v as f32)))));
    }
    let Some(view) = world.whole("bufferView", 0..=u32::MAX.into(), warnings) else { return Ok(None) };
    let decoded = match doc.buffer_view(view as usize) {
        Ok(view) => decode_environment(view.bytes, &doc.budget, doc.limits)?,
        Err(error) => Err(error.to_string()),
    };
    let map = match decoded {
        Ok(map) => map,
        Err(cause) => {
            let place = format!("{}.bufferView", world.place);
            warnings.add(place, format_args!("{cause}; the world is missing"));
            return Ok(None);
        }
    };
    let strength = world.number("strength", 0.0..=MAX, warnings).unwrap_or(1.0);
    let rotation = world.numbers::<4>("rotation", -1.0..=1.0, warnings);
    Ok(Some(FileEnvironment {
        map,
        intensity: strength as f32,
        rotation: rotation.map_or(DQuat::IDENTITY, |q| unit_quaternion(q.map(|component| component as f32))),
        axes: up.rotation(),
    }))
}
