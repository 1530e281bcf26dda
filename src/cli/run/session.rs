//! A scene set up for its pictures: whatever all frames share is found once, so that nothing
//! flickers, and any share of the frames is the same pictures as the whole.

use std::time::Instant;

use anyhow::{Result, bail};
use glam::{DAffine3, DMat3};

use crate::accel::{Accel, BuildReport, BuildSettings};
use crate::cli::args::values::Layers;
use crate::cli::plan::{Job, Look, Shot, Turning};
use crate::cli::run::framed::{Framed, looking};
use crate::cli::run::metering;
use crate::cli::run::metering::Exposed;
use crate::cli::run::progress::Teller;
use crate::display::{Display, ViewTransform};
use crate::integrator::{Frame, Phong};
use crate::output::{CropWindow, Picture};
use crate::render::{AdaptiveSampling, ProgressMonitor, RenderSettings, render, render_aovs, render_mattes};
use crate::scene::pose;
use crate::scene::{
    Animation, AnimationChoice, AxisRotation, Camera, GroundKind, Lighting, PoseSettings, PosedScene,
    ResolvedLighting, Scene, active_animations, clip_duration,
};

/// A scene with all that its pictures share.
pub(crate) struct Studio<'a> {
    pub look: &'a Look,
    pub teller: &'a Teller<'a>,
    build: BuildSettings,
    /// When the clip ends, in seconds: the last pose holds from there on.
    pub end: f64,
    settings: RenderSettings,
    framed: Framed,
    /// Its sources and its ambient colour are those of the clip's start.
    pub lighting: Lighting,
    /// How its pictures are exposed, by hand or by meter.
    pub exposed: Exposed,
    display: Display,
    /// From the scene's world to that of layers.
    world: DMat3,
}

/// A scene at one moment.
pub(crate) struct Moment<'s> {
    time: f64,
    pub posed: PosedScene<'s>,
    /// Its trees, from when they are first needed.
    pub accel: Option<Accel>,
}

impl<'a> Studio<'a> {
    /// Sets up `scene`; with it comes the scene at the start of its clip.
    pub fn new(job: &'a Job, scene: &'a Scene, teller: &'a Teller<'a>) -> Result<(Studio<'a>, Moment<'a>)> {
        let look = &job.look;
        let animation = look.animation(scene)?;
        if let Some(text) = idle(scene, &animation)? {
            teller.note(&text);
        }
        let start = Instant::now();
        let posed = pose(scene, &PoseSettings { time: 0.0, animation: animation.clone(), centre: None })?;
        teller.stage("pose", start, "");
        let mut moment = Moment { time: 0.0, posed, accel: None };

        let (width, height) = look.size_for(scene);
        let settings = RenderSettings { width, height, ..look.settings };
        check_crop(&settings)?;
        let framed = looking(teller, &moment.posed, || Framed::of(job, &moment.posed, (width, height)))?;
        teller.note(&format!("camera: {}", framed.notes.description));
        for warning in &framed.notes.warnings {
            teller.warn(warning)?;
        }
        let camera = framed.camera;
        let lit = look.lighting.resolve(&moment.posed, &camera);
        teller.note(&format!("lights: {}", lit.description));
        let mut studio = Studio {
            look,
            teller,
            build: job.build,
            end: clip_duration(scene, &animation)?,
            settings,
            framed,
            lighting: settled(look.lighting.clone(), &lit),
            exposed: Exposed::default(),
            display: Display {
                ev: 0.0,
                view: look.view_transform.unwrap_or_else(|| ViewTransform::default_for(&scene.source)),
                background: look.background,
            },
            world: job.views.map_or(DMat3::IDENTITY, |views| views.up.turn()),
        };
        studio.exposed = metering::expose(&studio, &mut moment, &lit)?;
        let ev = studio.exposed.ev;
        studio.display.ev = ev;
        studio.settings.adaptive = settings.adaptive.map(|adaptive| AdaptiveSampling { ev, ..adaptive });
        if let Some(scale) = studio.exposed.light_scale {
            let scaled = Lighting { scale, ..look.lighting.clone() };
            let lit = scaled.resolve(&moment.posed, &camera);
            studio.lighting = settled(scaled, &lit);
        }
        if look.ground == Some(GroundKind::ShadowCatcher) && lit.rig.lights.is_empty() && look.ao.is_none() {
            teller.warn("--ground shadow shows nothing: no light casts a shadow, and --ao is not given")?;
        }
        Ok((studio, moment))
    }

    /// True where `moment` is what is seen at `time`.
    pub fn is_at(&self, moment: &Moment, time: f64) -> bool {
        moment.time == time.min(self.end)
    }

