//! What pictures look like, resolved: all that decides their pixels, but for scene and frame.

use crate::accel::SimdLevel;
use crate::cli::Usage;
use crate::cli::args::values::{Ao, Exposure, Layers};
use crate::cli::args::{
    CameraArgs, CommonArgs, CullArg, FilterArg, FitArg, GroundArg, HeatmapArg, ImageArgs, IntegratorArg,
    LightArgs, LookArgs, ProjectionArg, SceneArgs, ShadingArgs, UnitsArg, UpArg, ViewArg,
};
use crate::cli::plan::{Shot, Turning};
use crate::display::{Background, ViewTransform};
use crate::geometry::Rgb;
use crate::import::{Limits, LoadOptions, SceneChoice, UpAxis, load_camera_xml, load_sky};
use crate::integrator::{Aov, MaterialOverrides, Stage};
use crate::render::{AdaptiveSampling, PixelFilter, RenderSettings};
use crate::scene::{
    AnimationChoice, Camera, GroundKind, LightSet, LightUnits, Lighting, OrbitAngles, PosedScene, Projection,
    Scene, Selection, SensorFit, View, ViewError,
};

/// Longer side of a picture whose size was not given.
const DEFAULT_SIDE: u32 = 1280;
/// The default shape, 16:9.
const DEFAULT_SIZE: (u32, u32) = (1280, 720);

/// Everything that decides what is in a picture, but for its scene and its frame.
#[derive(Clone, Debug)]
pub struct Look {
    /// With the usual limits: how much may be taken is the process's affair, and decides on no picture.
    pub load: LoadOptions,
    pub selection: Selection,
    pub animation: Option<String>,
    pub size: Option<(u32, u32)>,
    pub settings: RenderSettings,
    pub background: Background,
    pub exposure: Option<Exposure>,
    /// `None`: by where the scene comes from.
    pub view_transform: Option<ViewTransform>,
    pub layers: Layers,
    pub view: View,
    pub lighting: Lighting,
    pub shadows: bool,
    pub ao: Option<Ao>,
    pub ground: Option<GroundKind>,
    pub stage: Stage,
    pub overrides: MaterialOverrides,
    pub cull: bool,
    /// Set for turntables.
    pub turning: Option<Turning>,
}

impl Look {
    pub fn new(
        args: &LookArgs,
        scene: &SceneArgs,
        animation: Option<&str>,
        common: &CommonArgs,
        limits: &Limits,
    ) -> Result<Look, Usage> {
        let LookArgs { image, camera, light, shading } = args;
        let stage = match shading.integrator {
            IntegratorArg::Phong => Stage::Phong,
            IntegratorArg::Shadow => Stage::Shadow,
            IntegratorArg::Diffuse => Stage::Diffuse,
            IntegratorArg::Color => Stage::Color,
        };
        idle(light, stage)?;
        if let (Some(crop), Some((w, h))) = (image.crop, image.size)
            && (crop.x + crop.width > w || crop.y + crop.height > h)
        {
            return Err(Usage(format!("--crop reaches beyond the picture of {w}x{h} pixels")));
        }
        if image.adaptive.is_some() && image.samples <= 4 {
            return Err(Usage(
                "--adaptive chooses who gets more than four samples: give --samples 16".into(),
            ));
        }
        Ok(Look {
            load: load_options(scene, common),
            selection: Selection { only: shading.only_objects.clone(), hide: shading.hide.clone() },
            animation: animation.map(str::to_string),
            size: image.size,
            settings: RenderSettings {
                samples: image.samples,
                filter: match image.filter {
                    FilterArg::Box => PixelFilter::Box,
                    FilterArg::Tent => PixelFilter::Tent,
                    FilterArg::Gaussian => PixelFilter::Gaussian,
                    FilterArg::BlackmanHarris => PixelFilter::BlackmanHarris,
                },
                seed: image.seed,
                // The stops are known when the scene is.
                adaptive: image.adaptive.map(|threshold| AdaptiveSampling { threshold, ev: 0.0 }),
                crop: image.crop,
                tile: if image.samples > 16 { 16 } else { 32 },
                ..Default::default()
            },
            background: match (image.background, image.no_background, stage) {
                (_, true, _) => Background::Transparent,
                (Some(given), _, _) => given,
                // The lecture: the surface's colour, else black.
                (None, false, Stage::Color) => Background::Color(Rgb::ZERO),
                (None, false, _) => Background::Color(Rgb::splat(0.05)),
            },
            exposure: image.exposure,
            view_transform: match image.view {
                ViewArg::Auto => None,
                ViewArg::Standard => Some(ViewTransform::Standard),
                ViewArg::Agx => Some(ViewTransform::Agx),
                ViewArg::PbrNeutral => Some(ViewTransform::PbrNeutral),
                ViewArg::Raw => Some(ViewTransform::Raw),
            },
            layers: layers(image),
            view: view(camera)?,
            lighting: lighting(light, limits)?,
            shadows: !light.no_shadows,
            ao: light.ao,
            ground: light.ground.map(|ground| match ground {
                GroundArg::Plane => GroundKind::Plane,
                GroundArg::Shadow => GroundKind::ShadowCatcher,
            }),
            stage,
            overrides: overrides(shading),
            cull: shading.cull == CullArg::Auto,
            turning: None,
        })
    }

