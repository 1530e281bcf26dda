//! Parsers of light sources, environments and ambient occlusion.

use glam::DVec3;

use super::color::color;
use super::numbers::{exactly, number, positive};
use crate::options::OcclusionSampling;
use blinn_core::closest_name::did_you_mean;
use blinn_core::geometry::Rgb;
use blinn_scene::{LightSet, UserLight};

/// The radius of lights in metres.
pub fn radius(text: &str) -> Result<f64, String> {
    let v = number(text)?;
    if (0.0..=1e6).contains(&v) { Ok(v) } else { Err("must be from 0 to 1000000 metres".into()) }
}

/// `SAMPLES` or `SAMPLES,DISTANCE`.
pub fn ao(text: &str) -> Result<OcclusionSampling, String> {
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
    Ok(OcclusionSampling { samples, distance })
}

/// A strength of light, at least 0.
pub fn strength(text: &str) -> Result<f64, String> {
    let v = number(text)?;
    if v >= 0.0 { Ok(v) } else { Err("must not be negative".into()) }
}

/// A list of light sources, or `none`.
pub fn lights(text: &str) -> Result<Vec<LightSet>, String> {
    if text == "none" {
        return Ok(Vec::new());
    }
    let parse = |name: &str| match name.trim() {
        "file" => Ok(LightSet::File),
        "headlight" => Ok(LightSet::Headlight),
        "three-point" => Ok(LightSet::ThreePoint),
        "none" => Err("'none' cannot be combined with others".to_string()),
        other => {
            let hint = did_you_mean(other, ["file", "headlight", "three-point", "none"]);
            Err(format!(
                "unknown light source '{other}'{hint}; expected file, headlight, three-point or none"
            ))
        }
    };
    let mut sources = Vec::new();
    for source in text.split(',').map(parse) {
        let source = source?;
        if !sources.contains(&source) {
            sources.push(source);
        }
    }
    Ok(sources)
}

/// A position or direction, and a strength times a colour.
struct LightNumbers {
    vector: DVec3,
    strength: Rgb,
}

/// Four numbers and an optional colour; `form` is their name in errors.
fn light_numbers(text: &str, form: &str) -> Result<LightNumbers, String> {
    let parts: Vec<&str> = text.splitn(5, ',').collect();
    let wrong = |e: String| format!("{e}; expected {form}");
    if parts.len() < 4 {
        return Err(wrong("too few numbers".into()));
    }
    let [x, y, z, strength] = exactly::<4>(&parts[..4].join(","), form).map_err(wrong)?;
    if strength < 0.0 {
        return Err("the strength of a light must not be negative".into());
    }
    let tint = parts.get(4).map_or(Ok(Rgb::ONE), |c| color(c))?;
    Ok(LightNumbers { vector: DVec3::new(x, y, z), strength: tint * strength as f32 })
}

/// `X,Y,Z,I[,COLOR]`.
pub fn point_light(text: &str) -> Result<UserLight, String> {
    let light = light_numbers(text, "X,Y,Z,I[,COLOR]")?;
    Ok(UserLight::Point { position: light.vector, intensity: light.strength })
}

/// `DX,DY,DZ,E[,COLOR]`.
pub fn sun(text: &str) -> Result<UserLight, String> {
    let light = light_numbers(text, "DX,DY,DZ,E[,COLOR]")?;
    if light.vector.try_normalize().is_none() {
        return Err("the direction of a sun must not be zero".into());
    }
    Ok(UserLight::Sun { direction: light.vector, intensity: light.strength })
}

