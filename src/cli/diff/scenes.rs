//! Compares two scenes: pictures from the same cameras in the same light, their objects and their properties.

use std::path::Path;
use std::sync::Arc;

use anyhow::{Context, Result};
use glam::{DMat3, DVec2, DVec3};

use super::animations::curve_differences;
use super::comparison::{Comparison, PicturePair, ViewComparison};
use super::hints::{NewScene, hint};
use super::information::is_information;
use super::length::LengthUnit;
use super::noise::forgive_noise;
use crate::args::{DiffArgs, UpArg};
use crate::info::comparable_properties;
use crate::plan::RenderPlan;
use crate::run::progress::{ImageMonitor, SceneLog};
use crate::scene_file::load_scene_file;
use blinn_core::cancellation::CancelToken;
use blinn_core::geometry::Aabb;
use blinn_import::{LoadOptions, MemoryWatch, Warning};
use blinn_output::compare::{
    CanonicalOrder, DifferenceMap, ObjectComparison, ObjectDifference, compare_objects, json_differences,
};
use blinn_render::PixelRect;
use blinn_scene::{
    Camera, PoseSettings, PosedScene, Projection, ResolvedLighting, Scene, SourceFormat, StandardView,
    UpAxis, View, pose,
};
use blinn_session::{
    Permit, PlannedFrame, PosedFrame, RenderedImage, SceneRenderer, SessionPlan, check_memory, natural_size,
    prepare_scene, scaled_to,
};

/// Cameras of the file that are compared.
const MAX_CAMERAS: usize = 8;
/// Longer side of a picture without --size, in pixels.
const DEFAULT_SIDE: u32 = 640;
/// Size of a picture without --size and without cameras.
pub const DEFAULT_SIZE: (u32, u32) = (DEFAULT_SIDE, DEFAULT_SIDE * 3 / 4);
/// Space around the scenes in standard views, as a factor of their size.
const MARGIN: f64 = 1.12;
/// Space between an object and its box in pixels.
const BOX_MARGIN: f64 = 3.0;

/// A view of both scenes.
struct SharedView {
    name: String,
    camera: Camera,
}

/// How both scenes are pictured in a view.
struct Shot<'l> {
    camera: Camera,
    lit: ResolvedLighting,
    planned: PlannedFrame,
    log: &'l SceneLog<'l>,
}

impl Shot<'_> {
    fn render<'a>(
        &self,
        renderer: &SceneRenderer<'a>,
        posed_frame: &PosedFrame<'a>,
    ) -> Result<RenderedImage> {
        let monitor = ImageMonitor::new(self.log, renderer.pixels(), &renderer.setup.cancel);
        let frame = renderer.setup.lit_frame(posed_frame, self.camera, &self.lit)?;
        let image = renderer.render_frame(frame, &self.planned, posed_frame, &monitor)?;
        monitor.finish();
        Ok(image)
    }

    fn may_be_noisy(&self, renderer: &SceneRenderer, posed_frame: &PosedFrame) -> Result<bool> {
        Ok(renderer.setup.lit_frame(posed_frame, self.camera, &self.lit)?.may_be_noisy())
    }
}

/// A loaded scene.
struct Loaded {
    scene: Scene,
    warnings: Vec<Warning>,
}

/// Compares the scenes in two files. `plan` has the options of the pictures; without --size, their size is that of the
/// file's camera. Messages go to the log of each file, the memory of both scenes is claimed from `permit`, and `cancel` ends
/// the comparison early.
pub fn compare(
    files: [&Path; 2],
    mut plan: RenderPlan,
    args: &DiffArgs,
    logs: &[SceneLog; 2],
    permit: &Arc<Permit>,
    cancel: &CancelToken,
) -> Result<Comparison> {
    let LoadedPair { mut old, mut new, new_scale } =
        LoadedPair::load(files, &mut plan, args, permit, cancel)?;
    logs[0].warn_of_import(old.warnings.clone())?;
    logs[1].warn_of_import(new.warnings.clone())?;
    let mode = plan.session.options.load.glass;
    let mut differences = json_differences(
        &comparable_properties(&old.scene, &old.warnings, mode)?,
        &comparable_properties(&new.scene, &new.warnings, mode)?,
    );
    differences.extend(curve_differences(&old.scene, &new.scene));
    let tolerance = args.distance_tolerance;
    let (information, properties): (Vec<_>, Vec<_>) =
        differences.into_iter().partition(|difference| is_information(difference, tolerance));
    let frames = plan.frames.resolve(0.0, None)?;
    let planned = *frames.first().context("there is no frame")?;

    let (ObjectComparison { differences: objects, accepted_distance }, [at_old, at_new]) =
        compare_geometry(&plan, &mut old.scene, &mut new.scene, planned.time, tolerance)?;
    let posed_old = pose(&old.scene, &at_old)?;
    let posed_new = pose(&new.scene, &at_new)?;
    let views = shared_views(&plan, &posed_old, &posed_new)?;
    let hint = hint(
        &posed_old.bounds(),
        NewScene { bounds: posed_new.bounds(), up: new.scene.source.up, scale: new_scale },
    );
    plan.session.options.view.complete = views.first().map(|view| view.camera);
    let pictures = ViewPairs { session: &plan.session, args, planned, objects: &objects, log: &logs[0] };
    let pictures = pictures.compare(&old.scene, posed_old, posed_new, views, cancel)?;
    let has_picture_tolerance = args.compare.tolerance.is_some() || args.compare.flip;
    Ok(Comparison {
        views: pictures,
        objects,
        properties,
        information,
        hint,
        accepted_distance,
        mismatch: None,
        apart: Vec::new(),
        pictures_decide: has_picture_tolerance && tolerance.is_none(),
        // Rounding alone moves no pixel that an eye sees: pictures still count.
        ignores_pictures: tolerance.is_some() && accepted_distance.is_some() && !has_picture_tolerance,
        unit: length_unit(&old.scene, &new.scene),
    })
}

