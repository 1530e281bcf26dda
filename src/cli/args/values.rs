//! Values on the command line.

use glam::{DVec3, Vec3};

use crate::batch::FrameList;
use crate::display::Background;
use crate::geometry::Rgb;
use crate::import::NormalMode;
use crate::integrator::{Aov, MatteKind};
use crate::render::PixelRect;
use crate::scene::{ClipPlanes, Glob, LightSet, Orbit, UserLight};

/// Numbers separated by commas, none of which becomes infinite in single precision.
fn numbers(text: &str) -> Result<Vec<f64>, String> {
    let one = |part: &str| match part.trim().parse::<f64>() {
        Ok(v) if v.abs() <= f64::from(f32::MAX) => Ok(v),
        Ok(v) if v.is_finite() => Err(format!("'{part}' is too large")),
        _ => Err(format!("'{part}' is not a number")),
    };
    text.split(',').map(one).collect()
}

fn exactly<const N: usize>(text: &str, form: &str) -> Result<[f64; N], String> {
    numbers(text)?.try_into().map_err(|_| format!("expected {form}, such as {}", vec!["1"; N].join(",")))
}

/// `X,Y,Z`.
pub(crate) fn vector(text: &str) -> Result<DVec3, String> {
    exactly::<3>(text, "X,Y,Z").map(DVec3::from_array)
}

/// `X,Y,Z`, but not all zero.
pub(crate) fn direction(text: &str) -> Result<DVec3, String> {
    let direction = vector(text)?;
    direction.try_normalize().map(|_| direction).ok_or_else(|| "a direction has a length".to_string())
}

/// A finite number.
pub(crate) fn number(text: &str) -> Result<f64, String> {
    exactly::<1>(text, "a number").map(|[v]| v)
}

/// A number greater than zero.
pub(crate) fn positive(text: &str) -> Result<f64, String> {
    let v = number(text)?;
    if v > 0.0 { Ok(v) } else { Err("must be greater than zero".into()) }
}

/// A number of bytes, with or without a unit: 1073741824, 1GiB, 1.5 GB.
pub(crate) fn bytes(text: &str) -> Result<u64, String> {
    const UNITS: [(&str, u64); 10] = [
        ("TIB", 1 << 40),
        ("GIB", 1 << 30),
        ("MIB", 1 << 20),
        ("KIB", 1 << 10),
        ("TB", 1_000_000_000_000),
        ("GB", 1_000_000_000),
        ("MB", 1_000_000),
        ("KB", 1000),
        ("B", 1),
        ("", 1),
    ];
    let upper = text.trim().to_ascii_uppercase();
    let cut =
        |&(name, unit): &(&str, u64)| Some((upper.strip_suffix(name)?.trim_end().parse::<f64>().ok()?, unit));
    match UNITS.iter().find_map(cut) {
        Some((count, unit)) if count > 0.0 && count.is_finite() => Ok((count * unit as f64) as u64),
        _ => Err("expected a number of bytes, such as 4GiB or 800MB".into()),
    }
}

/// An angle in degrees up to 180, or `off`.
pub(crate) fn smooth(text: &str) -> Result<NormalMode, String> {
    if text == "off" {
        return Ok(NormalMode::Flat);
    }
    match number(text) {
        Ok(v) if (0.0..=180.0).contains(&v) => Ok(NormalMode::CreaseAngle(v)),
        _ => Err("expected off, or an angle from 0 to 180 degrees".into()),
    }
}

/// An angle in degrees, to radians.
pub(crate) fn angle(text: &str) -> Result<f64, String> {
    number(text).map(f64::to_radians)
}

/// An angle within a quarter turn of the horizon, in degrees, to radians.
pub(crate) fn elevation(text: &str) -> Result<f64, String> {
    let v = number(text)?;
    if v.abs() <= 90.0 { Ok(v.to_radians()) } else { Err("the elevation is within ±90 degrees".into()) }
}

/// `x`, `y`, `z` or `X,Y,Z`, of unit length.
pub(crate) fn axis(text: &str) -> Result<DVec3, String> {
    let axis = match text {
        "x" => DVec3::X,
        "y" => DVec3::Y,
        "z" => DVec3::Z,
        _ => vector(text).map_err(|e| format!("{e}; or x, y, z"))?,
    };
    axis.try_normalize().ok_or_else(|| "an axis has a length".to_string())
}

