//! Scenes as programs load them.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use crate::blend::load_scene;
use crate::error::SessionError;
use crate::options::{BackFaceCulling, Options};
use blinn_import::{LoadOptions, Warning};
use blinn_scene::{Scene as SceneData, Selection};

/// A scene and where it comes from.
///
/// ```no_run
/// use blinn_session::{Options, Scene};
///
/// let scene = Scene::load("chair.glb")?;
/// let options = Options { size: Some((640, 480)), samples: 16, ..Options::default() };
/// scene.render(&options)?.save("chair.png")?;
/// # Ok::<(), blinn_session::SessionError>(())
/// ```
#[derive(Clone, Debug)]
pub struct Scene {
    /// Meshes, materials, lights and cameras of the file.
    pub data: Arc<SceneData>,
    /// The scene's file.
    pub path: PathBuf,
    /// Defects of the file that were repaired or ignored.
    pub warnings: Vec<Warning>,
    load: LoadOptions,
}

impl Scene {
    /// Loads a glTF, GLB, OBJ or .blend file as `blinn render` does ([`load_scene`]).
    ///
    /// # Errors
    /// The file cannot be read, is malformed, exceeds a limit or needs an unsupported feature.
    pub fn load(path: impl AsRef<Path>) -> Result<Scene, SessionError> {
        Scene::load_with(path, &LoadOptions::default())
    }

    /// Loads a file with options. Pictures of the scene need the same in [`Options::load`].
    ///
    /// # Errors
    /// As [`Scene::load`].
    pub fn load_with(path: impl AsRef<Path>, options: &LoadOptions) -> Result<Scene, SessionError> {
        let path = path.as_ref().to_path_buf();
        let (data, warnings) = load_scene(&path, options, None)?;
        Ok(Scene { data: Arc::new(data), path, warnings, load: options.clone() })
    }

    /// The scene with the parts that `options` select.
    pub(crate) fn prepared(&self, options: &Options) -> Result<Arc<SceneData>, SessionError> {
        if options.load != self.load {
            let text = "the options for reading the file differ from those of Scene::load_with";
            return Err(SessionError::Option(text.into()));
        }
        if options.selection == Selection::default() && options.cull != BackFaceCulling::All {
            return Ok(self.data.clone());
        }
        let mut data = SceneData::clone(&self.data);
        prepare_scene(options, &mut data)?;
        Ok(Arc::new(data))
    }
}

/// Removes the objects that `options` hide, and makes materials single-sided for [`BackFaceCulling::All`].
///
/// # Errors
/// The objects to show or hide are not found.
pub fn prepare_scene(options: &Options, scene: &mut SceneData) -> Result<(), SessionError> {
    scene.select(&options.selection)?;
    if options.cull == BackFaceCulling::All {
        scene.materials.iter_mut().for_each(|material| material.double_sided = false);
    }
    Ok(())
}
