//! Where pictures go, in which format.

use std::path::{Path, PathBuf, is_separator};

use crate::batch::{FileDigests, PathTemplate, SettingsHash, TemplateFields};
use crate::cli::Usage;
use crate::cli::args::OutputArgs;
use crate::cli::args::values::Layers;
use crate::cli::plan::animation;
use crate::cli::plan::animation::Playing;
use crate::cli::plan::{Look, Shot};
use crate::display::Background;
use crate::output::{BitDepth, ImageFormat, Overwrite, read_fingerprint};

/// Where one picture goes.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub enum Target {
    /// To standard output, as PNG.
    Stdout,
    /// To a file.
    File(PathBuf),
}

/// What the pictures of a scene become.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Form {
    /// A file each.
    Pictures(ImageFormat, BitDepth),
    /// One file.
    Moving(Playing),
}

/// The pictures of each scene, as far as their files depend on them.
#[derive(Clone, Copy, Debug)]
pub struct Series {
    /// Whether they are numbered.
    pub many: bool,
    /// Frames a second, where they are played; `None` where that was not said.
    pub fps: Option<f64>,
    /// The flag by which they are a share of a whole.
    pub share: Option<&'static str>,
    /// Whether what turns is seen to do so clockwise from above.
    pub clockwise: bool,
}

/// Where all pictures go.
#[derive(Clone, Debug)]
pub struct Outputs {
    /// Names of files; `None` for standard output.
    template: Option<PathTemplate>,
    pub form: Form,
    pub replace: Overwrite,
    /// Whether finished pictures are kept.
    pub resume: bool,
    /// Names of pictures beside each, of its layers.
    beside: Vec<String>,
}

impl Outputs {
    pub fn new(args: &OutputArgs, series: &Series, look: &Look) -> Result<Outputs, Usage> {
        let output = args.output.as_deref();
        let text = pattern(output)?;
        let (folder, name) = apart(&text);
        if let Some(word) = PathTemplate::unknown_placeholder(name) {
            return Err(Usage(format!(
                "-o {text}: {word} stands for nothing: there are {{stem}}, {{model}}, {{parent}}, {{index}}, {{frame}} \
                 and {{frame:04}}"
            )));
        }
        let template = PathTemplate::in_folder(folder, name);
        let mut outputs = Outputs {
            form: match animation::format(Path::new(&text)) {
                Some(format) => Form::Moving(Playing::new(format, &template, args, series, look)?),
                None => pictures(&text, args, look)?,
            },
            replace: if args.no_overwrite { Overwrite::No } else { Overwrite::Yes },
            resume: args.resume,
            beside: Vec::new(),
            template: Some(template),
        };
        let Form::Pictures(format, _) = outputs.form else { return Ok(outputs) };
        if args.r#loop.is_some() {
            return Err(Usage(
                "--loop is of moving pictures, and -o names none: write .gif, .apng, .mp4 or .html".into(),
            ));
        }
        if !format.supports_layers() {
            outputs.beside = look.layers.names();
        }
        if output != Some(Path::new("-")) {
            outputs.template = outputs.template.map(|t| if series.many { t.with_frame_number() } else { t });
            return Ok(outputs);
        }
        outputs.template = None;
        if series.many {
            return Err(Usage(
                "-o -: standard output takes one picture, and several frames are asked for".into(),
            ));
        }
        if look.layers != Layers::default() {
            return Err(Usage("--aov: standard output takes one picture; give -o a file's name".into()));
        }
        Ok(outputs)
    }

    /// Where a picture of the `index`-th scene, from 1, goes.
    pub fn target(&self, scene: &Path, index: usize, shot: &Shot) -> Target {
        match &self.template {
            Some(template) => {
                Target::File(template.expand(&TemplateFields { scene, index, frame: shot.frame }))
            }
            None => Target::Stdout,
        }
    }

    /// All files that a picture becomes, with those of its layers.
    pub fn files(&self, target: &Target) -> Vec<PathBuf> {
        let Target::File(path) = target else { return Vec::new() };
        let beside = self.beside.iter().map(|layer| path.with_extension(format!("{layer}.png")));
        std::iter::once(path.clone()).chain(beside).collect()
    }

    /// Whether layers are inside the pictures.
    pub fn holds_layers(&self) -> bool {
        matches!(self.form, Form::Pictures(format, _) if format.supports_layers())
    }

    /// Whether a picture is there already, as it would be made now.
    pub fn has(&self, target: &Target, key: SettingsHash, scene: &Path, contents: &mut FileDigests) -> bool {
        let files = self.files(target);
        let is_it = |file: &PathBuf| {
            read_fingerprint(file).is_some_and(|stamp| contents.is_current(&stamp, key, scene))
        };
        !files.is_empty() && files.iter().all(is_it)
    }

    /// Refuses to write more than one picture to standard output, or another thing beside it.
    pub fn check_stdout(&self, scenes: &[PathBuf], report: bool) -> Result<(), Usage> {
        match (&self.template, scenes) {
            (None, _) if report => {
                Err(Usage("-o - and --report - would both be written to standard output: name a file".into()))
            }
            (None, [_, _, ..]) => {
                Err(Usage("-o -: standard output takes one picture, and several scenes were given".into()))
            }
            _ => Ok(()),
        }
    }
}

