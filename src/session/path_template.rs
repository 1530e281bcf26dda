//! Templates of output paths, with placeholders for the scene and the frame.

use std::ffi::{OsStr, OsString};
use std::path::{Path, PathBuf, is_separator};

/// A path with placeholders: `{stem}`, `{ext}`, `{parent}`, `{index}` or `{index:05}`, `{camera}`, for the frame number `####`,
/// `%04d` or `{frame:04}`, and for the number of an archive `{shard}` or `{shard:05}`. Other braces, `#` and `%` are literal.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PathTemplate(Vec<Piece>);

#[derive(Clone, Debug, PartialEq, Eq)]
enum Piece {
    Literal(String),
    Stem,
    /// The extension of the scene file, without a dot.
    Extension,
    Parent,
    /// The number of the scene, padded with zeros.
    Index {
        digits: usize,
    },
    /// The name of the camera.
    Camera,
    /// The frame number, padded with zeros.
    Frame {
        digits: usize,
    },
    /// The number of an archive, padded with zeros.
    Shard {
        digits: usize,
    },
}

/// The values of the placeholders.
#[derive(Clone, Copy, Debug)]
pub struct TemplateFields<'a> {
    /// The scene file.
    pub scene: &'a Path,
    /// The index of the scene in the batch, from 1.
    pub index: usize,
    /// The frame number.
    pub frame: i64,
    /// The name of the camera in a list, which may have folders; empty without a list.
    pub camera: &'a str,
    /// The number of the archive, from 0.
    pub shard: usize,
}

/// Digits of a frame number that is appended to a path without one.
const DEFAULT_DIGITS: usize = 4;
const MAX_DIGITS: usize = 32;

impl PathTemplate {
    /// Parses a template. Every text is valid.
    pub fn parse(text: &str) -> PathTemplate {
        let mut pieces = Vec::new();
        let mut rest = text;
        while let Some(c) = rest.chars().next() {
            if let Some((piece, after)) = parse_placeholder(rest) {
                pieces.push(piece);
                rest = after;
                continue;
            }
            match pieces.last_mut() {
                Some(Piece::Literal(text)) => text.push(c),
                _ => pieces.push(Piece::Literal(c.into())),
            }
            rest = &rest[c.len_utf8()..];
        }
        PathTemplate(pieces)
    }

    /// A template inside a folder whose name is literal.
    pub fn in_folder(folder: &str, name: &str) -> PathTemplate {
        let mut pieces = vec![Piece::Literal(folder.into())];
        pieces.extend(PathTemplate::parse(name).0);
        PathTemplate(pieces)
    }

    /// Returns the first word in braces that is not a placeholder, which is probably a typing error.
    pub fn unknown_placeholder(text: &str) -> Option<&str> {
        let open_braces = text.match_indices('{').map(|(i, _)| &text[i..]);
        open_braces.filter(|rest| parse_placeholder(rest).is_none()).find_map(|rest| {
            let word = &rest[..=rest.find('}')?];
            let in_name = |c: char| c.is_ascii_alphanumeric() || "_:".contains(c);
            (word.len() > 2 && word[1..word.len() - 1].chars().all(in_name)).then_some(word)
        })
    }

    /// Returns true if it has no placeholders.
    pub fn is_literal(&self) -> bool {
        self.0.iter().all(|piece| matches!(piece, Piece::Literal(_)))
    }

    /// Returns true if it has a placeholder for the frame number.
    pub fn has_frame_number(&self) -> bool {
        self.0.iter().any(|piece| matches!(piece, Piece::Frame { .. }))
    }

    /// Returns true if it has a placeholder for the number of an archive.
    pub fn has_shard_number(&self) -> bool {
        self.0.iter().any(|piece| matches!(piece, Piece::Shard { .. }))
    }

    /// Returns true if it has no placeholder but that.
    pub fn has_only_shard_number(&self) -> bool {
        self.0.iter().all(|piece| matches!(piece, Piece::Shard { .. } | Piece::Literal(_)))
    }

    /// Returns true if it has a placeholder for the name of the camera.
    pub fn has_camera(&self) -> bool {
        self.0.contains(&Piece::Camera)
    }

