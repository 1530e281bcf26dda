//! Parses MTL text into materials, line by line. An invalid line is skipped with a warning.

use super::super::error::Warnings;
use super::decimal_comma::DecimalCommas;
use super::mtl_opacity::{self, OpacityStatements};
use super::mtl_writer::MtlWriter;
use super::text::{logical_lines, split_keyword};
use super::texture_map::{self, TextureMap};
use crate::files::escape::printable;
use crate::options::MtlColors;
use blinn_core::geometry::Rgb;
use blinn_scene::srgb_to_linear;

/// The statements of a material; `None` for a statement that is missing.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct MtlMaterial {
    pub name: String,
    /// Folder of the MTL relative to the OBJ. Texture names are relative to it.
    pub folder: String,
    /// The program that wrote the file.
    pub writer: MtlWriter,
    pub ka: Option<Rgb>,
    pub kd: Option<Rgb>,
    pub ks: Option<Rgb>,
    pub ke: Option<Rgb>,
    /// `Tf`: transmission filter.
    pub tf: Option<Rgb>,
    pub ns: Option<f32>,
    pub ni: Option<f32>,
    /// The opacity: see [`mtl_opacity`].
    pub d: Option<f32>,
    pub opacity: OpacityStatements,
    pub illum: Option<i64>,
    pub roughness: Option<f32>,
    pub metallic: Option<f32>,
    /// `Pc`: clear coat; 4 covers the surface.
    pub coat: Option<f32>,
    /// `Pcr`: roughness of the clear coat.
    pub coat_roughness: Option<f32>,
    /// `Ps`: weight of the sheen.
    pub sheen: Option<f32>,
    /// `aniso`: strength of the anisotropy.
    pub anisotropy: Option<f32>,
    /// `anisor`: its rotation, in turns.
    pub anisotropy_rotation: Option<f32>,
    pub map_ka: Option<TextureMap>,
    pub map_kd: Option<TextureMap>,
    pub map_ks: Option<TextureMap>,
    pub map_ke: Option<TextureMap>,
    pub map_d: Option<TextureMap>,
    pub map_roughness: Option<TextureMap>,
    pub map_metallic: Option<TextureMap>,
    pub map_coat: Option<TextureMap>,
    pub map_coat_roughness: Option<TextureMap>,
    pub map_sheen: Option<TextureMap>,
    pub map_normal: Option<TextureMap>,
    /// True if the map came from `bump`, which may hold heights.
    pub normal_is_bump: bool,
}

/// Context of an MTL file that decides how its text is read.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct MtlContext<'a> {
    /// Program that wrote the OBJ.
    pub generator: &'a str,
    /// The encoding of colours.
    pub colors: MtlColors,
}

/// Parses an MTL file. `place` names the file in warnings.
pub(super) fn parse(
    text: &str,
    place: &str,
    folder: &str,
    context: MtlContext,
    warnings: &mut Warnings,
) -> Vec<MtlMaterial> {
    let writer = MtlWriter::find(text, context.generator);
    let mut all: Vec<MtlMaterial> = Vec::new();
    let mut commas = DecimalCommas::default();
    for line in logical_lines(text) {
        let (keyword, rest) = split_keyword(&line.text);
        if keyword.eq_ignore_ascii_case("newmtl") {
            all.push(MtlMaterial {
                name: rest.to_string(),
                folder: folder.to_string(),
                writer,
                ..Default::default()
            });
            continue;
        }
        let here = format!("{place}, line {}", line.number);
        let Some(material) = all.last_mut() else {
            warnings.add(here, "ignored a statement before the first newmtl");
            continue;
        };
        let found_before = commas.found;
        if let Err(problem) = material.apply(keyword, rest, line.number as u64, &mut commas) {
            problem.warn(&printable(keyword), &here, place, warnings);
        }
        if commas.found && !found_before {
            warnings.add(&here, "numbers have decimal commas: read as decimal points");
        }
    }
    let statements: Vec<_> = all.iter().map(|material| material.opacity).collect();
    let opacities = mtl_opacity::resolve(&statements, writer, place, warnings);
    for (material, d) in all.iter_mut().zip(opacities) {
        material.d = d;
    }
    all.iter_mut().for_each(MtlMaterial::remove_defaults);
    if writer.colors_are_srgb(context.colors) {
        all.iter_mut().for_each(MtlMaterial::decode_colors);
    }
    all
}

