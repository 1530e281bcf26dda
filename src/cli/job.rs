//! From words to a plan: what is rendered, how, and where it goes. Whatever can be found wrong
//! without reading a scene is found here.

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use super::Usage;
use super::args::{
    CameraArgs, CommonArgs, CullArg, FilterArg, FitArg, GroundArg, ImageArgs, IntegratorArg, LightArgs,
    ProjectionArg, RenderArgs, SceneArgs, TimeArgs, UnitsArg, UpArg, ViewArg,
};
use super::values::{Ao, Exposure, Layers};
use crate::accel::{BuildSettings, Tier};
use crate::display::{Background, ViewTransform};
use crate::geometry::Rgb;
use crate::import::{Limits, LoadOptions, SceneChoice, Up, load_camera_xml, load_sky};
use crate::integrator::{Overrides, Stage};
use crate::output::{Depth, Format, Replace};
use crate::render::{Filter, RenderSettings};
use crate::scene::{
    AnimationChoice, Fit, GroundKind, LightUnits, Lighting, Projection, Scene, Selection, View,
};

/// Longer side of a picture whose size was not given.
const DEFAULT_SIDE: u32 = 1280;
/// The default shape, 16:9.
const DEFAULT_SIZE: (u32, u32) = (1280, 720);

/// Where a picture goes.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Target {
    /// To standard output, as PNG.
    Stdout,
    /// To a file.
    File(PathBuf, Format),
}

/// Everything but the scenes.
#[derive(Debug)]
pub(super) struct Job {
    pub targets: Vec<(PathBuf, Target)>,
    pub load: LoadOptions,
    pub strict: bool,
    pub quiet: bool,
    pub size: Option<(u32, u32)>,
    pub settings: RenderSettings,
    pub build: BuildSettings,
    pub background: Background,
    pub exposure: Option<Exposure>,
    /// `None`: by where the scene comes from.
    pub view_transform: Option<ViewTransform>,
    pub depth: Depth,
    pub layers: Layers,
    pub replace: Replace,
    pub view: View,
    pub lighting: Lighting,
    pub shadows: bool,
    pub ao: Option<Ao>,
    pub ground: Option<GroundKind>,
    pub stage: Stage,
    pub overrides: Overrides,
    pub cull: bool,
    pub selection: Selection,
    pub time: f64,
    animation: Option<String>,
}