/// `AZIMUTH,ELEVATION[,DISTANCE]`, angles in degrees.
pub(crate) fn orbit(text: &str) -> Result<Orbit, String> {
    let (azimuth, elevation, distance) = match numbers(text)?[..] {
        [a, e] => (a, e, None),
        [a, e, d] => (a, e, Some(d)),
        _ => return Err("expected AZIMUTH,ELEVATION or AZIMUTH,ELEVATION,DISTANCE, such as 45,20".into()),
    };
    if elevation.abs() > 90.0 {
        return Err("the elevation is within ±90 degrees".into());
    }
    if distance.is_some_and(|d| !(d > 0.0)) {
        return Err("the distance must be greater than zero".into());
    }
    Ok(Orbit { azimuth: azimuth.to_radians(), elevation: elevation.to_radians(), distance })
}

/// An angle of view in degrees, to radians.
pub(crate) fn field_of_view(text: &str) -> Result<f64, String> {
    let v = number(text)?;
    if v > 0.0 && v < 180.0 { Ok(v.to_radians()) } else { Err("must be between 0 and 180 degrees".into()) }
}

/// `R,G,B` linear, or `#rrggbb` sRGB.
pub(crate) fn color(text: &str) -> Result<Rgb, String> {
    let form = "expected R,G,B (linear) or #rrggbb (sRGB)";
    let Some(hex) = text.strip_prefix('#') else {
        let [r, g, b] = exactly::<3>(text, "R,G,B").map_err(|e| format!("{e}; {form}"))?;
        if r < 0.0 || g < 0.0 || b < 0.0 {
            return Err("a colour is not negative".into());
        }
        return Ok(Vec3::new(r as f32, g as f32, b as f32));
    };
    if hex.len() != 6 || !hex.bytes().all(|b| b.is_ascii_hexdigit()) {
        return Err(form.into());
    }
    let packed = u32::from_str_radix(hex, 16).map_err(|_| form.to_string())?;
    let channel = |shift: u32| crate::scene::srgb_to_linear(((packed >> shift) & 255) as f32 / 255.0);
    Ok(Vec3::new(channel(16), channel(8), channel(0)))
}

/// A colour, or `transparent`.
pub(crate) fn background(text: &str) -> Result<Background, String> {
    if text == "transparent" {
        return Ok(Background::Transparent);
    }
    color(text).map(Background::Color).map_err(|e| format!("{e}, or 'transparent'"))
}

/// `WxH` or `W,H`.
pub(crate) fn size(text: &str) -> Result<(u32, u32), String> {
    let form = || "expected WIDTHxHEIGHT, such as 1280x720".to_string();
    let (w, h) = text.split_once(['x', 'X', ',']).ok_or_else(form)?;
    let side = |s: &str| s.trim().parse::<u32>().map_err(|_| form());
    let (w, h) = (side(w)?, side(h)?);
    if w == 0 || h == 0 || w > 65_536 || h > 65_536 || u64::from(w) * u64::from(h) > 1 << 29 {
        return Err("each side must be 1 to 65536 pixels, and at most 536,870,912 in all".into());
    }
    Ok((w, h))
}

/// `X,Y,W,H`.
pub(crate) fn crop(text: &str) -> Result<PixelRect, String> {
    let v = exactly::<4>(text, "X,Y,W,H")?;
    if v.iter().any(|v| !(0.0..=65_536.0).contains(v) || v.fract() != 0.0) || v[2] == 0.0 || v[3] == 0.0 {
        return Err("expected whole pixels X,Y,W,H with a width and a height".into());
    }
    let [x, y, width, height] = v.map(|v| v as u32);
    Ok(PixelRect { x, y, width, height })
}

/// A pattern of names.
pub(crate) fn glob(text: &str) -> Result<Glob, String> {
    Glob::new(text).map_err(|e| format!("{e}; * and ? stand for any text and any letter"))
}

/// `NEAR,FAR` or `off`.
pub(crate) fn clip(text: &str) -> Result<ClipPlanes, String> {
    if text == "off" {
        return Ok(ClipPlanes::OFF);
    }
    let [near, far] = exactly::<2>(text, "NEAR,FAR").map_err(|e| format!("{e}, or 'off'"))?;
    if near >= 0.0 && far > near {
        Ok(ClipPlanes { near, far })
    } else {
        Err("expected 0 ≤ NEAR < FAR, or 'off'".into())
    }
}

/// How light is exposed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Exposure {
    /// By metering the scene.
    Auto,
    /// By so many stops.
    Stops(f64),
}

/// Stops, or `auto`.
pub(crate) fn exposure(text: &str) -> Result<Exposure, String> {
    if text == "auto" {
        return Ok(Exposure::Auto);
    }
    let ev = number(text).map_err(|e| format!("{e}; expected stops, or 'auto'"))?;
    if ev.abs() <= 100.0 { Ok(Exposure::Stops(ev)) } else { Err("must be within ±100 stops".into()) }
}

