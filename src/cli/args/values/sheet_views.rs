//! Parser of the views of a sheet.

use blinn_session::values::{NAMED_DIRECTIONS, number};

/// Most positions of `turntable=N`.
const MAX_TURNTABLE: u32 = 360;

/// A view of a sheet.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SheetView {
    /// Orthographic, from a direction.
    Direction {
        /// The name, unless it has only angles.
        name: Option<&'static str>,
        /// Degrees from the front (+Z) to the right (+X).
        azimuth: f64,
        /// Degrees above the horizon.
        elevation: f64,
    },
    /// Those of all cameras of the file.
    FileCameras,
}

/// The views of a sheet, in their order. Never empty.
#[derive(Clone, Debug, PartialEq)]
pub struct SheetViews(pub Vec<SheetView>);

/// `front,30/20,turntable=8,cameras` and so on.
pub fn sheet_views(text: &str) -> Result<SheetViews, String> {
    let mut views = Vec::new();
    for word in text.split(',').map(str::trim) {
        match word.strip_prefix("turntable=") {
            Some(count) => views.extend(turntable(count)?),
            None => views.push(view(word)?),
        }
    }
    Ok(SheetViews(views))
}

fn turntable(text: &str) -> Result<impl Iterator<Item = SheetView>, String> {
    let count = text.parse::<u32>().ok().filter(|count| (1..=MAX_TURNTABLE).contains(count));
    let count = count.ok_or_else(|| format!("turntable=N has 1 to {MAX_TURNTABLE} positions"))?;
    let azimuth = move |i: u32| 360.0 * f64::from(i) / f64::from(count);
    Ok((0..count).map(move |i| SheetView::Direction { name: None, azimuth: azimuth(i), elevation: 0.0 }))
}

fn view(word: &str) -> Result<SheetView, String> {
    if word == "cameras" {
        return Ok(SheetView::FileCameras);
    }
    if let Some((name, azimuth, elevation)) = NAMED_DIRECTIONS.into_iter().find(|(name, ..)| *name == word) {
        return Ok(SheetView::Direction { name: Some(name), azimuth, elevation });
    }
    let (azimuth, elevation) = word.split_once('/').unwrap_or((word, "0"));
    let (Ok(azimuth), Ok(elevation)) = (number(azimuth), number(elevation)) else {
        let names: Vec<&str> = NAMED_DIRECTIONS.into_iter().map(|(name, ..)| name).collect();
        return Err(format!(
            "unknown view '{word}': expected {}, degrees such as 30 or 30/20, turntable=N, or cameras",
            names.join(", ")
        ));
    };
    if !(-90.0..=90.0).contains(&elevation) {
        return Err("elevations are from -90 to 90 degrees".into());
    }
    Ok(SheetView::Direction { name: None, azimuth, elevation })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lists_have_names_angles_and_turns() {
        let SheetViews(views) = sheet_views("top, -30/20,turntable=3,cameras,45").unwrap();
        let direction = |azimuth, elevation| SheetView::Direction { name: None, azimuth, elevation };
        assert_eq!(views[0], SheetView::Direction { name: Some("top"), azimuth: 0.0, elevation: 90.0 });
        assert_eq!(
            views[1..5],
            [-30.0, 0.0, 120.0, 240.0].map(|a| direction(a, if a < 0.0 { 20.0 } else { 0.0 }))
        );
        assert_eq!(views[5..], [SheetView::FileCameras, direction(45.0, 0.0)]);
        for (text, message) in [
            ("", "unknown view ''"),
            ("front,", "unknown view ''"),
            ("side", "expected front, right"),
            ("0/91", "-90 to 90"),
            ("turntable=0", "1 to 360"),
            ("turntable=1000000", "1 to 360"),
            ("nan", "unknown view"),
        ] {
            let error = sheet_views(text).unwrap_err();
            assert!(error.contains(message), "{text}: {error}");
        }
    }
}
