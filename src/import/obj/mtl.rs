//! MTL text: what each material says, line by line. One bad line costs that line.

use glam::Vec2;

use super::super::error::Warnings;
use super::super::uri::printable;
use super::text::{lines, number, split_keyword};
use crate::geometry::Rgb;

/// A texture as an MTL names it.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Map {
    /// The file's name as written.
    pub file: String,
    /// `-s` and `-o` along u and v (v upward).
    pub scale: Vec2,
    pub offset: Vec2,
    /// `-clamp on`.
    pub clamp: bool,
    /// `-bm`.
    pub bump: f32,
    /// `-imfchan`.
    pub channel: Option<char>,
}

/// A material's statements; `None` where there is none.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Mtl {
    pub name: String,
    /// Where the MTL lies, relative to the OBJ: textures are relative to it.
    pub folder: String,
    pub by_blender: bool,
    pub ka: Option<Rgb>,
    pub kd: Option<Rgb>,
    pub ks: Option<Rgb>,
    pub ke: Option<Rgb>,
    pub ns: Option<f32>,
    pub ni: Option<f32>,
    pub d: Option<f32>,
    pub illum: Option<i64>,
    pub roughness: Option<f32>,
    pub metallic: Option<f32>,
    pub map_ka: Option<Map>,
    pub map_kd: Option<Map>,
    pub map_ks: Option<Map>,
    pub map_ke: Option<Map>,
    pub map_d: Option<Map>,
    pub map_roughness: Option<Map>,
    pub map_metallic: Option<Map>,
    pub map_normal: Option<Map>,
    /// True where the map came as `bump`, which may be heights.
    pub normal_is_bump: bool,
}

/// Reads an MTL. `place` names the file in warnings.
pub(super) fn parse(text: &str, place: &str, folder: &str, warnings: &mut Warnings) -> Vec<Mtl> {
    let by_blender = text.trim_start_matches('\u{feff}').trim_start().starts_with("# Blender");
    let mut all: Vec<Mtl> = Vec::new();
    for line in lines(text) {
        let (keyword, rest) = split_keyword(&line.text);
        if keyword.eq_ignore_ascii_case("newmtl") {
            all.push(Mtl {
                name: rest.to_string(),
                folder: folder.to_string(),
                by_blender,
                ..Default::default()
            });
            continue;
        }
        let here = format!("{place}, line {}", line.number);
        let Some(material) = all.last_mut() else {
            warnings.add(here, "a statement before the first newmtl was left out");
            continue;
        };
        match material.statement(keyword, rest) {
            Ok(()) => {}
            Err(Left::Bad(why)) => {
                warnings.add(here, format!("{}: {why}; the line was left out", printable(keyword)))
            }
            Err(Left::Unknown) => warnings.add(place, format!("'{}' is not shown", printable(keyword))),
            Err(Left::TransparencyTwice) => warnings.add(here, "both d and Tr: the later counts"),
            Err(Left::Unsupported(what)) => warnings.add(place, what),
        }
    }
    all
}

