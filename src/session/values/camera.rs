//! Parsers of positions, angles and clip planes of cameras.

use glam::{DVec2, DVec3};

use super::numbers::{exactly, number, numbers, vector};
use blinn_scene::{ClipPlanes, Focus, Intrinsics, Orbit, ViewRect};

const ELEVATION_RANGE: &str = "the elevation must be within ±90 degrees";

/// An elevation above the horizon in degrees, converted to radians.
pub fn elevation(text: &str) -> Result<f64, String> {
    let v = number(text)?;
    if v.abs() <= 90.0 { Ok(v.to_radians()) } else { Err(ELEVATION_RANGE.into()) }
}

/// `x`, `y`, `z` or `X,Y,Z`, normalized.
pub fn axis(text: &str) -> Result<DVec3, String> {
    let axis = match text {
        "x" => DVec3::X,
        "y" => DVec3::Y,
        "z" => DVec3::Z,
        _ => vector(text).map_err(|e| format!("{e}; or x, y, z"))?,
    };
    axis.try_normalize().ok_or_else(|| "an axis must not be zero".to_string())
}

/// Names of directions, with azimuth and elevation in degrees.
pub const NAMED_DIRECTIONS: [(&str, f64, f64); 7] = [
    ("front", 0.0, 0.0),
    ("right", 90.0, 0.0),
    ("back", 180.0, 0.0),
    ("left", 270.0, 0.0),
    ("top", 0.0, 90.0),
    ("bottom", 0.0, -90.0),
    // atan(1/√2): all three axes have the same scale.
    ("isometric", 45.0, 35.264_389_682_754_654),
];

/// `AZIMUTH,ELEVATION[,DISTANCE]`, angles in degrees, or one of [`NAMED_DIRECTIONS`].
pub fn orbit(text: &str) -> Result<Orbit, String> {
    let text = text.trim();
    let named = NAMED_DIRECTIONS.into_iter().find(|(name, ..)| *name == text);
    let (azimuth, elevation, distance) = if let Some((_, azimuth, elevation)) = named {
        (azimuth, elevation, None)
    } else if text.starts_with(|c: char| c.is_ascii_alphabetic()) {
        let names = NAMED_DIRECTIONS.map(|(name, ..)| name).join(", ");
        return Err(format!("expected AZIMUTH,ELEVATION, such as 45,20, or one of {names}"));
    } else {
        match numbers(text)?[..] {
            [a, e] => (a, e, None),
            [a, e, d] => (a, e, Some(d)),
            _ => return Err("expected AZIMUTH,ELEVATION or AZIMUTH,ELEVATION,DISTANCE, such as 45,20".into()),
        }
    };
    if elevation.abs() > 90.0 {
        return Err(ELEVATION_RANGE.into());
    }
    if distance.is_some_and(|d| !(d > 0.0)) {
        return Err("the distance must be greater than zero".into());
    }
    Ok(Orbit { azimuth: azimuth.to_radians(), elevation: elevation.to_radians(), distance })
}

/// A field of view in degrees, converted to radians.
pub fn field_of_view(text: &str) -> Result<f64, String> {
    let v = number(text)?;
    if v > 0.0 && v < 180.0 { Ok(v.to_radians()) } else { Err("must be between 0 and 180 degrees".into()) }
}

/// `L,R,B,T`.
pub fn view_rect(text: &str) -> Result<ViewRect, String> {
    let [left, right, bottom, top] = exactly::<4>(text, "L,R,B,T")?;
    let rect = ViewRect { left, right, bottom, top };
    if rect.is_valid() { Ok(rect) } else { Err("expected L < R and B < T, such as -1,1,-1,1".into()) }
}

/// `FX,FY,CX,CY` in pixels.
pub fn intrinsics(text: &str) -> Result<Intrinsics, String> {
    let [fx, fy, cx, cy] = exactly::<4>(text, "FX,FY,CX,CY")?;
    let intrinsics = Intrinsics { fx, fy, cx, cy };
    if intrinsics.is_valid() { Ok(intrinsics) } else { Err("FX and FY must be greater than zero".into()) }
}

/// `X,Y`.
pub fn shift(text: &str) -> Result<DVec2, String> {
    exactly::<2>(text, "X,Y").map(DVec2::from_array)
}

/// The radius of an aperture in metres, or 0.
pub fn aperture_radius(text: &str) -> Result<f64, String> {
    let radius = number(text)?;
    if radius >= 0.0 { Ok(radius) } else { Err("must be 0 or more".into()) }
}

/// `D` or `X,Y,Z`.
pub fn focus(text: &str) -> Result<Focus, String> {
    match numbers(text)?[..] {
        [distance] if distance > 0.0 => Ok(Focus::Distance(distance)),
        [_] => Err("the distance must be greater than zero".into()),
        [x, y, z] => Ok(Focus::Point(DVec3::new(x, y, z))),
        _ => Err("expected a distance or a point X,Y,Z, such as 2.5".into()),
    }
}

/// Number of corners of an aperture, or 0 for a disc.
pub fn aperture_blades(text: &str) -> Result<u32, String> {
    const MOST: u32 = 1000;
    match text.parse() {
        Ok(blades @ (0 | 3..=MOST)) => Ok(blades),
        _ => Err(format!("expected 0 for a disc, or a number of corners from 3 to {MOST}")),
    }
}

/// `NEAR,FAR` or `off`.
pub fn clip(text: &str) -> Result<ClipPlanes, String> {
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
