//! Names and formats of output files.

use std::path::{Path, PathBuf, is_separator};
use std::sync::Arc;

use super::animation_output::{AnimationOutput, animation_format};
use super::frames::FrameSet;
use super::sequence_info::SequenceInfo;
use super::shards::{self, SampleNames, ShardPlan};
use crate::args::OutputArgs;
use crate::console::is_stdout;
use crate::usage::UsageError;
use blinn_core::worded;
use blinn_output::{BitDepth, ImageFormat, LayerFolder, Overwrite, read_fingerprint};
use blinn_render::display::Background;
use blinn_render::integrator::Aov;
use blinn_session::{
    CameraList, FileDigests, ImageKind, Options, PathTemplate, PlannedFrame, SettingsHash, TemplateFields,
    is_marked_empty,
};

/// Where one image is written.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub enum Target {
    /// Standard output, as PNG.
    Stdout,
    File(PathBuf),
}

/// The kind of output files: the settings that decide the bytes of a file.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
#[serde(untagged)]
pub enum OutputKind {
    /// One image per frame.
    Images(ImageKind),
    /// One animation per scene.
    Animation(AnimationOutput),
}

/// All output files.
#[derive(Clone, Debug)]
pub struct Outputs {
    /// Pattern of file names; `None` for standard output.
    template: Option<PathTemplate>,
    /// The list that names of cameras come from.
    cameras: Option<Arc<CameraList>>,
    pub kind: OutputKind,
    pub replace: Overwrite,
    /// True to keep images that are up to date.
    pub resume: bool,
    /// Set if all images go into numbered archives.
    pub shards: Option<ShardPlan>,
    /// Names of AOV previews of each image.
    previews: Vec<String>,
    /// Where they are.
    pub layer_folder: LayerFolder,
}

/// An image of an earlier run that is up to date.
#[derive(Clone, Copy, Debug)]
pub struct KeptImage {
    /// True for an image of a dataset that shows nothing.
    pub is_empty: bool,
}

/// The error for a flag that applies only to animations.
pub fn animation_only(option: &str) -> UsageError {
    UsageError(worded!(
        "`{}` applies only to animations; set `output` to .gif, .apng, .mp4 or .html (blinn assemble makes .webp of \
         frames)",
        option
    ))
}

