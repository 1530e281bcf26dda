//! Texture map statements of MTL: options before or after the file name, and a name that may contain spaces and
//! words that look like options.

use glam::Vec2;

use super::text::{parse_number, split_keyword};
use crate::scene::TextureChannel;

/// A texture map of a material.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct TextureMap {
    /// File name as written.
    pub file: String,
    /// `-s` and `-o` along u and v, v upward.
    pub scale: Vec2,
    pub offset: Vec2,
    /// `-clamp on`.
    pub clamp: bool,
    /// `-bm`: bump multiplier.
    pub bump: f32,
    /// `-imfchan`: the channel of a scalar or bump texture.
    pub channel: Option<TextureChannel>,
}

/// Returns the maximum number of values of an option; `None` for a word that is no option.
fn max_option_values(word: &str) -> Option<usize> {
    match word {
        "-s" | "-o" | "-t" => Some(3),
        "-mm" => Some(2),
        "-bm" | "-boost" | "-texres" | "-clamp" | "-blendu" | "-blendv" | "-cc" | "-imfchan" | "-type"
        | "-colorspace" => Some(1),
        _ => None,
    }
}

/// A parsed map and the options that would change the picture but are not supported.
pub(super) struct ParsedMap<'t> {
    pub map: TextureMap,
    pub unsupported: Vec<&'t str>,
}

/// Parses the rest of a map statement. Returns `None` if it names no file.
pub(super) fn parse(rest: &str) -> Option<ParsedMap<'_>> {
    let rest = rest.trim();
    let mut unsupported = Vec::new();
    let mut map = TextureMap {
        file: String::new(),
        scale: Vec2::ONE,
        offset: Vec2::ZERO,
        clamp: false,
        bump: 1.0,
        channel: None,
    };
    // The name so far, and the state before options that seem to follow it.
    let mut name = 0..0;
    let mut before = None;
    let mut text = rest;
    while !text.is_empty() {
        let (word, after) = split_keyword(text);
        let at = rest.len() - text.len();
        let Some(max_values) = max_option_values(word) else {
            if let Some(state) = before.take() {
                if word.starts_with('#') {
                    break;
                }
                // More of the name follows: the options were part of it.
                (map, unsupported) = state;
            }
            name = if name.is_empty() { at } else { name.start }..at + word.len();
            text = after;
            continue;
        };
        if !name.is_empty() && before.is_none() {
            before = Some((map.clone(), unsupported.clone()));
        }
        let mut values = Vec::new();
        text = after;
        while values.len() < max_values && !text.is_empty() {
            let (value, after) = split_keyword(text);
            let fits = match word {
                "-clamp" | "-blendu" | "-blendv" | "-cc" => is_word(value, "on") || is_word(value, "off"),
                "-imfchan" | "-type" | "-colorspace" => true,
                _ => parse_number(value).is_some(),
            };
            if !fits {
                break;
            }
            values.push(value);
            text = after;
        }
        if !map.set_option(word, &values) {
            unsupported.push(word);
        }
    }
    map.file = rest[name].trim_matches('"').to_string();
    (!map.file.is_empty()).then_some(ParsedMap { map, unsupported })
}

/// Compares a value, ignoring case.
fn is_word(value: &str, word: &str) -> bool {
    value.eq_ignore_ascii_case(word)
}

impl TextureMap {
    /// Sets an option. Returns false if the option would change the picture but is not supported.
    fn set_option(&mut self, option: &str, values: &[&str]) -> bool {
        let first = values.first().copied().unwrap_or("");
        if values.iter().any(|v| parse_number(v).is_some_and(|v| !v.is_finite())) {
            return false;
        }
        let value = |i: usize, default: f32| values.get(i).and_then(|v| parse_number(v)).unwrap_or(default);
        match option {
            "-s" => self.scale = Vec2::new(value(0, 1.0), value(1, 1.0)),
            "-o" => self.offset = Vec2::new(value(0, 0.0), value(1, 0.0)),
            "-bm" => self.bump = value(0, 1.0),
            "-clamp" => self.clamp = is_word(first, "on"),
            "-imfchan" => {
                self.channel = first.chars().next().map(|c| match c.to_ascii_lowercase() {
                    'r' => TextureChannel::R,
                    'g' => TextureChannel::G,
                    'b' => TextureChannel::B,
                    'm' => TextureChannel::A,
                    _ => TextureChannel::Mean,
                });
            }
            "-mm" => return value(0, 0.0) == 0.0 && value(1, 1.0) == 1.0,
            "-t" | "-boost" => return (0..3).all(|i| value(i, 0.0) == 0.0),
            "-cc" => return !is_word(first, "on"),
            "-blendu" | "-blendv" => return !is_word(first, "off"),
            "-colorspace" => return is_word(first, "sRGB"),
            _ => {}
        }
        true
    }
}
