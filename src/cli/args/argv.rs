//! The words of a command line, before they are read.

use std::ffi::{OsStr, OsString};
use std::path::Path;

use clap::{Arg, Command};

use crate::batch::FrameList;
use crate::bench::scenes;
use crate::cli::args::help;

/// `--frames LIST` becomes `--frames=LIST`, and `--frames` without a list stays alone: what follows
/// it is then a scene or another flag. So does `--suite`. And `--FLAG -1` becomes `--FLAG=-1`, as no flag
/// is a number: what is wrong with it is then that flag's to say.
pub(crate) fn join_lists(words: impl IntoIterator<Item = OsString>) -> Vec<OsString> {
    let mut out: Vec<OsString> = Vec::new();
    let mut flags = true;
    for word in words {
        match out.last_mut() {
            Some(last)
                if flags
                    && (last == "--frames" && is_list(&word)
                        || last == "--suite" && is_sizes(&word)
                        || is_negative(&word) && takes_value(last)) =>
            {
                last.push("=");
                last.push(word);
            }
            _ => {
                flags &= word != "--";
                out.push(word);
            }
        }
    }
    out
}

/// Whether a word is a list of frames, or was meant as one.
fn is_list(word: &OsString) -> bool {
    let Some(text) = word.to_str() else { return false };
    let ending = Path::new(text).extension().and_then(|e| e.to_str()).unwrap_or_default();
    let is_scene = ["glb", "gltf", "obj"].iter().any(|e| ending.eq_ignore_ascii_case(e));
    let is_else = is_scene || text.starts_with(['-', '@']) || Path::new(text).exists();
    FrameList::parse(text).is_ok() || !is_else
}

/// Whether a word is a number below zero, or begins with one.
fn is_negative(word: &OsStr) -> bool {
    let digits = word.to_str().and_then(|text| text.strip_prefix('-'));
    digits.is_some_and(|text| text.starts_with(|c: char| c.is_ascii_digit() || c == '.'))
}

/// Whether a word is the long name of an option, of whichever command.
fn takes_value(word: &OsStr) -> bool {
    fn has(command: &Command, long: &str) -> bool {
        let is = |arg: &Arg| {
            let named =
                arg.get_long() == Some(long) || arg.get_all_aliases().is_some_and(|a| a.contains(&long));
            named && arg.get_action().takes_values()
        };
        command.get_arguments().any(is) || command.get_subcommands().any(|below| has(below, long))
    }
    word.to_str().and_then(|text| text.strip_prefix("--")).is_some_and(|long| has(&help::full(), long))
}

/// Whether a word is the sizes of a suite, or was meant as such.
fn is_sizes(word: &OsString) -> bool {
    let Some(text) = word.to_str() else { return false };
    sizes(text).is_ok() || text.starts_with(|c: char| c.is_ascii_digit()) && !Path::new(text).exists()
}

/// Counts of triangles: `70k,1.1m`.
pub(crate) fn sizes(text: &str) -> Result<Vec<usize>, String> {
    text.split(',').map(|word| scenes::parse_triangle_count(word.trim())).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_list_belongs_to_its_flag_and_a_scene_does_not() {
        let joined = |line: &str| {
            let words = join_lists(line.split(' ').map(OsString::from));
            words.iter().map(|w| w.to_str().unwrap()).collect::<Vec<_>>().join(" ")
        };
        for (line, expected) in [
            ("render --frames 1-4 a.glb", "render --frames=1-4 a.glb"),
            ("render --frames -4--2 a.glb", "render --frames=-4--2 a.glb"),
            ("render --frames 1..4", "render --frames=1..4"),
            ("render --frames a.GLB", "render --frames a.GLB"),
            ("render --frames @list.txt", "render --frames @list.txt"),
            ("render --frames Cargo.toml", "render --frames Cargo.toml"),
            ("render --frames -s 1", "render --frames -s 1"),
            ("render --frames 1-x a.glb", "render --frames=1-x a.glb"),
            ("render --frames=3 7", "render --frames=3 7"),
            ("render a.glb --frames", "render a.glb --frames"),
            ("render -- --frames 3", "render -- --frames 3"),
            ("render --zoom -1 --clip -.5,2 a.glb", "render --zoom=-1 --clip=-.5,2 a.glb"),
            ("render --camera-index -1 -q -1", "render --camera-index=-1 -q -1"),
            ("render --quiet -1 --zoom -x", "render --quiet -1 --zoom -x"),
            ("render -- --zoom -1", "render -- --zoom -1"),
            ("bench --suite 70k,1.1m a.glb", "bench --suite=70k,1.1m a.glb"),
            ("bench --suite 70q", "bench --suite=70q"),
            ("bench --suite a.glb", "bench --suite a.glb"),
            ("bench --suite --json a", "bench --suite --json a"),
        ] {
            assert_eq!(joined(line), expected);
        }
    }
}
