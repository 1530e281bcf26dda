//! Renders the frames of a scene. Everything that frames share is resolved once at the start of the clip, so that
//! nothing flickers and any part of the frames has the same pixels as in the complete sequence.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use glam::{DAffine3, DMat3, DVec3};

use crate::camera_list::ImageCamera;
use crate::clip_bounds::log_clip_bounds;
use crate::depth_range::check_depth_range;
use crate::empty_images::empty_reason;
use crate::empty_reason::EmptyReason;
use crate::error::SessionError;
use crate::exposure::{ResolvedExposure, resolve_exposure};
use crate::framing::Framing;
use crate::idle_animations::log_idle_animations;
use crate::image_size::check_crop;
use crate::light_advice::LightAdvice;
use crate::light_hints::ImageLight;
use crate::log::SessionLog;
use crate::memory_estimate::bvh_triangles;
use crate::near_plane::cuts_picture;
use crate::notice::Notice;
use crate::option_remarks::{asks_for_file_lights, check_environment, remark_on_options};
use crate::options::Options;
use crate::picture_edges::{blank, empty_drawing, is_blank, picture_edges};
use crate::picture_layers::{light_layers, normalize_layers};
use crate::plan::SessionPlan;
use crate::planned_frame::PlannedFrame;
use crate::posed_frame::{PosedFrame, SceneSetup};
use crate::scene_lighting::{fixed_lighting, uses_own_view_and_lights};
use blinn_accel::{AccelSettings, Preset};
use blinn_core::cancellation::CancelToken;
use blinn_output::datasets::WorldUp;
use blinn_output::{CropWindow, IdNames, Picture};
use blinn_render::display::{Display, ViewTransform};
use blinn_render::integrator::{Aov, Frame, NeighbourFrames, Phong, Stage};
use blinn_render::{
    AdaptiveSampling, AovLayer, EdgeCache, Pixels, ProgressMonitor, RenderMemory, RenderSettings, draw_edges,
    render_light_layers, render_mattes, render_moving_aovs, render_with_memory,
};
use blinn_scene::{
    AxisRotation, Camera, ClipBoundsCache, Environment, LightRotation, Lighting, Normalization, PoseSettings,
    PosedScene, Scene,
};
use blinn_scene::{clip_duration, pose};

/// A scene with everything that its images share.
pub struct SceneRenderer<'a> {
    /// Settings that all frames share.
    pub setup: SceneSetup<'a>,
    /// The exposure of all images.
    pub exposure: ResolvedExposure,
    settings: RenderSettings,
    id_names: Arc<IdNames>,
    display: Display,
    /// Rotation from the scene's world to that of AOVs.
    aov_world: DMat3,
    /// Memory of finished images, for the next ones.
    memory: RenderMemory,
    /// The edges of meshes, if pictures show them.
    edges: EdgeCache,
    /// The light sources of all images.
    sources: String,
    /// The advice about dark pictures.
    advice: LightAdvice,
    /// True after the light of an image has been remarked on.
    has_light_remarks: AtomicBool,
    /// True after an image without edges has been remarked on.
    has_edge_remark: AtomicBool,
}

impl<'a> SceneRenderer<'a> {
    /// Resolves camera, lights and exposure for a number of frames. Also returns the scene at the start of its clip.
    pub fn new(
        plan: &SessionPlan,
        scene: &'a Scene,
        frames: usize,
        log: &'a dyn SessionLog,
        clip_bounds: &ClipBoundsCache,
        cancel: &CancelToken,
    ) -> Result<(SceneRenderer<'a>, PosedFrame<'a>), SessionError> {
        let animation = plan.options.animation(scene)?;
        let start = Instant::now();
        let posed = pose(scene, &PoseSettings { time: 0.0, animation, centre: None })?
            .with_clip_bounds_cache(clip_bounds);
        log.stage_since("pose", start, "");
        let mut first = PosedFrame { time: 0.0, posed, accel: None };
        let samples = plan.options.samples_of_frames(scene, frames);
        let preset = Preset::for_samples(samples, bvh_triangles(scene, plan.build.flatten));
        let build = AccelSettings { preset, ..plan.build };
        let session = SceneRenderer::resolve(plan, build, scene, log, &mut first, cancel)?;
        Ok((session, first))
    }

