//! What a farm does, in no engine's language.

use std::path::{Path, PathBuf};

use anyhow::{Result, bail};
use twox_hash::XxHash3_128;

use super::given::{Given, text};
use super::place::{Base, Place};
use super::view;
use crate::batch::{FrameList, PathTemplate};
use crate::cli::Usage;
use crate::cli::args::{EngineArgs, FramesArgs};
use crate::cli::plan::{Form, Job, Playing, Shot, Target};
use crate::cli::run::metering::Exposed;
use crate::cli::run::progress::Teller;
use crate::cli::run::scene_job::read;
use crate::cli::run::session::Studio;
use crate::output::AnimationFormat;

/// All that a job's tasks have in common: each renders some of the frames, and keeps what is finished.
#[derive(Debug)]
pub struct Task {
    /// `render` or `turntable`.
    pub command: &'static str,
    pub scene: Place,
    /// The folder that holds what else the scene is made of; `None` where it is one file.
    pub beside: Option<Place>,
    /// Flags and their values.
    pub flags: Vec<String>,
    /// Other files that are read.
    pub files: Vec<Input>,
    /// All frames, in increasing order.
    pub frames: FrameList,
    /// The flag that says which of them.
    pub frames_flag: &'static str,
    /// Where pictures go.
    pub folder: Place,
    /// What they are called in there; empty for their default names.
    pub pattern: String,
    pub assembly: Option<Assembly>,
    pub chunk_size: u32,
    pub threads: Option<u16>,
    /// Bytes.
    pub memory: Option<u64>,
}

/// A file that a flag names.
#[derive(Debug)]
pub struct Input {
    /// The flag, without dashes.
    pub flag: &'static str,
    pub place: Place,
}

/// What becomes of all frames, once they are there.
#[derive(Debug)]
pub struct Assembly {
    /// The folder of the frames, inside that of the pictures.
    pub frames: String,
    /// The moving picture, beside it.
    pub file: String,
    pub flags: Vec<String>,
}

/// Tasks before their scene is looked at.
pub struct Plan<'a> {
    job: &'a Job,
    given: Given,
    scene: Place,
    scene_folder: Place,
    files: Vec<Input>,
    folder: Place,
    pattern: String,
    moving: Option<(Playing, String)>,
    engine: &'a EngineArgs,
}

/// Flags that a job says in its own way.
const OWN: [&str; 13] = [
    "output",
    "config",
    "resume",
    "progress",
    "frames",
    "only",
    "exposure",
    "size",
    "camera-xml",
    "hdri",
    "threads",
    "max-memory",
    "print-config",
];

/// The most tasks that a job is cut into by default: what Slurm takes unless told otherwise.
const MOST_TASKS: usize = 1000;
/// Frames in a task by default.
const CHUNK_SIZE: usize = 10;

