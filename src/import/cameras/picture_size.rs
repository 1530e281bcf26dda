//! Sizes of pictures.

/// Longest side in pixels, and most pixels: those of `--size`.
const MAX_SIDE: f64 = 65_536.0;
const MAX_PIXELS: f64 = (1u64 << 29) as f64;

/// Returns a size from a width and a height, both or neither of which are given.
pub(super) fn picture_size(width: Option<f64>, height: Option<f64>) -> Result<Option<(u32, u32)>, String> {
    let (width, height) = match (width, height) {
        (None, None) => return Ok(None),
        (Some(width), Some(height)) => (width, height),
        _ => return Err("the picture has a width or a height, but not both; give both".into()),
    };
    let is_side = |side: f64| (1.0..=MAX_SIDE).contains(&side) && side.fract() == 0.0;
    if !is_side(width) || !is_side(height) || width * height > MAX_PIXELS {
        return Err(format!(
            "the picture has {width} by {height} pixels; each side must be a whole number from 1 to {MAX_SIDE}, and \
             the picture at most {MAX_PIXELS} pixels"
        ));
    }
    Ok(Some((width as u32, height as u32)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_are_whole_and_limited() {
        assert_eq!(picture_size(Some(640.0), Some(480.0)), Ok(Some((640, 480))));
        assert_eq!(picture_size(None, None), Ok(None));
        for (width, height) in
            [(0.0, 1.0), (1.5, 2.0), (-3.0, 2.0), (65_537.0, 1.0), (65_536.0, 65_536.0), (f64::NAN, 1.0)]
        {
            assert!(picture_size(Some(width), Some(height)).is_err(), "{width} {height}");
        }
        assert!(picture_size(Some(1.0), None).is_err());
    }
}
