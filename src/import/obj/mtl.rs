//! MTL text: what each material says, line by line. One bad line costs that line.

use super::super::error::Warnings;
use super::map;
use super::map::Map;
use super::text::{lines, number, split_keyword};
use crate::geometry::Rgb;
use crate::import::files::escape::printable;

/// A material's statements; `None` where there is none.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Mtl {
    pub name: String,
    /// Where the MTL lies, relative to the OBJ: textures are relative to it.
    pub folder: String,
    pub by_blender: bool,
    /// By Blender's older exporter (2.93's), which did not write its version into MTLs.
    pub by_old_blender: bool,
    /// By the Visualization Toolkit, PyVista's too, which writes opacity into Tr.
    pub by_vtk: bool,
    pub ka: Option<Rgb>,
    pub kd: Option<Rgb>,
    pub ks: Option<Rgb>,
    pub ke: Option<Rgb>,
    /// Transmission filter.
    pub tf: Option<Rgb>,
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
    let head = text.trim_start_matches('\u{feff}').trim_start();
    let by_blender = head.starts_with("# Blender");
    let by_old_blender = head.starts_with("# Blender MTL File");
    let by_vtk = head.starts_with("# wavefront mtl file written by the visualization toolkit");
    let mut all: Vec<Mtl> = Vec::new();
    for line in lines(text) {
        let (keyword, rest) = split_keyword(&line.text);
        if keyword.eq_ignore_ascii_case("newmtl") {
            all.push(Mtl {
                name: rest.to_string(),
                folder: folder.to_string(),
                by_blender,
                by_old_blender,
                by_vtk,
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
            Err(Left::Negative) => {
                warnings.add(here, format!("{}: what is below 0 counts as 0", printable(keyword)))
            }
            Err(Left::Bytes) => {
                let what = format!("{} reaches beyond 1: read as bytes from 0 to 255", printable(keyword));
                warnings.add(place, what);
            }
            Err(Left::Bright(most)) => {
                let keyword = printable(keyword);
                warnings.add(here, format!("{keyword} reaches {most}, which is neither up to 1 nor a byte"));
            }
            Err(Left::Unsupported(what)) => warnings.add(place, what),
            Err(Left::Options(which)) => {
                let keyword = printable(keyword);
                warnings.add(here, format!("{keyword}: {which} left out, the texture is used without"));
            }
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
    Negative,
    /// A colour of bytes.
    Bytes,
    /// A colour of this much.
    Bright(f32),
    /// The map is used without these options.
    Options(String),
}

impl Mtl {
    fn statement(&mut self, keyword: &str, rest: &str) -> Result<(), Left> {
        let scalar = || {
            let word = rest.split_whitespace().next().unwrap_or("");
            let value = number(word).filter(|v| v.is_finite());
            value.ok_or_else(|| Left::Bad(format!("'{}' is not a number", printable(word))))
        };
        match keyword.to_ascii_lowercase().as_str() {
            "ka" => return set_share(&mut self.ka, rest),
            "kd" => return set_share(&mut self.kd, rest),
            "ks" => return set_share(&mut self.ks, rest),
            "ke" => return set_color(&mut self.ke, rest),
            "tf" => return set_color(&mut self.tf, rest),
            "ns" => self.ns = Some(scalar()?),
            "ni" => self.ni = Some(scalar()?),
            "pr" => self.roughness = Some(scalar()?),
            "pm" => self.metallic = Some(scalar()?),
            "illum" => self.illum = Some(scalar()? as i64),
            key @ ("d" | "tr") => {
                let value = number(rest.trim_start_matches("-halo").trim()).filter(|v| v.is_finite());
                let value = value.map_or_else(scalar, Ok)?;
                let value = if key == "d" || self.by_vtk { value } else { 1.0 - value };
                let before = self.d.replace(value);
                // 3ds Max writes both, with four decimals.
                if before.is_some_and(|before| (before - value).abs() > 1e-3) {
                    return Err(Left::TransparencyTwice);
                }
            }
            "map_ka" => return set_colors(&mut self.map_ka, rest),
            "map_kd" => return set_colors(&mut self.map_kd, rest),
            "map_ks" => return set_colors(&mut self.map_ks, rest),
            "map_ke" => return set_colors(&mut self.map_ke, rest),
            "map_d" | "map_opacity" => return set(&mut self.map_d, rest),
            "map_pr" => return set(&mut self.map_roughness, rest),
            "map_pm" => return set(&mut self.map_metallic, rest),
            // Blender's words for the same, where it is not told to write physical ones.
            "map_ns" if self.by_blender => return set(&mut self.map_roughness, rest),
            "refl" | "map_refl" if self.by_blender => return set(&mut self.map_metallic, rest),
            "norm" => {
                self.normal_is_bump = false;
                return set(&mut self.map_normal, rest);
            }
            // A map that says it holds normals goes before one that may.
            "bump" | "map_bump" if self.map_normal.is_none() || self.normal_is_bump => {
                self.normal_is_bump = true;
                return set(&mut self.map_normal, rest);
            }
            "bump" | "map_bump" => {}
            "disp" | "map_disp" => return Err(Left::Unsupported("displacement (disp) is not shown")),
            "refl" | "map_refl" => return Err(Left::Unsupported("reflection maps (refl) are not shown")),
            // What a coat of Pc and a stretch of aniso are like, of which those two tell.
            "pcr" | "anisor" => {}
            // Of reflections of surroundings, and of edges that are smoothed always.
            "sharpness" | "map_aat" => {}
            // Exporters write all that they know, and 0 for what a material has not.
            _ if is_zero(rest) => {}
            _ => return Err(Left::Unknown),
        }
        Ok(())
    }
}

/// Numbers, all 0.
fn is_zero(rest: &str) -> bool {
    !rest.is_empty() && rest.split_whitespace().all(|word| number(word) == Some(0.0))
}

/// Three numbers, or one for all three.
fn color(rest: &str) -> Result<Rgb, Left> {
    // Some write commas between them.
    let words: Vec<&str> = rest.split([' ', '\t', ',']).filter(|word| !word.is_empty()).collect();
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

/// Reads a colour into its place; none takes light away.
fn set_color(slot: &mut Option<Rgb>, rest: &str) -> Result<(), Left> {
    let color = color(rest)?;
    *slot = Some(color.max(Rgb::ZERO));
    if color.min_element() < 0.0 { Err(Left::Negative) } else { Ok(()) }
}

/// The most that a colour may be which says how much of the light is given back: brighter ones are another program's
/// bytes, or wrong.
const BRIGHT: f32 = 10.0;

/// Reads a colour that says how much of the light is given back; whole numbers far beyond 1 are bytes.
fn set_share(slot: &mut Option<Rgb>, rest: &str) -> Result<(), Left> {
    set_color(slot, rest)?;
    let Some(color) = slot else { return Ok(()) };
    match color.max_element() {
        most if most <= BRIGHT => Ok(()),
        most if most <= 255.0 && color.fract() == Rgb::ZERO => {
            *color /= 255.0;
            Err(Left::Bytes)
        }
        most => Err(Left::Bright(most)),
    }
}

/// Reads a texture of numbers into its place, even where some of its options do not count.
fn set(slot: &mut Option<Map>, rest: &str) -> Result<(), Left> {
    let (map, left) = map::read(rest).ok_or_else(|| Left::Bad("no file is named".into()))?;
    *slot = Some(map);
    if left.is_empty() { Ok(()) } else { Err(Left::Options(left.join(" "))) }
}

/// The same for a texture of colours, of which no one channel is taken.
fn set_colors(slot: &mut Option<Map>, rest: &str) -> Result<(), Left> {
    let read = set(slot, rest);
    if slot.as_mut().and_then(|map| map.channel.take()).is_none() {
        return read;
    }
    Err(match read {
        Err(Left::Options(others)) => Left::Options(format!("{others} -imfchan")),
        Err(other) => other,
        Ok(()) => Left::Options("-imfchan".into()),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::TextureChannel;
    use glam::Vec2;

    fn one(text: &str) -> (Mtl, Vec<String>) {
        let mut warnings = Warnings::default();
        let all = parse(text, "a.mtl", "", &mut warnings);
        (all.into_iter().next().unwrap(), warnings.into_vec().iter().map(ToString::to_string).collect())
    }

    /// Pitfall 38 too: one number is grey.
    #[test]
    fn statements_are_read_and_a_bad_line_costs_that_line() {
        let (m, warnings) = one("newmtl red #2\nKd 1, 0.5,0\nKs x\nKa .2\nNs 1D2\nd 0.5\nTr 0.25\nwhat 1\n");
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

    /// Pitfalls 28 and 29.
    #[test]
    fn options_stand_before_and_after_names_with_spaces() {
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

    /// As folders are named, whose names Blender writes as they are.
    #[test]
    fn what_looks_like_options_in_the_midst_of_a_name_is_part_of_it() {
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
    fn options_that_would_change_the_picture_are_told_and_the_texture_stays() {
        let (m, warnings) = one("newmtl a\nmap_Kd -mm 0.1 2 -t .5 -blendu off -cc off a.png\n");
        assert_eq!(m.map_kd.unwrap().file, "a.png");
        assert!(warnings.len() == 1 && warnings[0].contains("-mm -t -blendu left out"), "{warnings:?}");
        for options in ["-colorspace linear", "-imfchan r", "-s nan 1", "-o 1 inf", "-bm nan"] {
            let (m, warnings) = one(&format!("newmtl a\nmap_Kd {options} a.png\n"));
            assert_eq!(warnings.len(), 1, "{options}: {warnings:?}");
            let map = m.map_kd.unwrap();
            assert_eq!((map.scale, map.offset, map.bump), (Vec2::ONE, Vec2::ZERO, 1.0), "{options}");
        }
        let (_, warnings) = one("newmtl a\nmap_Kd -imfchan r -t .5 a.png\n");
        assert!(warnings.len() == 1 && warnings[0].contains("-t -imfchan left out"), "{warnings:?}");
        let (_, warnings) = one("newmtl a\nmap_Kd -mm 0 1 -t 0 0 0 -blendu on -texres 512 a.png\n");
        assert!(warnings.is_empty(), "{warnings:?}");
    }

    #[test]
    fn physical_extras_that_are_not_shown_are_told_once() {
        let (_, warnings) = one("newmtl a\nPs .5\nPc .5\naniso 0\nnewmtl b\nPs .2\n");
        assert_eq!(warnings, ["a.mtl: 'Ps' is not shown", "a.mtl: 'Pc' is not shown"]);
    }

    #[test]
    fn no_colour_takes_light_away() {
        let (m, warnings) = one("newmtl a\nKd -1 .5 -.25\nKs -0 0 0\n");
        assert_eq!((m.kd, m.ks), (Some(Rgb::new(0.0, 0.5, 0.0)), Some(Rgb::ZERO)));
        assert_eq!(warnings, ["a.mtl, line 2: Kd: what is below 0 counts as 0"]);
    }

    #[test]
    fn colours_of_bytes_are_read_as_such() {
        let (m, warnings) = one("newmtl a\nKd 255 51 0\nKs 255 255 255\nKe 20 0 0\nnewmtl b\nKd 0 255 1\n");
        assert_eq!((m.kd, m.ks), (Some(Rgb::new(1.0, 0.2, 0.0)), Some(Rgb::ONE)));
        assert_eq!(m.ke, Some(Rgb::new(20.0, 0.0, 0.0)));
        let said = |key| format!("a.mtl: {key} reaches beyond 1: read as bytes from 0 to 255");
        assert_eq!(warnings, [said("Kd"), said("Ks")]);
        // What may be meant, and what can be neither.
        let (m, warnings) = one("newmtl a\nKd 2 2 2\n");
        assert!(m.kd == Some(Rgb::splat(2.0)) && warnings.is_empty(), "{warnings:?}");
        for (kd, most) in [("300 0 0", "300"), ("20.5 0 0", "20.5")] {
            let (_, warnings) = one(&format!("newmtl a\nKd {kd}\n"));
            let said = format!("a.mtl, line 2: Kd reaches {most}, which is neither up to 1 nor a byte");
            assert_eq!(warnings, [said]);
        }
    }

    /// Blender's default cube, 3ds Max's d beside Tr, and ModelIO's list of everything.
    #[test]
    fn what_says_nothing_is_no_warning() {
        for text in [
            "Ps 0\nPc 0\nPcr .03\naniso 0\nanisor .5\n",
            "d 1\nTr 0\n",
            "d .7\nTr .3\n",
            "ao 0 0 0\nsubsurface 0 0 0\nsheenTint 0.0\n",
        ] {
            let (_, warnings) = one(&format!("newmtl a\n{text}"));
            assert!(warnings.is_empty(), "{text}: {warnings:?}");
        }
        for text in ["Pc .5\nPcr .03\n", "d 1\nTr 1\n", "ao 0 .5 0\n", "ao\n"] {
            let (_, warnings) = one(&format!("newmtl a\n{text}"));
            assert_eq!(warnings.len(), 1, "{text}: {warnings:?}");
        }
    }

    /// There Tr 1 is opaque.
    #[test]
    fn tr_of_the_visualization_toolkit_is_opacity() {
        let vtk = "# wavefront mtl file written by the visualization toolkit\r\n\n";
        for (tr, d) in [("Tr 1", 1.0), ("Tr 0.9", 0.9), ("d 0.5\nTr 0.5", 0.5)] {
            let (m, warnings) = one(&format!("{vtk}newmtl a\n{tr}\n"));
            assert!(m.d == Some(d) && warnings.is_empty(), "{tr}: {:?} {warnings:?}", m.d);
        }
        assert_eq!(one("# another\nnewmtl a\nTr 0.75\n").0.d, Some(0.25));
    }

    #[test]
    fn a_norm_map_goes_before_a_bump_map() {
        for text in ["newmtl a\nnorm n.png\nbump b.png\n", "newmtl a\nbump b.png\nnorm n.png\n"] {
            let (m, _) = one(text);
            assert_eq!((m.map_normal.unwrap().file.as_str(), m.normal_is_bump), ("n.png", false));
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
