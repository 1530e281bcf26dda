//! Plans for images that no list of frames or cameras describes, and the files that options name.

use std::sync::Arc;

use super::outputs::Outputs;
use super::sequence_info::SequenceInfo;
use super::{FormatsPlan, FrameSet, RenderPlan, SceneList, build_settings};
use crate::args::OutputArgs;
use crate::usage::UsageError;
use blinn_session::{Options, PlannedFrame, SessionPlan, load_limits};

/// How images of any plan are made.
#[derive(Clone, Copy, Debug)]
pub struct ImagePolicy {
    /// True to treat warnings as errors.
    pub strict: bool,
    /// Memory limit in bytes.
    pub max_memory: Option<u64>,
    /// Name of images in a folder; `None` is the usual one.
    pub image_name: Option<&'static str>,
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
        RenderPlan {
            scenes: Arc::new(scenes),
            scene_chunk: None,
            frames,
            session: SessionPlan {
                build: build_settings()?,
                holds_layers: outputs.holds_aovs(),
                max_memory: policy.max_memory,
                ..session
            },
            outputs,
            formats: FormatsPlan::default(),
            check: None,
            strict: policy.strict,
            dry_run: false,
        }
        .checked(None)
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
