//! The commands that make a picture, as a POSIX shell reads them.

use std::borrow::Cow;
use std::ffi::OsStr;
use std::path::{Path, PathBuf};

use crate::args::ExplicitFlags;
use crate::plan::check_animation;
use blinn_output::AnimationFormat;
use blinn_session::DEFAULT_FPS;
use blinn_session::Options;

/// Animation formats of turntables. The first that suits the picture is used.
const ANIMATIONS: [(AnimationFormat, &str); 3] =
    [(AnimationFormat::Mp4, "mp4"), (AnimationFormat::Apng, "apng"), (AnimationFormat::Gif, "gif")];

/// Characters that begin placeholders in output names.
const PLACEHOLDERS: [char; 3] = ['#', '%', '{'];

/// The command that renders a picture of `scene` to the current folder; `None` if a name cannot be quoted.
pub fn render_command(flags: &ExplicitFlags, scene: &Path) -> Option<String> {
    shell_line("render", flags, scene, &output_name(scene, "", "png"))
}

/// The command that renders a turntable in place of the picture, if there is one. `options` are those that `flags` set.
pub fn turntable_command(flags: &ExplicitFlags, options: &Options, scene: &Path) -> Option<String> {
    let mut formats = ANIMATIONS.into_iter();
    let (_, extension) =
        formats.find(|(format, _)| check_animation(*format, DEFAULT_FPS, options).is_ok())?;
    shell_line("turntable", flags, scene, &output_name(scene, "_turntable", extension))
}

fn output_name(scene: &Path, suffix: &str, extension: &str) -> PathBuf {
    let stem = scene.file_stem().and_then(OsStr::to_str).filter(|stem| !stem.contains(PLACEHOLDERS));
    let stem = stem.unwrap_or("{stem}");
    format!("{stem}{suffix}.{extension}").into()
}

fn shell_line(command: &str, flags: &ExplicitFlags, scene: &Path, output: &Path) -> Option<String> {
    let scene = undashed(scene);
    let output = undashed(output);
    let words = ["blinn", command, scene.to_str()?].into_iter();
    let flags = flags.to_args();
    let words = words.chain(flags.iter().map(|flag| flag.to_str()).collect::<Option<Vec<_>>>()?);
    let words = words.chain(["-o", output.to_str()?]).map(quoted).collect::<Option<Vec<_>>>()?;
    Some(words.join(" "))
}

/// A word as a shell reads it; plain if no shell changes it.
fn quoted(word: &str) -> Option<Cow<'_, str>> {
    let is_plain = |c: char| c.is_ascii_alphanumeric() || "-_=./,:+@%".contains(c);
    if !word.is_empty() && !word.starts_with('=') && word.chars().all(is_plain) {
        return Some(word.into());
    }
    shlex::try_quote(word).ok()
}

/// A path that does not look like a flag.
fn undashed(path: &Path) -> PathBuf {
    let is_dashed = path.as_os_str().as_encoded_bytes().first() == Some(&b'-');
    if is_dashed { Path::new(".").join(path) } else { path.to_path_buf() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_quoted_and_do_not_look_like_flags() {
        let mut flags = ExplicitFlags::default();
        flags.push("hide", "it's [[]1]");
        flags.push("samples", "4");
        let line = render_command(&flags, Path::new("a b/$x.glb")).unwrap();
        let words = shlex::split(&line).unwrap();
        let expected = ["blinn", "render", "a b/$x.glb", "--hide=it's [[]1]", "--samples=4", "-o", "$x.png"];
        assert_eq!(words, expected);
        assert!(!line.contains(" $x"));
        let line = render_command(&ExplicitFlags::default(), Path::new("-x.glb")).unwrap();
        assert_eq!(line, "blinn render ./-x.glb -o ./-x.png");
        let line = render_command(&ExplicitFlags::default(), Path::new("a#.glb")).unwrap();
        assert_eq!(shlex::split(&line).unwrap().last().unwrap(), "{stem}.png");
    }
}