impl Job {
    pub fn new(args: &RenderArgs) -> Result<Job, Usage> {
        let image = &args.image;
        let stage = match args.shading.integrator {
            IntegratorArg::Phong => Stage::Phong,
            IntegratorArg::Shadow => Stage::Shadow,
            IntegratorArg::Diffuse => Stage::Diffuse,
            IntegratorArg::Color => Stage::Color,
        };
        idle(&args.light, stage)?;
        let build = BuildSettings { tier: tier(std::env::var_os("BLINN_SIMD"))?, ..Default::default() };
        let background = match (image.background, image.no_background, stage) {
            (_, true, _) => Background::Transparent,
            (Some(given), _, _) => given,
            // The lecture: the surface's colour, else black.
            (None, false, Stage::Color) => Background::Color(Rgb::ZERO),
            (None, false, _) => Background::Color(Rgb::splat(0.05)),
        };
        let filter = match image.filter {
            FilterArg::Box => Filter::Box,
            FilterArg::Tent => Filter::Tent,
            FilterArg::Gaussian => Filter::Gaussian,
            FilterArg::BlackmanHarris => Filter::BlackmanHarris,
        };
        if let (Some(crop), Some((w, h))) = (image.crop, image.size)
            && (crop.x + crop.width > w || crop.y + crop.height > h)
        {
            return Err(Usage(format!("--crop reaches beyond the picture of {w}x{h} pixels")));
        }
        let settings = RenderSettings {
            samples: image.samples,
            filter,
            seed: image.seed,
            crop: image.crop,
            tile: if image.samples > 16 { 16 } else { 32 },
            ..Default::default()
        };
        let mut targets = targets(&args.scene.scenes, image.output.as_deref(), &args.time)?;
        check_format(image, background, &targets)?;
        let depth = depth(image.depth.as_deref(), format(&targets))?;
        for (_, target) in &mut targets {
            if let (Target::File(_, Format::Jpeg(quality)), Some(asked)) = (target, image.quality) {
                *quality = asked;
            }
        }
        Ok(Job {
            targets,
            load: load_options(&args.scene, &args.common),
            strict: args.common.strict,
            quiet: args.common.quiet,
            size: image.size,
            settings,
            build,
            background,
            exposure: image.exposure,
            view_transform: match image.view {
                ViewArg::Auto => None,
                ViewArg::Standard => Some(ViewTransform::Standard),
                ViewArg::Agx => Some(ViewTransform::Agx),
                ViewArg::PbrNeutral => Some(ViewTransform::PbrNeutral),
                ViewArg::Raw => Some(ViewTransform::Raw),
            },
            depth,
            layers: image.aov.clone().unwrap_or_default(),
            replace: if image.no_overwrite { Replace::No } else { Replace::Yes },
            view: view(&args.camera)?,
            lighting: lighting(&args.light)?,
            shadows: !args.light.no_shadows,
            ao: args.light.ao,
            ground: args.light.ground.map(|ground| match ground {
                GroundArg::Plane => GroundKind::Plane,
                GroundArg::Shadow => GroundKind::Shadow,
            }),
            stage,
            overrides: Overrides {
                k_d: args.shading.kd,
                k_s: args.shading.ks,
                shininess: args.shading.shininess.map(|p| p as f32),
            },
            cull: args.shading.cull == CullArg::Auto,
            selection: Selection { only: args.shading.only_objects.clone(), hide: args.shading.hide.clone() },
            time: args.time.time.or(args.time.frame.map(|n| n / args.time.fps)).unwrap_or(0.0),
            animation: args.time.animation.clone(),
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

    /// Width and height: as given, else the file camera's shape, else 16:9.
    pub fn size_for(&self, scene: &Scene) -> (u32, u32) {
        if let Some(size) = self.size {
            return size;
        }
        let camera = match &self.view.camera {
            Some(name) => scene.find_camera(name),
            None if self.view.is_its_own() => None,
            None => (!scene.cameras.is_empty()).then_some(0),
        };
        natural_size(scene, camera)
    }
}

/// The size of a picture through a file's camera, or of a framed scene: no flag changes it.
pub(super) fn natural_size(scene: &Scene, camera: Option<usize>) -> (u32, u32) {
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

/// How scene files are read.
pub(super) fn load_options(args: &SceneArgs, common: &CommonArgs) -> LoadOptions {
    LoadOptions {
        limits: Limits::default(),
        scene: args.scene.clone().map_or(SceneChoice::Default, SceneChoice::Named),
        variant: args.variant.clone(),
        up: match args.up {
            UpArg::Y => Up::Y,
            UpArg::Z => Up::Z,
        },
        smooth: args.smooth.unwrap_or_default(),
        allow_outside: common.allow_outside,
    }
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
            FitArg::Auto => Fit::Auto,
            FitArg::Horizontal => Fit::Horizontal,
            FitArg::Vertical => Fit::Vertical,
        },
        orbit: args.orbit,
        turn: (args.camera_azimuth_angle, args.camera_elevation_angle),
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

fn lighting(args: &LightArgs) -> Result<Lighting, Usage> {
    let sky = args.hdri.as_ref().map(|path| load_sky(path, &Limits::default())).transpose();
    Ok(Lighting {
        sources: args.lights.clone(),
        given: args.point_light.iter().chain(&args.sun).copied().collect(),
        units: match args.light_units {
            UnitsArg::Auto => LightUnits::Auto,
            UnitsArg::Standard => LightUnits::Standard,
            UnitsArg::Unitless => LightUnits::Unitless,
            UnitsArg::Raw => LightUnits::Raw,
        },
        scale: args.light_scale as f32,
        ambient: args.ambient,
        plain_ambient: args.ao.is_some(),
        sky: sky.map_err(|e| Usage(format!("--hdri: {e}")))?,
        radius: args.light_radius.unwrap_or(0.0) as f32,
    })
}

/// The instructions to trace with: those that `BLINN_SIMD` names, else the best there are.
fn tier(asked: Option<std::ffi::OsString>) -> Result<Tier, Usage> {
    let Some(asked) = asked.filter(|asked| !asked.is_empty()) else { return Ok(Tier::best()) };
    let names = || Tier::ALL.map(Tier::name).join(", ");
    match Tier::ALL.into_iter().find(|tier| asked == tier.name()) {
        Some(tier) if tier.available() => Ok(tier),
        Some(tier) => Err(Usage(format!("BLINN_SIMD: this processor has no {}", tier.name()))),
        None => Err(Usage(format!("BLINN_SIMD: '{}' is none of {}", asked.to_string_lossy(), names()))),
    }
}

/// The format that all pictures of this job have.
fn format(targets: &[(PathBuf, Target)]) -> Format {
    match targets.first() {
        Some((_, Target::File(_, format))) => *format,
        Some((_, Target::Stdout)) | None => Format::Png,
    }
}

fn depth(asked: Option<&str>, format: Format) -> Result<Depth, Usage> {
    let wrong = |asked: &str, has: &str| Err(Usage(format!("--depth {asked}: {has} bits a channel")));
    match (asked, format) {
        (None, _) | (Some("32"), Format::Exr) => Ok(Depth::Usual),
        (Some("16"), Format::Png | Format::Exr) => Ok(Depth::Sixteen),
        (Some("8"), Format::Png | Format::Jpeg(_) | Format::Webp) => Ok(Depth::Eight),
        (Some(other), Format::Exr) => wrong(other, "an EXR has 16 or 32"),
        (Some(other), Format::Png) => wrong(other, "a PNG has 8 or 16"),
        (Some(other), Format::Jpeg(_)) => wrong(other, "a JPEG has 8"),
        (Some(other), Format::Webp) => wrong(other, "a WebP has 8"),
    }
}

/// Refuses what the format cannot hold.
fn check_format(
    image: &ImageArgs,
    background: Background,
    targets: &[(PathBuf, Target)],
) -> Result<(), Usage> {
    let format = format(targets);
    let jpeg = matches!(format, Format::Jpeg(_));
    if image.quality.is_some() && !jpeg {
        return Err(Usage("--quality is of JPEGs alone, and -o names none".into()));
    }
    if background == Background::Transparent && jpeg {
        return Err(Usage(
            "a JPEG has no transparency: give a --background COLOR, or write .png, .webp or .exr".into(),
        ));
    }
    if image.aov.is_some() && targets.iter().any(|(_, t)| *t == Target::Stdout) {
        return Err(Usage("--aov: standard output takes one picture; give -o a file's name".into()));
    }
    Ok(())
}

/// Where each scene's picture goes. Names that collide are found before anything is rendered.
fn targets(
    scenes: &[PathBuf],
    output: Option<&Path>,
    time: &TimeArgs,
) -> Result<Vec<(PathBuf, Target)>, Usage> {
    let mut taken: HashMap<PathBuf, &PathBuf> = HashMap::new();
    let mut targets = Vec::new();
    let frame = time.frame.map_or(1, |n| n.max(0.0) as u64);
    for (index, scene) in scenes.iter().enumerate() {
        let target = match output {
            Some(path) if path == Path::new("-") => {
                if scenes.len() > 1 {
                    return Err(Usage(
                        "-o -: standard output takes one picture, and several scenes were given".into(),
                    ));
                }
                Target::Stdout
            }
            _ => {
                let template = template(output);
                let path = PathBuf::from(fill_in(&template, scene, index + 1, frame));
                let Some(format) = Format::of(&path) else {
                    let name = path.display();
                    return Err(Usage(format!(
                        "-o {name}: the name must end in .png, .exr, .jpg or .webp, or in / for a folder"
                    )));
                };
                if let Some(other) = taken.insert(path.clone(), scene) {
                    return Err(Usage(format!(
                        "{} and {} would both be written to {}: use {{stem}}, {{parent}} or {{index}} in -o",
                        other.display(),
                        scene.display(),
                        path.display()
                    )));
                }
                Target::File(path, format)
            }
        };
        targets.push((scene.clone(), target));
    }
    Ok(targets)
}

fn template(output: Option<&Path>) -> String {
    let Some(output) = output else { return "{stem}.png".into() };
    let text = output.to_string_lossy().into_owned();
    if text.ends_with('/') || text.ends_with(std::path::MAIN_SEPARATOR) || output.is_dir() {
        format!("{}/{{stem}}.png", text.trim_end_matches(['/', std::path::MAIN_SEPARATOR]))
    } else {
        text
    }
}

/// Replaces `{stem}`, `{model}`, `{parent}`, `{index}` and the frame patterns `####`, `%04d`,
/// `{frame:04}`.
fn fill_in(template: &str, scene: &Path, index: usize, frame: u64) -> String {
    let stem = scene.file_stem().map(|s| s.to_string_lossy().into_owned()).unwrap_or_default();
    let parent = scene.parent().and_then(Path::file_name).map(|s| s.to_string_lossy().into_owned());
    let mut out = String::new();
    let mut rest = template;
    while let Some(c) = rest.chars().next() {
        let braces = rest.strip_prefix('{').and_then(|r| r.split_once('}'));
        if let Some((key, after)) = braces {
            let value = match key {
                "stem" | "model" => Some(stem.clone()),
                "parent" => Some(parent.clone().unwrap_or_default()),
                "index" => Some(index.to_string()),
                "frame" => Some(frame.to_string()),
                _ => key.strip_prefix("frame:").and_then(|w| w.parse().ok()).map(|w| padded(frame, w)),
            };
            if let Some(value) = value {
                out.push_str(&value);
                rest = after;
                continue;
            }
        }
        if c == '#' {
            let hashes = rest.len() - rest.trim_start_matches('#').len();
            out.push_str(&padded(frame, hashes));
            rest = &rest[hashes..];
            continue;
        }
        let percent = rest.strip_prefix('%').and_then(|r| r.split_once('d'));
        if let Some((width, after)) = percent
            && (width.is_empty() || width.bytes().all(|b| b.is_ascii_digit()))
        {
            out.push_str(&padded(frame, width.parse().unwrap_or(0)));
            rest = after;
            continue;
        }
        out.push(c);
        rest = &rest[c.len_utf8()..];
    }
    out
}

fn padded(frame: u64, width: usize) -> String {
    format!("{frame:0width$}", width = width.min(32))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_filled_in() {
        let scene = Path::new("shots/Ä robot.glb");
        for (template, expected) in [
            ("{stem}.png", "Ä robot.png"),
            ("out/{parent}-{model}-{index}.exr", "out/shots-Ä robot-3.exr"),
            ("f_####.png", "f_0007.png"),
            ("f_%04d.png", "f_0007.png"),
            ("f_%d.png", "f_7.png"),
            ("f_{frame:05}.png", "f_00007.png"),
            ("100%.png", "100%.png"),
            ("{other}.png", "{other}.png"),
            ("{.png", "{.png"),
        ] {
            assert_eq!(fill_in(template, scene, 3, 7), expected);
        }
    }

    #[test]
    fn colliding_names_are_found() {
        let time = TimeArgs { time: None, frame: None, fps: 24.0, animation: None };
        let scenes = [PathBuf::from("a/x.glb"), PathBuf::from("b/x.glb")];
        assert!(targets(&scenes, None, &time).is_err());
        assert!(targets(&scenes, Some(Path::new("{parent}.png")), &time).is_ok());
        assert!(targets(&scenes, Some(Path::new("-")), &time).is_err());
        assert!(targets(&scenes[..1], Some(Path::new("x.tiff")), &time).is_err());
    }
}
