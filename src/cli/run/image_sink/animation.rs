//! All frames of a scene in one animation file.

use std::path::Path;
use std::time::{Duration, Instant};

use anyhow::Result;

use super::{ImageSink, SceneOutput, WrittenFiles};
use crate::plan::AnimationOutput;
use crate::run::animation_writer::{AnimationWriter, WrittenAnimation};
use crate::run::report_section::ReportSection;
use blinn_core::worded;
use blinn_session::{PlannedFrame, RenderedImage};

/// Appends each frame to an animation, which appears when it is complete.
pub struct AnimationSink<'a> {
    output: SceneOutput<'a>,
    report: Option<&'a mut ReportSection>,
    writer: AnimationWriter,
}

impl<'a> AnimationSink<'a> {
    /// Starts an animation of `size` pixels.
    pub fn new(
        output: SceneOutput<'a>,
        report: Option<&'a mut ReportSection>,
        animation: &AnimationOutput,
        file: &Path,
        size: (u32, u32),
    ) -> Result<AnimationSink<'a>> {
        let animation = &animation
            .in_scene(output.scene)
            .map_err(|text| anyhow::anyhow!(worded!("`output` {}: {}", file.display(), text)))?;
        let writer = AnimationWriter::new(file, animation, size, output.plan.outputs.replace)?;
        Ok(AnimationSink { output, report, writer })
    }
}

impl ImageSink for AnimationSink<'_> {
    fn add(
        &mut self,
        _: &PlannedFrame,
        image: &mut RenderedImage,
        render_time: Duration,
    ) -> Result<WrittenFiles> {
        let start = Instant::now();
        self.writer.add(&image.picture, render_time)?;
        self.output.log.stage_since("encode", start, "");
        Ok(WrittenFiles::default())
    }

    fn finish(self: Box<Self>) -> Result<WrittenFiles> {
        let AnimationSink { output: SceneOutput { log, .. }, report, writer } = *self;
        let start = Instant::now();
        let WrittenAnimation { file, thumbnail, render_time } = writer.finish()?;
        log.stage_since("save", start, "");
        let mut files = WrittenFiles::default();
        files.add_file(&file);
        log.wrote(&file);
        if let Some(report) = report {
            report.add_image(&thumbnail, &file, render_time, false);
        }
        Ok(files)
    }
}