/// `X,Y,Z,DX,DY,DZ,W,H,L[,COLOR]`.
pub fn area_light(text: &str) -> Result<UserLight, String> {
    let form = "X,Y,Z,DX,DY,DZ,W,H,L[,COLOR]";
    let parts: Vec<&str> = text.splitn(10, ',').collect();
    let wrong = |e: String| format!("{e}; expected {form}");
    if parts.len() < 9 {
        return Err(wrong("too few numbers".into()));
    }
    let numbers = exactly::<9>(&parts[..9].join(","), form).map_err(wrong)?;
    let [x, y, z, dx, dy, dz, width, height, radiance] = numbers;
    let direction = DVec3::new(dx, dy, dz);
    if direction.try_normalize().is_none() {
        return Err("the direction of an area light must not be zero".into());
    }
    if !(1e-6..=1e6).contains(&width) || !(1e-6..=1e6).contains(&height) {
        return Err("the sides of an area light must be from 0.000001 to 1000000 metres".into());
    }
    if radiance < 0.0 {
        return Err("the radiance of a light must not be negative".into());
    }
    let tint = parts.get(9).map_or(Ok(Rgb::ONE), |c| color(c))?;
    Ok(UserLight::Area {
        position: DVec3::new(x, y, z),
        direction,
        size: [width as f32, height as f32],
        radiance: tint * radiance as f32,
    })
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;

    #[test]
    fn occlusion_takes_samples_and_a_distance() {
        assert_eq!(ao("16").unwrap(), OcclusionSampling { samples: 16, distance: None });
        assert_eq!(ao("64,.5").unwrap(), OcclusionSampling { samples: 64, distance: Some(0.5) });
        assert_eq!(ao("1,inf").unwrap(), OcclusionSampling { samples: 1, distance: Some(f64::INFINITY) });
        for wrong in ["0", "-1", "65537", "x", "", "16,", "16,0", "16,-1", "16,nan", "1.5", "16,1,2"] {
            assert!(ao(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn radii_are_not_negative() {
        assert_eq!((radius("0").unwrap(), radius(".25").unwrap()), (0.0, 0.25));
        assert!(strength("-0.1").is_err() && strength("0") == Ok(0.0));
        assert!(radius("-1").is_err() && radius("1e7").is_err() && radius("inf").is_err());
    }

    #[test]
    fn area_lights_have_a_direction_a_size_and_an_optional_colour() {
        let light = area_light("1,2,3,0,-1,0,2,0.5,4,1,0.5,0").unwrap();
        let expected = UserLight::Area {
            position: DVec3::new(1.0, 2.0, 3.0),
            direction: DVec3::NEG_Y,
            size: [2.0, 0.5],
            radiance: Vec3::new(4.0, 2.0, 0.0),
        };
        assert_eq!(light, expected);
        for wrong in
            ["1,2,3,0,-1,0,2,0.5", "1,2,3,0,0,0,1,1,1", "1,2,3,0,-1,0,0,1,1", "1,2,3,0,-1,0,1,1,-1", ""]
        {
            assert!(area_light(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn lights_have_an_optional_colour() {
        let white = UserLight::Point { position: DVec3::new(1.0, 2.0, 3.0), intensity: Vec3::splat(4.0) };
        assert_eq!(point_light("1,2,3,4").unwrap(), white);
        let tinted = UserLight::Sun { direction: DVec3::NEG_Y, intensity: Vec3::new(2.0, 1.0, 0.0) };
        assert_eq!(sun("0,-1,0,2,1,.5,0").unwrap(), tinted);
        assert!(sun("0,0,0,1").is_err() && sun("0,-1,0,1e39").is_err());
        assert!(point_light("1,2,3").is_err() && point_light("1,2,3,-1").is_err());
        // Normalizing it would give a sun from straight above.
        assert!(sun("1e-200,0,0,1").unwrap_err().contains("must not be zero"));
    }

    #[test]
    fn light_sources_are_a_list_or_none() {
        assert!(lights("none").unwrap().is_empty());
        assert_eq!(lights("file,headlight").unwrap(), [LightSet::File, LightSet::Headlight]);
        assert!(lights("sun").is_err());
        assert!(lights("none,file").unwrap_err().contains("'none' cannot be combined"));
    }
}
