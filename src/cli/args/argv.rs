//! Joins flags and values before clap parses them, for two forms that clap does not support.

use std::ffi::{OsStr, OsString};
use std::path::Path;

use clap::{Command, ValueEnum};

use super::choices::ColorArg;
use super::command_tree::{built, find_flag};
use super::values;
use blinn_session::{FrameList, SCENE_EXTENSIONS};

/// Joins a flag and the argument after it with `=` in two cases. Only then clap takes the argument for the value.
///
/// - `--frames LIST` and `--suite SIZES`: their values are optional, so a scene may follow them, too.
/// - `--FLAG -1`: no flag begins with a digit or a dot, so this is always a value.
pub fn join_values(argv: impl IntoIterator<Item = OsString>) -> Vec<OsString> {
    let mut joined: Vec<OsString> = Vec::new();
    let mut flags_allowed = true;
    for arg in argv {
        match joined.last_mut() {
            Some(last)
                if flags_allowed
                    && (last == "--frames" && is_frame_list(&arg)
                        || last == "--suite" && is_triangle_counts(&arg)
                        || is_negative(&arg) && takes_value(last)) =>
            {
                last.push("=");
                last.push(arg);
            }
            _ => {
                flags_allowed &= arg != "--";
                joined.push(arg);
            }
        }
    }
    joined
}

/// True for --version or -V in any position, such as after a command.
pub fn asks_for_version(argv: &[OsString]) -> bool {
    let mut flags = argv.iter().skip(1).take_while(|arg| *arg != "--");
    flags.any(|arg| arg == "--version" || arg == "-V")
}

/// The choice of --color, before the command line is parsed: its errors have colours, too.
pub fn color(argv: &[OsString]) -> ColorArg {
    let mut flags = argv.iter().skip(1).take_while(|arg| *arg != "--").map(|arg| arg.to_string_lossy());
    let mut color = ColorArg::Auto;
    while let Some(flag) = flags.next() {
        let value = match flag.strip_prefix("--color=") {
            Some(value) => Some(value.to_string()),
            None if flag == "--color" => flags.next().map(|value| value.into_owned()),
            None => continue,
        };
        color = value.and_then(|value| ColorArg::from_str(&value, true).ok()).unwrap_or(color);
    }
    color
}

/// True for a list of frames, and for text that is nothing else, so that its error mentions --frames.
fn is_frame_list(arg: &OsString) -> bool {
    let Some(text) = arg.to_str() else { return false };
    let extension = Path::new(text).extension().and_then(|e| e.to_str()).unwrap_or_default();
    let is_scene = SCENE_EXTENSIONS.iter().any(|e| extension.eq_ignore_ascii_case(e));
    let is_other = is_scene || text.starts_with(['-', '@']) || Path::new(text).exists();
    FrameList::parse(text).is_ok() || !is_other
}

/// True for triangle counts, and for text that begins like them and is no file.
fn is_triangle_counts(arg: &OsString) -> bool {
    let Some(text) = arg.to_str() else { return false };
    values::triangle_counts(text).is_ok()
        || text.starts_with(|c: char| c.is_ascii_digit()) && !Path::new(text).exists()
}

/// True for text that begins with a negative number.
fn is_negative(arg: &OsStr) -> bool {
    let digits = arg.to_str().and_then(|text| text.strip_prefix('-'));
    digits.is_some_and(|text| text.starts_with(|c: char| c.is_ascii_digit() || c == '.'))
}

/// True for the long name of an option with a value, of any command.
fn takes_value(arg: &OsStr) -> bool {
    fn search(command: &Command, long: &str) -> bool {
        find_flag(command, long).is_some_and(|arg| arg.get_action().takes_values())
            || command.get_subcommands().any(|below| search(below, long))
    }
    arg.to_str().and_then(|text| text.strip_prefix("--")).is_some_and(|long| search(&built(), long))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_version_is_found_in_any_position() {
        let asks =
            |line: &str| asks_for_version(&line.split(' ').map(OsString::from).collect::<Vec<OsString>>());
        for line in
            ["blinn -V", "blinn --version", "blinn render --version", "blinn job slurm render a.glb -V"]
        {
            assert!(asks(line), "{line}");
        }
        for line in
            ["--version", "blinn render -v a.glb", "blinn render -- --version", "blinn info --version=1"]
        {
            assert!(!asks(line), "{line}");
        }
    }

    #[test]
    fn the_color_is_known_before_errors() {
        let of = |line: &str| color(&line.split(' ').map(OsString::from).collect::<Vec<OsString>>());
        assert_eq!(of("blinn render a.glb --color never --nonsense"), ColorArg::Never);
        assert_eq!(of("blinn info --color=ALWAYS a.glb"), ColorArg::Always);
        for line in ["blinn render a.glb", "blinn render a.glb --color", "blinn info -- --color=always"] {
            assert_eq!(of(line), ColorArg::Auto, "{line}");
        }
    }

    #[test]
    fn lists_and_negative_numbers_are_joined_to_their_flags() {
        let joined = |line: &str| {
            let argv = join_values(line.split(' ').map(OsString::from));
            argv.iter().map(|arg| arg.to_str().unwrap()).collect::<Vec<_>>().join(" ")
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
