//! The commands that make a picture, as a POSIX shell reads them.

use std::borrow::Cow;
use std::ffi::{OsStr, OsString};
use std::path::{Path, PathBuf};

use crate::render_flags::turntable_plan;

/// Animation formats of turntables. The first that suits the picture is used.
const ANIMATIONS: [&str; 3] = ["mp4", "apng", "gif"];

/// Characters that begin placeholders in output names.
const PLACEHOLDERS: [char; 3] = ['#', '%', '{'];

/// The command that renders a picture of `scene` to the current folder; `None` if a name cannot be quoted.
pub fn render_command(flags: &[OsString], scene: &Path) -> Option<String> {
    shell_line("render", flags, scene, &output_name(scene, "", "png"))
}

/// The command that renders a turntable in place of the picture, if there is one.
pub fn turntable_command(flags: &[OsString], scene: &Path) -> Option<String> {
    let output =
        ANIMATIONS.iter().map(|extension| output_name(scene, "_turntable", extension)).find(|output| {
            let mut flags = flags.to_vec();
            let mut flag = OsString::from("--output=");
            flag.push(output);
            flags.push(flag);
            turntable_plan(flags, scene).is_ok()
        })?;
    shell_line("turntable", flags, scene, &output)
}

fn output_name(scene: &Path, suffix: &str, extension: &str) -> PathBuf {
    let stem = scene.file_stem().and_then(OsStr::to_str).filter(|stem| !stem.contains(PLACEHOLDERS));
    let stem = stem.unwrap_or("{stem}");
    format!("{stem}{suffix}.{extension}").into()
}

fn shell_line(command: &str, flags: &[OsString], scene: &Path, output: &Path) -> Option<String> {
    let scene = undashed(scene);
    let output = undashed(output);
    let words = ["blinn", command, scene.to_str()?].into_iter();
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
        let flags = ["--hide=it's [[]1]", "--samples=4"].map(OsString::from);
        let line = render_command(&flags, Path::new("a b/$x.glb")).unwrap();
        let words = shlex::split(&line).unwrap();
        let expected = ["blinn", "render", "a b/$x.glb", "--hide=it's [[]1]", "--samples=4", "-o", "$x.png"];
        assert_eq!(words, expected);
        assert!(!line.contains(" $x"));
        let line = render_command(&[], Path::new("-x.glb")).unwrap();
        assert_eq!(line, "blinn render ./-x.glb -o ./-x.png");
        let line = render_command(&[], Path::new("a#.glb")).unwrap();
        assert_eq!(shlex::split(&line).unwrap().last().unwrap(), "{stem}.png");
    }
}