/// The pattern that names files.
fn pattern(output: Option<&Path>) -> Result<String, Usage> {
    let Some(output) = output else { return Ok("{stem}.png".into()) };
    let Some(text) = output.to_str() else {
        let name = output.display();
        return Err(Usage(format!("-o {name}: patterns are UTF-8 text, and this name is not: take another")));
    };
    Ok(if text.ends_with(is_separator) || output.is_dir() {
        format!("{}/{{stem}}.png", text.trim_end_matches(is_separator))
    } else {
        text.into()
    })
}

/// A pattern's folder, and what follows it, which is filled in. A folder that is there is meant as it is called.
fn apart(pattern: &str) -> (&str, &str) {
    let mut folders = pattern.rmatch_indices(is_separator).map(|(i, _)| pattern.split_at(i + 1));
    folders.find(|(folder, _)| Path::new(folder).is_dir()).unwrap_or(("", pattern))
}

/// The format of single pictures that are called so.
fn pictures(name: &str, args: &OutputArgs, look: &Look) -> Result<Form, Usage> {
    let mut format = match ImageFormat::from_path(Path::new(name)) {
        _ if name == "-" => ImageFormat::Png,
        Some(format) => format,
        None => {
            return Err(Usage(format!(
                "-o {name}: the name must end in {}, .gif, .apng, .mp4 or .html, or in / for a folder",
                ImageFormat::EXTENSIONS
            )));
        }
    };
    if let Some(asked) = args.quality {
        match &mut format {
            ImageFormat::Jpeg(quality) => *quality = asked,
            _ => return Err(Usage("--quality is of .jpg, .mp4 and .html alone, and -o names none".into())),
        }
    }
    if look.background == Background::Transparent && matches!(format, ImageFormat::Jpeg(_)) {
        return Err(Usage(
            "a JPEG has no transparency: give a --background COLOR, or write .png, .webp or .exr".into(),
        ));
    }
    if let Some(size) = look.known_size() {
        format.check_size(size).map_err(|e| Usage(format!("-o {name}: {e}")))?;
    }
    Ok(Form::Pictures(format, depth(args.depth.as_deref(), format)?))
}

fn depth(asked: Option<&str>, format: ImageFormat) -> Result<BitDepth, Usage> {
    let Some(asked) = asked else { return Ok(BitDepth::Default) };
    let (name, depths) = format.bit_depths();
    let bits: Vec<String> = depths.iter().map(|(bits, _)| bits.to_string()).collect();
    let found = bits.iter().position(|bits| bits == asked);
    let wrong = || Usage(format!("--depth {asked}: {name} has {} bits a channel", bits.join(" or ")));
    found.map(|i| depths[i].1).ok_or_else(wrong)
}