    /// Inserts `_####` before the extension if there is neither a frame number nor a camera.
    pub fn with_frame_number(mut self) -> PathTemplate {
        if self.has_frame_number() || self.has_camera() {
            return self;
        }
        let number = [Piece::Literal("_".into()), Piece::Frame { digits: DEFAULT_DIGITS }];
        match self.0.pop() {
            Some(Piece::Literal(last)) => {
                let name = last.rfind(['/', '\\']).map_or(0, |i| i + 1);
                let extension = last[name..].rfind('.').map_or(last.len(), |i| name + i);
                let (before, extension) = last.split_at(extension);
                if !before.is_empty() {
                    self.0.push(Piece::Literal(before.into()));
                }
                self.0.extend(number);
                self.0.push(Piece::Literal(extension.into()));
            }
            other => self.0.extend(other.into_iter().chain(number)),
        }
        self
    }

    /// Expands the placeholders.
    pub fn expand(&self, fields: &TemplateFields) -> PathBuf {
        let mut path = OsString::new();
        for piece in &self.0 {
            match *piece {
                Piece::Literal(ref text) => path.push(text),
                Piece::Stem => path.push(fields.scene.file_stem().unwrap_or_default()),
                Piece::Extension => path.push(fields.scene.extension().unwrap_or_default()),
                Piece::Parent => path.push(folder_name(fields.scene)),
                Piece::Index { digits } => path.push(format!("{:0digits$}", fields.index)),
                // Folders of a name are folders only where a part of the path begins.
                Piece::Camera if begins_part(&path) => path.push(fields.camera),
                Piece::Camera => path.push(fields.camera.replace('/', "_")),
                Piece::Frame { digits } => {
                    let sign = if fields.frame < 0 { "-" } else { "" };
                    path.push(format!("{sign}{:0digits$}", fields.frame.unsigned_abs()));
                }
                Piece::Shard { digits } => path.push(format!("{:0digits$}", fields.shard)),
            }
        }
        path.into()
    }
}

/// Returns true if what follows `path` begins a folder or file name.
fn begins_part(path: &OsStr) -> bool {
    path.as_encoded_bytes().last().is_none_or(|last| is_separator(char::from(*last)))
}