/// A part of the whole.
pub(crate) fn share(text: &str) -> Result<f32, String> {
    let v = number(text)?;
    if (0.0..=1.0).contains(&v) { Ok(v as f32) } else { Err("must be from 0 to 1".into()) }
}

/// The radius of lights.
pub(crate) fn radius(text: &str) -> Result<f64, String> {
    let v = number(text)?;
    if (0.0..=1e6).contains(&v) { Ok(v) } else { Err("must be from 0 to 1000000 metres".into()) }
}

/// Ambient occlusion: rays for each pixel, and how far they go if that is said.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Ao {
    pub samples: u32,
    pub distance: Option<f64>,
}

/// `SAMPLES` or `SAMPLES,DISTANCE`.
pub(crate) fn ao(text: &str) -> Result<Ao, String> {
    let (samples, distance) = match text.split_once(',') {
        Some((samples, distance)) => (samples, Some(distance.trim())),
        None => (text, None),
    };
    let samples = match samples.trim().parse() {
        Ok(n) if (1..=65_536).contains(&n) => n,
        _ => return Err("expected a number of rays from 1 to 65536, such as 16".into()),
    };
    let distance = match distance {
        None => None,
        Some("inf") => Some(f64::INFINITY),
        Some(metres) => {
            Some(positive(metres).map_err(|e| format!("distance: {e}; expected metres, or 'inf'"))?)
        }
    };
    Ok(Ao { samples, distance })
}

/// Layers beside the colour.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Layers {
    /// Of what lies behind pixels' centres.
    pub aovs: Vec<Aov>,
    /// Mattes of objects and materials.
    pub cryptomatte: bool,
}

impl Layers {
    /// All that there are.
    pub fn all() -> Layers {
        Layers { aovs: Aov::ALL.to_vec(), cryptomatte: true }
    }

    /// Names of the pictures that show them.
    pub fn names(&self) -> Vec<String> {
        let aovs = self.aovs.iter().map(|aov| aov.name().to_string());
        let mattes = MatteKind::ALL.iter().filter(|_| self.cryptomatte);
        aovs.chain(mattes.map(|kind| format!("{CRYPTOMATTE}-{}", kind.name()))).collect()
    }
}

const CRYPTOMATTE: &str = "cryptomatte";

/// Names of layers.
pub(crate) fn layers(text: &str) -> Result<Layers, String> {
    let mut layers = Layers::default();
    for name in text.split(',').map(str::trim) {
        match Aov::by_name(name) {
            Some(aov) if layers.aovs.contains(&aov) => {}
            Some(aov) => layers.aovs.push(aov),
            None if name == CRYPTOMATTE => layers.cryptomatte = true,
            None => {
                let names: Vec<_> = Aov::ALL.iter().map(|a| a.name()).chain([CRYPTOMATTE]).collect();
                return Err(format!("no layer '{name}': there are {}", names.join(", ")));
            }
        }
    }
    Ok(layers)
}

/// How many frames a turn has.
pub(crate) fn frame_count(text: &str) -> Result<u32, String> {
    let count = text.parse().ok().filter(|count| (1..=1_000_000).contains(count));
    count.ok_or_else(|| {
        let listed = text.parse::<u64>().is_err() && FrameList::parse(text).is_ok();
        let some = if listed { text } else { "LIST" };
        format!("expected how many frames go once around, 1 to 1000000; --only {some} renders some of them")
    })
}

/// Where light comes from: a list, or `none`.
pub(crate) fn lights(text: &str) -> Result<Vec<LightSet>, String> {
    if text == "none" {
        return Ok(Vec::new());
    }
    let one = |name: &str| match name.trim() {
        "file" => Ok(LightSet::File),
        "headlight" => Ok(LightSet::Headlight),
        "three-point" => Ok(LightSet::ThreePoint),
        "none" => Err("'none' stands alone: leave it out, or the others".to_string()),
        other => Err(format!("no lights '{other}': there are file, headlight, three-point and none")),
    };
    let mut list = Vec::new();
    for source in text.split(',').map(one) {
        let source = source?;
        if !list.contains(&source) {
            list.push(source);
        }
    }
    Ok(list)
}

/// Four numbers and perhaps a colour.
fn light(text: &str, form: &str) -> Result<(DVec3, Rgb), String> {
    let parts: Vec<&str> = text.splitn(5, ',').collect();
    let wrong = |e: String| format!("{e}; expected {form}");
    if parts.len() < 4 {
        return Err(wrong("too few numbers".into()));
    }
    let [x, y, z, strength] = exactly::<4>(&parts[..4].join(","), form).map_err(wrong)?;
    if strength < 0.0 {
        return Err("a light's strength is not negative".into());
    }
    let tint = parts.get(4).map_or(Ok(Rgb::ONE), |c| color(c))?;
    Ok((DVec3::new(x, y, z), tint * strength as f32))
}

