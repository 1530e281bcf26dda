//! The command line.

use std::path::PathBuf;

use blinn::accel::{AccelSettings, SimdLevel};
use blinn_scenes::{SceneKind, parse_triangle_count};

use crate::rays::Film;

/// The measurement.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mode {
    /// Rays per second of blinn and of Embree.
    Rays,
    /// The rays of archives, with obvhs beside Embree, and the hits of all compared with those of the archive.
    Dump,
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
    /// The archives of `dump`.
    pub dumps: Vec<PathBuf>,
    pub threads: Vec<usize>,
    pub rounds: usize,
    /// The films to trace rays for, one for each size.
    pub films: Vec<Film>,
    pub json: Option<PathBuf>,
    pub embree: PathBuf,
    /// The name of the only ray set to trace.
    pub only: Option<String>,
    /// The settings of blinn's BVHs, with the SIMD level.
    pub build: AccelSettings,
}

pub const USAGE: &str = "usage: blinn-peers rays|build|scale|frame|alone [KIND:TRIANGLES …] [options]
       blinn-peers dump FILE.npz … [options]
  --quick           480x270 pixels, three rounds, smaller scenes
  --threads LIST    numbers of threads [default: 1,2]
  --rounds N        interleaved rounds, whose medians count [default: 5]
  --size LIST       pixels [default: 256x256,480x270,1920x1080; with `scale`: 1920x1080]
  --tile N          side of a tile (a batch of rays) in pixels [default: 32]
  --samples N       samples per pixel [default: 1]
  --only NAME       with `alone`: trace only this set of rays
  --json FILE       write all results
  --embree FOLDER   folder of libembree4 [default: target/embree/embreex.libs]
A scene is a kind and a number of triangles: scan:70k, interior:1.4m. `blinn rays SCENE --dump FILE.npz --triangles`
writes the archives of `dump`. BLINN_SIMD selects blinn's SIMD level, as it
does for the program.";

/// Pixels of small, middle and large pictures.
const SIZES: [(u32, u32); 3] = [(256, 256), (480, 270), (1920, 1080)];

impl Options {
    pub fn parse(words: &[String]) -> Result<Options, String> {
        let mut words = words.iter().map(String::as_str);
        let mode = match words.next() {
            Some("rays") => Mode::Rays,
            Some("dump") => Mode::Dump,
            Some("build") => Mode::Build,
            Some("scale") => Mode::Scale,
            Some("frame") => Mode::Frame,
            Some("alone") => Mode::Alone,
            _ => return Err(USAGE.into()),
        };
        let mut options = Options {
            mode,
            scenes: Vec::new(),
            dumps: Vec::new(),
            threads: vec![1, 2],
            rounds: 5,
            films: Vec::new(),
            json: None,
            embree: "target/embree/embreex.libs".into(),
            only: None,
            build: AccelSettings { simd: simd_level()?, ..AccelSettings::default() },
        };
        let mut quick = false;
        let mut sizes = if mode == Mode::Scale { vec![SIZES[2]] } else { SIZES.to_vec() };
        let mut tile = 32;
        let mut samples = 1;
        while let Some(word) = words.next() {
            let mut value = || words.next().ok_or(format!("{word} needs a value\n{USAGE}"));
            match word {
                "--quick" => quick = true,
                "--threads" => {
                    options.threads =
                        value()?.split(',').map(|n| number(n, 256)).collect::<Result<_, _>>()?;
                }
                "--rounds" => options.rounds = number(value()?, 1000)?,
                "--size" => sizes = value()?.split(',').map(size).collect::<Result<_, _>>()?,
                "--tile" => tile = number(value()?, 4096)? as u32,
                "--samples" => samples = number(value()?, 4096)? as u32,
                "--only" => options.only = Some(value()?.into()),
                "--json" => options.json = Some(value()?.into()),
                "--embree" => options.embree = value()?.into(),
                file if mode == Mode::Dump && !file.starts_with('-') => options.dumps.push(file.into()),
                scene => {
                    let (kind, size) =
                        scene.split_once(':').ok_or(format!("unknown argument '{scene}'\n{USAGE}"))?;
                    options.scenes.push((kind.parse()?, parse_triangle_count(size)?));
                }
            }
        }
        if quick {
            sizes = vec![SIZES[1]];
            options.rounds = options.rounds.min(3);
        }
        options.films =
            sizes.into_iter().map(|(width, height)| Film { width, height, tile, samples }).collect();
        if mode == Mode::Dump && options.dumps.is_empty() {
            return Err(format!("dump needs archives of blinn rays --triangles\n{USAGE}"));
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

/// Parses `WxH`.
fn size(word: &str) -> Result<(u32, u32), String> {
    let (w, h) = word.split_once('x').ok_or(format!("'{word}' is not a size like 480x270"))?;
    Ok((number(w, 16384)? as u32, number(h, 16384)? as u32))
}

/// The SIMD level that `BLINN_SIMD` names, else the highest that this processor has.
fn simd_level() -> Result<SimdLevel, String> {
    match std::env::var("BLINN_SIMD") {
        Ok(name) if !name.is_empty() => name.parse().map_err(|e| format!("BLINN_SIMD: {e}")),
        _ => Ok(SimdLevel::detect()),
    }
}

/// The scenes of docs/reference/performance-figures.md.
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
        (Mode::Dump, _) => Vec::new(),
        (Mode::Frame, _) => scans(&[70_000, 1_100_000]),
    }
}
