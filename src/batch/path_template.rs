//! What files are called: patterns, filled in for a scene and a frame.

use std::ffi::{OsStr, OsString};
use std::path::{Path, PathBuf};

/// A file name with places to fill in: `{stem}` or `{model}`, `{parent}`, `{index}`, and for the
/// frame's number `####`, `%04d` or `{frame:04}`. What looks like none of those stands for itself.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PathTemplate(Vec<Piece>);

#[derive(Clone, Debug, PartialEq, Eq)]
enum Piece {
    Text(String),
    Stem,
    Parent,
    Index,
    /// Padded with zeros to so many digits.
    Frame(usize),
}

/// What a name is filled in with.
#[derive(Clone, Copy, Debug)]
pub struct TemplateFields<'a> {
    /// The scene's file.
    pub scene: &'a Path,
    /// Which scene of the batch, from 1.
    pub index: usize,
    /// The frame's number.
    pub frame: i64,
}

/// Digits of a frame's number where no pattern says.
const DIGITS: usize = 4;
/// Digits that anyone may want.
const MOST_DIGITS: usize = 32;

impl PathTemplate {
    /// Reads a pattern. Every text is one.
    pub fn parse(text: &str) -> PathTemplate {
        let mut pieces = Vec::new();
        let mut rest = text;
        while let Some(c) = rest.chars().next() {
            if let Some((piece, after)) = place(rest) {
                pieces.push(piece);
                rest = after;
                continue;
            }
            match pieces.last_mut() {
                Some(Piece::Text(text)) => text.push(c),
                _ => pieces.push(Piece::Text(c.into())),
            }
            rest = &rest[c.len_utf8()..];
        }
        PathTemplate(pieces)
    }

    /// A pattern inside a folder, whose name stands for itself.
    pub fn in_folder(folder: &str, name: &str) -> PathTemplate {
        let mut pieces = vec![Piece::Text(folder.into())];
        pieces.extend(PathTemplate::parse(name).0);
        PathTemplate(pieces)
    }

    /// The first word in braces that would be filled in if it were a known one.
    pub fn unknown_placeholder(text: &str) -> Option<&str> {
        let opens = text.match_indices('{').map(|(i, _)| &text[i..]);
        opens.filter(|rest| place(rest).is_none()).find_map(|rest| {
            let word = &rest[..=rest.find('}')?];
            let letter = |c: char| c.is_ascii_alphanumeric() || "_:".contains(c);
            (word.len() > 2 && word[1..word.len() - 1].chars().all(letter)).then_some(word)
        })
    }

    /// Whether there is nothing to fill in.
    pub fn is_literal(&self) -> bool {
        self.0.iter().all(|piece| matches!(piece, Piece::Text(_)))
    }

    /// Whether a frame's number is part of the name.
    pub fn has_frame_number(&self) -> bool {
        self.0.iter().any(|piece| matches!(piece, Piece::Frame(_)))
    }

    /// With `_####` before the ending, unless frames have a number already.
    pub fn with_frame_number(mut self) -> PathTemplate {
        if self.has_frame_number() {
            return self;
        }
        let number = [Piece::Text("_".into()), Piece::Frame(DIGITS)];
        match self.0.pop() {
            Some(Piece::Text(last)) => {
                let name = last.rfind(['/', '\\']).map_or(0, |i| i + 1);
                let ending = last[name..].rfind('.').map_or(last.len(), |i| name + i);
                let (before, ending) = last.split_at(ending);
                if !before.is_empty() {
                    self.0.push(Piece::Text(before.into()));
                }
                self.0.extend(number);
                self.0.push(Piece::Text(ending.into()));
            }
            other => self.0.extend(other.into_iter().chain(number)),
        }
        self
    }

    /// The name for a scene and a frame.
    pub fn expand(&self, name: &TemplateFields) -> PathBuf {
        let mut out = OsString::new();
        for piece in &self.0 {
            match piece {
                Piece::Text(t) => out.push(t),
                Piece::Stem => out.push(name.scene.file_stem().unwrap_or_default()),
                Piece::Parent => out.push(folder_name(name.scene)),
                Piece::Index => out.push(name.index.to_string()),
                Piece::Frame(width) => {
                    let sign = if name.frame < 0 { "-" } else { "" };
                    out.push(format!("{sign}{:0width$}", name.frame.unsigned_abs(), width = *width));
                }
            }
        }
        out.into()
    }
}

