//! The lights of all frames of a scene, as resolved at the start of its clip.

use blinn_scene::{Lighting, ResolvedLighting, Scene, SourceFormat, View};

use crate::plan::SessionPlan;

/// Fixes light sources and ambient colour to the resolved ones for all frames.
pub fn fixed_lighting(lighting: Lighting, lit: &ResolvedLighting) -> Lighting {
    Lighting {
        sets: Some(lit.sets.clone()),
        glowing_surfaces: Some(lit.rig.glowing_surfaces),
        ambient: Some(lit.rig.ambient),
        file_environment: Some(lit.uses_file_environment),
        ..lighting
    }
}

/// Returns true if a glTF file of Blender has neither camera nor lights, and the options give none.
pub fn uses_own_view_and_lights(plan: &SessionPlan, scene: &Scene) -> bool {
    let is_blender = scene.source.format == SourceFormat::Gltf && scene.source.is_blender();
    let has_light =
        !(scene.lights.is_empty() && scene.area_lights.is_empty() && scene.lost_lights.is_empty());
    let View { camera, complete, view_point, orbit, .. } = &plan.options.view;
    let Lighting { sets, user_lights, environment, .. } = &plan.options.lighting;
    is_blender
        && !has_light
        && scene.cameras.is_empty()
        && scene.environment.is_none()
        && plan.cameras.is_none()
        && plan.dataset.is_none()
        && (camera.is_none() && complete.is_none() && view_point.is_none() && orbit.is_none())
        && (sets.is_none() && user_lights.is_empty() && environment.is_none())
}