impl<'a> Plan<'a> {
    /// # Errors
    /// What makes no job: more than one scene, a single picture, flags of one process alone.
    pub fn new(engine: &'a EngineArgs, job: &'a Job, given: Given, base: &Base) -> Result<Self, Usage> {
        for (flag, why) in [
            ("chunk", "the farm makes the shares: leave it out, and say --chunk-size before the command"),
            ("no-overwrite", "a task that is run again keeps what is finished: leave it out"),
            ("report", "every task would write it: leave it out"),
            ("dry-run", "a job is printed, and nothing is rendered: leave it out"),
        ] {
            if given.has(flag) {
                return Err(Usage(format!("--{flag}: {why}")));
            }
        }
        let [scene] = &job.scenes[..] else {
            return Err(Usage(format!(
                "a job is of one scene, not {}: make a job of each",
                job.scenes.len()
            )));
        };
        if !job.shots.are_many() {
            return Err(Usage("a job is of many frames: add --frames".into()));
        }
        let output = match engine.frames() {
            FramesArgs::Render(args) => args.output.output.as_deref(),
            FramesArgs::Turntable(args) => args.output.output.as_deref(),
        };
        let (folder, pattern, moving) = match job.outputs.form {
            Form::Pictures(..) => {
                let (folder, pattern) = split(output)?;
                (folder, pattern, None)
            }
            Form::Moving(playing) => {
                let first = job.shots.known().and_then(|shots| shots.first().copied());
                let shot = first.unwrap_or(Shot::at(1, 0.0));
                let Target::File(file) = job.outputs.target(scene, 1, &shot) else {
                    return Err(Usage("-o -: a job writes files".into()));
                };
                let name = text("-o", file.file_name().unwrap_or_default())?;
                (
                    file.parent().map(Path::to_path_buf).unwrap_or_default(),
                    String::new(),
                    Some((playing, name)),
                )
            }
        };
        let folder = base.place(&folder)?;
        if !PathTemplate::parse(&folder.path).is_literal() {
            let name = &folder.path;
            return Err(Usage(format!("{name}: parts of this folder's name would be filled in: rename it")));
        }
        let (xml, hdri) = match engine.frames() {
            FramesArgs::Render(args) => (&args.look.camera.camera_xml, &args.look.light.hdri),
            FramesArgs::Turntable(args) => (&args.look.camera.camera_xml, &args.look.light.hdri),
        };
        let mut files = Vec::new();
        for (flag, file) in [("camera-xml", xml), ("hdri", hdri)] {
            if let Some(file) = file {
                files.push(Input { flag, place: base.place(file)? });
            }
        }
        Ok(Plan {
            scene: base.place(scene)?,
            scene_folder: base.place(scene.parent().unwrap_or(Path::new("")))?,
            job,
            given,
            files,
            folder,
            pattern,
            moving,
            engine,
        })
    }

    /// Reads the scene, and finds once what all tasks share.
    pub fn resolve(self, teller: &Teller) -> Result<Task> {
        let Plan { job, engine, mut files, .. } = self;
        let scene = read(job, &job.scenes[0], teller)?;
        let (studio, start) = Studio::new(job, &scene, teller)?;
        let look = &job.look;
        let (width, height) = look.size_for(&scene);
        if let Some((playing, file)) = &self.moving {
            let refused = |text| anyhow::anyhow!("-o {file}: {text}");
            playing.format.check_size(studio.size()).map_err(refused)?;
        }

        let mut given = self.given.without(&OWN);
        let mut resolved = vec![format!("--size={width}x{height}")];
        let Exposed { ev, light_scale } = studio.exposed;
        resolved.push(format!("--exposure={ev}"));
        if let Some(light_scale) = light_scale {
            given = given.without(&["light-scale"]);
            resolved.push(format!("--light-scale={light_scale}"));
        }
        // What a file's camera sees is in the file, and may move; a dataset has many views.
        if job.views.is_none() && !look.view.uses_file_camera(&scene) {
            let (camera, _) = look.view.resolve(&start.posed, width, height)?;
            if let Some(flags) = view::flags(&camera) {
                given = given.without(&view::REPLACED);
                files.retain(|file| file.flag != "camera-xml");
                resolved.extend(flags);
            }
        }
        let (command, frames_flag) = match engine.frames() {
            FramesArgs::Render(_) => ("render", "--frames"),
            FramesArgs::Turntable(_) => ("turntable", "--only"),
        };
        if self.moving.is_some() {
            // Those are the moving picture's; but an animation's frames are as far apart as --fps says.
            let fps = if command == "turntable" { "fps" } else { "loop" };
            given = given.without(&["quality", "loop", fps]);
        }
        let flags = [given.words(), resolved].concat();

        let shots: Vec<i64> = job.shots.of(studio.end)?.iter().map(|shot| shot.frame).collect();
        let frames = FrameList::ascending(shots.iter().copied());
        let mut pattern = self.pattern;
        let mut assembly = None;
        if let Some((playing, file)) = self.moving {
            if frames.frames() != shots || shots.first().is_some_and(|first| *first < 0) {
                bail!(
                    "--frames: a moving picture is assembled in the order of its frames' numbers: let them \
                     begin at 0 or above, and increase"
                );
            }
            // Frames of other settings lie elsewhere.
            let all = format!("{command} {} {flags:?} {frames}", self.scene.path);
            let folder = format!("frames-{:08x}", XxHash3_128::oneshot(all.as_bytes()) as u32);
            pattern = format!("{folder}/####.png");
            assembly = Some(Assembly { frames: folder, file, flags: playing_flags(&playing) });
        }
        let by_default = CHUNK_SIZE.max(frames.frames().len().div_ceil(MOST_TASKS)) as u32;
        Ok(Task {
            command,
            scene: self.scene,
            beside: (!scene.source.files.is_empty()).then_some(self.scene_folder),
            flags,
            files,
            frames,
            frames_flag,
            folder: self.folder,
            pattern,
            assembly,
            chunk_size: engine.job().chunk_size.unwrap_or(by_default),
            threads: engine.frames().process().threads,
            memory: job.max_memory,
        })
    }
}

