//! Options of edges over pictures.

use crate::round_sizes::RoundWidth;
use blinn_core::closest_name::did_you_mean;
use blinn_core::geometry::Rgb;
use blinn_render::{EdgeKinds, EdgeStyle, EdgeWidth, HiddenEdges};

/// The widest edges in pixels.
const MAX_PIXELS: f64 = 100.0;
/// Names of kinds of edges.
const KINDS: [&str; 4] = ["all", "feature", "silhouette", "boundary"];

/// The edges of pictures.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct EdgeOptions {
    /// The edges that are drawn; none by default.
    pub kinds: EdgeKinds,
    /// Angle in degrees above which an edge is sharp.
    pub angle: f64,
    /// Colour, linear; `None` for those of the file, and black where it has none.
    pub color: Option<Rgb>,
    /// Width; a pixel for [`RoundWidth::Auto`].
    pub width: RoundWidth,
    /// Edges behind surfaces.
    pub hidden: HiddenEdges,
    /// True to draw the edges alone.
    pub alone: bool,
}

impl Default for EdgeOptions {
    fn default() -> EdgeOptions {
        EdgeOptions {
            kinds: EdgeKinds::default(),
            angle: 30.0,
            color: None,
            width: RoundWidth::Auto,
            hidden: HiddenEdges::Off,
            alone: false,
        }
    }
}

impl EdgeOptions {
    /// How the edges are drawn; `None` without any.
    pub(crate) fn style(&self) -> Option<EdgeStyle> {
        let width = match self.width {
            RoundWidth::Auto => EdgeWidth::Pixels(1.0),
            RoundWidth::Pixels(width) => EdgeWidth::Pixels(width),
            RoundWidth::Metres(width) => EdgeWidth::Metres(width),
            RoundWidth::Off => return None,
        };
        let EdgeOptions { kinds, angle, color, hidden, .. } = *self;
        (kinds != EdgeKinds::default()).then_some(EdgeStyle { kinds, angle, color, width, hidden })
    }

    /// Adds the kinds of a list such as `feature,silhouette`.
    ///
    /// # Errors
    /// A name that is not known.
    pub(crate) fn add_kinds(&mut self, text: &str) -> Result<(), String> {
        for name in text.split(',').map(str::trim) {
            let kind = match name {
                "all" => &mut self.kinds.all,
                "feature" => &mut self.kinds.feature,
                "silhouette" => &mut self.kinds.silhouette,
                "boundary" => &mut self.kinds.boundary,
                _ => return Err(format!("expected {}{}", KINDS.join(", "), did_you_mean(name, KINDS))),
            };
            *kind = true;
        }
        Ok(())
    }

    /// Reads a width in pixels or metres.
    ///
    /// # Errors
    /// As for lines; more than 100 pixels.
    pub(crate) fn parse_width(text: &str) -> Result<RoundWidth, String> {
        match RoundWidth::parse(text)? {
            RoundWidth::Off => Err("expected pixels such as 2px, metres such as 0.01, or auto".into()),
            RoundWidth::Pixels(width) if width > MAX_PIXELS => {
                Err(format!("must be at most {MAX_PIXELS} pixels"))
            }
            width => Ok(width),
        }
    }

    /// Reads an angle.
    ///
    /// # Errors
    /// It is not between 0 and 180 degrees.
    pub(crate) fn parse_angle(text: &str) -> Result<f64, String> {
        match text.parse() {
            Ok(angle) if (0.0..=180.0).contains(&angle) => Ok(angle),
            _ => Err("expected degrees from 0 to 180".into()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn kinds_add_up() {
        let mut edges = EdgeOptions::default();
        assert_eq!(edges.style(), None);
        edges.add_kinds("feature, silhouette").unwrap();
        edges.add_kinds("boundary").unwrap();
        let all_but_one = EdgeKinds { all: false, feature: true, silhouette: true, boundary: true };
        assert_eq!(edges.style().map(|style| style.kinds), Some(all_but_one));
        assert!(edges.add_kinds("features").unwrap_err().contains("did you mean 'feature'?"));
        assert!(edges.add_kinds("").is_err());
    }

    #[test]
    fn widths_and_angles_have_limits() {
        assert_eq!(EdgeOptions::parse_width("2px"), Ok(RoundWidth::Pixels(2.0)));
        assert_eq!(EdgeOptions::parse_width(".01"), Ok(RoundWidth::Metres(0.01)));
        for wrong in ["off", "101px", "0", "-1", "wide"] {
            assert!(EdgeOptions::parse_width(wrong).is_err(), "{wrong}");
        }
        assert_eq!(EdgeOptions::parse_angle("0"), Ok(0.0));
        for wrong in ["-1", "181", "nan", ""] {
            assert!(EdgeOptions::parse_angle(wrong).is_err(), "{wrong}");
        }
    }
}
