//! Plans for images that no list of frames or cameras describes, and the files that options name.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::outputs::Outputs;
use super::path_conflicts::{PathConflicts, Writer};
use super::sequence_info::SequenceInfo;
use super::{FormatsPlan, FrameSet, RenderPlan, SceneList, ScopedChunk, build_settings};
use crate::args::OutputArgs;
use crate::usage::UsageError;
use blinn_output::ImageFormat;
use blinn_session::{EnvironmentSource, Options, PlannedFrame, SessionPlan, load_limits};

/// How images of any plan are made.
#[derive(Clone, Copy, Debug)]
pub struct ImagePolicy {
    /// True to treat warnings as errors.
    pub strict: bool,
    /// Memory limit in bytes.
    pub max_memory: Option<u64>,
    /// Name of images in a folder; `None` is the usual one.
    pub image_name: Option<&'static str>,
    /// True if one file shows all scenes: its name is that of no scene, and [`RenderPlan::check_shared_files`] checks it.
    pub is_shared: bool,
}

impl RenderPlan {
    /// The plan for one image of each scene, at `time`.
    pub fn for_images(
        scenes: SceneList,
        options: Options,
        time: f64,
        output: &OutputArgs,
        policy: ImagePolicy,
    ) -> Result<RenderPlan, UsageError> {
        let frames = FrameSet::Single(PlannedFrame::at(1, time));
        let sequence = SequenceInfo {
            is_batch: scenes.is_batch(),
            image_name: policy.image_name,
            ..SequenceInfo::default()
        };
        let outputs = Outputs::new(output, &sequence, &frames, &options)?;
        let session = SessionPlan::new(options);
        let plan = RenderPlan {
            scenes: Arc::new(scenes),
            chunk: ScopedChunk::default(),
            frames,
            session: SessionPlan {
                build: build_settings()?,
                holds_layers: outputs.holds_aovs(),
                encoding_bytes: outputs.encoding_bytes(),
                max_memory: policy.max_memory,
                ..session
            },
            outputs,
            formats: FormatsPlan::default(),
            check: None,
            random_per_scene: false,
            strict: policy.strict,
            dry_run: false,
        };
        if policy.is_shared { Ok(plan) } else { plan.checked(None) }
    }

    /// Checks that no file that shows all scenes is an input.
    ///
    /// # Errors
    /// A file is a scene or is named by an option, or the list of scenes cannot be read.
    pub fn check_shared_files(&self, files: impl Iterator<Item = PathBuf>) -> Result<(), UsageError> {
        let options = &self.session.options;
        let environment = options.environment.as_ref().and_then(EnvironmentSource::file);
        let mut inputs: Vec<PathBuf> = [environment, options.camera_file.as_deref()]
            .into_iter()
            .flatten()
            .map(Path::to_path_buf)
            .collect();
        for scene in self.scenes.iter() {
            // Files with the names of other formats are no images, and there may be many.
            inputs.extend(Some(scene?).filter(|scene| ImageFormat::from_path(scene).is_some()));
        }
        let mut paths = PathConflicts::with_inputs(inputs);
        for file in files {
            paths.add_output(&file, Writer::Option("output")).map_err(UsageError)?;
        }
        Ok(())
    }

    /// Reads the files that options name.
    ///
    /// # Errors
    /// A file cannot be read or is damaged.
    pub fn read_files(&mut self) -> Result<(), UsageError> {
        let limits = load_limits(self.session.max_memory);
        Ok(self.session.options.read_files(&limits)?)
    }
}