/// Both scenes.
struct LoadedPair {
    old: Loaded,
    new: Loaded,
    /// Factor of the new file's lengths.
    new_scale: f64,
}

impl LoadedPair {
    /// Loads both files, and sets the size of pictures in `plan`.
    fn load(
        files: [&Path; 2],
        plan: &mut RenderPlan,
        args: &DiffArgs,
        permit: &Arc<Permit>,
        cancel: &CancelToken,
    ) -> Result<LoadedPair> {
        let of_old = LoadOptions {
            limits: plan.session.scene_limits(),
            cancel: cancel.clone(),
            ..plan.session.options.load.clone()
        };
        let of_new = LoadOptions {
            up: args.new.new_up.map(up_axis).or(of_old.up),
            scale: args.new.new_scale.or(of_old.scale),
            ..of_old.clone()
        };
        let old = load_scene(plan, files[0], of_old, permit, 0).map_err(|e| in_file(files[0], e))?;
        plan.session.options.size = Some(args.size.unwrap_or_else(|| default_size(&old.scene)));
        let old_memory = check_memory(&plan.session, &old.scene, 2)?;
        permit.resize(old_memory)?;
        let new_scale = of_new.scale.unwrap_or(1.0);
        let new = load_scene(plan, files[1], of_new, permit, old_memory).map_err(|e| in_file(files[1], e))?;
        let new_memory = check_memory(&plan.session, &new.scene, 2)?;
        permit.resize(old_memory.saturating_add(new_memory))?;
        Ok(LoadedPair { old, new, new_scale })
    }
}

/// Compares the objects of both scenes at a time, and gives their triangles one order: equal ones have equal pictures. Also
/// returns how both are posed: with one centre, so that equal triangles have equal coordinates.
fn compare_geometry(
    plan: &RenderPlan,
    old: &mut Scene,
    new: &mut Scene,
    time: f64,
    tolerance: Option<f64>,
) -> Result<(ObjectComparison, [PoseSettings; 2])> {
    let options = &plan.session.options;
    let mut at_old = PoseSettings { time, animation: options.animation(old)?, centre: None };
    let animation = options.animation(new).or_else(|_| options.animation(&Scene::default()))?;
    let mut at_new = PoseSettings { time, animation, centre: None };
    let (objects, [old_order, new_order]) = {
        let posed_old = pose(old, &at_old)?;
        at_old.centre = Some(posed_old.centre);
        at_new.centre = at_old.centre;
        let posed_new = pose(new, &at_new)?;
        let orders = [&posed_old, &posed_new].map(CanonicalOrder::new);
        (compare_objects(&posed_old, &posed_new, tolerance), orders)
    };
    old_order.apply(old);
    new_order.apply(new);
    Ok((objects, [at_old, at_new]))
}

/// How pictures of both scenes are made and compared.
struct ViewPairs<'p> {
    session: &'p SessionPlan,
    args: &'p DiffArgs,
    planned: PlannedFrame,
    /// The differences of objects, whose boxes are shown.
    objects: &'p [ObjectDifference],
    log: &'p SceneLog<'p>,
}

