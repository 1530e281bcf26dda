//! Suns whose strength is not in the file.

use crate::error::Warnings;
use crate::files::escape::printable;
use blinn_scene::{BlenderVersion, Light, LightKind, Scene};

/// The versions of Blender that lose the strength, up to and without the second. Their lights have shader nodes with an
/// emission of 1, which the exporter takes for the strength of a sun if the scene's engine is Cycles.
const AFFECTED: [BlenderVersion; 2] = [BlenderVersion::new(5, 1), BlenderVersion::new(5, 3)];

/// Intensities that the exporter writes for 1 W/m²: in lux, and without a unit.
const INTENSITIES: [f32; 2] = [683.0, 1.0];

/// Names in a warning.
const MAX_NAMES: usize = 5;

/// Warns of suns in files of affected versions that have the strength that stands for any.
pub(super) fn warn_of_lost(scene: &Scene, warnings: &mut Warnings) {
    let is_affected = |version: BlenderVersion| (AFFECTED[0]..AFFECTED[1]).contains(&version);
    // The extension of blinn writes the units of lights, and the true strength.
    let has_strengths = scene.source.light_units.is_some();
    if has_strengths || !scene.source.blender_version().is_some_and(is_affected) {
        return;
    }
    let is_lost =
        |light: &&Light| light.kind == LightKind::Directional && INTENSITIES.contains(&light.intensity);
    let lost: Vec<&Light> = scene.lights.iter().filter(is_lost).collect();
    if lost.is_empty() {
        return;
    }
    let name = |light: &&Light| {
        let node = || scene.nodes.get(light.node as usize).map_or("", |node| node.name.as_str());
        let name = if light.name.is_empty() { node() } else { &light.name };
        format!("'{}'", printable(name))
    };
    let mut names: Vec<String> = lost.iter().take(MAX_NAMES).map(name).collect();
    if let more @ 1.. = lost.len().saturating_sub(MAX_NAMES) {
        names.push(format!("and {more} more"));
    }
    let (suns, have) = if lost.len() == 1 { ("sun", "has") } else { ("suns", "have") };
    let names = names.join(", ");
    warnings.add(
        "",
        format_args!(
            "{suns} {names} {have} 1 W/m², which Blender 5.1 and 5.2 write for suns of any strength if the render \
             engine is Cycles; to keep the strength, export with the extension of blinn, with the engine set to EEVEE, or \
             with Blender 5.3"
        ),
    );
}