    /// The scene at `time`, with its trees, out of what it was at another. Trees of a moment that
    /// has been are made to fit: less work where little moves.
    pub fn at(&self, time: f64, other: &Moment<'a>, trees: Option<Accel>) -> Result<Moment<'a>> {
        let time = time.min(self.end);
        let start = Instant::now();
        let posed = other.posed.at_time(time);
        self.teller.stage("pose", start, "");
        let mut moment = Moment { time, posed, accel: None };
        match trees {
            Some(mut accel) => {
                let start = Instant::now();
                let cleaned = accel.update(&moment.posed);
                moment.accel = Some(accel);
                self.teller.stage("update", start, &without_area(&cleaned));
                self.tell(&cleaned)?;
            }
            None => self.build(&mut moment)?,
        }
        Ok(moment)
    }

    /// Builds the trees of a moment that has none.
    pub fn build(&self, moment: &mut Moment) -> Result<()> {
        if moment.accel.is_some() {
            return Ok(());
        }
        let start = Instant::now();
        let (accel, cleaned) = Accel::build(&moment.posed, &self.build);
        moment.accel = Some(accel);
        self.teller.stage("build", start, &without_area(&cleaned));
        self.tell(&cleaned)
    }

    fn tell(&self, cleaned: &BuildReport) -> Result<()> {
        left_out(cleaned).map_or(Ok(()), |text| self.teller.warn(&text))
    }

    /// What `camera` sees, without a ground.
    pub fn frame<'m>(&self, moment: &'m Moment<'m>, camera: Camera) -> Result<Frame<'m>> {
        let Some(accel) = &moment.accel else { bail!("the scene has no trees") };
        let lit = self.lighting.resolve(&moment.posed, self.framed.rest.as_ref().unwrap_or(&camera));
        Ok(Frame {
            overrides: self.look.overrides,
            cull_back_faces: self.look.cull,
            shadows: self.look.shadows,
            ambient_occlusion: self.framed.occlusion,
            ..Frame::new(&moment.posed, accel, camera, &lit)
        })
    }

    /// What `camera` sees once it, or the scene, is turned.
    fn turned<'m>(&self, angle: f64, moment: &'m Moment<'m>, camera: Camera) -> Result<Frame<'m>> {
        let Some(Turning { axis, camera: by_camera }) = self.look.turning else {
            return self.frame(moment, camera);
        };
        let motion = AxisRotation { axis, pivot: self.framed.pivot, angle }.to_affine();
        if by_camera {
            self.frame(moment, camera.transformed(&motion))
        } else {
            Ok(self.frame(moment, camera)?.with_scene_motion(&motion))
        }
    }

    /// Width and height of a picture.
    pub fn size(&self) -> (u32, u32) {
        let window = self.settings.window();
        (window.width, window.height)
    }

    /// Pixels of a picture.
    pub fn pixels(&self) -> u64 {
        let (width, height) = self.size();
        u64::from(width) * u64::from(height)
    }

    /// Renders a picture of the scene at its moment.
    pub fn picture(&self, shot: &Shot, moment: &Moment, watch: &dyn ProgressMonitor) -> Result<Picture> {
        let settings = &self.settings;
        let (width, height) = (settings.width, settings.height);
        let camera = self.look.camera(shot, &moment.posed, (width, height))?;
        let frame = self.turned(shot.angle, moment, camera)?;
        // The ground comes last: it changes neither what is framed nor what is metered.
        let frame = Frame { ground: self.framed.ground, ..frame };

        let start = Instant::now();
        let pixels = render(&frame, &Phong { stage: self.look.stage }, settings, watch)?;
        let what = format!("{width}x{height}, {} samples, frame {}", settings.samples, shot.frame);
        self.teller.stage("render", start, &what);
        let start = Instant::now();
        // Places and directions are said in the world that a dataset is in.
        let placed = DAffine3::from_mat3(self.world) * frame.scene_to_world;
        let layers = render_aovs(
            &Frame { scene_to_world: placed, ..frame.clone() },
            &self.look.layers.aovs,
            settings,
            &(),
        )?;
        let mattes = match self.look.layers.cryptomatte {
            true => render_mattes(&frame, settings, &())?,
            false => Vec::new(),
        };
        if self.look.layers != Layers::default() {
            self.teller.stage("layers", start, "");
        }
        let crop_window = settings.crop.map(|crop| CropWindow { crop, width, height });
        let depth_step = self.framed.depth_step;
        Ok(Picture { layers, mattes, crop_window, depth_step, ..Picture::new(pixels, self.display) })
    }
}

/// The same lighting for every frame: its sources and its ambient colour are those that were resolved.
fn settled(lighting: Lighting, lit: &ResolvedLighting) -> Lighting {
    Lighting { sets: Some(lit.sets.clone()), ambient: Some(lit.rig.ambient), ..lighting }
}

/// Which animations do not play for want of a choice, in words.
fn idle(scene: &Scene, choice: &AnimationChoice) -> Result<Option<String>> {
    let (plays, idle) = scene.animations.split_at(active_animations(scene, choice)?.len());
    let names = |of: &[Animation]| of.iter().map(|a| format!("'{}'", a.name)).collect::<Vec<_>>().join(", ");
    let (plays, others) = (names(plays), names(idle));
    let text =
        format!("animation: {plays}; left out: {others}: some drive the same, and --animation chooses");
    Ok((*choice == AnimationChoice::Default && !idle.is_empty()).then_some(text))
}

fn check_crop(settings: &RenderSettings) -> Result<()> {
    let (width, height) = (settings.width, settings.height);
    if let Some(crop) = settings.crop
        && (u64::from(crop.x) + u64::from(crop.width) > u64::from(width)
            || u64::from(crop.y) + u64::from(crop.height) > u64::from(height))
    {
        bail!("--crop reaches beyond the picture of {width}x{height} pixels");
    }
    Ok(())
}

/// What pictures lack of a scene, in words.
pub(crate) fn left_out(report: &BuildReport) -> Option<String> {
    let count = report.non_finite;
    (count > 0).then(|| format!("triangles left out: {count} with vertices that are not finite numbers"))
}

/// Triangles of which pictures lack nothing, in words: they cover no point, and nearly every program writes some.
fn without_area(report: &BuildReport) -> String {
    match report.zero_area {
        0 => String::new(),
        count => format!("{count} triangles without area"),
    }
}
