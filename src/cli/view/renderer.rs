//! The one thread that renders for all viewers, and loads the scene again when its files change.

use std::collections::HashSet;
use std::path::PathBuf;
use std::sync::{Arc, Mutex};

use anyhow::Result;
use serde_json::{Value, json};

use super::commands;
use super::frame::{Frame, Quality, render_frame};
use super::hub::{Hub, Task, Turn, ViewerId};
use super::messages::{self, PickMessage, ViewMessage};
use super::outbox::{FrameMessage, Outbox};
use super::pick::pick;
use super::picture_plans::{PicturePlan, PicturePlans};
use super::quality::NextFrame;
use super::scene_cache::SceneCache;
use super::scene_message;
use super::start_state::start_state;
use super::state::{CameraState, ViewState};
use super::view_scene::ViewScene;
use super::visibility::HidePatterns;
use crate::console::{print_error, scene_error, single_line};
use crate::run::panics;
use crate::watched_files::{WatchedFiles, scene_files};
use blinn_core::cancellation::CancelToken;
use blinn_scene::Scene;

/// Size of the picture that is rendered before there is a viewer.
const FIRST_SIZE: (u32, u32) = (1280, 720);
const FIRST_QUALITY: Quality = Quality::Coarse { width: 96, height: 54 };

/// Renders for all viewers.
pub struct Renderer {
    hub: Arc<Hub>,
    plans: PicturePlans,
    scenes: SceneCache,
    description: Description,
    watched: Arc<Mutex<WatchedFiles>>,
    generation: u64,
    /// Seconds for a sample of a pixel before the first frame of a viewer.
    first_cost: f64,
}

/// A scene as the page knows it.
struct Description {
    message: Value,
    start: ViewState,
    objects: Vec<String>,
}

impl Renderer {
    /// Loads the scene, and renders a small picture to build all that pictures share.
    ///
    /// # Errors
    /// The scene cannot be loaded, or the options do not suit it.
    pub fn new(hub: Arc<Hub>, mut plans: PicturePlans) -> Result<Renderer> {
        let mut before = WatchedFiles::new(option_files(&plans));
        let mut loaded = load(&mut plans, 0);
        // Shows the first scene that can be loaded.
        for file in plans.files.clone().into_iter().skip(1) {
            if let Err(error) = &loaded {
                print_error(&single_line(&scene_error(&plans.path, error)));
                plans.path = file;
                before = WatchedFiles::new(option_files(&plans));
                loaded = load(&mut plans, 0);
            }
        }
        let (scenes, description) = loaded?;
        let watched = before.with(watched_files(&plans, scenes.scene()?));
        let watched = Arc::new(Mutex::new(watched));
        let mut renderer =
            Renderer { hub, plans, scenes, description, watched, generation: 0, first_cost: 0.0 };
        let message = ViewMessage {
            serial: 0,
            moving: false,
            size: FIRST_SIZE,
            view: renderer.description.start.clone(),
        };
        // The first picture builds and fills caches, the second shows what pictures cost.
        for _ in 0..2 {
            let (_, frame) = renderer.render(&message, FIRST_QUALITY, &CancelToken::default())?;
            renderer.first_cost = frame.cost();
        }
        Ok(renderer)
    }

    /// The files whose changes matter.
    pub fn watched(&self) -> Arc<Mutex<WatchedFiles>> {
        self.watched.clone()
    }

    /// Renders until the process ends.
    pub fn run(mut self) {
        loop {
            match self.hub.next_turn() {
                Turn::Reload => {
                    self.load(None);
                    self.hub.reloaded();
                }
                Turn::Open(file) => {
                    if let Some(path) = self.plans.files.get(file).cloned() {
                        self.load(Some(path));
                    }
                }
                Turn::Viewer { id, outbox, task } => self.serve(id, &outbox, task),
            }
        }
    }

    fn serve(&mut self, id: ViewerId, outbox: &Outbox, task: Task) {
        match task {
            Task::Scene => {
                let message = self.hub.message(id);
                let view = message.as_ref().map_or(&self.description.start, |message| &message.view);
                outbox.scene(scene_message::with_view(&self.description.message, view).into());
            }
            Task::Pick { pick, message } => {
                let picked = panics::catch(|| self.pick(pick, message.as_deref()));
                if let Err(error) = &picked {
                    outbox.error(self.error_message(error).into());
                }
                outbox.picked(messages::picked(pick.serial, picked.unwrap_or_default()));
            }
            Task::Frame { message, next, cost, cancel } => {
                self.serve_frame(id, outbox, &message, next, cost, &cancel);
            }
        }
    }

