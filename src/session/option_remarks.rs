//! Remarks on options that have no effect on a scene, or not the one that was probably meant.

use glam::Vec3;

use crate::error::SessionError;
use crate::light_hints::shows_surroundings;
use crate::log::SessionLog;
use crate::notice::Notice;
use crate::options::Options;
use crate::plan::SessionPlan;
use crate::round_sizes::RoundWidth;
use blinn_core::worded;
use blinn_render::integrator::{MaterialOverrides, Stage};
use blinn_scene::{GroundKind, LightSet, Material, PosedScene, ResolvedLighting};

/// Warns of options without effect, and hints at those that are missing.
pub(crate) fn remark_on_options(
    options: &Options,
    lit: &ResolvedLighting,
    posed: &PosedScene,
    log: &dyn SessionLog,
) -> Result<(), SessionError> {
    let is_emissive =
        |material: &Material| material.emission.factor * material.emission_strength != Vec3::ZERO;
    let is_lightless = lit.rig.is_dark() && !posed.materials.iter().any(is_emissive);
    if asks_for_file_lights(options) && options.stage != Stage::Color && is_lightless {
        log.warn(Notice::NoLights { lost_lights: posed.scene.lost_light_names() })?;
    }
    if options.ground == Some(GroundKind::ShadowCatcher)
        && lit.rig.lights.is_empty()
        && lit.rig.area_lights.is_empty()
        && !lit.rig.glowing_surfaces
        && options.ao.is_none()
    {
        log.warn(Notice::NothingCastsShadows)?;
    }
    if lit.rig.environment.is_none()
        && !is_lightless
        && (options.stage == Stage::Phong && options.bounces > 0)
        && options.overrides == MaterialOverrides::default()
        && posed.materials.iter().any(shows_surroundings)
    {
        log.hint(Notice::NothingToReflect);
    }
    if options.caustics == Some(true) && options.indirect.unwrap_or(0) == 0 {
        log.warn(Notice::CausticsAlone)?;
    }
    if let Some(large) = large_rounds(options, posed) {
        log.hint(large);
    }
    Ok(())
}

/// Warns of options of an environment where none lights the scene.
///
/// # Errors
/// Such an environment is the background.
pub(crate) fn check_environment(
    plan: &SessionPlan,
    lit: &ResolvedLighting,
    log: &dyn SessionLog,
) -> Result<(), SessionError> {
    let options = &plan.options;
    if lit.rig.sky.is_some() {
        return Ok(());
    }
    if options.environment_blur().is_some() {
        return Err(SessionError::Option(worded!(
            "`background hdri`: no environment lights the scene; add `hdri FILE`, `hdri studio` or `hdri sky`"
        )));
    }
    if options.lighting.adjusts_environment() {
        log.warn(Notice::NoEnvironment { options: "`hdri-rotate` and `hdri-strength` have" })?;
    }
    if plan.dataset.is_some_and(|dataset| dataset.sampling.random_environment) {
        log.warn(Notice::NoEnvironment { options: "`random-hdri` has" })?;
    }
    Ok(())
}

/// True if the lights of the file are named, and not only the default.
pub(crate) fn asks_for_file_lights(options: &Options) -> bool {
    options.lighting.sets.as_ref().is_some_and(|sets| sets.contains(&LightSet::File))
}

/// Remarks on a size in metres that is as large as the scene: probably pixels were meant.
fn large_rounds(options: &Options, posed: &PosedScene) -> Option<Notice> {
    let scene = posed.scene;
    let sizes = [
        ("point-size", options.point_size, scene.instanced_point_count()),
        ("line-width", options.line_width, scene.instanced_line_count()),
    ];
    sizes.into_iter().find_map(|(option, width, count)| match width {
        RoundWidth::Metres(width) if count > 0 => {
            let radius = posed.bounding_sphere().radius;
            (width >= radius).then_some(Notice::LargeRounds { option, radius })
        }
        _ => None,
    })
}
