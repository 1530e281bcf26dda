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
use blinn_scene::{BlenderVersion, srgb_to_linear};

/// The statements of a material; `None` for a statement that is missing.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct MtlMaterial {
    pub name: String,
    /// Folder of the MTL relative to the OBJ. Texture names are relative to it.
    pub folder: String,
    /// Written by Blender.
    pub by_blender: bool,
    /// Version of Blender, if the file names it.
    pub blender_version: Option<BlenderVersion>,
    /// Written by Blender's exporter up to 2.93, which does not write its version into MTL files.
    pub by_old_blender: bool,
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
    pub map_ka: Option<TextureMap>,
    pub map_kd: Option<TextureMap>,
    pub map_ks: Option<TextureMap>,
    pub map_ke: Option<TextureMap>,
    pub map_d: Option<TextureMap>,
    pub map_roughness: Option<TextureMap>,
    pub map_metallic: Option<TextureMap>,
    pub map_normal: Option<TextureMap>,
    /// True if the map came from `bump`, which may hold heights.
    pub normal_is_bump: bool,
}

/// What the meaning of an MTL file depends on, besides its text.
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
    let head = text.trim_start_matches('\u{feff}').trim_start();
    let by_blender = head.starts_with("# Blender");
    let by_old_blender = head.starts_with("# Blender MTL File");
    let blender_version = head.lines().next().filter(|_| by_blender).and_then(BlenderVersion::from_generator);
    let writer = MtlWriter::find(text, context.generator);
    let mut all: Vec<MtlMaterial> = Vec::new();
    let mut commas = DecimalCommas::default();
    for line in logical_lines(text) {
        let (keyword, rest) = split_keyword(&line.text);
        if keyword.eq_ignore_ascii_case("newmtl") {
            all.push(MtlMaterial {
                name: rest.to_string(),
                folder: folder.to_string(),
                by_blender,
                blender_version,
                by_old_blender,
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
    mtl_opacity::resolve(&mut all, writer, place, warnings);
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
            // Blender's keywords for the same without the PBR extensions option.
            "map_ns" if self.by_blender => return set_scalar_map(&mut self.map_roughness, rest, commas),
            "refl" | "map_refl" if self.by_blender => {
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
            // A parameter of aniso, which is reported itself.
            "anisor" => {}
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

/// Returns the fourth of four numbers, if it can be an opacity.
fn fourth_share(rest: &str, commas: &mut DecimalCommas) -> Option<f32> {
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
mod tests {
    use super::*;
    use blinn_scene::TextureChannel;
    use glam::Vec2;

    fn one(text: &str) -> (MtlMaterial, Vec<String>) {
        let mut warnings = Warnings::default();
        let all = parse(text, "a.mtl", "", MtlContext::default(), &mut warnings);
        (all.into_iter().next().unwrap(), warnings.into_vec().iter().map(ToString::to_string).collect())
    }

    /// A colour of one number is grey.
    #[test]
    fn an_invalid_line_is_ignored_and_the_rest_is_read() {
        let (m, warnings) = one("newmtl red #2\nKd 1, 0.5,0\nKs x\nKa .2\nNs 1D2\nd 0.5\nTr 0.25\nwhat 1\n");
        assert_eq!(
            (m.name.as_str(), m.kd, m.ka, m.ns),
            ("red #2", Some(Rgb::new(1.0, 0.5, 0.0)), Some(Rgb::splat(0.2)), Some(100.0))
        );
        assert_eq!((m.ks, m.d), (None, Some(0.75)));
        assert_eq!(warnings.len(), 3, "{warnings:?}");
        assert!(
            warnings[0].contains("line 3") && warnings[1].contains("what") && warnings[2].contains("line 7")
        );
    }

    #[test]
    fn map_options_may_precede_or_follow_a_name_with_spaces() {
        for text in [
            "-s 2 3 1 -o .5 -clamp on -bm 0.5 -imfchan g my  tex 2.png",
            "my  tex 2.png -s 2 3 1 -o .5 -clamp on -bm 0.5 -imfchan g",
            "-clamp on -imfchan g -s 2 3 \"my  tex 2.png\" -o .5 -bm 0.5",
        ] {
            let (m, warnings) = one(&format!("newmtl a\nmap_Pr {text} \t\n"));
            let map = m.map_roughness.unwrap();
            assert_eq!(map.file, "my  tex 2.png", "{text}");
            assert_eq!((map.scale, map.offset), (Vec2::new(2.0, 3.0), Vec2::new(0.5, 0.0)));
            assert_eq!((map.clamp, map.bump, map.channel), (true, 0.5, Some(TextureChannel::G)));
            assert!(warnings.is_empty());
        }
        let (m, warnings) = one("newmtl a\nMap_Kd -clamp ON -colorspace sRGB tex#1.png\n");
        let map = m.map_kd.unwrap();
        assert!(map.file == "tex#1.png" && map.clamp && warnings.is_empty(), "{map:?} {warnings:?}");
    }

    /// Blender writes folder names unquoted.
    #[test]
    fn options_inside_a_name_are_part_of_it() {
        for (text, scale) in [
            ("t/s11 -s 2 dir/a -bm 1 b.png", 1.0),
            ("-s 4 4 4 t/s11 -s 2 dir/a -bm 1 b.png", 4.0),
            ("t/s11 -s 2 dir/a -bm 1 b.png -s 4 4 4", 4.0),
            ("t/s11 -s 2 dir/a -bm 1 b.png -s 4 4 4 # comment", 4.0),
        ] {
            let (m, warnings) = one(&format!("newmtl a\nmap_Kd {text}\n"));
            let map = m.map_kd.unwrap();
            assert_eq!((map.file.as_str(), map.bump), ("t/s11 -s 2 dir/a -bm 1 b.png", 1.0), "{text}");
            assert!(map.scale.x == scale && warnings.is_empty(), "{text}: {map:?} {warnings:?}");
        }
    }

    #[test]
    fn unsupported_map_options_are_reported_and_the_map_is_used() {
        let (m, warnings) = one("newmtl a\nmap_Kd -mm 0.1 2 -t .5 -blendu off -cc off a.png\n");
        assert_eq!(m.map_kd.unwrap().file, "a.png");
        assert!(
            warnings.len() == 1 && warnings[0].contains("ignored the options -mm -t -blendu of"),
            "{warnings:?}"
        );
        for options in ["-colorspace linear", "-imfchan r", "-s nan 1", "-o 1 inf", "-bm nan"] {
            let (m, warnings) = one(&format!("newmtl a\nmap_Kd {options} a.png\n"));
            assert_eq!(warnings.len(), 1, "{options}: {warnings:?}");
            let map = m.map_kd.unwrap();
            assert_eq!((map.scale, map.offset, map.bump), (Vec2::ONE, Vec2::ZERO, 1.0), "{options}");
        }
        let (_, warnings) = one("newmtl a\nmap_Kd -imfchan r -t .5 a.png\n");
        assert!(
            warnings.len() == 1 && warnings[0].contains("ignored the options -t -imfchan of"),
            "{warnings:?}"
        );
        let (_, warnings) = one("newmtl a\nmap_Kd -mm 0 1 -t 0 0 0 -blendu on -texres 512 a.png\n");
        assert!(warnings.is_empty(), "{warnings:?}");
    }

    #[test]
    fn unsupported_keywords_are_reported_once_per_file() {
        let (_, warnings) = one("newmtl a\nPs .5\naniso .5\nmap_Pc a.png\nnewmtl b\nPs .2\n");
        let expected = ["Ps", "aniso", "map_Pc"].map(|key| format!("a.mtl: ignored '{key}': not supported"));
        assert_eq!(warnings, expected);
    }

    #[test]
    fn negative_colours_become_zero() {
        let (m, warnings) = one("newmtl a\nKd -1 .5 -.25\nKs -0 0 0\n");
        assert_eq!((m.kd, m.ks), (Some(Rgb::new(0.0, 0.5, 0.0)), Some(Rgb::ZERO)));
        assert_eq!(warnings, ["a.mtl, line 2: Kd: used 0 instead of a negative value"]);
    }

    #[test]
    fn integer_colours_above_one_are_bytes() {
        let (m, warnings) = one("newmtl a\nKd 255 51 0\nKs 255 255 255\nKe 20 0 0\nnewmtl b\nKd 0 255 1\n");
        assert_eq!((m.kd, m.ks), (Some(Rgb::new(1.0, 0.2, 0.0)), Some(Rgb::ONE)));
        assert_eq!(m.ke, Some(Rgb::new(20.0, 0.0, 0.0)));
        let message = |key| format!("a.mtl: {key} exceeds 1: read as bytes from 0 to 255");
        assert_eq!(warnings, [message("Kd"), message("Ks")]);
        // A plausible reflectance, and values that are neither.
        let (m, warnings) = one("newmtl a\nKd 2 2 2\n");
        assert!(m.kd == Some(Rgb::splat(2.0)) && warnings.is_empty(), "{warnings:?}");
        for (kd, max) in [("300 0 0", "300"), ("20.5 0 0", "20.5")] {
            let (_, warnings) = one(&format!("newmtl a\nKd {kd}\n"));
            let message = format!("a.mtl, line 2: Kd has the value {max}, expected 0 to 1 or bytes");
            assert_eq!(warnings, [message]);
        }
    }

    /// Blender's default cube, 3ds Max's d and Tr, and Model I/O's list of all features.
    #[test]
    fn default_values_cause_no_warning() {
        for text in [
            "Ps 0\nPc 0\nPcr .03\naniso 0\nanisor .5\n",
            "d 1\nTr 0\n",
            "d .7\nTr .3\n",
            "ao 0 0 0\nsubsurface 0 0 0\nsheenTint 0.0\n",
        ] {
            let (_, warnings) = one(&format!("newmtl a\n{text}"));
            assert!(warnings.is_empty(), "{text}: {warnings:?}");
        }
        for text in ["Ps .5\nanisor .03\n", "d 1\nTr .5\n", "ao 0 .5 0\n", "ao\n"] {
            let (_, warnings) = one(&format!("newmtl a\n{text}"));
            assert_eq!(warnings.len(), 1, "{text}: {warnings:?}");
        }
    }

    #[test]
    fn tr_of_vtk_is_opacity() {
        let vtk = "# wavefront mtl file written by the visualization toolkit\r\n\n";
        for (tr, d) in [("Tr 1", 1.0), ("Tr 0.9", 0.9), ("d 0.5\nTr 0.5", 0.5)] {
            let (m, warnings) = one(&format!("{vtk}newmtl a\n{tr}\n"));
            assert!(m.d == Some(d) && warnings.is_empty(), "{tr}: {:?} {warnings:?}", m.d);
        }
        assert_eq!(one("# another\nnewmtl a\nTr 0.75\n").0.d, Some(0.25));
    }

    #[test]
    fn defaults_of_trimesh_and_vtk_do_not_count() {
        let grey = "Ka .4 .4 .4\nKd .4 .4 .4\nKs .4 .4 .4\nNs 1\n";
        let trimesh = "# https://github.com/mikedh/trimesh\n";
        let colors = |text: &str| {
            let (m, _) = one(text);
            (m.ka, m.kd, m.ks)
        };
        let all = Some(Rgb::splat(0.4));
        assert_eq!(colors(&format!("{trimesh}newmtl a\n{grey}map_Kd a.png\n")), (None, None, None));
        assert_eq!(colors(&format!("{trimesh}newmtl a\n{grey}")), (None, all, None));
        assert_eq!(colors(&format!("newmtl a\n{grey}map_Kd a.png\n")), (all, all, all));
        let vtk = "# wavefront mtl file written by the visualization toolkit\n";
        assert_eq!(one(&format!("{vtk}newmtl a\nillum 3\n")).0.illum, Some(2));
        assert_eq!(one("newmtl a\nillum 3\n").0.illum, Some(3));
    }

    #[test]
    fn colours_of_programs_that_write_displayed_values_are_decoded() {
        let kd = |text: &str, colors| {
            let context = MtlContext { generator: "", colors };
            parse(text, "a.mtl", "", context, &mut Warnings::default())[0].kd.unwrap().x
        };
        let jmol = "# Created by Jmol 14\nnewmtl a\nKd .5 1 0\n";
        let blender = "# Blender 5.0.1 MTL File\nnewmtl a\nKd .5 1 0\n";
        let unknown = "newmtl a\nKd .5 1 0\n";
        let decoded = srgb_to_linear(0.5);
        for (text, auto) in [(jmol, decoded), (blender, 0.5), (unknown, 0.5)] {
            assert_eq!(kd(text, MtlColors::Auto), auto, "{text}");
            assert_eq!((kd(text, MtlColors::Srgb), kd(text, MtlColors::Linear)), (decoded, 0.5), "{text}");
        }
        // Beyond what a display shows.
        assert_eq!(kd("newmtl a\nKd .5 2 0\n", MtlColors::Srgb), 0.5);
    }

    #[test]
    fn norm_takes_precedence_over_bump() {
        for text in ["newmtl a\nnorm n.png\nbump b.png\n", "newmtl a\nbump b.png\nnorm n.png\n"] {
            let (m, _) = one(text);
            assert_eq!((m.map_normal.unwrap().file.as_str(), m.normal_is_bump), ("n.png", false));
        }
    }

    #[test]
    fn truncated_text_does_not_panic() {
        let text = "# Blender\nnewmtl é\nKd 1 1 1\nmap_Kd -s 1 1 a.png\nbump -bm\nd\nillum 1e300\nNs nan\n";
        for end in (0..text.len()).filter(|&i| text.is_char_boundary(i)) {
            parse(&text[..end], "", "", MtlContext::default(), &mut Warnings::default());
        }
    }
}