impl Task {
    /// The scene's name without folder and ending.
    pub fn stem(&self) -> String {
        let stem = Path::new(&self.scene.path).file_stem().unwrap_or_default();
        stem.to_string_lossy().into_owned()
    }

    /// Flags about the machine that a task runs on.
    pub fn memory_flag(&self) -> Option<String> {
        self.memory.map(|bytes| format!("--max-memory={bytes}"))
    }
}

/// The folder of `-o` that is the same for all frames, and what follows it.
fn split(output: Option<&Path>) -> Result<(PathBuf, String), Usage> {
    let Some(output) = output else { return Ok((PathBuf::new(), String::new())) };
    let name = text("-o", output.as_os_str())?;
    if name == "-" {
        return Err(Usage("-o -: a job writes files".into()));
    }
    let name = if output.is_dir() && !name.ends_with('/') { name + "/" } else { name };
    let slashes = name.match_indices('/').map(|(i, _)| i + 1);
    let cut = slashes.take_while(|&i| PathTemplate::parse(&name[..i]).is_literal()).last().unwrap_or(0);
    Ok((name[..cut].into(), name[cut..].into()))
}

fn playing_flags(playing: &Playing) -> Vec<String> {
    let Playing { format, fps, repeat, quality, clockwise } = *playing;
    let mut flags = vec![format!("--fps={fps}")];
    if !repeat {
        flags.push("--loop=once".into());
    }
    if AnimationFormat::has_quality(format) {
        flags.push(format!("--quality={quality}"));
    }
    if clockwise && format == AnimationFormat::Html {
        flags.push("--direction=cw".into());
    }
    flags
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_page_is_told_which_way_its_frames_turn() {
        let playing = |format| Playing { format, fps: 24.0, repeat: true, quality: 90, clockwise: true };
        assert_eq!(playing_flags(&playing(AnimationFormat::Html)).last().unwrap(), "--direction=cw");
        assert!(!playing_flags(&playing(AnimationFormat::Mp4)).concat().contains("direction"));
    }

    #[test]
    fn the_folder_of_pictures_is_cut_off_their_names() {
        for (output, folder, pattern) in [
            ("a.png", "", "a.png"),
            ("out/a.png", "out/", "a.png"),
            ("out/####.png", "out/", "####.png"),
            ("/x/out/{stem}/####.png", "/x/out/", "{stem}/####.png"),
            ("f#/a.png", "", "f#/a.png"),
            ("out/", "out/", ""),
            ("out/{stem}/", "out/", "{stem}/"),
            ("src", "src/", ""),
        ] {
            let (found, rest) = split(Some(Path::new(output))).unwrap();
            assert_eq!((found.as_path(), &rest[..]), (Path::new(folder), pattern), "{output}");
        }
        assert!(split(Some(Path::new("-"))).is_err());
    }
}