    /// The animation that was asked for; a name wins over an index.
    pub fn animation(&self, scene: &Scene) -> anyhow::Result<AnimationChoice> {
        let Some(asked) = self.animation.as_deref() else { return Ok(AnimationChoice::Default) };
        let all = &scene.animations;
        if let Some(i) = all.iter().position(|a| a.name == asked) {
            return Ok(AnimationChoice::One(i));
        }
        match (asked, asked.parse::<usize>()) {
            ("all", _) => Ok(AnimationChoice::All),
            ("none", _) => Ok(AnimationChoice::Rest),
            (_, Ok(i)) if i < all.len() => Ok(AnimationChoice::One(i)),
            (_, Ok(0)) => Ok(AnimationChoice::Rest),
            _ => {
                let names: Vec<_> =
                    all.iter().enumerate().map(|(i, a)| format!("{i} '{}'", a.name)).collect();
                let names = if names.is_empty() { "none".to_string() } else { names.join(", ") };
                anyhow::bail!("no animation '{asked}' in the file; it has: {names}")
            }
        }
    }

    /// The camera of a shot, for a picture of that size.
    pub fn camera(&self, shot: &Shot, posed: &PosedScene, size: (u32, u32)) -> Result<Camera, ViewError> {
        let view = View { orbit: shot.orbit.or(self.view.orbit), ..self.view.clone() };
        Ok(view.resolve(posed, size.0, size.1)?.0)
    }

    /// Width and height of what is rendered, where that needs no look at the scene.
    pub fn known_size(&self) -> Option<(u32, u32)> {
        self.settings.crop.map(|crop| (crop.width, crop.height)).or(self.size)
    }

    /// Width and height: as given, else the file camera's shape, else 16:9.
    pub fn size_for(&self, scene: &Scene) -> (u32, u32) {
        if let Some(size) = self.size {
            return size;
        }
        let camera = match &self.view.camera {
            Some(name) => scene.find_camera(name),
            None if self.view.replaces_file_camera() => None,
            None => (!scene.cameras.is_empty()).then_some(0),
        };
        natural_size(scene, camera)
    }
}

/// The size of a picture through a file's camera, or of a framed scene: no flag changes it.
pub fn natural_size(scene: &Scene, camera: Option<usize>) -> (u32, u32) {
    let aspect = camera.and_then(|i| scene.cameras[i].aspect()).filter(|a| (0.01..=100.0).contains(a));
    match aspect {
        None => DEFAULT_SIZE,
        Some(a) => {
            let side = f64::from(DEFAULT_SIDE);
            let (w, h) = if a >= 1.0 { (side, side / a) } else { (side * a, side) };
            (w.round().max(1.0) as u32, h.round().max(1.0) as u32)
        }
    }
}

/// How scene files are read, within limits that no machine has a part in: pictures carry a hash of it.
pub fn load_options(args: &SceneArgs, common: &CommonArgs) -> LoadOptions {
    LoadOptions {
        limits: Limits::default(),
        scene: args.scene.clone().map_or(SceneChoice::Default, SceneChoice::Named),
        variant: args.variant.clone(),
        up: match args.up {
            UpArg::Y => UpAxis::Y,
            UpArg::Z => UpAxis::Z,
        },
        normals: args.smooth.unwrap_or_default(),
        allow_outside: common.allow_outside,
    }
}

fn layers(args: &ImageArgs) -> Layers {
    let mut layers = args.aov.clone().unwrap_or_default();
    let heatmap = args.heatmap.map(|HeatmapArg::Steps| Aov::Steps);
    layers.aovs.extend(heatmap.filter(|aov| !layers.aovs.contains(aov)));
    layers
}

fn overrides(args: &ShadingArgs) -> MaterialOverrides {
    MaterialOverrides { k_d: args.kd, k_s: args.ks, shininess: args.shininess.map(|p| p as f32), k_e: None }
}

