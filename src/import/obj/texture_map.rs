//! Texture map statements of MTL: options before or after the file name, and a name that may contain spaces and
//! words that look like options.

use glam::Vec2;

use super::decimal_comma::DecimalCommas;
use super::number::parse_number;
use super::text::split_keyword;
use blinn_scene::TextureChannel;

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
    /// `-mm`: base and gain of the texels.
    pub range: TexelRange,
    /// `-imfchan`: the channel of a scalar or bump texture.
    pub channel: Option<TextureChannel>,
}

/// Base and gain of a texture's values: base + gain · value, clamped to 0…1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct TexelRange {
    pub base: f32,
    pub gain: f32,
}

impl TexelRange {
    /// Values as they are.
    pub const FULL: TexelRange = TexelRange { base: 0.0, gain: 1.0 };

    pub fn apply(self, value: f32) -> f32 {
        (self.base + self.gain * value).clamp(0.0, 1.0)
    }
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
pub(super) fn parse<'t>(rest: &'t str, commas: &mut DecimalCommas) -> Option<ParsedMap<'t>> {
    let rest = rest.trim();
    let mut unsupported = Vec::new();
    let mut map = TextureMap {
        file: String::new(),
        scale: Vec2::ONE,
        offset: Vec2::ZERO,
        clamp: false,
        bump: 1.0,
        range: TexelRange::FULL,
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
        let mut values = OptionValues::default();
        text = after;
        while values.count() < max_values && !text.is_empty() {
            let (value, after) = split_keyword(text);
            let fits = match word {
                "-clamp" | "-blendu" | "-blendv" | "-cc" => {
                    values.word = Some(value).filter(|value| is_word(value, "on") || is_word(value, "off"));
                    values.word.is_some()
                }
                "-imfchan" | "-type" | "-colorspace" => values.word.replace(value).is_none(),
                _ => values.push_numbers(value, max_values, commas),
            };
            if !fits {
                break;
            }
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

/// The values of an option: numbers, or a word.
#[derive(Default)]
struct OptionValues<'t> {
    numbers: Vec<f32>,
    word: Option<&'t str>,
}

impl<'t> OptionValues<'t> {
    fn count(&self) -> usize {
        self.numbers.len() + usize::from(self.word.is_some())
    }

    /// Adds the number in `text`, or numbers with commas between them. Returns false if it is neither.
    fn push_numbers(&mut self, text: &str, max_values: usize, commas: &mut DecimalCommas) -> bool {
        if let Some(number) = commas.parse(text) {
            self.numbers.push(number);
            return true;
        }
        let list: Option<Vec<f32>> = text.split(',').map(parse_number).collect();
        let list = list.filter(|list| self.numbers.is_empty() && (2..=max_values).contains(&list.len()));
        list.map(|list| self.numbers = list).is_some()
    }

    fn number(&self, index: usize, default: f32) -> f32 {
        self.numbers.get(index).copied().unwrap_or(default)
    }

    fn is_word(&self, word: &str) -> bool {
        self.word.is_some_and(|own| is_word(own, word))
    }
}

impl TextureMap {
    /// Sets an option. Returns false if the option would change the picture but is not supported.
    fn set_option(&mut self, option: &str, values: &OptionValues) -> bool {
        if values.numbers.iter().any(|v| !v.is_finite()) {
            return false;
        }
        let value = |i: usize, default: f32| values.number(i, default);
        match option {
            "-s" => self.scale = Vec2::new(value(0, 1.0), value(1, 1.0)),
            "-o" => self.offset = Vec2::new(value(0, 0.0), value(1, 0.0)),
            "-bm" => self.bump = value(0, 1.0),
            "-clamp" => self.clamp = values.is_word("on"),
            "-imfchan" => {
                let letter = values.word.and_then(|word| word.chars().next());
                self.channel = letter.map(|c| match c.to_ascii_lowercase() {
                    'r' => TextureChannel::R,
                    'g' => TextureChannel::G,
                    'b' => TextureChannel::B,
                    'm' => TextureChannel::A,
                    _ => TextureChannel::Mean,
                });
            }
            "-mm" => self.range = TexelRange { base: value(0, 0.0), gain: value(1, 1.0) },
            "-t" | "-boost" => return (0..3).all(|i| value(i, 0.0) == 0.0),
            "-cc" => return !values.is_word("on"),
            "-blendu" | "-blendv" => return !values.is_word("off"),
            "-colorspace" => return values.is_word("sRGB"),
            _ => {}
        }
        true
    }
}
