//! Options that a scene's file gives where the user gives none.

use std::sync::Arc;

use crate::error::SessionError;
use crate::frame_neighbours::FrameNeighbours;
use crate::log::SessionLog;
use crate::notice::Notice;
use crate::options::{Exposure, ImageBackground, Options};
use crate::plan::SessionPlan;
use blinn_render::PixelRect;
use blinn_render::display::{Background, Look, ViewTransform};
use blinn_render::integrator::Stage;
use blinn_scene::{FileSettings, LightSet, Scene};

impl SessionPlan {
    /// The plan for a scene: options that are not given are those of its file.
    pub(crate) fn for_scene(&self, scene: &Scene) -> Arc<SessionPlan> {
        let mut plan = self.clone();
        plan.options.add_file_settings(scene);
        // A dataset and a list have cameras of their own.
        if plan.options.crop.is_none() && self.dataset.is_none() && self.cameras.is_none() {
            plan.options.crop = plan.options.region(scene);
        }
        if let (FrameNeighbours::Animation { fps }, Some(frames)) =
            (&mut plan.neighbours, &scene.settings.frames)
        {
            fps.get_or_insert(frames.rate);
        }
        Arc::new(plan)
    }

    /// Warns once of all that the file asks for and images lack.
    pub(crate) fn warn_of_unsupported(
        &self,
        scene: &Scene,
        log: &dyn SessionLog,
    ) -> Result<(), SessionError> {
        let settings = &scene.settings;
        let mut missing = Vec::new();
        if self.options.view_transform.is_none()
            && let Some(name) = settings.view_transform.as_ref().filter(|name| view_transform(name).is_none())
        {
            missing.push(format!("view transform '{name}'"));
        }
        if self.options.look.is_none()
            && let Some(name) = settings.look.as_ref().filter(|name| file_look(settings, name).is_none())
        {
            missing.push(format!("look '{name}'"));
        }
        if missing.is_empty() { Ok(()) } else { log.warn(Notice::UnsupportedSettings(missing)) }
    }
}

impl Options {
    /// Sets the options that are not given and that the file of `scene` gives.
    fn add_file_settings(&mut self, scene: &Scene) {
        let settings = &scene.settings;
        self.exposure = self.exposure.or(settings.exposure.map(Exposure::Stops));
        let view = settings.view_transform.as_deref().and_then(view_transform);
        if self.view_transform.is_none() {
            // A look and a gamma are made for one view.
            let look = settings.look.as_deref().and_then(|name| file_look(settings, name));
            self.look = self.look.or(look);
            self.gamma = self.gamma.or(settings.gamma);
        }
        self.view_transform = self.view_transform.or(view);
        // Ambient occlusion weights the ambient light, which indirect light replaces.
        self.indirect = self.indirect.or(settings.indirect.filter(|_| self.ao.is_none()));
        self.caustics = self.caustics.or(settings.caustics);
        if self.background.is_none() && self.stage == Stage::Phong {
            self.background = match settings.film_transparent {
                Some(true) => Some(ImageBackground::Fixed(Background::Transparent)),
                Some(false) if self.has_environment(scene) => Some(ImageBackground::Environment),
                _ => None,
            };
        }
    }

    /// True if an environment lights the scene.
    fn has_environment(&self, scene: &Scene) -> bool {
        let lighting = &self.lighting;
        let shows_file = lighting.sets.as_ref().is_none_or(|sets| sets.contains(&LightSet::File));
        let uses_file = scene.environment.is_some() && lighting.ambient.is_none() && shows_file;
        uses_file || self.environment.is_some() || lighting.environment.is_some()
    }

    /// The file's region in pixels, if images show what the file's camera sees.
    fn region(&self, scene: &Scene) -> Option<PixelRect> {
        let region = scene.settings.region.filter(|_| self.view.uses_file_camera(scene))?;
        let [x, y, width, height] = region.pixels(self.size_for(scene))?;
        Some(PixelRect { x, y, width, height })
    }
}

/// The look of a file; `None` if its view transform is not supported or has none of this name.
fn file_look(settings: &FileSettings, name: &str) -> Option<Look> {
    let view = settings.view_transform.as_deref().and_then(view_transform);
    match name {
        "" | "None" => Some(Look::None),
        _ => Look::of_blender(name, view?),
    }
}

/// The view transform that Blender calls `name`.
fn view_transform(name: &str) -> Option<ViewTransform> {
    match name {
        "Standard" => Some(ViewTransform::Standard),
        "AgX" => Some(ViewTransform::Agx),
        "Filmic" => Some(ViewTransform::Filmic),
        "Khronos PBR Neutral" => Some(ViewTransform::PbrNeutral),
        "Raw" => Some(ViewTransform::Raw),
        _ => None,
    }
}