fn view(args: &CameraArgs) -> Result<View, Usage> {
    let from_xml = match &args.camera_xml {
        Some(path) => load_camera_xml(path).map_err(|e| Usage(format!("--camera-xml: {e}")))?,
        None => View::default(),
    };
    let projection = match (args.projection, args.camera_orthographic) {
        (_, true) | (Some(ProjectionArg::Orthographic), _) => Some(Projection::Orthographic),
        (Some(ProjectionArg::Perspective), _) => Some(Projection::Perspective),
        (None, false) => from_xml.projection,
    };
    // An angle takes the place of the block's rectangle, a direction that of a point to look at.
    let (xml_width, xml_height) =
        if args.yfov.is_some() { (None, None) } else { (from_xml.view_width, from_xml.view_height) };
    Ok(View {
        camera: args.camera.clone(),
        view_point: args.view_point.or(from_xml.view_point),
        view_dir: args.view_dir.or(if args.look_at.is_some() { None } else { from_xml.view_dir }),
        look_at: args.look_at,
        view_up: args.view_up.or(from_xml.view_up),
        proj_distance: args.proj_distance.or(from_xml.proj_distance),
        view_width: args.view_width.or(xml_width),
        view_height: args.view_height.or(xml_height),
        yfov: args.yfov,
        projection,
        clip: args.clip,
        fit: match args.fit {
            FitArg::Auto => SensorFit::Auto,
            FitArg::Horizontal => SensorFit::Horizontal,
            FitArg::Vertical => SensorFit::Vertical,
        },
        orbit: args.orbit,
        orbit_by: OrbitAngles { azimuth: args.camera_azimuth_angle, elevation: args.camera_elevation_angle },
        zoom: args.zoom,
    })
}

/// Refuses what would be asked for in vain.
fn idle(args: &LightArgs, stage: Stage) -> Result<(), Usage> {
    let shadowless = match stage {
        Stage::Color => Some("--integrator color"),
        Stage::Diffuse => Some("--integrator diffuse"),
        _ => args.no_shadows.then_some("--no-shadows"),
    };
    let unlit =
        args.lights.as_ref().is_some_and(Vec::is_empty) && args.point_light.is_empty() && args.sun.is_empty();
    let without = shadowless.or(unlit.then_some("--lights none"));
    if let (Some(r), Some(without)) = (args.light_radius, without)
        && r > 0.0
    {
        return Err(Usage(format!("--light-radius softens shadows, and {without} has none: leave one out")));
    }
    if let Some(sources) = args.lights.as_ref().filter(|sources| !sources.contains(&LightSet::File))
        && args.light_scale.is_some()
    {
        let without = if sources.is_empty() { "none" } else { "without file" };
        return Err(Usage(format!(
            "--light-scale multiplies the file's lights, and --lights {without} leaves them out: leave one out"
        )));
    }
    if args.ao.is_some() && stage != Stage::Phong {
        return Err(Usage(
            "--ao weights the ambient term, which only --integrator phong has: leave one out".into(),
        ));
    }
    if args.hdri.is_some() && stage != Stage::Phong {
        return Err(Usage(
            "--hdri lights by the ambient term, which only --integrator phong has: leave one out".into(),
        ));
    }
    if args.ao.is_some() && args.ambient == Some(Rgb::ZERO) {
        return Err(Usage(
            "--ao weights the ambient term, and --ambient 0,0,0 is none: leave one out".into(),
        ));
    }
    if let (Some(GroundArg::Shadow), None, Some(without)) = (args.ground, args.ao, without) {
        return Err(Usage(format!(
            "--ground shadow shows nothing but shadows, and {without} has none: take --ground plane"
        )));
    }
    Ok(())
}

fn lighting(args: &LightArgs, limits: &Limits) -> Result<Lighting, Usage> {
    let sky = args.hdri.as_ref().map(|path| load_sky(path, limits)).transpose();
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
        sky: sky.map_err(|e| Usage(format!("--hdri: {e}")))?,
        radius: args.light_radius.unwrap_or(0.0) as f32,
    })
}

/// The instructions to trace with: those that `BLINN_SIMD` names, else the best there are.
pub fn tier(asked: Option<std::ffi::OsString>) -> Result<SimdLevel, Usage> {
    let Some(asked) = asked.filter(|asked| !asked.is_empty()) else { return Ok(SimdLevel::detect()) };
    let names = || SimdLevel::ALL.map(SimdLevel::name).join(", ");
    match SimdLevel::ALL.into_iter().find(|tier| asked == tier.name()) {
        Some(tier) if tier.is_supported() => Ok(tier),
        Some(tier) => Err(Usage(format!("BLINN_SIMD: this processor has no {}", tier.name()))),
        None => Err(Usage(format!("BLINN_SIMD: '{}' is none of {}", asked.to_string_lossy(), names()))),
    }
}

#[cfg(test)]
mod tests {
    use clap::Parser;

    use super::*;
    use crate::cli::args::{Cli, Command};

    /// Pictures carry a hash of how their scenes are read. Machines of other memory make the same pictures.
    #[test]
    fn no_machine_has_a_part_in_how_scenes_are_read() {
        let cli = Cli::try_parse_from(["blinn", "render", "a.glb"]).unwrap();
        let Command::Render(args) = cli.command else { panic!("another command") };
        assert_eq!(load_options(&args.scene, &args.common).limits, Limits::default());
    }
}
