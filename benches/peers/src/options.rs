//! The command line.

use std::path::PathBuf;

use blinn_scenes::{SceneKind, parse_triangle_count};

use crate::rays::Film;

/// The measurement.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mode {
    /// Rays per second of blinn and of Embree.
    Rays,
    /// Build times and memory of blinn and of Embree.
    Build,
    /// Time per ray from 10 thousand triangles to 10 million.
    Scale,
    /// Frames: two threads against one, and the time outside ray traversal.
    Frame,
    /// Rays per second of blinn alone, for profilers.
    Alone,
}

/// The options of a run.
pub struct Options {
    pub mode: Mode,
    pub scenes: Vec<(SceneKind, usize)>,
    pub threads: Vec<usize>,
    pub rounds: usize,
    pub film: Film,
    pub json: Option<PathBuf>,
    pub embree: PathBuf,
    /// The name of the only ray set to trace.
    pub only: Option<String>,
}

pub const USAGE: &str = "usage: blinn-peers rays|build|scale|frame|alone [KIND:TRIANGLES …] [options]
  --quick           480 × 270 pixels, three rounds, smaller scenes
  --threads LIST    numbers of threads [default: 1,2]
  --rounds N        interleaved rounds, whose medians count [default: 5]
  --size WxH        pixels [default: 1920x1080]
  --tile N          side of a tile (a batch of rays) in pixels [default: 32]
  --samples N       samples per pixel [default: 1]
  --only NAME       with `alone`: trace only this set of rays
  --json FILE       write all results
  --embree FOLDER   folder of libembree4 [default: target/embree/embreex.libs]
A scene is a kind and a number of triangles: scan:70k, interior:1.4m.";

impl Options {
    pub fn parse(words: &[String]) -> Result<Options, String> {
        let mut words = words.iter().map(String::as_str);
        let mode = match words.next() {
            Some("rays") => Mode::Rays,
            Some("build") => Mode::Build,
            Some("scale") => Mode::Scale,
            Some("frame") => Mode::Frame,
            Some("alone") => Mode::Alone,
            _ => return Err(USAGE.into()),
        };
        let mut options = Options {
            mode,
            scenes: Vec::new(),
            threads: vec![1, 2],
            rounds: 5,
            film: Film { width: 1920, height: 1080, tile: 32, samples: 1 },
            json: None,
            embree: "target/embree/embreex.libs".into(),
            only: None,
        };
        let mut quick = false;
        while let Some(word) = words.next() {
            let mut value = || words.next().ok_or(format!("{word} needs a value\n{USAGE}"));
            match word {
                "--quick" => quick = true,
                "--threads" => {
                    options.threads =
                        value()?.split(',').map(|n| number(n, 256)).collect::<Result<_, _>>()?;
                }
                "--rounds" => options.rounds = number(value()?, 1000)?,
                "--size" => {
                    let (w, h) = value()?.split_once('x').ok_or("--size is WxH")?;
                    options.film.width = number(w, 16384)? as u32;
                    options.film.height = number(h, 16384)? as u32;
                }
                "--tile" => options.film.tile = number(value()?, 4096)? as u32,
                "--samples" => options.film.samples = number(value()?, 4096)? as u32,
                "--only" => options.only = Some(value()?.into()),
                "--json" => options.json = Some(value()?.into()),
                "--embree" => options.embree = value()?.into(),
                scene => {
                    let (kind, size) =
                        scene.split_once(':').ok_or(format!("unknown argument '{scene}'\n{USAGE}"))?;
                    options.scenes.push((kind.parse()?, parse_triangle_count(size)?));
                }
            }
        }
        if quick {
            options.film = Film { width: 480, height: 270, ..options.film };
            options.rounds = options.rounds.min(3);
        }
        if options.scenes.is_empty() {
            options.scenes = default_scenes(mode, quick);
        }
        Ok(options)
    }
}

fn number(word: &str, max: usize) -> Result<usize, String> {
    match word.parse() {
        Ok(n) if (1..=max).contains(&n) => Ok(n),
        _ => Err(format!("'{word}' is not a number from 1 to {max}")),
    }
}

/// The scenes with goals in docs/explanation/performance.md.
fn default_scenes(mode: Mode, quick: bool) -> Vec<(SceneKind, usize)> {
    let scans = |counts: &[usize]| counts.iter().map(|&n| (SceneKind::Scan, n)).collect::<Vec<_>>();
    match (mode, quick) {
        (Mode::Rays, false) => {
            vec![
                (SceneKind::Scan, 70_000),
                (SceneKind::Interior, 1_400_000),
                (SceneKind::Scan, 1_100_000),
                (SceneKind::Scan, 8_000_000),
            ]
        }
        (Mode::Rays, true) => vec![(SceneKind::Scan, 70_000), (SceneKind::Interior, 400_000)],
        (Mode::Build, false) => scans(&[70_000, 1_100_000, 8_000_000]),
        (Mode::Build, true) => scans(&[70_000, 1_100_000]),
        (Mode::Scale, false) => scans(&[10_000, 100_000, 1_000_000, 10_000_000]),
        (Mode::Scale, true) => scans(&[10_000, 100_000, 1_000_000]),
        (Mode::Alone, _) => scans(&[70_000]),
        (Mode::Frame, _) => scans(&[70_000, 1_100_000]),
    }
}