/// Why a statement is ignored, or not used as written.
enum Problem {
    Invalid(String),
    Unknown,
    Unsupported(&'static str),
    Negative,
    /// A colour of bytes, 0 to 255.
    Bytes,
    /// A reflectance with a component of this value.
    TooBright(f32),
    /// The map is used without these options.
    UnsupportedOptions(String),
}

impl Problem {
    /// Adds a warning at `line`, or at `file` if one warning per file and keyword is enough.
    fn warn(self, keyword: &str, line: &str, file: &str, warnings: &mut Warnings) {
        match self {
            Problem::Invalid(why) => warnings.add(line, format!("{keyword}: {why}; ignored the line")),
            Problem::Unknown => warnings.add(file, format!("ignored '{keyword}': not supported")),
            Problem::Negative => warnings.add(line, format!("{keyword}: used 0 instead of a negative value")),
            Problem::Bytes => {
                warnings.add(file, format!("{keyword} exceeds 1: read as bytes from 0 to 255"));
            }
            Problem::TooBright(max) => {
                warnings.add(line, format!("{keyword} has the value {max}, expected 0 to 1 or bytes"));
            }
            Problem::Unsupported(what) => warnings.add(file, what),
            Problem::UnsupportedOptions(options) => {
                warnings.add(line, format!("{keyword}: ignored the options {options} of the texture"));
            }
        }
    }
}

impl MtlMaterial {
    /// Applies a statement to the material.
    fn apply(
        &mut self,
        keyword: &str,
        rest: &str,
        line: u64,
        commas: &mut DecimalCommas,
    ) -> Result<(), Problem> {
        let mut scalar_in = |text: &str| {
            let word = text.split_whitespace().next().unwrap_or("");
            let value = commas.parse(word).filter(|v| v.is_finite());
            value.ok_or_else(|| Problem::Invalid(format!("'{}' is not a number", printable(word))))
        };
        match keyword.to_ascii_lowercase().as_str() {
            "ka" => return set_reflectance(&mut self.ka, rest, commas),
            "kd" => {
                self.opacity.kd = fourth_share(rest, commas);
                return set_reflectance(&mut self.kd, rest, commas);
            }
            "ks" => return set_reflectance(&mut self.ks, rest, commas),
            "ke" => return set_color(&mut self.ke, rest, commas),
            "tf" => return set_color(&mut self.tf, rest, commas),
            "ns" => self.ns = Some(scalar_in(rest)?),
            "ni" => self.ni = Some(scalar_in(rest)?),
            "pr" => self.roughness = Some(scalar_in(rest)?),
            "pm" => self.metallic = Some(scalar_in(rest)?),
            "pc" => self.coat = Some(scalar_in(rest)?),
            "pcr" => self.coat_roughness = Some(scalar_in(rest)?),
            "ps" => self.sheen = Some(scalar_in(rest)?),
            "aniso" => self.anisotropy = Some(scalar_in(rest)?),
            "anisor" => self.anisotropy_rotation = Some(scalar_in(rest)?),
            "illum" => self.illum = Some(scalar_in(rest)? as i64),
            "d" => {
                self.opacity.d = Some(scalar_in(rest.trim_start_matches("-halo"))?);
                (self.opacity.tr_is_later, self.opacity.line) = (false, line);
            }
            "tr" => {
                self.opacity.tr = Some(scalar_in(rest)?);
                (self.opacity.tr_is_later, self.opacity.line) = (true, line);
            }
            "map_ka" => return set_color_map(&mut self.map_ka, rest, commas),
            "map_kd" => return set_color_map(&mut self.map_kd, rest, commas),
            "map_ks" => return set_color_map(&mut self.map_ks, rest, commas),
            "map_ke" => return set_color_map(&mut self.map_ke, rest, commas),
            "map_d" | "map_opacity" => return set_scalar_map(&mut self.map_d, rest, commas),
            "map_pr" => return set_scalar_map(&mut self.map_roughness, rest, commas),
            "map_pm" => return set_scalar_map(&mut self.map_metallic, rest, commas),
            "map_pc" => return set_scalar_map(&mut self.map_coat, rest, commas),
            "map_pcr" => return set_scalar_map(&mut self.map_coat_roughness, rest, commas),
            "map_ps" => return set_scalar_map(&mut self.map_sheen, rest, commas),
            // Blender's keywords for the same without the PBR extensions option.
            "map_ns" if self.writer.is_blender() => {
                return set_scalar_map(&mut self.map_roughness, rest, commas);
            }
            "refl" | "map_refl" if self.writer.is_blender() => {
                return set_scalar_map(&mut self.map_metallic, rest, commas);
            }
            "norm" => {
                self.normal_is_bump = false;
                return set_scalar_map(&mut self.map_normal, rest, commas);
            }
            // `norm` takes precedence over `bump`, which may hold heights.
            "bump" | "map_bump" if self.map_normal.is_none() || self.normal_is_bump => {
                self.normal_is_bump = true;
                return set_scalar_map(&mut self.map_normal, rest, commas);
            }
            "bump" | "map_bump" => {}
            "disp" | "map_disp" => {
                return Err(Problem::Unsupported("ignored displacement maps (disp): not supported"));
            }
            "refl" | "map_refl" => {
                return Err(Problem::Unsupported("ignored reflection maps (refl): not supported"));
            }
            // Sharpness of reflection maps, and texture antialiasing, which is always on.
            "sharpness" | "map_aat" => {}
            // Exporters write 0 for every feature that a material does not use.
            _ if is_zero(rest, commas) => {}
            _ => return Err(Problem::Unknown),
        }
        Ok(())
    }
}

impl MtlMaterial {
    /// Removes what the program writes for every material. trimesh's default is grey .4 for all coefficients, with an
    /// exponent of 1. It does not darken or veil a texture. VTK always writes the illumination model 3 and has no mirrors.
    fn remove_defaults(&mut self) {
        match self.writer {
            MtlWriter::Vtk if self.illum == Some(3) => self.illum = Some(2),
            MtlWriter::Trimesh => {
                const GREY: Option<Rgb> = Some(Rgb::splat(0.4));
                if self.ks == GREY && self.ns == Some(1.0) {
                    self.ks = None;
                }
                if self.ka == GREY {
                    self.ka = None;
                }
                if self.kd == GREY && self.map_kd.is_some() {
                    self.kd = None;
                }
            }
            _ => {}
        }
    }