impl ViewPairs<'_> {
    /// Renders both scenes from each view in the light of the old one, and compares the pictures.
    fn compare(
        &self,
        old: &Scene,
        posed_old: PosedScene,
        posed_new: PosedScene,
        views: Vec<SharedView>,
        cancel: &CancelToken,
    ) -> Result<Vec<ViewComparison>> {
        let ViewPairs { session, args, planned, objects, log } = *self;
        let seed = session.options.seed;
        let mut old_frame = PosedFrame { time: planned.time, posed: posed_old, accel: None };
        let mut renderer = SceneRenderer::from_start(session, old, log, &mut old_frame, cancel)?;
        renderer.setup.build(&mut old_frame)?;
        let mut new_frame = PosedFrame { time: planned.time, posed: posed_new, accel: None };
        renderer.setup.build(&mut new_frame)?;
        log.begin_frames(2 * views.len());
        let mut pictures = Vec::new();
        for view in views {
            let lit = renderer.setup.lights(&old_frame, &view.camera);
            let shot = Shot { camera: view.camera, lit, planned, log };
            let old_image = shot.render(&renderer, &old_frame)?;
            let new_image = shot.render(&renderer, &new_frame)?;
            let mut pair = picture_pair(&old_image, &new_image);
            let mut noise = 0;
            let may_be_noisy = shot.may_be_noisy(&renderer, &new_frame)?;
            if may_be_noisy && !args.compare.flip && pair.map.magnitudes.iter().any(|m| *m > 0.0) {
                renderer.set_seed(seed.wrapping_add(1));
                let again = shot.render(&renderer, &old_frame)?;
                renderer.set_seed(seed);
                noise = forgive_noise(&mut pair, &picture_pair(&old_image, &again));
            }
            let mut compared = pair.compare(view.name, &args.compare);
            compared.noise = noise;
            compared.objects = object_boxes(objects, &view.camera, &compared);
            pictures.push(compared);
        }
        Ok(pictures)
    }
}

fn up_axis(axis: UpArg) -> UpAxis {
    match axis {
        UpArg::Y => UpAxis::Y,
        UpArg::Z => UpAxis::Z,
    }
}

/// Metres, if both formats have them.
fn length_unit(old: &Scene, new: &Scene) -> LengthUnit {
    let is_metric = |scene: &Scene| scene.source.format == SourceFormat::Gltf;
    if is_metric(old) && is_metric(new) { LengthUnit::Metre } else { LengthUnit::Unknown }
}

fn in_file(file: &Path, error: anyhow::Error) -> anyhow::Error {
    anyhow::Error::msg(crate::console::scene_error(file, &error))
}

/// Loads a scene. The memory that it needs beside `claimed` bytes is claimed from `permit`.
fn load_scene(
    plan: &RenderPlan,
    file: &Path,
    options: LoadOptions,
    permit: &Arc<Permit>,
    claimed: u64,
) -> Result<Loaded> {
    let permit = permit.clone();
    let memory = MemoryWatch::new(move |bytes| permit.grow(claimed.saturating_add(bytes)));
    let options = LoadOptions { memory, ..options };
    let (mut scene, warnings) = load_scene_file(file, &options, plan.session.options.blender.as_deref())?;
    prepare_scene(&plan.session.options, &mut scene)?;
    Ok(Loaded { scene, warnings })
}

/// The aspect ratio of the file's first camera, else 4:3.
fn default_size(scene: &Scene) -> (u32, u32) {
    if scene.cameras.is_empty() {
        return DEFAULT_SIZE;
    }
    scaled_to(DEFAULT_SIDE, natural_size(scene, Some(0)))
}

/// The cameras of the old file and the isometric view; without cameras, all standard views. They frame both scenes.
fn shared_views(plan: &RenderPlan, old: &PosedScene, new: &PosedScene) -> Result<Vec<SharedView>> {
    let (width, height) = plan.session.options.size.unwrap_or((DEFAULT_SIDE, DEFAULT_SIDE));
    let mut views = Vec::new();
    for (i, camera) in old.cameras.iter().enumerate().take(MAX_CAMERAS) {
        let view = View { camera: Some(i.to_string()), ..View::default() };
        // A camera that cannot be used shows nothing to compare.
        if let Ok((resolved, _)) = view.resolve(old, width, height) {
            let name = &old.scene.nodes[camera.node as usize].name;
            views.push(SharedView { name: format!("camera '{name}'"), camera: resolved });
        }
    }
    let mut bounds = old.bounds();
    bounds.extend_box(&new.bounds());
    let standard = if views.is_empty() { &StandardView::ALL[..] } else { &[StandardView::Isometric] };
    let pixels = DVec2::new(f64::from(width), f64::from(height));
    views.extend(standard.iter().map(|view| {
        let metres_per_pixel = (view.projected_extent(&bounds) * MARGIN / pixels).max_element();
        let metres_per_pixel = if metres_per_pixel > 0.0 { metres_per_pixel } else { 1.0 / pixels.x };
        let camera = view.camera(&bounds, pixels * metres_per_pixel);
        SharedView { name: view.name().into(), camera }
    }));
    Ok(views)
}