/// `X,Y,Z,I[,COLOR]`.
pub(crate) fn point_light(text: &str) -> Result<UserLight, String> {
    light(text, "X,Y,Z,I[,COLOR]").map(|(position, intensity)| UserLight::Point { position, intensity })
}

/// `DX,DY,DZ,E[,COLOR]`.
pub(crate) fn sun(text: &str) -> Result<UserLight, String> {
    let (direction, intensity) = light(text, "DX,DY,DZ,E[,COLOR]")?;
    if direction.try_normalize().is_none() {
        return Err("a sun's direction has a length".into());
    }
    Ok(UserLight::Sun { direction, intensity })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn vectors_take_exponents_and_minus_signs() {
        assert_eq!(vector("-5,-2.1,3e-2").unwrap(), DVec3::new(-5.0, -2.1, 0.03));
        for wrong in ["1,2", "1,2,3,4", "1,2,x", "", "1,,2", "nan,1,1", "inf,0,0"] {
            assert!(vector(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn numbers_that_single_precision_has_not_are_refused() {
        for wrong in ["1e39", "-1e39", "1e300"] {
            assert!(number(wrong).unwrap_err().contains("too large"), "{wrong}");
        }
        assert!(color("1e39,0,0").is_err() && sun("0,-1,0,1e39").is_err());
        assert_eq!(number("-3e38").unwrap(), -3e38);
        // It would shine straight down.
        assert!(sun("1e-200,0,0,1").unwrap_err().contains("length"));
    }

    #[test]
    fn colours_are_linear_numbers_or_srgb_hex() {
        assert_eq!(color(".5,0,1").unwrap(), Vec3::new(0.5, 0.0, 1.0));
        assert!(color("#ff0080").unwrap().abs_diff_eq(Vec3::new(1.0, 0.0, 0.2158605), 1e-6));
        for wrong in ["#ff008", "#gg0000", "1,2", "-1,0,0", "#+f0000"] {
            assert!(color(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn sizes_and_crops() {
        assert_eq!(size("1280x720").unwrap(), (1280, 720));
        assert_eq!(size("64,32").unwrap(), (64, 32));
        assert!(size("0x10").is_err() && size("100000x1").is_err() && size("65536x65536").is_err());
        assert_eq!(crop("1,2,3,4").unwrap(), PixelRect { x: 1, y: 2, width: 3, height: 4 });
        assert!(crop("1,2,0,4").is_err() && crop("-1,2,3,4").is_err() && crop("1.5,2,3,4").is_err());
    }

    #[test]
    fn occlusion_and_radii() {
        assert_eq!(ao("16").unwrap(), Ao { samples: 16, distance: None });
        assert_eq!(ao("64,.5").unwrap(), Ao { samples: 64, distance: Some(0.5) });
        assert_eq!(ao("1,inf").unwrap(), Ao { samples: 1, distance: Some(f64::INFINITY) });
        for wrong in ["0", "-1", "65537", "x", "", "16,", "16,0", "16,-1", "16,nan", "1.5", "16,1,2"] {
            assert!(ao(wrong).is_err(), "{wrong}");
        }
        assert_eq!((radius("0").unwrap(), radius(".25").unwrap()), (0.0, 0.25));
        assert!(radius("-1").is_err() && radius("1e7").is_err() && radius("inf").is_err());
    }

    #[test]
    fn lights_with_and_without_colour() {
        let plain = UserLight::Point { position: DVec3::new(1.0, 2.0, 3.0), intensity: Vec3::splat(4.0) };
        assert_eq!(point_light("1,2,3,4").unwrap(), plain);
        let tinted = UserLight::Sun { direction: DVec3::NEG_Y, intensity: Vec3::new(2.0, 1.0, 0.0) };
        assert_eq!(sun("0,-1,0,2,1,.5,0").unwrap(), tinted);
        assert!(sun("0,0,0,1").is_err() && point_light("1,2,3").is_err() && point_light("1,2,3,-1").is_err());
        assert!(lights("none").unwrap().is_empty());
        assert_eq!(lights("file,headlight").unwrap(), [LightSet::File, LightSet::Headlight]);
        assert!(lights("sun").is_err());
        assert!(lights("none,file").unwrap_err().contains("'none' stands alone"));
    }
}
