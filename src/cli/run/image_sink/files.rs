//! Images in files of their own, or one on standard output.

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use anyhow::{Context, Result};

use super::{ImageSink, SceneOutput, WrittenFiles};
use crate::console::print_stdout;
use crate::files::create_parent_folder;
use crate::plan::{OutputKind, Target};
use crate::run::dataset::note_view;
use crate::run::report::THUMBNAIL_SIDE;
use crate::run::report_section::ReportSection;
use blinn_output::{encode_thumbnail, save_with_layers};
use blinn_session::{ImageKind, PlannedFrame, RenderedImage};

/// Writes each image, with a fingerprint of what it was made from.
pub struct FileSink<'a> {
    pub output: SceneOutput<'a>,
    pub report: Option<&'a mut ReportSection>,
    /// The images of a dataset that are known, by file name: true if they show something.
    pub views_shown: &'a mut BTreeMap<String, bool>,
}

impl ImageSink for FileSink<'_> {
    fn add(
        &mut self,
        frame: &PlannedFrame,
        image: &mut RenderedImage,
        render_time: Duration,
    ) -> Result<WrittenFiles> {
        let start = Instant::now();
        let SceneOutput { plan, log, .. } = self.output;
        let mut files = WrittenFiles::default();
        let OutputKind::Images(ImageKind { format, depth }) = plan.outputs.kind else { return Ok(files) };
        match self.output.target(frame) {
            Target::Stdout => {
                let bytes = format.encode(&image.picture, depth).context("standard output")?;
                print_stdout(&bytes)?;
            }
            Target::File(file) => {
                let is_empty = image.empty.is_some();
                image.picture.fingerprint = self.output.fingerprint(frame, image);
                let outputs = &plan.outputs;
                create_parent_folder(&file)?;
                create_parent_folder(&outputs.layer_folder.file(&file, "layer"))?;
                for written in save_with_layers(
                    &image.picture,
                    &file,
                    outputs.layer_folder,
                    format,
                    depth,
                    outputs.replace,
                )? {
                    files.add_file(&written);
                    log.wrote_image(&written, is_empty);
                }
                if let Some(report) = &mut self.report {
                    let thumbnail = encode_thumbnail(&image.picture, THUMBNAIL_SIDE)?;
                    report.add_image(&thumbnail, &file, render_time, is_empty);
                }
                if plan.session.dataset.is_some() {
                    note_view(self.views_shown, &file, !is_empty);
                }
            }
        }
        log.stage_since("save", start, "");
        Ok(files)
    }
}
