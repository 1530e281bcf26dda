//! Resolves arguments into options of images.

mod camera;
mod lights;

use crate::args::values::BackgroundArg;
use crate::args::{
    CommonArgs, CullArg, FilterArg, FormatArg, GlassArg, GroundArg, ImageArgs, IntegratorArg, ProcessArgs,
    RenderOptionArgs, SceneArgs, ShadingArgs, UpArg, ViewArg,
};
use crate::usage::UsageError;
use blinn_core::cancellation::CancelToken;
use blinn_core::geometry::Rgb;
use blinn_import::{GlassMode, Limits, LoadOptions, SceneChoice, UpAxis};
use blinn_render::PixelFilter;
use blinn_render::display::{Background, ViewTransform};
use blinn_render::integrator::{MaterialOverrides, Stage};
use blinn_scene::{GroundKind, Selection, SourceFormat};
use blinn_session::{BackFaceCulling, DEFAULT_BACKGROUND, Options, load_limits};

/// Resolves arguments. The limits of the process apply to the environment map.
pub fn options_from_args(
    args: &RenderOptionArgs,
    scene: &SceneArgs,
    animation: Option<&str>,
    common: &CommonArgs,
    process: &ProcessArgs,
) -> Result<Options, UsageError> {
    let RenderOptionArgs { image, camera, light, shading } = args;
    let stage = stage(shading.integrator);
    lights::check_effects(light, stage)?;
    check_image(image)?;
    check_background(image, stage)?;
    Ok(Options {
        load: load_options(scene, common),
        selection: Selection { only: shading.only_objects.clone(), hide: shading.hide.clone() },
        animation: animation.map(str::to_string),
        size: image.size,
        max_size: image.max_size,
        samples: image.samples,
        filter: pixel_filter(image.filter),
        seed: image.seed,
        adaptive: image.adaptive,
        crop: image.crop,
        background: background(image, stage),
        environment_background: match image.background {
            Some(BackgroundArg::Hdri) => Some(image.background_blur.unwrap_or(0.0)),
            _ => None,
        },
        exposure: image.exposure,
        view_transform: view_transform(image.view),
        aovs: image.aov.clone().unwrap_or_default(),
        depth_unit: image.depth_unit,
        view: camera::view(camera)?,
        lighting: lights::lighting(light, &load_limits(process.max_memory), process.threads)?,
        shadows: !light.no_shadows,
        ao: light.ao,
        ground: light.ground.map(|ground| match ground {
            GroundArg::Plane => GroundKind::Plane,
            GroundArg::Shadow => GroundKind::ShadowCatcher,
        }),
        stage,
        overrides: overrides(shading),
        bounces: shading.bounces,
        cull: match shading.cull {
            CullArg::Auto => BackFaceCulling::SingleSided,
            CullArg::Back => BackFaceCulling::All,
            CullArg::Off => BackFaceCulling::Off,
        },
        normalize: None,
        rotation: None,
    })
}

/// Options for reading scene files. Fingerprints of images hash them, so the limits are defaults on every machine.
pub fn load_options(args: &SceneArgs, common: &CommonArgs) -> LoadOptions {
    LoadOptions {
        limits: Limits::default(),
        cancel: CancelToken::default(),
        format: args.format.map(|format| match format {
            FormatArg::Gltf | FormatArg::Glb => SourceFormat::Gltf,
            FormatArg::Obj => SourceFormat::Obj,
        }),
        scene: args.scene.clone().map_or(SceneChoice::Default, SceneChoice::Named),
        variant: args.variant.clone(),
        up: match args.up {
            UpArg::Y => UpAxis::Y,
            UpArg::Z => UpAxis::Z,
        },
        normals: args.smooth.unwrap_or_default(),
        glass: match args.glass {
            GlassArg::Auto => GlassMode::Auto,
            GlassArg::Thin => GlassMode::Thin,
            GlassArg::Solid => GlassMode::Solid,
        },
        allow_outside: common.allow_outside,
    }
}

fn stage(integrator: IntegratorArg) -> Stage {
    match integrator {
        IntegratorArg::Phong => Stage::Phong,
        IntegratorArg::Shadow => Stage::Shadow,
        IntegratorArg::Diffuse => Stage::Diffuse,
        IntegratorArg::Color => Stage::Color,
    }
}

fn check_image(args: &ImageArgs) -> Result<(), UsageError> {
    if let (Some(crop), Some((width, height))) = (args.crop, args.size)
        && (crop.x + crop.width > width || crop.y + crop.height > height)
    {
        return Err(UsageError(format!("--crop reaches beyond the image of {width}x{height} pixels")));
    }
    if args.adaptive.is_some() && args.samples <= 4 {
        return Err(UsageError("--adaptive needs more than 4 samples; set --samples 16".into()));
    }
    Ok(())
}

fn check_background(image: &ImageArgs, stage: Stage) -> Result<(), UsageError> {
    let shows_environment = image.background == Some(BackgroundArg::Hdri);
    if shows_environment && stage != Stage::Phong {
        return Err(UsageError(
            "--background hdri shows the environment, which only --integrator phong has; remove one of them"
                .into(),
        ));
    }
    if image.background_blur.is_some() && !shows_environment {
        return Err(UsageError("--background-blur applies only to --background hdri".into()));
    }
    Ok(())
}

fn pixel_filter(filter: FilterArg) -> PixelFilter {
    match filter {
        FilterArg::Box => PixelFilter::Box,
        FilterArg::Tent => PixelFilter::Tent,
        FilterArg::Gaussian => PixelFilter::Gaussian,
        FilterArg::BlackmanHarris => PixelFilter::BlackmanHarris,
    }
}

fn background(args: &ImageArgs, stage: Stage) -> Background {
    if args.no_background {
        return Background::Transparent;
    }
    match (args.background, stage) {
        (Some(BackgroundArg::Fixed(background)), _) => background,
        // The environment covers it.
        (Some(BackgroundArg::Hdri), _) => Background::Color(Rgb::ZERO),
        // As in the lecture: the colour of the surface, else black.
        (None, Stage::Color) => Background::Color(Rgb::ZERO),
        (None, _) => DEFAULT_BACKGROUND,
    }
}

fn view_transform(view: ViewArg) -> Option<ViewTransform> {
    match view {
        ViewArg::Auto => None,
        ViewArg::Standard => Some(ViewTransform::Standard),
        ViewArg::Agx => Some(ViewTransform::Agx),
        ViewArg::PbrNeutral => Some(ViewTransform::PbrNeutral),
        ViewArg::Raw => Some(ViewTransform::Raw),
    }
}

fn overrides(args: &ShadingArgs) -> MaterialOverrides {
    MaterialOverrides { k_d: args.kd, k_s: args.ks, shininess: args.shininess.map(|p| p as f32), k_e: None }
}

#[cfg(test)]
mod tests {
    use clap::Parser;

    use super::*;
    use crate::args::{Cli, Command};

    #[test]
    fn the_defaults_are_those_of_the_library() {
        let cli = Cli::try_parse_from(["blinn", "render", "a.glb"]).unwrap();
        let Command::Render(args) = cli.command else { panic!("another command") };
        let options = options_from_args(&args.options, &args.scene, None, &args.common, &args.process);
        assert_eq!(format!("{:?}", options.unwrap()), format!("{:?}", Options::default()));
    }

    #[test]
    fn load_options_do_not_depend_on_the_machine() {
        let cli = Cli::try_parse_from(["blinn", "render", "a.glb"]).unwrap();
        let Command::Render(args) = cli.command else { panic!("another command") };
        assert_eq!(load_options(&args.scene, &args.common).limits, Limits::default());
    }
}