fn picture_pair(old: &RenderedImage, new: &RenderedImage) -> PicturePair {
    let images = [old, new].map(|image| &image.picture);
    let [a, b] = images.map(|picture| picture.display.to_rgba16(&picture.pixels));
    let [light_a, light_b] = images.map(|picture| &picture.pixels.colors);
    let pixel = |i: usize| {
        if light_a[i].to_array().map(f32::to_bits) == light_b[i].to_array().map(f32::to_bits) {
            return 0.0;
        }
        let shown = a[i].iter().zip(&b[i]).map(|(x, y)| x.abs_diff(*y)).max().unwrap_or(0);
        // Light may differ where 16 bits do not.
        (f32::from(shown) / 65535.0).max(f32::MIN_POSITIVE)
    };
    let (width, height) = (images[0].pixels.width, images[0].pixels.height);
    let over_black = |pixels: &[[u16; 4]]| -> Vec<DVec3> {
        let unit = |v: u16| f64::from(v) / 65535.0;
        pixels.iter().map(|p| DVec3::new(unit(p[0]), unit(p[1]), unit(p[2])) * unit(p[3])).collect()
    };
    PicturePair {
        width,
        height,
        map: DifferenceMap { width, height, magnitudes: (0..light_a.len()).map(pixel).collect() },
        colors: [over_black(&a), over_black(&b)],
        shown: images.map(|picture| picture.display.to_rgba8(&picture.pixels)),
    }
}

/// The boxes of changed objects that are in view.
fn object_boxes(
    objects: &[ObjectDifference],
    camera: &Camera,
    view: &ViewComparison,
) -> Vec<(usize, PixelRect)> {
    let size = (view.width, view.height);
    let rects = objects.iter().map(|object| projected_rect(&object.bounds, camera, size)).enumerate();
    rects.filter_map(|(i, rect)| Some((i, rect?))).collect()
}

/// The pixels that a box covers, with a margin. The whole picture if it reaches behind the eye; `None` out of view.
fn projected_rect(bounds: &Aabb, camera: &Camera, (width, height): (u32, u32)) -> Option<PixelRect> {
    if bounds.is_empty() {
        return None;
    }
    let size = DVec2::new(f64::from(width), f64::from(height));
    let mut min = DVec2::INFINITY;
    let mut max = DVec2::NEG_INFINITY;
    for i in 0..8 {
        let corner = DVec3::from([0, 1, 2].map(|axis| [bounds.min, bounds.max][i >> axis & 1][axis]));
        match project(camera, corner) {
            Some(film) => {
                let pixel = DVec2::new(film.x, 1.0 - film.y) * size;
                min = min.min(pixel);
                max = max.max(pixel);
            }
            None => return Some(PixelRect { x: 0, y: 0, width, height }),
        }
    }
    let min = (min - BOX_MARGIN).floor().clamp(DVec2::ZERO, size);
    let max = (max + BOX_MARGIN).ceil().clamp(DVec2::ZERO, size);
    let side = max - min;
    (side.min_element() >= 1.0).then_some(PixelRect {
        x: min.x as u32,
        y: min.y as u32,
        width: side.x as u32,
        height: side.y as u32,
    })
}

/// Film position of a point, 0 to 1 to the right and upward; `None` behind the eye.
fn project(camera: &Camera, point: DVec3) -> Option<DVec2> {
    let axes = DMat3::from_cols(camera.basis.u, camera.basis.v, -camera.basis.w);
    let inside = axes.inverse() * (point - camera.view_point);
    let across = match camera.projection {
        Projection::Orthographic => inside.truncate(),
        Projection::Perspective if inside.z > 0.0 => inside.truncate() * (camera.proj_distance / inside.z),
        Projection::Perspective => return None,
    };
    Some((across - camera.view_centre) / DVec2::new(camera.view_width, camera.view_height) + 0.5)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_project_to_where_eye_rays_pass() {
        let bounds = Aabb { min: DVec3::splat(-1.0), max: DVec3::new(1.0, 2.0, 3.0) };
        let orthographic = StandardView::Isometric.camera(&bounds, DVec2::new(4.0, 3.0));
        let perspective = Camera {
            projection: Projection::Perspective,
            view_centre: DVec2::new(0.3, -0.2),
            proj_distance: 1.7,
            ..orthographic
        };
        for camera in [orthographic, perspective] {
            for (x, y) in [(0.1, 0.9), (0.5, 0.5), (0.7, 0.2)] {
                let ray = camera.eye_ray(x, y, DVec3::ZERO);
                let film = project(&camera, (ray.o + 1.5 * ray.d).as_dvec3()).unwrap();
                assert!(film.distance(DVec2::new(x, y)) < 1e-5, "{film}");
            }
        }
        assert_eq!(project(&perspective, perspective.view_point + perspective.basis.w), None);
    }
}
