//! Parsers of distributions of views, and of the ranges of their elevations and distances.

use blinn_scene::{DistanceRange, ViewLayout};
use blinn_session::values::{exactly, number, numbers, positive};

/// `sphere`, `stereo=0.065` and so on.
pub fn view_layout(text: &str) -> Result<ViewLayout, String> {
    if let Some(baseline) = text.strip_prefix("stereo=") {
        return Ok(ViewLayout::Stereo { baseline: Some(positive(baseline)?) });
    }
    match text {
        "sphere" => Ok(ViewLayout::Sphere),
        "hemisphere" => Ok(ViewLayout::Hemisphere),
        "ring" => Ok(ViewLayout::Ring),
        "icosphere" => Ok(ViewLayout::Icosphere),
        "random" => Ok(ViewLayout::Random),
        "stereo" => Ok(ViewLayout::Stereo { baseline: None }),
        _ => Err("expected sphere, hemisphere, ring, icosphere, random, stereo or stereo=BASELINE".into()),
    }
}

/// `LO,HI` or one angle, in degrees from −90 to 90, converted to radians.
pub fn elevation_range(text: &str) -> Result<(f64, f64), String> {
    let (low, high) = range(text)?;
    if low < -90.0 || high > 90.0 {
        return Err("elevations are from -90 to 90 degrees".into());
    }
    Ok((low.to_radians(), high.to_radians()))
}

/// `LO,HI` or one distance, in metres or as multiples: `1x,1.5x`.
pub fn distance_range(text: &str) -> Result<DistanceRange, String> {
    let multiples: Option<Vec<&str>> = text.split(',').map(|part| part.trim().strip_suffix('x')).collect();
    let is_multiple = multiples.is_some();
    if !is_multiple && text.contains('x') {
        return Err("expected two distances in metres, or two multiples such as 1x,1.5x".into());
    }
    let (low, high) = range(&multiples.map_or_else(|| text.to_string(), |parts| parts.join(",")))?;
    if low <= 0.0 {
        return Err("distances must be greater than zero".into());
    }
    Ok(if is_multiple { DistanceRange::Framed(low, high) } else { DistanceRange::Metres(low, high) })
}

/// An angle from 0 to 180 degrees, converted to radians.
pub fn roll(text: &str) -> Result<f64, String> {
    let degrees = number(text)?;
    if (0.0..=180.0).contains(&degrees) {
        Ok(degrees.to_radians())
    } else {
        Err("must be from 0 to 180 degrees".into())
    }
}

/// `LO,HI`, or one number for both.
fn range(text: &str) -> Result<(f64, f64), String> {
    let [low, high] = match numbers(text)?[..] {
        [one] => [one, one],
        _ => exactly::<2>(text, "LO,HI")?,
    };
    if low <= high { Ok((low, high)) } else { Err(format!("the range is empty: {low} is more than {high}")) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_are_ordered_and_within_their_limits() {
        assert_eq!(elevation_range("-30,45").unwrap(), (-30f64.to_radians(), 45f64.to_radians()));
        assert_eq!(elevation_range("20").unwrap().0, 20f64.to_radians());
        for wrong in ["45,-30", "0,91", "-91,0", "1,2,3", "", "a,b"] {
            assert!(elevation_range(wrong).is_err(), "{wrong}");
        }
        assert_eq!(distance_range("1.5,2"), Ok(DistanceRange::Metres(1.5, 2.0)));
        assert_eq!(distance_range("1x, 1.5x"), Ok(DistanceRange::Framed(1.0, 1.5)));
        assert_eq!(distance_range("2x"), Ok(DistanceRange::Framed(2.0, 2.0)));
        for wrong in ["0,1", "-1,1", "1x,2", "1,2x", "2,1", "x", "inf,inf"] {
            assert!(distance_range(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn layouts_have_their_names() {
        assert_eq!(view_layout("ring"), Ok(ViewLayout::Ring));
        assert_eq!(view_layout("stereo"), Ok(ViewLayout::Stereo { baseline: None }));
        assert_eq!(view_layout("stereo=.065"), Ok(ViewLayout::Stereo { baseline: Some(0.065) }));
        for wrong in ["Sphere", "stereo=", "stereo=0", "stereo=-1", "ring=1", ""] {
            assert!(view_layout(wrong).is_err(), "{wrong}");
        }
    }
}