    /// Resolves camera, lights and exposure for a scene that is posed at the start of its clip. Builds the acceleration
    /// structure of `first` if the exposure is metered.
    pub fn from_start(
        plan: &SessionPlan,
        scene: &'a Scene,
        log: &'a dyn SessionLog,
        first: &mut PosedFrame<'_>,
        cancel: &CancelToken,
    ) -> Result<SceneRenderer<'a>, SessionError> {
        SceneRenderer::resolve(plan, plan.build, scene, log, first, cancel)
    }

    fn resolve(
        plan: &SessionPlan,
        build: AccelSettings,
        scene: &'a Scene,
        log: &'a dyn SessionLog,
        first: &mut PosedFrame<'_>,
        cancel: &CancelToken,
    ) -> Result<SceneRenderer<'a>, SessionError> {
        let plan = plan.for_scene(scene);
        plan.warn_of_unsupported(scene, log)?;
        let options = &plan.options;
        let animation = options.animation(scene)?;
        log_idle_animations(scene, &animation, log)?;

        let (width, height) = options.size_for(scene);
        let mut settings = options.render_settings((width, height), 0.0);
        check_crop(&settings)?;
        let framing =
            log_clip_bounds(log, &first.posed, || Framing::new(&plan, &first.posed, (width, height)))??;
        framing.log_cameras(&plan, log)?;
        cancel.check()?;
        let camera = framing.camera;
        let lit = options.lighting.resolve(&first.posed, &camera);
        log.note(Notice::Lights(lit.description.clone()));
        if uses_own_view_and_lights(&plan, scene) && !lit.rig.glowing_surfaces {
            log.hint(Notice::NoCameraAndLights);
        }
        let lighting = fixed_lighting(options.lighting.clone(), &lit);
        let clip_duration = clip_duration(scene, &animation)?;
        check_environment(&plan, &lit, log)?;
        let cancel = cancel.clone();
        let mut setup = SceneSetup {
            plan: plan.clone(),
            log,
            build,
            cancel,
            clip_duration,
            framing,
            lighting,
            background_blur: options.environment_blur(),
            unlit_scale: 1.0,
        };
        let exposure = resolve_exposure(&setup, first, &lit)?;
        let ev = exposure.ev;
        setup.unlit_scale = exposure.unlit_scale();
        settings.adaptive = settings.adaptive.map(|adaptive| AdaptiveSampling { ev, ..adaptive });
        if let Some(scale) = exposure.light_scale {
            let scaled = Lighting { scale, ..options.lighting.clone() };
            let lit = scaled.resolve(&first.posed, &camera);
            setup.lighting = fixed_lighting(scaled, &lit);
        }
        remark_on_options(options, &lit, &first.posed, log)?;
        let uses_near_plane = plan.cameras.is_none()
            && plan.dataset.is_none()
            && options.view.clip.is_none()
            && options.view.uses_file_camera(scene);
        if uses_near_plane && cuts_picture(&setup, first, camera, &settings)? {
            log.hint(Notice::NearPlane { near: camera.clip.near });
        }
        let display = display(options, scene, ev);
        if !display.look.is_of(display.view) {
            log.warn(Notice::LookOfOtherViews(display.look))?;
        }
        Ok(SceneRenderer {
            setup,
            exposure,
            settings,
            id_names: id_names(&plan, scene),
            display,
            aov_world: aov_world(&plan),
            memory: RenderMemory::default(),
            edges: EdgeCache::default(),
            advice: LightAdvice::of_lighting(&lit),
            sources: lit.description,
            // Without any light, a request for those of the file has had its warning.
            has_light_remarks: AtomicBool::new(lit.rig.is_dark() && asks_for_file_lights(options)),
            has_edge_remark: AtomicBool::new(options.edges.alone),
        })
    }

    /// Width and height of an image.
    pub fn size(&self) -> (u32, u32) {
        let window = self.settings.window();
        (window.width, window.height)
    }

    /// Number of pixels of an image; of the largest, if they differ.
    pub fn pixels(&self) -> u64 {
        let (width, height) = self.size();
        u64::from(width) * u64::from(height)
    }

    /// Number of pixels of the image of a frame.
    pub fn frame_pixels(&self, planned: &PlannedFrame) -> Result<u64, SessionError> {
        let Some(listed) = self.listed_camera(planned)? else { return Ok(self.pixels()) };
        let window = self.settings_for(&listed).window();
        Ok(u64::from(window.width) * u64::from(window.height))
    }

    /// Width and height of an image without crop.
    pub fn full_size(&self) -> (u32, u32) {
        (self.settings.width, self.settings.height)
    }

    /// The camera of a frame.
    pub fn camera(&self, planned: &PlannedFrame, posed: &PosedScene) -> Result<Camera, SessionError> {
        Ok(self.image_camera(planned, posed)?.camera)
    }

    /// The camera of a frame, with what the list or the dataset sets for its image.
    fn image_camera(&self, planned: &PlannedFrame, posed: &PosedScene) -> Result<ImageCamera, SessionError> {
        let options = &self.setup.plan.options;
        if let Some(listed) = self.listed_camera(planned)? {
            // An option takes precedence.
            return Ok(ImageCamera { depth_step: options.depth_unit.or(listed.depth_step), ..listed });
        }
        Ok(ImageCamera {
            light: planned.view.map_or(LightRotation::default(), |view| view.light),
            normalization: options.normalize.map(|_| options.normalization(posed)),
            ..self.plain_camera(options.camera(planned, posed, self.full_size())?)
        })
    }

    /// A camera with the settings of the plan.
    fn plain_camera(&self, camera: Camera) -> ImageCamera {
        ImageCamera {
            camera,
            size: self.full_size(),
            crop: self.settings.crop,
            depth_step: self.setup.framing.depth_step,
            light: LightRotation::default(),
            normalization: None,
        }
    }

    /// Renders an image with its AOVs. Also returns the reason if it shows nothing.
    pub fn render(
        &self,
        planned: &PlannedFrame,
        posed_frame: &PosedFrame<'a>,
        monitor: &dyn ProgressMonitor,
    ) -> Result<RenderedImage, SessionError> {
        let view = self.image_camera(planned, &posed_frame.posed)?;
        let image = self.render_camera(&view, planned, posed_frame, monitor)?;
        Ok(RenderedImage { view: Some(view), ..image })
    }

    /// The camera of a list.
    fn listed_camera(&self, planned: &PlannedFrame) -> Result<Option<ImageCamera>, SessionError> {
        let (Some(cameras), Some(index)) = (&self.setup.plan.cameras, planned.camera) else {
            return Ok(None);
        };
        Ok(Some(cameras.camera(index)?))
    }

    /// The settings for an image of another size.
    fn settings_for(&self, view: &ImageCamera) -> RenderSettings {
        let (width, height) = view.size;
        RenderSettings { width, height, crop: view.crop, ..self.settings }
    }

    /// Keeps the memory of an image that has been written, for the next one.
    pub fn recycle(&self, image: RenderedImage) {
        self.memory.recycle(image.picture.pixels);
    }

    /// Renders an image from any camera, as [`SceneRenderer::render`] does.
    pub fn render_view(
        &self,
        camera: Camera,
        planned: &PlannedFrame,
        posed_frame: &PosedFrame<'a>,
        monitor: &dyn ProgressMonitor,
    ) -> Result<RenderedImage, SessionError> {
        self.render_camera(&self.plain_camera(camera), planned, posed_frame, monitor)
    }

    /// Renders an image of any size from any camera, as [`SceneRenderer::render`] does.
    pub fn render_camera(
        &self,
        view: &ImageCamera,
        planned: &PlannedFrame,
        posed_frame: &PosedFrame<'a>,
        monitor: &dyn ProgressMonitor,
    ) -> Result<RenderedImage, SessionError> {
        let frame = self.setup.rotated_frame(planned.angle, posed_frame, view.camera)?;
        self.render_lit(view, turn_light(frame, &view.light), planned, posed_frame, monitor)
    }

    /// Renders an image of any frame, of a scene posed as `posed_frame`.
    pub fn render_frame(
        &self,
        frame: Frame,
        planned: &PlannedFrame,
        posed_frame: &PosedFrame<'a>,
        monitor: &dyn ProgressMonitor,
    ) -> Result<RenderedImage, SessionError> {
        self.render_lit(&self.plain_camera(frame.camera), frame, planned, posed_frame, monitor)
    }

    /// Changes the random numbers of the next images, as `--seed` does.
    pub fn set_seed(&mut self, seed: u32) {
        self.settings.seed = seed;
    }

    /// Renders an image of a frame that has the camera and the light of `view`.
    fn render_lit(
        &self,
        view: &ImageCamera,
        frame: Frame,
        planned: &PlannedFrame,
        posed_frame: &PosedFrame<'a>,
        monitor: &dyn ProgressMonitor,
    ) -> Result<RenderedImage, SessionError> {
        let settings = &self.settings_for(view);
        let SceneSetup { plan, log, framing, cancel, .. } = &self.setup;
        let options = &plan.options;
        let (width, height) = (settings.width, settings.height);
        // The ground is added last: it affects neither framing nor metering.
        let rounds = self.setup.round_sizes(frame.accel, &frame.camera, height);
        let frame = Frame { ground: framing.ground, rounds, ..frame };

        let start = Instant::now();
        let integrator = Phong { stage: options.stage };
        let mut pixels = match options.edges.alone {
            true => blank(settings),
            false => render_with_memory(&self.memory, &frame, &integrator, settings, monitor)?,
        };
        let detail = format!("{width}x{height}, {} samples, frame {}", settings.samples, planned.number);
        log.stage_since("render", start, &detail);
        let edges = picture_edges(&self.setup, &self.edges, &frame, settings)?;
        let empty = match options.edges.alone {
            true => empty_drawing(&frame, settings, edges.as_ref(), cancel)?,
            false => empty_reason(&frame, settings, &pixels, cancel)?,
        };
        if empty.is_none() {
            self.remark_on_image(&frame, settings, &pixels, edges.as_ref());
        }
        let start = Instant::now();
        let scene_to_world = DAffine3::from_mat3(self.aov_world) * frame.scene_to_world;
        let neighbours = self.neighbour_frames(planned, posed_frame)?;
        let [previous, next] =
            neighbours.each_ref().map(|n| n.as_ref().map(|n| n.frame(&self.setup)).transpose());
        let (previous, next) = (previous?, next?);
        let neighbours = NeighbourFrames { previous: previous.as_ref(), next: next.as_ref() };
        let frame_in_world = Frame { scene_to_world, ..frame.clone() };
        let (light_aovs, hit_aovs): (Vec<Aov>, Vec<Aov>) =
            options.aovs.aovs.iter().partition(|aov| aov.light().is_some());
        let mut layers = render_moving_aovs(&frame_in_world, &neighbours, &hit_aovs, settings, cancel)?;
        if !light_aovs.is_empty() {
            let light = render_light_layers(&frame, &integrator, settings, cancel)?;
            layers.extend(light_layers(&light_aovs, &light, &pixels, &self.display));
            let position = |layer: &AovLayer| options.aovs.aovs.iter().position(|aov| *aov == layer.aov);
            layers.sort_by_key(position);
        }
        if let Some(normalization) = view.normalization {
            let centre = self.aov_world * normalization.centre;
            normalize_layers(&mut layers, &Normalization { centre, ..normalization });
        }
        let mattes =
            if options.aovs.cryptomatte { render_mattes(&frame, settings, cancel)? } else { Vec::new() };
        if !options.aovs.is_empty() {
            log.stage_since("aovs", start, "");
        }
        let crop_window =
            settings.crop.map(|crop| CropWindow { crop, full_width: width, full_height: height });
        let depth_step = view.depth_step;
        if options.depth_unit.is_some() {
            check_depth_range(&layers, depth_step, planned.number, *log)?;
        }
        if let Some(edges) = edges {
            draw_edges(&mut pixels, &edges);
        }
        let picture = Picture { id_names: self.id_names.clone(), ..Picture::new(pixels, self.display) };
        let picture = Picture { layers, mattes, crop_window, depth_step, ..picture };
        Ok(RenderedImage { picture, empty, view: None })
    }

    /// Remarks on the edges and the light of the first image that shows something.
    fn remark_on_image(
        &self,
        frame: &Frame,
        settings: &RenderSettings,
        pixels: &Pixels,
        edges: Option<&Pixels>,
    ) {
        let SceneSetup { plan, log, lighting, .. } = &self.setup;
        if edges.is_some_and(is_blank) && !self.has_edge_remark.swap(true, Ordering::Relaxed) {
            log.hint(Notice::NoEdges);
        }
        if plan.options.edges.alone
            || plan.options.stage != Stage::Phong
            || self.has_light_remarks.swap(true, Ordering::Relaxed)
        {
            return;
        }
        let light = ImageLight {
            sources: &self.sources,
            advice: &self.advice,
            exposure: &self.exposure,
            lighting,
            view: self.display.view,
        };
        light.remarks(frame, pixels).into_iter().for_each(|notice| log.hint(notice));
        if settings.keeps_noise(frame) {
            log.hint(Notice::NoisySample);
        }
    }
}