impl Outputs {
    pub fn new(
        args: &OutputArgs,
        sequence: &SequenceInfo,
        frames: &FrameSet,
        options: &Options,
    ) -> Result<Outputs, UsageError> {
        let output = args.output.as_deref();
        let mut pattern = name_pattern(output, sequence)?;
        let shards = ShardPlan::new(&pattern, args.shard_size, frames)?;
        if shards.is_some() {
            pattern = shards::image_name(&pattern);
        }
        let (folder, name) = split_existing_folder(&pattern);
        if let Some(word) = PathTemplate::unknown_placeholder(name) {
            return Err(UsageError(worded!(
                "`output` {}: unknown placeholder {}: expected {{stem}}, {{ext}}, {{parent}}, {{index}}, \
                 {{index:05}}, {{camera}}, {{frame}}, {{frame:04}}, or {{shard:05}} in the name of a .tar",
                pattern,
                word
            )));
        }
        let template = PathTemplate::in_folder(folder, name);
        if template.has_camera() && !sequence.has_cameras {
            return Err(UsageError(worded!(
                "`output` {}: {{camera}} is the name of a camera of `cameras`; add `cameras` or use {{frame}}",
                pattern
            )));
        }
        let kind = match animation_format(Path::new(&pattern)) {
            Some(_) if shards.is_some() => {
                return Err(UsageError(worded!(
                    "`output`: an archive holds images; use {{shard}}.tar, {{shard}}.jpg.tar or the like"
                )));
            }
            Some(format) => {
                OutputKind::Animation(AnimationOutput::new(format, &template, args, sequence, options)?)
            }
            None => image_kind(&pattern, args, options)?,
        };
        let replace = if args.no_overwrite { Overwrite::No } else { Overwrite::Yes };
        let mut outputs = Outputs {
            template: Some(template),
            cameras: None,
            kind,
            replace,
            resume: args.resume,
            shards,
            previews: Vec::new(),
            layer_folder: LayerFolder::Beside,
        };
        let OutputKind::Images(ImageKind { format, .. }) = outputs.kind else {
            return match options.depth_unit {
                Some(_) => Err(UsageError(worded!("`depth-unit` applies only to images; remove it"))),
                None => Ok(outputs),
            };
        };
        if args.r#loop.is_some() {
            return Err(animation_only("loop"));
        }
        check_depth_unit(options, format)?;
        if !format.supports_layers() {
            outputs.previews = options.aovs.preview_names();
        }
        if !output.is_some_and(is_stdout) {
            outputs.template =
                outputs.template.map(|t| if sequence.is_sequence { t.with_frame_number() } else { t });
            return Ok(outputs);
        }
        outputs.template = None;
        if sequence.is_sequence {
            return Err(UsageError(worded!(
                "`output` -: standard output takes one image, not several frames"
            )));
        }
        if !options.aovs.is_empty() {
            return Err(UsageError(worded!(
                "`aov`: standard output takes one image; set `output` to a file name"
            )));
        }
        Ok(outputs)
    }

    /// Names files after the cameras of a list.
    pub fn with_cameras(self, cameras: Option<&Arc<CameraList>>) -> Outputs {
        Outputs { cameras: cameras.cloned(), ..self }
    }

    /// Names files as BOP's tools read them: in archives by their samples, else with layers in a folder of their own, as the
    /// tools take every file in the folder of images as an image.
    pub fn with_bop_names(self) -> Outputs {
        let layer_folder = if self.shards.is_some() { LayerFolder::Sample } else { LayerFolder::Layers };
        let shards = self.shards.map(|shards| shards.with_names(SampleNames::Bop));
        Outputs { shards, layer_folder, ..self }
    }

    /// Where a frame of the `index`-th scene, counted from 1, is written.
    pub fn target(&self, scene: &Path, index: usize, frame: &PlannedFrame) -> Target {
        if let Some(shards) = &self.shards {
            return Target::File(shards.image(scene, index, frame.number, &self.member_extension()));
        }
        match &self.template {
            Some(template) => {
                let cameras = self.cameras.as_ref().filter(|_| template.has_camera());
                let camera = cameras.and_then(|cameras| Some(cameras.name(frame.camera?)));
                let camera = camera.as_deref().unwrap_or_default();
                Target::File(template.expand(&TemplateFields {
                    scene,
                    index,
                    frame: frame.number,
                    camera,
                    shard: 0,
                }))
            }
            None => Target::Stdout,
        }
    }

    /// The extension of images in archives.
    pub fn member_extension(&self) -> String {
        let fields = TemplateFields { scene: Path::new(""), index: 0, frame: 0, camera: "", shard: 0 };
        let name = self.template.as_ref().map(|template| template.expand(&fields)).unwrap_or_default();
        name.extension().unwrap_or_default().to_string_lossy().into_owned()
    }

    /// The files of an image: itself and its previews.
    pub fn files(&self, target: &Target) -> Vec<PathBuf> {
        let Target::File(path) = target else { return Vec::new() };
        let previews = self.previews.iter().map(|aov| self.layer_folder.file(path, aov));
        std::iter::once(path.clone()).chain(previews).collect()
    }

    /// True if the image goes to standard output.
    pub fn is_stdout(&self) -> bool {
        self.template.is_none()
    }

    /// True if AOVs are stored in the images themselves.
    pub fn holds_aovs(&self) -> bool {
        matches!(self.kind, OutputKind::Images(ImageKind { format, .. }) if format.supports_layers())
    }

    /// Bytes per pixel that encoding an image takes, if all go to files of one format.
    pub fn encoding_bytes(&self) -> Option<u64> {
        match self.kind {
            OutputKind::Images(ImageKind { format, depth, .. }) => Some(format.encoding_bytes(depth)),
            _ => None,
        }
    }

    /// The image, if its files exist and their fingerprints match the settings and the current input files.
    pub fn up_to_date(
        &self,
        target: &Target,
        hash: SettingsHash,
        scene: &Path,
        digests: &mut FileDigests,
    ) -> Option<KeptImage> {
        let mut kept = None;
        for file in self.files(target) {
            let fingerprint = read_fingerprint(&file)?;
            if !digests.is_current(&fingerprint, hash, scene) {
                return None;
            }
            kept = Some(KeptImage { is_empty: is_marked_empty(&fingerprint) });
        }
        kept
    }

    /// Checks that at most one thing is written to standard output.
    pub fn check_stdout(&self, scenes: usize, report: bool) -> Result<(), UsageError> {
        let text = match (&self.template, scenes) {
            (None, _) if report => {
                worded!("`output` - and `report` - would both be written to standard output; name a file")
            }
            (None, 2..) => worded!("`output` -: standard output takes one image, not several scenes"),
            _ => return Ok(()),
        };
        Err(UsageError(text))
    }
}

