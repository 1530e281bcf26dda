//! Resolves light options into lighting settings, and reports those that would have no effect.

use crate::args::values::HdriArg;
use crate::args::{GroundArg, LightArgs, UnitsArg};
use crate::usage::UsageError;
use blinn_core::geometry::Rgb;
use blinn_import::{Limits, load_environment};
use blinn_render::integrator::Stage;
use blinn_scene::{Environment, LightSet, LightUnits, Lighting};
use blinn_session::load_cached;

/// Resolves the lights. The environment is made within `limits`, by that many threads.
pub(super) fn lighting(
    args: &LightArgs,
    limits: &Limits,
    threads: Option<u16>,
) -> Result<Lighting, UsageError> {
    let make = |hdri: &HdriArg| {
        let make = || match hdri {
            HdriArg::File(path) => load_cached(path, limits.file_bytes, || load_environment(path, limits)),
            HdriArg::Studio => Ok(Environment::studio()),
            HdriArg::Sky => Ok(Environment::sky()),
        };
        // The process's own pool of threads starts when the command line has been read.
        match rayon::ThreadPoolBuilder::new().num_threads(threads.map_or(0, usize::from)).build() {
            Ok(pool) => pool.install(make),
            Err(_) => make(),
        }
    };
    let environment = args.hdri.as_ref().map(make).transpose();
    Ok(Lighting {
        sets: args.lights.clone(),
        user_lights: args.point_light.iter().chain(&args.sun).copied().collect(),
        units: match args.light_units {
            UnitsArg::Auto => LightUnits::Auto,
            UnitsArg::Standard => LightUnits::Standard,
            UnitsArg::Unitless => LightUnits::Unitless,
            UnitsArg::Raw => LightUnits::Raw,
        },
        scale: args.light_scale.unwrap_or(1.0) as f32,
        ambient: args.ambient,
        boost_ambient: args.ao.is_some(),
        environment: environment.map_err(|e| UsageError(format!("--hdri: {e}")))?,
        environment_rotation: args.hdri_rotate.unwrap_or(0.0),
        environment_strength: args.hdri_strength.unwrap_or(1.0) as f32,
        radius: args.light_radius.map(|radius| radius as f32),
    })
}

/// Returns an error for light options that would have no effect.
pub(super) fn check_effects(args: &LightArgs, stage: Stage) -> Result<(), UsageError> {
    if let Some(sources) = args.lights.as_ref().filter(|sources| !sources.contains(&LightSet::File))
        && args.light_scale.is_some()
    {
        let value = if sources.is_empty() { "none" } else { "without file" };
        return Err(UsageError(format!(
            "--light-scale applies to the file's lights, which --lights {value} disables; remove one of them"
        )));
    }
    for (flag, is_set) in [("--ao", args.ao.is_some()), ("--hdri", args.hdri.is_some())] {
        if is_set && stage != Stage::Phong {
            return Err(UsageError(format!(
                "{flag} changes the ambient term, which only --integrator phong has; remove one of them"
            )));
        }
    }
    if args.ao.is_some() && args.ambient == Some(Rgb::ZERO) {
        return Err(UsageError("--ao has no effect with --ambient 0,0,0; remove one of them".into()));
    }
    let Some(cause) = no_shadows_cause(args, stage) else { return Ok(()) };
    if args.light_radius.is_some_and(|radius| radius > 0.0) {
        return Err(UsageError(format!(
            "--light-radius softens shadows, which {cause} disables; remove one of them"
        )));
    }
    if args.ground == Some(GroundArg::Shadow) && args.ao.is_none() {
        return Err(UsageError(format!(
            "--ground shadow shows only shadows, which {cause} disables; use --ground plane"
        )));
    }
    Ok(())
}

/// The option that disables all shadows, if any.
fn no_shadows_cause(args: &LightArgs, stage: Stage) -> Option<&'static str> {
    let has_no_lights =
        args.lights.as_ref().is_some_and(Vec::is_empty) && args.point_light.is_empty() && args.sun.is_empty();
    match stage {
        Stage::Color => Some("--integrator color"),
        Stage::Diffuse => Some("--integrator diffuse"),
        _ if args.no_shadows => Some("--no-shadows"),
        _ if has_no_lights => Some("--lights none"),
        _ => None,
    }
}