/// A rendered image.
pub struct RenderedImage {
    /// Its pixels and layers.
    pub picture: Picture,
    /// The reason if it shows nothing.
    pub empty: Option<EmptyReason>,
    /// Its camera, for images of the plan's frames.
    pub view: Option<ImageCamera>,
}

/// The rotation from the scene's world to that of AOVs: the world of a dataset or of a list of cameras.
fn aov_world(plan: &SessionPlan) -> DMat3 {
    let listed = plan.cameras.as_ref().map(|cameras| cameras.world_up());
    let up = plan.dataset.map(|dataset| dataset.up).or(listed);
    up.map_or(DMat3::IDENTITY, WorldUp::rotation)
}

/// How images of a scene are displayed.
fn display(options: &Options, scene: &Scene, ev: f64) -> Display {
    Display {
        ev,
        view: options.view_transform.unwrap_or_else(|| ViewTransform::default_for(&scene.source)),
        look: options.look.unwrap_or_default(),
        gamma: options.gamma.unwrap_or(1.0) as f32,
        background: options.fixed_background(),
    }
}

/// The names for id layers, if there are any beside images.
fn id_names(plan: &SessionPlan, scene: &Scene) -> Arc<IdNames> {
    let has_names = plan.options.aovs.aovs.iter().any(|aov| aov.is_id()) && !plan.holds_layers;
    if !has_names {
        return Arc::default();
    }
    let materials = scene.materials.iter().map(|material| material.name.clone()).collect();
    Arc::new(IdNames { objects: scene.objects.clone(), materials })
}

/// Turns the light of a view.
fn turn_light<'f>(mut frame: Frame<'f>, rotation: &LightRotation) -> Frame<'f> {
    let (sources, environment) = (rotation.sources.to_radians(), rotation.environment.to_radians());
    let has_map = frame.sky.is_some();
    if sources != 0.0 {
        let pivot = frame.posed.clip_sphere().centre;
        let turn = AxisRotation { axis: DVec3::Y, pivot, angle: sources }.to_affine();
        let centre = frame.posed.centre;
        frame.lights = frame.lights.iter().map(|light| light.transformed(&turn, centre)).collect();
        frame.area_lights = frame.area_lights.iter().map(|light| light.transformed(&turn, centre)).collect();
        if !has_map {
            // The studio is the reflection of the lights.
            frame.environment = frame.environment.map(|map| map.rotated_about_y(sources));
        }
    }
    if environment != 0.0 && has_map {
        let turned = |map: Environment| map.rotated_about_y(environment);
        frame.environment = frame.environment.map(turned);
        frame.background = frame.background.map(turned);
        frame.sky = frame.environment.as_ref().map(Environment::ambient_irradiance);
    }
    frame
}
