//! Images as samples of an archive, each with its description.

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use anyhow::Result;
use serde_json::json;

use super::{ImageSink, SceneOutput, WrittenFiles};
use crate::plan::{OutputKind, Target};
use crate::run::dataset_files::SampleFiles;
use blinn_output::datasets::{Dataset, DatasetView};
use blinn_output::{EncodedFile, SaveError, ShardPart, encode_files, sample_file};
use blinn_session::{ImageKind, PlannedFrame, RenderedImage, fingerprint};

/// Adds each image with its layers and its description to an archive.
pub struct ArchiveSink<'a> {
    pub output: SceneOutput<'a>,
    /// The images of the scene in it.
    pub part: &'a mut ShardPart,
    /// The views of a dataset, which descriptions have.
    pub dataset: Option<(Dataset, Vec<DatasetView>)>,
    /// The annotations of the images by their number; empty without.
    pub sample_files: BTreeMap<i64, SampleFiles>,
}

impl ImageSink for ArchiveSink<'_> {
    fn add(&mut self, frame: &PlannedFrame, image: &mut RenderedImage, _: Duration) -> Result<WrittenFiles> {
        let start = Instant::now();
        let SceneOutput { plan, scene, path, index, log } = self.output;
        let mut files = WrittenFiles::default();
        let OutputKind::Images(ImageKind { format, depth }) = plan.outputs.kind else { return Ok(files) };
        let Target::File(name) = self.output.target(frame) else { return Ok(files) };
        // The image is the same as in a file of its own, with the fingerprint of its camera. That of the description is known
        // without the scene.
        image.picture.fingerprint = self.output.fingerprint(frame, image);
        let own_fingerprint = plan.member_hash(frame).and_then(|hash| fingerprint(hash, path, &scene.source));
        let mut description = json!({
            "scene": path.to_string_lossy(), "index": index, "frame": frame.number, "time": frame.time,
        });
        if let Some((dataset, views)) = &self.dataset
            && let Some(view) = usize::try_from(frame.number - 1).ok().and_then(|i| views.get(i))
        {
            dataset.describe_sample(view, &mut description);
        }
        // Readers of archives infer the columns from the first samples.
        description["empty"] = json!(image.empty.is_some());
        description["fingerprint"] = json!(own_fingerprint);
        // A frame comes once.
        let annotations = self.sample_files.remove(&frame.number).unwrap_or_default();
        let others = [("json", format!("{description:#}\n"))].into_iter().chain(annotations).map(
            |(extension, text)| {
                Ok(EncodedFile { path: sample_file(&name, extension), bytes: text.into_bytes() })
            },
        );
        let layers = plan.outputs.layer_folder;
        for file in encode_files(&image.picture, &name, layers, format, depth).chain(others) {
            let EncodedFile { path, bytes } = file?;
            let added = self.part.add(&path.to_string_lossy(), &bytes);
            added.map_err(|cause| SaveError { path: self.part.path().join(&path), cause })?;
            files.files += 1;
            files.bytes += bytes.len() as u64;
        }
        log.stage_since("save", start, "");
        Ok(files)
    }
}
