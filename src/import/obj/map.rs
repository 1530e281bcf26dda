//! A texture in an MTL: its options, which stand before or after its name, and the name itself,
//! which may have spaces and words like theirs.

use glam::Vec2;

use super::text::{number, split_keyword};
use crate::scene::TextureChannel;

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
    pub channel: Option<TextureChannel>,
}

/// How many values an option takes at most; `None` for words that are no option.
fn option_values(word: &str) -> Option<usize> {
    match word {
        "-s" | "-o" | "-t" => Some(3),
        "-mm" => Some(2),
        "-bm" | "-boost" | "-texres" | "-clamp" | "-blendu" | "-blendv" | "-cc" | "-imfchan" | "-type"
        | "-colorspace" => Some(1),
        _ => None,
    }
}

/// A texture, and the options that would change the picture and are not known here. `None` where no
/// file is named.
pub(super) fn read(rest: &str) -> Option<(Map, Vec<&str>)> {
    let rest = rest.trim();
    let mut left = Vec::new();
    let mut map = Map {
        file: String::new(),
        scale: Vec2::ONE,
        offset: Vec2::ZERO,
        clamp: false,
        bump: 1.0,
        channel: None,
    };
    // The name so far, and what was known before options that seem to follow it.
    let (mut name, mut before) = (0..0, None);
    let mut text = rest;
    while !text.is_empty() {
        let (word, after) = split_keyword(text);
        let at = rest.len() - text.len();
        let Some(most) = option_values(word) else {
            if let Some(without) = before.take() {
                if word.starts_with('#') {
                    break;
                }
                // They are in its midst.
                (map, left) = without;
            }
            name = if name.is_empty() { at } else { name.start }..at + word.len();
            text = after;
            continue;
        };
        if !name.is_empty() && before.is_none() {
            before = Some((map.clone(), left.clone()));
        }
        let mut values = Vec::new();
        text = after;
        while values.len() < most && !text.is_empty() {
            let (value, after) = split_keyword(text);
            let fits = match word {
                "-clamp" | "-blendu" | "-blendv" | "-cc" => is(value, "on") || is(value, "off"),
                "-imfchan" | "-type" | "-colorspace" => true,
                _ => number(value).is_some(),
            };
            if !fits {
                break;
            }
            values.push(value);
            text = after;
        }
        if !map.set(word, &values) {
            left.push(word);
        }
    }
    map.file = rest[name].trim_matches('"').to_string();
    (!map.file.is_empty()).then_some((map, left))
}

/// Values of options count in any case.
fn is(value: &str, word: &str) -> bool {
    value.eq_ignore_ascii_case(word)
}

impl Map {
    /// False where the option would change the picture, and does not.
    fn set(&mut self, option: &str, values: &[&str]) -> bool {
        let first = values.first().copied().unwrap_or("");
        if values.iter().any(|v| number(v).is_some_and(|v| !v.is_finite())) {
            return false;
        }
        let at = |i: usize, missing: f32| values.get(i).and_then(|v| number(v)).unwrap_or(missing);
        match option {
            "-s" => self.scale = Vec2::new(at(0, 1.0), at(1, 1.0)),
            "-o" => self.offset = Vec2::new(at(0, 0.0), at(1, 0.0)),
            "-bm" => self.bump = at(0, 1.0),
            "-clamp" => self.clamp = is(first, "on"),
            "-imfchan" => {
                self.channel = first.chars().next().map(|c| match c.to_ascii_lowercase() {
                    'r' => TextureChannel::R,
                    'g' => TextureChannel::G,
                    'b' => TextureChannel::B,
                    'm' => TextureChannel::A,
                    _ => TextureChannel::Mean,
                });
            }
            "-mm" => return (at(0, 0.0), at(1, 1.0)) == (0.0, 1.0),
            "-t" | "-boost" => return (0..3).all(|i| at(i, 0.0) == 0.0),
            "-cc" => return !is(first, "on"),
            "-blendu" | "-blendv" => return !is(first, "off"),
            "-colorspace" => return is(first, "sRGB"),
            _ => {}
        }
        true
    }
}