/// The pattern of file names. A folder gets the default name; for several images, a name without extension is a folder.
fn name_pattern(output: Option<&Path>, sequence: &SequenceInfo) -> Result<String, UsageError> {
    let default = if sequence.has_cameras { "{stem}_{camera}.png" } else { "{stem}.png" };
    let Some(output) = output else { return Ok(default.into()) };
    let Some(text) = output.to_str() else {
        return Err(UsageError(worded!("`output` {}: the name must be UTF-8", output.display())));
    };
    let has_several = sequence.is_sequence || sequence.is_batch;
    let is_new_folder = has_several
        && !is_stdout(output)
        && output.extension().is_none()
        && !output.exists()
        && output.file_name().is_some_and(|name| PathTemplate::parse(&name.to_string_lossy()).is_literal());
    Ok(if text.ends_with(is_separator) || output.is_dir() || is_new_folder {
        let name = sequence.image_name.unwrap_or(default);
        // The folder may be that of the scene already.
        let is_of_scene = ["{stem}", "{index"].iter().any(|word| text.contains(word));
        let name = if is_of_scene { name.strip_prefix("{stem}/").unwrap_or(name) } else { name };
        format!("{}/{name}", text.trim_end_matches(is_separator))
    } else {
        text.into()
    })
}

/// Splits off the longest prefix that is an existing folder. Placeholders in it are not replaced.
pub fn split_existing_folder(pattern: &str) -> (&str, &str) {
    let mut splits = pattern.rmatch_indices(is_separator).map(|(i, _)| pattern.split_at(i + 1));
    splits.find(|(folder, _)| Path::new(folder).is_dir()).unwrap_or(("", pattern))
}

/// Returns an error if --depth-unit has no effect.
fn check_depth_unit(options: &Options, format: ImageFormat) -> Result<(), UsageError> {
    let text = if options.depth_unit.is_none() {
        return Ok(());
    } else if format.supports_layers() {
        worded!(
            "`depth-unit` applies only to depth beside images; an .exr holds metres: remove it, or set `output` to .png"
        )
    } else if !options.aovs.aovs.contains(&Aov::Depth) {
        worded!("`depth-unit` applies only to `aov` depth; add it")
    } else {
        return Ok(());
    };
    Err(UsageError(text))
}

/// ImageFormat and bit depth of images with this name.
fn image_kind(name: &str, args: &OutputArgs, options: &Options) -> Result<OutputKind, UsageError> {
    let mut format = match ImageFormat::from_path(Path::new(name)) {
        _ if name == "-" => ImageFormat::Png,
        Some(format) => format,
        // Thumbnailers are given an empty file whose name ends in random letters.
        None if is_empty_file(Path::new(name)) => ImageFormat::Png,
        None if is_drawing(Path::new(name)) => {
            return Err(UsageError(worded!(
                "`output` {}: drawings of vectors are not written; write a large .png, with `edges-only` for \
                 lines alone",
                name
            )));
        }
        None => {
            return Err(UsageError(worded!(
                "`output` {}: unknown format; the name must end in {}, .gif, .apng, .mp4, .html or .tar, or \
                 in / for a folder",
                name,
                ImageFormat::EXTENSIONS
            )));
        }
    };
    if let Some(value) = args.encoder_quality {
        match &mut format {
            ImageFormat::Jpeg(quality) => *quality = value,
            _ => {
                return Err(UsageError(worded!(
                    "`encoder-quality` applies only to .jpg, .mp4 and .html; remove it"
                )));
            }
        }
    }
    if options.fixed_background() == Background::Transparent && matches!(format, ImageFormat::Jpeg(_)) {
        return Err(UsageError(worded!(
            "JPEG has no transparency; set `background` COLOR, or write .png, .webp or .exr"
        )));
    }
    if let Some(size) = options.known_size() {
        format.check_size(size).map_err(|e| UsageError(worded!("`output` {}: {}", name, e)))?;
    }
    let depth = bit_depth(args.depth.as_deref(), format)?;
    Ok(OutputKind::Images(ImageKind { format, depth }))
}

/// Returns true for the extension of a drawing of vectors.
fn is_drawing(path: &Path) -> bool {
    let extension = path.extension().unwrap_or_default();
    ["svg", "pdf", "eps", "dxf", "dwg"].iter().any(|known| extension.eq_ignore_ascii_case(known))
}

fn is_empty_file(path: &Path) -> bool {
    path.metadata().is_ok_and(|metadata| metadata.is_file() && metadata.len() == 0)
}

fn bit_depth(bits: Option<&str>, format: ImageFormat) -> Result<BitDepth, UsageError> {
    let Some(bits) = bits else { return Ok(BitDepth::Default) };
    let (name, depths) = format.bit_depths();
    let known: Vec<String> = depths.iter().map(|(bits, _)| bits.to_string()).collect();
    let error =
        || UsageError(worded!("`depth` {}: {} has {} bits per channel", bits, name, known.join(" or ")));
    known.iter().position(|known| known == bits).map(|i| depths[i].1).ok_or_else(error)
}
