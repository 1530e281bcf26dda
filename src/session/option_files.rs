//! The files that options name: the environment map and the camera.

use crate::environment_cache::load_cached;
use crate::error::SessionError;
use crate::options::{EnvironmentSource, Options};
use crate::shared_memory::program_bytes;
use blinn_import::{Limits, load_camera_xml, load_environment};
use blinn_scene::{Environment, View};

impl Options {
    /// Reads the files that the options name, and replaces their names by their contents. A [`Session`](crate::Session)
    /// does so when it starts.
    ///
    /// # Errors
    /// A file cannot be read, is damaged, exceeds `limits`, or does not suit the other options.
    pub fn read_files(&mut self, limits: &Limits) -> Result<(), SessionError> {
        if let Some(path) = &self.camera_file {
            let file = load_camera_xml(path).map_err(|e| SessionError::OptionFile("camera-xml", e))?;
            self.view = completed(&self.view, &file);
            self.check_projection().map_err(SessionError::Option)?;
            self.camera_file = None;
        }
        if let Some(source) = &self.environment {
            let environment = match source {
                EnvironmentSource::File(path) => {
                    let limits = Limits { taken_bytes: program_bytes(), ..limits.clone() };
                    load_cached(path, limits.file_bytes, || load_environment(path, &limits))
                        .map_err(|e| SessionError::OptionFile("hdri", e))?
                }
                EnvironmentSource::Studio => Environment::studio(),
                EnvironmentSource::Sky => Environment::sky(),
            };
            self.lighting.environment = Some(environment);
            self.environment = None;
        }
        Ok(())
    }
}

/// The view with what only the camera of a file has.
fn completed(view: &View, file: &View) -> View {
    // A field of view and the like replace the file's view rectangle, a point to look at its direction.
    let keeps_rectangle = view.yfov.is_none() && view.view_rect.is_none() && view.intrinsics.is_none();
    let keeps_direction = view.look_at.is_none();
    View {
        view_point: view.view_point.or(file.view_point),
        view_dir: view.view_dir.or(file.view_dir.filter(|_| keeps_direction)),
        view_up: view.view_up.or(file.view_up),
        proj_distance: view.proj_distance.or(file.proj_distance),
        view_width: view.view_width.or(file.view_width.filter(|_| keeps_rectangle)),
        view_height: view.view_height.or(file.view_height.filter(|_| keeps_rectangle)),
        projection: view.projection.or(file.projection),
        ..view.clone()
    }
}
