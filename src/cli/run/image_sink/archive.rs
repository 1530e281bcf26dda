//! Images as samples of an archive, each with its description.

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use anyhow::Result;
use serde_json::json;

use super::{ImageSink, SceneOutput, WrittenFiles};
use crate::plan::{OutputKind, Target};
use blinn_output::datasets::{Dataset, DatasetView};
use blinn_output::{EncodedFile, SaveError, ShardWriter, encode_files};
use blinn_session::{ImageKind, PlannedFrame, RenderedImage, fingerprint};

/// Adds each image with its layers and its description to an archive.
pub struct ArchiveSink<'a> {
    pub output: SceneOutput<'a>,
    pub shard: &'a mut ShardWriter,
    /// The views of a dataset, which descriptions have.
    pub dataset: Option<(Dataset, Vec<DatasetView>)>,
    /// COCO's annotations of the images by their number; empty without.
    pub annotations: BTreeMap<i64, String>,
}

impl ImageSink for ArchiveSink<'_> {
    fn add(&mut self, frame: &PlannedFrame, image: &mut RenderedImage, _: Duration) -> Result<WrittenFiles> {
        let start = Instant::now();
        let SceneOutput { plan, scene, path, index, log } = self.output;
        let mut files = WrittenFiles::default();
        let OutputKind::Images(ImageKind { format, depth }) = plan.outputs.kind else { return Ok(files) };
        let Target::File(name) = self.output.target(frame) else { return Ok(files) };
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
        let description = EncodedFile {
            path: name.with_extension("json"),
            bytes: format!("{description:#}\n").into_bytes(),
        };
        let annotations = self.annotations.get(&frame.number).map(|text| EncodedFile {
            path: name.with_extension("coco.json"),
            bytes: text.clone().into_bytes(),
        });
        let others = [Some(description), annotations].into_iter().flatten().map(Ok);
        for file in encode_files(&image.picture, &name, format, depth).chain(others) {
            let EncodedFile { path, bytes } = file?;
            let added = self.shard.add(&path.to_string_lossy(), &bytes);
            added.map_err(|cause| SaveError { path: self.shard.path().join(&path), cause })?;
            files.files += 1;
            files.bytes += bytes.len() as u64;
        }
        log.stage_since("save", start, "");
        Ok(files)
    }
}