    /// Decodes colours from sRGB. Values above 1 are no displayed colours.
    fn decode_colors(&mut self) {
        for color in [&mut self.ka, &mut self.kd, &mut self.ks, &mut self.ke].into_iter().flatten() {
            if color.max_element() <= 1.0 {
                *color = Rgb::from_array(color.to_array().map(srgb_to_linear));
            }
        }
    }
}

/// Returns the fourth number behind a colour of three, if it can be an opacity.
fn fourth_share(rest: &str, commas: &mut DecimalCommas) -> Option<f32> {
    // `xyz` before three numbers would make the last of them the fourth word.
    parse_color(rest, commas).ok()?;
    let mut words = rest.split_whitespace();
    let fourth = words.nth(3)?;
    commas.parse(fourth).filter(|share| words.next().is_none() && (0.0..=1.0).contains(share))
}

/// Returns true if all words are the number 0.
fn is_zero(rest: &str, commas: &mut DecimalCommas) -> bool {
    !rest.is_empty() && rest.split_whitespace().all(|word| commas.parse(word) == Some(0.0))
}

/// Parses three numbers, or one for all three channels.
fn parse_color(rest: &str, commas: &mut DecimalCommas) -> Result<Rgb, Problem> {
    if matches!(rest.split_whitespace().next(), Some("spectral" | "xyz")) {
        return Err(Problem::Invalid("only RGB colours are supported".into()));
    }
    let invalid = |why: &str| Problem::Invalid(format!("'{}' {why}", printable(rest)));
    let values = commas.parse_color(rest).map_err(invalid)?;
    match values[..] {
        [v] if v.is_finite() => Ok(Rgb::splat(v)),
        [r, g, b, ..] if (r + g + b).is_finite() => Ok(Rgb::new(r, g, b)),
        _ => Err(invalid("is not a colour")),
    }
}

/// Sets a colour. Negative components become 0.
fn set_color(slot: &mut Option<Rgb>, rest: &str, commas: &mut DecimalCommas) -> Result<(), Problem> {
    let color = parse_color(rest, commas)?;
    *slot = Some(color.max(Rgb::ZERO));
    if color.min_element() < 0.0 { Err(Problem::Negative) } else { Ok(()) }
}

/// Largest plausible reflectance. Larger values are bytes, or wrong.
const MAX_REFLECTANCE: f32 = 10.0;

/// Sets a reflectance. Integers far beyond 1 are read as bytes.
fn set_reflectance(slot: &mut Option<Rgb>, rest: &str, commas: &mut DecimalCommas) -> Result<(), Problem> {
    set_color(slot, rest, commas)?;
    let Some(color) = slot else { return Ok(()) };
    match color.max_element() {
        max if max <= MAX_REFLECTANCE => Ok(()),
        max if max <= 255.0 && color.fract() == Rgb::ZERO => {
            *color /= 255.0;
            Err(Problem::Bytes)
        }
        max => Err(Problem::TooBright(max)),
    }
}

/// Sets a map of scalars or normals.
fn set_scalar_map(
    slot: &mut Option<TextureMap>,
    rest: &str,
    commas: &mut DecimalCommas,
) -> Result<(), Problem> {
    let parsed = texture_map::parse(rest, commas);
    let parsed = parsed.ok_or_else(|| Problem::Invalid("the file name is missing".into()))?;
    *slot = Some(parsed.map);
    match parsed.unsupported[..] {
        [] => Ok(()),
        _ => Err(Problem::UnsupportedOptions(parsed.unsupported.join(" "))),
    }
}

/// Sets a map of colours, which does not support the choice of a channel.
fn set_color_map(
    slot: &mut Option<TextureMap>,
    rest: &str,
    commas: &mut DecimalCommas,
) -> Result<(), Problem> {
    let result = set_scalar_map(slot, rest, commas);
    if slot.as_mut().and_then(|map| map.channel.take()).is_none() {
        return result;
    }
    Err(match result {
        Err(Problem::UnsupportedOptions(others)) => Problem::UnsupportedOptions(format!("{others} -imfchan")),
        Err(other) => other,
        Ok(()) => Problem::UnsupportedOptions("-imfchan".into()),
    })
}

#[cfg(test)]
mod tests;