/// The name of the folder of a scene. The path may not contain it, or may end in `..`.
pub fn folder_name(scene: &Path) -> OsString {
    let folder = scene.parent().filter(|f| !f.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let name = |folder: &Path| folder.file_name().map(OsStr::to_os_string);
    name(folder).or_else(|| name(&folder.canonicalize().ok()?)).unwrap_or_default()
}

/// Parses the placeholder at the start of `text`. Returns it with the rest of the text.
fn parse_placeholder(text: &str) -> Option<(Piece, &str)> {
    let frame = |digits: usize| Piece::Frame { digits: digits.min(MAX_DIGITS) };
    if let Some((key, after)) = text.strip_prefix('{').and_then(|rest| rest.split_once('}')) {
        let piece = match key {
            "stem" => Piece::Stem,
            "ext" => Piece::Extension,
            "parent" => Piece::Parent,
            "camera" => Piece::Camera,
            _ => {
                let (name, digits) = key.split_once(':').unwrap_or((key, "0"));
                let digits = digits.parse::<usize>().ok()?.min(MAX_DIGITS);
                match name {
                    "index" => Piece::Index { digits },
                    "frame" => Piece::Frame { digits },
                    "shard" => Piece::Shard { digits },
                    _ => return None,
                }
            }
        };
        return Some((piece, after));
    }
    let after = text.trim_start_matches('#');
    if after.len() < text.len() {
        return Some((frame(text.len() - after.len()), after));
    }
    let (digits, after) = text.strip_prefix('%')?.split_once('d')?;
    if digits.is_empty() {
        return Some((frame(0), after));
    }
    let is_number = digits.bytes().all(|b| b.is_ascii_digit());
    Some((frame(digits.parse().ok().filter(|_| is_number)?), after))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn expand(template: &PathTemplate, frame: i64) -> String {
        let scene = Path::new("shots/Ä robot.glb");
        template
            .expand(&TemplateFields { scene, index: 3, frame, camera: "", shard: 12 })
            .to_str()
            .unwrap()
            .into()
    }

    #[test]
    fn placeholders_are_expanded() {
        for (template, expected) in [
            ("{stem}.png", "Ä robot.png"),
            ("out/{parent}-{stem}-{index}.exr", "out/shots-Ä robot-3.exr"),
            ("{stem}.{ext}.png", "Ä robot.glb.png"),
            ("{index:05}/{stem}.png", "00003/Ä robot.png"),
            ("{index:x}.png", "{index:x}.png"),
            ("f_####.png", "f_0007.png"),
            ("f_%04d.png", "f_0007.png"),
            ("f_%d.png", "f_7.png"),
            ("f_{frame}.png", "f_7.png"),
            ("f_{frame:05}.png", "f_00007.png"),
            ("s_{shard}.tar", "s_12.tar"),
            ("s_{shard:05}.tar", "s_00012.tar"),
            ("100%.png", "100%.png"),
            ("%xd.png", "%xd.png"),
            ("{other}.png", "{other}.png"),
            ("{frame:x}.png", "{frame:x}.png"),
            ("{.png", "{.png"),
        ] {
            assert_eq!(expand(&PathTemplate::parse(template), 7), expected);
        }
        assert_eq!(expand(&PathTemplate::parse("f_####.png"), 12345), "f_12345.png");
        assert_eq!(expand(&PathTemplate::parse("f_####.png"), -7), "f_-0007.png");
    }

    #[test]
    fn folders_of_camera_names_are_folders_where_a_part_begins() {
        let expand = |template: &str| {
            let scene = Path::new("a.glb");
            let fields = TemplateFields { scene, index: 1, frame: 7, camera: "train/r_0", shard: 0 };
            PathTemplate::parse(template).with_frame_number().expand(&fields)
        };
        assert_eq!(expand("out/{camera}.png"), Path::new("out/train/r_0.png"));
        assert_eq!(expand("{camera}.png"), Path::new("train/r_0.png"));
        assert_eq!(expand("out/{stem}_{camera}.png"), Path::new("out/a_train_r_0.png"));
        assert_eq!(expand("{camera}_##.png"), Path::new("train/r_0_07.png"));
    }

    #[test]
    fn unknown_placeholders_are_reported() {
        for (text, unknown) in [
            ("{other}.png", Some("{other}")),
            ("{model}.png", Some("{model}")),
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
    fn the_folder_name_is_found_without_a_path_and_behind_dots() {
        let here = std::env::current_dir().unwrap().file_name().unwrap().to_os_string();
        for scene in ["a.glb", "./a.glb", "../session/a.glb"] {
            assert_eq!(folder_name(Path::new(scene)), here, "{scene}");
        }
        assert_eq!(folder_name(Path::new("../scene/texture/../a.glb")), "scene");
        assert_eq!(folder_name(Path::new("not/there/a.glb")), "there");
        assert_eq!(folder_name(Path::new("/a.glb")), "");
    }

    #[test]
    fn the_folder_of_a_template_is_literal() {
        assert_eq!(
            expand(&PathTemplate::in_folder("C#/{stem}/", "{stem}_#.png"), 7),
            "C#/{stem}/Ä robot_7.png"
        );
        assert_eq!(expand(&PathTemplate::in_folder("C#/", "a.png").with_frame_number(), 7), "C#/a_0007.png");
        assert!(!PathTemplate::in_folder("C#/", "a.png").has_frame_number());
    }

    /// Scenes whose names are not UTF-8 get distinct images.
    #[cfg(unix)]
    #[test]
    fn names_keep_their_bytes() {
        use std::os::unix::ffi::OsStrExt;
        let scene = Path::new(OsStr::from_bytes(b"a\xff.glb"));
        let name = PathTemplate::parse("{stem}_#.png").expand(&TemplateFields {
            scene,
            index: 1,
            frame: 2,
            camera: "",
            shard: 0,
        });
        assert_eq!(name.as_os_str().as_bytes(), b"a\xff_2.png");
    }

    #[test]
    fn the_frame_number_is_inserted_before_the_extension() {
        for (template, expected) in [
            ("a.png", "a_0007.png"),
            ("b.d/a", "b.d/a_0007"),
            ("{stem}.exr", "Ä robot_0007.exr"),
            ("{stem}", "Ä robot_0007"),
            ("a.{index}", "a.3_0007"),
            ("##.png", "07.png"),
        ] {
            assert_eq!(expand(&PathTemplate::parse(template).with_frame_number(), 7), expected);
        }
    }
}