    fn serve_frame(
        &mut self,
        id: ViewerId,
        outbox: &Outbox,
        message: &ViewMessage,
        next: NextFrame,
        cost: Option<f64>,
        cancel: &CancelToken,
    ) {
        let samples = message.view.samples;
        let quality = next.quality(message.size, samples, cost.unwrap_or(self.first_cost));
        let serial = message.serial;
        match panics::catch(|| self.render(message, quality, cancel)) {
            Ok((picture, frame)) => {
                let cost = frame.cost();
                let header = frame.header(serial);
                // Before the frame, which may be the last: the page then has the command of what it shows.
                if !message.moving && !next.is_refinement() {
                    outbox.command(self.command_message(message, &picture, &frame.warnings));
                }
                outbox.frame(FrameMessage { header, bytes: frame.bytes });
                self.hub.frame_done(id, serial, Some(cost), next.after(quality, samples));
            }
            Err(_) if cancel.is_cancelled() => self.hub.frame_cancelled(id, serial, next),
            Err(error) => {
                outbox.error(self.error_message(&error).into());
                self.hub.frame_done(id, serial, None, None);
            }
        }
    }

    fn render(
        &mut self,
        message: &ViewMessage,
        quality: Quality,
        cancel: &CancelToken,
    ) -> Result<(PicturePlan, Frame)> {
        let picture = self.plans.plan(message, &mut self.scenes, cancel)?;
        let path = &self.plans.path;
        let view_scene = self.scenes.show(&picture.plan, path, cancel)?;
        let frame = render_frame(view_scene, &picture.plan, path, quality, cancel)?;
        Ok((picture, frame))
    }

    fn pick(
        &mut self,
        question: PickMessage,
        message: Option<&ViewMessage>,
    ) -> Result<Option<super::pick::Picked>> {
        let Some(message) = message else { return Ok(None) };
        let cancel = CancelToken::default();
        let picture = self.plans.plan(message, &mut self.scenes, &cancel)?;
        let path = &self.plans.path;
        let view_scene = self.scenes.show(&picture.plan, path, &cancel)?;
        pick(view_scene, &picture.plan, path, question.x, question.y)
    }

    fn command_message(&self, message: &ViewMessage, picture: &PicturePlan, warnings: &[String]) -> String {
        let path = &self.plans.path;
        let render = commands::render_command(&picture.flags, path).unwrap_or_default();
        let turntable = commands::turntable_command(&picture.flags, &picture.plan.session.options, path);
        let hidden = self.plans.patterns.all_hidden(&message.view.hidden);
        messages::command(message.serial, &render, turntable.as_deref(), &hidden, warnings)
    }

    fn error_message(&self, error: &anyhow::Error) -> String {
        messages::error(&single_line(&format!("{error:#}")))
    }

    /// Loads the scene again, or another one. After an error, the old one stays.
    fn load(&mut self, other: Option<PathBuf>) {
        let state = if other.is_some() { "loading" } else { "reloading" };
        let carry: CarryOver = if other.is_some() { carry_options } else { carry_over };
        let status: Arc<str> = messages::status(state, "").into();
        self.hub.outboxes().iter().for_each(|outbox| outbox.status(status.clone()));
        let before = match &other {
            Some(path) => WatchedFiles::new(vec![path.clone()]),
            None => self.lock_watched(|watched| watched.now()),
        };
        let old_path = self.plans.path.clone();
        self.plans.path = other.unwrap_or_else(|| old_path.clone());
        self.generation += 1;
        match panics::catch(|| load(&mut self.plans, self.generation)) {
            Ok((scenes, description)) => {
                let messages = self.hub.messages().into_iter();
                let messages = messages.map(|(id, message)| {
                    let carried = message.map(|message| ViewMessage {
                        view: carry(&message.view, &self.description, &description),
                        ..(*message).clone()
                    });
                    (id, carried)
                });
                let messages = messages.collect();
                let files = scenes.scene().map(|scene| watched_files(&self.plans, scene)).unwrap_or_default();
                self.scenes = scenes;
                self.description = description;
                // Files that are no longer used matter no more.
                let watched = before.only(|path| files.iter().any(|file| file == path)).with(files);
                self.lock_watched(|current| *current = watched);
                self.hub.replace_scene(messages);
            }
            Err(error) => {
                let line = single_line(&scene_error(&self.plans.path, &error));
                print_error(&line);
                let text: Arc<str> = messages::scene_error(&line).into();
                let status: Arc<str> = messages::status("idle", "").into();
                for outbox in self.hub.outboxes() {
                    outbox.status(status.clone());
                    outbox.error(text.clone());
                }
                if self.plans.path == old_path {
                    self.lock_watched(|current| *current = before);
                }
                self.plans.path = old_path;
            }
        }
    }