/// Why a statement does not count, or not as written.
enum Left {
    Bad(String),
    Unknown,
    TransparencyTwice,
    Unsupported(&'static str),
}

impl Mtl {
    fn statement(&mut self, keyword: &str, rest: &str) -> Result<(), Left> {
        let scalar = || {
            let word = rest.split_whitespace().next().unwrap_or("");
            let value = number(word).filter(|v| v.is_finite());
            value.ok_or_else(|| Left::Bad(format!("'{}' is not a number", printable(word))))
        };
        match keyword.to_ascii_lowercase().as_str() {
            "ka" => self.ka = Some(color(rest)?),
            "kd" => self.kd = Some(color(rest)?),
            "ks" => self.ks = Some(color(rest)?),
            "ke" => self.ke = Some(color(rest)?),
            "ns" => self.ns = Some(scalar()?),
            "ni" => self.ni = Some(scalar()?),
            "pr" => self.roughness = Some(scalar()?),
            "pm" => self.metallic = Some(scalar()?),
            "illum" => self.illum = Some(scalar()? as i64),
            key @ ("d" | "tr") => {
                let value = number(rest.trim_start_matches("-halo").trim()).map_or_else(scalar, Ok)?;
                let twice = self.d.is_some();
                self.d = Some(if key == "d" { value } else { 1.0 - value });
                if twice {
                    return Err(Left::TransparencyTwice);
                }
            }
            "map_ka" => self.map_ka = Some(map(rest)?),
            "map_kd" => self.map_kd = Some(map(rest)?),
            "map_ks" => self.map_ks = Some(map(rest)?),
            "map_ke" => self.map_ke = Some(map(rest)?),
            "map_d" | "map_opacity" => self.map_d = Some(map(rest)?),
            "map_pr" => self.map_roughness = Some(map(rest)?),
            "map_pm" => self.map_metallic = Some(map(rest)?),
            "norm" => (self.map_normal, self.normal_is_bump) = (Some(map(rest)?), false),
            "bump" | "map_bump" => {
                if self.map_normal.is_none() {
                    (self.map_normal, self.normal_is_bump) = (Some(map(rest)?), true);
                }
            }
            "disp" | "map_disp" => return Err(Left::Unsupported("displacement (disp) is not shown")),
            "refl" | "map_refl" => return Err(Left::Unsupported("reflection maps (refl) are not shown")),
            "pc" | "pcr" | "ps" | "aniso" | "anisor" => {
                if scalar()? != 0.0 {
                    return Err(Left::Unknown);
                }
            }
            // Index of refraction and filters matter to light that is bent, which this is not.
            "tf" | "sharpness" | "map_aat" => {}
            _ => return Err(Left::Unknown),
        }
        Ok(())
    }
}

/// Three numbers, or one for all three.
fn color(rest: &str) -> Result<Rgb, Left> {
    let words: Vec<&str> = rest.split_whitespace().collect();
    if matches!(words.first(), Some(&("spectral" | "xyz"))) {
        return Err(Left::Bad("only RGB colours are read".into()));
    }
    let values: Option<Vec<f32>> = words.iter().map(|w| number(w)).collect();
    match values.as_deref() {
        Some([v]) if v.is_finite() => Ok(Rgb::splat(*v)),
        Some([r, g, b, ..]) if (r + g + b).is_finite() => Ok(Rgb::new(*r, *g, *b)),
        _ => Err(Left::Bad(format!("'{}' is not a colour", printable(rest)))),
    }
}

/// How many values an option takes at most; `None` for words that are no option.
fn option_values(word: &str) -> Option<usize> {
    match word {
        "-s" | "-o" | "-t" => Some(3),
        "-mm" => Some(2),
        "-bm" | "-boost" | "-texres" | "-clamp" | "-blendu" | "-blendv" | "-cc" | "-imfchan" | "-type" => {
            Some(1)
        }
        _ => None,
    }
}

/// A texture with its options, before or after its name, which may have spaces.
fn map(rest: &str) -> Result<Map, Left> {
    let mut map = Map {
        file: String::new(),
        scale: Vec2::ONE,
        offset: Vec2::ZERO,
        clamp: false,
        bump: 1.0,
        channel: None,
    };
    let mut name: Vec<&str> = Vec::new();
    let mut text = rest.trim();
    while !text.is_empty() {
        let (word, after) = split_keyword(text);
        let Some(most) = option_values(word) else {
            // A run of the name, with the white space that follows it as written.
            let gap = text.len() - word.len() - after.len();
            name.push(&text[..word.len() + gap]);
            text = after;
            continue;
        };
        let mut values = Vec::new();
        text = after;
        while values.len() < most && !text.is_empty() {
            let (value, after) = split_keyword(text);
            let fits = match word {
                "-clamp" | "-blendu" | "-blendv" | "-cc" => matches!(value, "on" | "off"),
                "-imfchan" | "-type" => true,
                _ => number(value).is_some(),
            };
            if !fits {
                break;
            }
            values.push(value);
            text = after;
        }
        map.set(word, &values);
    }
    map.file = name.concat().trim().trim_matches('"').to_string();
    if map.file.is_empty() { Err(Left::Bad("no file is named".into())) } else { Ok(map) }
}

impl Map {
    fn set(&mut self, option: &str, values: &[&str]) {
        let at = |i: usize, missing: f32| values.get(i).and_then(|v| number(v)).unwrap_or(missing);
        match option {
            "-s" => self.scale = Vec2::new(at(0, 1.0), at(1, 1.0)),
            "-o" => self.offset = Vec2::new(at(0, 0.0), at(1, 0.0)),
            "-bm" => self.bump = at(0, 1.0),
            "-clamp" => self.clamp = values.first() == Some(&"on"),
            "-imfchan" => self.channel = values.first().and_then(|v| v.chars().next()),
            _ => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn one(text: &str) -> (Mtl, Vec<String>) {
        let mut warnings = Warnings::default();
        let all = parse(text, "a.mtl", "", &mut warnings);
        (all.into_iter().next().unwrap(), warnings.into_vec().iter().map(ToString::to_string).collect())
    }

    #[test]
    fn statements_are_read_and_a_bad_line_costs_that_line() {
        let (m, warnings) = one("newmtl red #2\nKd 1 0.5 0\nKs x\nKa .2\nNs 1D2\nd 0.5\nTr 0.25\nwhat 1\n");
        assert_eq!(
            (m.name.as_str(), m.kd, m.ka, m.ns),
            ("red #2", Some(Rgb::new(1.0, 0.5, 0.0)), Some(Rgb::splat(0.2)), Some(100.0))
        );
        assert_eq!((m.ks, m.d), (None, Some(0.75)));
        assert_eq!(warnings.len(), 3, "{warnings:?}");
        assert!(
            warnings[0].contains("line 3") && warnings[1].contains("line 7") && warnings[2].contains("what")
        );
    }

    #[test]
    fn options_stand_before_and_after_names_with_spaces() {
        for text in [
            "-s 2 3 1 -o .5 -clamp on -bm 0.5 -imfchan g my  tex 2.png",
            "my  tex 2.png -s 2 3 1 -o .5 -clamp on -bm 0.5 -imfchan g",
            "-clamp on -imfchan g -s 2 3 \"my  tex 2.png\" -o .5 -bm 0.5",
        ] {
            let (m, warnings) = one(&format!("newmtl a\nmap_Kd {text} \t\n"));
            let map = m.map_kd.unwrap();
            assert_eq!(map.file, "my  tex 2.png", "{text}");
            assert_eq!((map.scale, map.offset), (Vec2::new(2.0, 3.0), Vec2::new(0.5, 0.0)));
            assert_eq!((map.clamp, map.bump, map.channel), (true, 0.5, Some('g')));
            assert!(warnings.is_empty());
        }
    }

    #[test]
    fn no_text_does_harm() {
        let text = "# Blender\nnewmtl é\nKd 1 1 1\nmap_Kd -s 1 1 a.png\nbump -bm\nd\nillum 1e300\nNs nan\n";
        for end in (0..text.len()).filter(|&i| text.is_char_boundary(i)) {
            parse(&text[..end], "", "", &mut Warnings::default());
        }
    }
}