/// The name of the folder that holds a scene, which a bare name does not say, nor one behind `..`.
fn folder_name(scene: &Path) -> OsString {
    let folder = scene.parent().filter(|f| !f.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let name = |folder: &Path| folder.file_name().map(OsStr::to_os_string);
    name(folder).or_else(|| name(&folder.canonicalize().ok()?)).unwrap_or_default()
}

/// The place to fill in that `text` begins with, and what follows it.
fn place(text: &str) -> Option<(Piece, &str)> {
    let width = |digits: &str| digits.parse::<usize>().ok().map(|w| w.min(MOST_DIGITS));
    if let Some((key, after)) = text.strip_prefix('{').and_then(|rest| rest.split_once('}')) {
        let piece = match key {
            "stem" | "model" => Piece::Stem,
            "parent" => Piece::Parent,
            "index" => Piece::Index,
            "frame" => Piece::Frame(0),
            _ => Piece::Frame(width(key.strip_prefix("frame:")?)?),
        };
        return Some((piece, after));
    }
    let after = text.trim_start_matches('#');
    if after.len() < text.len() {
        return Some((Piece::Frame((text.len() - after.len()).min(MOST_DIGITS)), after));
    }
    let (digits, after) = text.strip_prefix('%')?.split_once('d')?;
    if digits.is_empty() {
        return Some((Piece::Frame(0), after));
    }
    let all_digits = digits.bytes().all(|b| b.is_ascii_digit());
    all_digits.then(|| width(digits)).flatten().map(|w| (Piece::Frame(w), after))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn filled(template: &PathTemplate, frame: i64) -> String {
        let scene = Path::new("shots/Ä robot.glb");
        template.expand(&TemplateFields { scene, index: 3, frame }).to_str().unwrap().into()
    }

    #[test]
    fn names_are_filled_in() {
        for (template, expected) in [
            ("{stem}.png", "Ä robot.png"),
            ("out/{parent}-{model}-{index}.exr", "out/shots-Ä robot-3.exr"),
            ("f_####.png", "f_0007.png"),
            ("f_%04d.png", "f_0007.png"),
            ("f_%d.png", "f_7.png"),
            ("f_{frame}.png", "f_7.png"),
            ("f_{frame:05}.png", "f_00007.png"),
            ("100%.png", "100%.png"),
            ("%xd.png", "%xd.png"),
            ("{other}.png", "{other}.png"),
            ("{frame:x}.png", "{frame:x}.png"),
            ("{.png", "{.png"),
        ] {
            assert_eq!(filled(&PathTemplate::parse(template), 7), expected);
        }
        assert_eq!(filled(&PathTemplate::parse("f_####.png"), 12345), "f_12345.png");
        assert_eq!(filled(&PathTemplate::parse("f_####.png"), -7), "f_-0007.png");
    }

    #[test]
    fn words_that_stand_for_nothing_are_found() {
        for (text, unknown) in [
            ("{other}.png", Some("{other}")),
            ("{stem}_{frames:04}.png", Some("{frames:04}")),
            ("{frame:x}.png", Some("{frame:x}")),
            ("{{stem}}.png", None),
            ("{stem}_{frame:04}.png", None),
            ("{}{ }{a b}{.png", None),
            ("a}b{ä}.png", None),
        ] {
            assert_eq!(PathTemplate::unknown_placeholder(text), unknown, "{text}");
        }
    }

    #[test]
    fn a_folder_has_a_name_wherever_one_is() {
        let here = std::env::current_dir().unwrap().file_name().unwrap().to_os_string();
        for scene in ["a.glb", "./a.glb", "src/../a.glb"] {
            assert_eq!(folder_name(Path::new(scene)), here, "{scene}");
        }
        assert_eq!(folder_name(Path::new("src/cli/../a.glb")), "src");
        assert_eq!(folder_name(Path::new("not/there/a.glb")), "there");
        assert_eq!(folder_name(Path::new("/a.glb")), "");
    }

    #[test]
    fn a_given_folder_is_not_filled_in() {
        assert_eq!(
            filled(&PathTemplate::in_folder("C#/{stem}/", "{stem}_#.png"), 7),
            "C#/{stem}/Ä robot_7.png"
        );
        assert_eq!(filled(&PathTemplate::in_folder("C#/", "a.png").with_frame_number(), 7), "C#/a_0007.png");
        assert!(!PathTemplate::in_folder("C#/", "a.png").has_frame_number());
    }

    /// Two scenes whose names are no text have two pictures.
    #[cfg(unix)]
    #[test]
    fn names_keep_their_bytes() {
        use std::os::unix::ffi::OsStrExt;
        let scene = Path::new(OsStr::from_bytes(b"a\xff.glb"));
        let name = PathTemplate::parse("{stem}_#.png").expand(&TemplateFields { scene, index: 1, frame: 2 });
        assert_eq!(name.as_os_str().as_bytes(), b"a\xff_2.png");
    }

    #[test]
    fn several_frames_are_numbered_before_the_ending() {
        for (template, expected) in [
            ("a.png", "a_0007.png"),
            ("b.d/a", "b.d/a_0007"),
            ("{stem}.exr", "Ä robot_0007.exr"),
            ("{stem}", "Ä robot_0007"),
            ("a.{index}", "a.3_0007"),
            ("##.png", "07.png"),
        ] {
            assert_eq!(filled(&PathTemplate::parse(template).with_frame_number(), 7), expected);
        }
    }
}