    fn lock_watched<T>(&self, function: impl FnOnce(&mut WatchedFiles) -> T) -> T {
        function(&mut self.watched.lock().unwrap_or_else(|e| e.into_inner()))
    }
}

/// Makes the state of a view for another scene from that for an old one.
type CarryOver = fn(&ViewState, &Description, &Description) -> ViewState;

/// Loads the scene and describes it.
fn load(plans: &mut PicturePlans, generation: u64) -> Result<(SceneCache, Description)> {
    let plan = plans.start_plan().map_err(|error| anyhow::Error::msg(error.0))?;
    let mut view_scene = ViewScene::load(&plan, &plans.path, &CancelToken::default())?;
    let warnings = view_scene.warnings()?.to_vec();
    let file = plans.path.to_string_lossy();
    let start = &plans.start;
    let names: Vec<_> = plans.files.iter().map(|file| file.to_string_lossy()).collect();
    let files = json!({"index": plans.file_index(), "names": names});
    let (mut message, start, scene_diameter) = view_scene.with_poses(|_, poses| {
        let posed = &poses.start.posed;
        let sphere = posed.clip_sphere();
        let message = scene_message::describe(posed, &file, &warnings, start, generation);
        Ok((message, start_state(&plan, start, posed)?, 2.0 * sphere.radius.max(f64::MIN_POSITIVE)))
    })?;
    message["files"] = files;
    message["start"] = json!(start);
    let scene = view_scene.scene()?;
    let description = Description { message, start, objects: scene.objects.clone() };
    plans.patterns = HidePatterns::new(scene);
    plans.scene_diameter = scene_diameter;
    plans.forget();
    Ok((SceneCache::new(view_scene), description))
}

/// The files that flags name.
fn option_files(plans: &PicturePlans) -> Vec<PathBuf> {
    let values = ["hdri", "camera-xml"].into_iter().filter_map(|flag| plans.start.all.value(flag));
    let files = values.map(PathBuf::from).filter(|path| path.exists());
    std::iter::once(plans.path.clone()).chain(files).collect()
}

fn watched_files(plans: &PicturePlans, scene: &Scene) -> Vec<PathBuf> {
    let mut files = option_files(plans);
    files.extend(scene_files(&plans.path, scene.source.file_names()));
    files
}

/// The state of a view for the scene after a reload: objects are found by their names.
fn carry_over(view: &ViewState, old: &Description, new: &Description) -> ViewState {
    let hidden_names: HashSet<&String> =
        view.hidden.iter().filter_map(|object| old.objects.get(*object as usize)).collect();
    let hidden = (0u32..).zip(&new.objects).filter(|(_, name)| hidden_names.contains(name));
    let count = |list: &str| new.message[list].as_array().map_or(0, Vec::len);
    let has_variant = |name: &String| {
        new.message["variants"].as_array().is_some_and(|all| all.iter().any(|other| other == name))
    };
    let camera = match &view.camera {
        CameraState::File { index } if *index as usize >= count("cameras") => new.start.camera.clone(),
        camera => camera.clone(),
    };
    ViewState {
        camera,
        hidden: hidden.map(|(object, _)| object).collect(),
        variant: view.variant.clone().filter(has_variant),
        animation: view.animation.filter(|index| (*index as usize) < count("animations")),
        ..view.clone()
    }
}

/// The state of a view for another scene: its own camera and objects, and the options that were changed for the old one.
fn carry_options(view: &ViewState, old: &Description, new: &Description) -> ViewState {
    fn changed<T: Clone + PartialEq>(view: &T, old: &T, new: &T) -> T {
        if view == old { new.clone() } else { view.clone() }
    }
    let (old, start) = (&old.start, &new.start);
    let offers_lights = new.message["choices"]["lights"]
        .as_array()
        .is_some_and(|all| all.iter().any(|lights| *lights == view.lights));
    let lights =
        if offers_lights { changed(&view.lights, &old.lights, &start.lights) } else { start.lights.clone() };
    ViewState {
        lights,
        exposure: changed(&view.exposure, &old.exposure, &start.exposure),
        view_transform: changed(&view.view_transform, &old.view_transform, &start.view_transform),
        hdri: changed(&view.hdri, &old.hdri, &start.hdri),
        hdri_rotate: changed(&view.hdri_rotate, &old.hdri_rotate, &start.hdri_rotate),
        background: changed(&view.background, &old.background, &start.background),
        ground: changed(&view.ground, &old.ground, &start.ground),
        ao: changed(&view.ao, &old.ao, &start.ao),
        samples: changed(&view.samples, &old.samples, &start.samples),
        ..start.clone()
    }
}
