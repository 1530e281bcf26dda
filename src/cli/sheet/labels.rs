//! Labels of a sheet: the names of the views, dimension lines, and rules between the cells.

use glam::DVec2;

use super::grid::Grid;
use super::layout::{Cell, SheetLayout};
use super::views::NamedViews;
use blinn_core::geometry::Aabb;
use blinn_output::{Anchor, Canvas, TextStyle};
use blinn_scene::{StandardView, UpAxis};

/// Text and lines on light and on dark backgrounds, 8-bit sRGB.
const DARK: [u8; 3] = [0x2b, 0x30, 0x38];
const LIGHT: [u8; 3] = [0xdd, 0xe1, 0xe7];
/// Rules between the cells.
const RULE_ON_LIGHT: [u8; 3] = [0xb9, 0xbf, 0xc8];
const RULE_ON_DARK: [u8; 3] = [0x45, 0x4b, 0x55];

/// Colours of the labels, and the unit of the dimensions.
pub struct Labels<'a> {
    /// Name of the scene.
    pub title: &'a str,
    pub unit: Unit,
    /// The axis of the file that points up, in whose coordinates the overall size is.
    pub up: UpAxis,
    /// True for dark labels.
    pub on_light: bool,
}

/// The unit of all dimensions of a sheet.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Unit {
    /// Units per unit of the file.
    factor: f64,
    /// Symbol after the number; empty if the file has no unit.
    symbol: &'static str,
}

impl Unit {
    /// The unit in which the longest dimension has a short number. Files that are not in metres have no unit.
    pub fn for_longest(longest: f64, is_metres: bool) -> Unit {
        let (factor, symbol) = match longest {
            _ if !is_metres => (1.0, ""),
            v if v >= 1e4 => (1e-3, " km"),
            v if (1e-4..1.0).contains(&v) => (1e3, " mm"),
            _ => (1.0, " m"),
        };
        Unit { factor, symbol }
    }

    /// A length with four significant digits.
    pub fn format(self, length: f64) -> String {
        let value = length * self.factor;
        let number = match value.abs() {
            0.0 => "0".to_string(),
            v if !(1e-3..1e6).contains(&v) => format!("{value:.3e}"),
            v => {
                let decimals = (3 - libm::log10(v).floor() as i32).max(0) as usize;
                let text = format!("{value:.decimals$}");
                if text.contains('.') {
                    text.trim_end_matches('0').trim_end_matches('.').into()
                } else {
                    text
                }
            }
        };
        number + self.symbol
    }
}

/// Draws the labels of a sheet.
pub fn draw(canvas: &mut Canvas, layout: &SheetLayout, labels: &Labels) {
    let height = layout.label_height;
    let style = style(height, labels.on_light);
    let rule = if labels.on_light { RULE_ON_LIGHT } else { RULE_ON_DARK };
    let (width, cell_height) = (f64::from(layout.cell_size.0), f64::from(layout.cell_size.1));
    let line_width = style.stroke.round();
    canvas.line(DVec2::new(width, 0.0), DVec2::new(width, 2.0 * cell_height), line_width, rule);
    canvas.line(DVec2::new(0.0, cell_height), DVec2::new(2.0 * width, cell_height), line_width, rule);
    for cell in &layout.cells {
        let [left, top] = cell.origin.map(f64::from);
        let corner = DVec2::new(left, top) + 1.5 * height;
        canvas.text(title_case(cell.view.name()).as_str(), corner, Anchor::Left, false, &style);
        if cell.view == StandardView::Isometric {
            let end = DVec2::new(left + width - 1.5 * height, top + 1.5 * height);
            let room = width - 11.0 * height;
            canvas.text(&shorten(labels.title, room, &style), end, Anchor::Right, false, &style);
            let below = DVec2::new(left + 0.5 * width, top + cell_height - 1.5 * height);
            canvas.text(&overall_size(layout.bounds, labels), below, Anchor::Middle, false, &style);
        } else {
            dimensions(canvas, layout, cell, labels.unit, &style);
        }
    }
}

/// Draws the labels of named views: the names below them, and on top the name of the scene and its size.
pub fn draw_names(canvas: &mut Canvas, views: &NamedViews, width: u32, bounds: Aabb, labels: &Labels) {
    let names: Vec<&str> = views.cells.iter().map(|cell| cell.name.as_str()).collect();
    let note = overall_size(bounds, labels);
    let labels = GridLabels { title: labels.title, note: &note, names: &names, on_light: labels.on_light };
    draw_grid(canvas, &views.grid, width, &labels);
}

/// The labels of pictures in a grid.
pub struct GridLabels<'a> {
    /// On top, on the left.
    pub title: &'a str,
    /// On top, on the right.
    pub note: &'a str,
    /// Below the pictures.
    pub names: &'a [&'a str],
    /// True for dark labels.
    pub on_light: bool,
}

/// Draws the labels of a grid on a sheet of `width` pixels.
pub fn draw_grid(canvas: &mut Canvas, grid: &Grid, width: u32, labels: &GridLabels) {
    let height = grid.label_height;
    let style = style(height, labels.on_light);
    let middle = 0.5 * f64::from(grid.header);
    let right = f64::from(width) - height;
    canvas.text(labels.note, DVec2::new(right, middle), Anchor::Right, false, &style);
    let room = right - Canvas::text_width(labels.note, &style) - 3.0 * height;
    if room > 0.0 {
        let title = shorten(labels.title, room, &style);
        canvas.text(&title, DVec2::new(height, middle), Anchor::Left, false, &style);
    }
    let room = f64::from(grid.area.0);
    for (index, name) in labels.names.iter().enumerate() {
        let name = shorten_middle(name, room, &style);
        canvas.text(&name, grid.caption(index), Anchor::Middle, false, &style);
    }
}

fn style(height: f64, on_light: bool) -> TextStyle {
    let color = if on_light { DARK } else { LIGHT };
    TextStyle { height, stroke: (height / 7.0).max(1.0), color }
}

/// Draws the dimension lines of a cell: the width below, the height on the left.
fn dimensions(canvas: &mut Canvas, layout: &SheetLayout, cell: &Cell, unit: Unit, style: &TextStyle) {
    let (low, high) = layout.model_rect(cell);
    let extent = cell.view.projected_extent(&layout.bounds);
    let (h, line) = (style.height, (style.stroke * 0.6).max(0.8));
    let below = high.y + h;
    let beside = low.x - h;
    for (from, to, tick) in [
        (DVec2::new(low.x, below), DVec2::new(high.x, below), DVec2::new(0.0, 0.5 * h)),
        (DVec2::new(beside, low.y), DVec2::new(beside, high.y), DVec2::new(0.5 * h, 0.0)),
    ] {
        canvas.line(from, to, line, style.color);
        [from, to].into_iter().for_each(|end| canvas.line(end - tick, end + tick, line, style.color));
    }
    let middle = 0.5 * (low + high);
    let width = unit.format(extent.x);
    canvas.text(&width, DVec2::new(middle.x, below + 1.4 * h), Anchor::Middle, false, style);
    let height = unit.format(extent.y);
    canvas.text(&height, DVec2::new(beside - 1.4 * h, middle.y), Anchor::Middle, true, style);
}

/// The size along the axes of the file.
fn overall_size(bounds: Aabb, labels: &Labels) -> String {
    let Labels { unit, up, .. } = *labels;
    let extent = up.size_in_file(bounds.extent());
    let plain = Unit { symbol: "", ..unit };
    format!("{} × {} × {}", plain.format(extent.x), plain.format(extent.y), unit.format(extent.z))
}

fn title_case(name: &str) -> String {
    let mut letters = name.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}

/// The text, or as much of its beginning as fits into `room` pixels.
fn shorten(text: &str, room: f64, style: &TextStyle) -> String {
    if Canvas::text_width(text, style) <= room {
        return text.into();
    }
    let mut kept = String::new();
    for c in text.chars() {
        kept.push(c);
        if Canvas::text_width(&format!("{kept}..."), style) > room {
            kept.pop();
            break;
        }
    }
    kept + "..."
}

/// The text, or as much of its beginning and end as fits into `room` pixels: names of cameras often differ at the end.
fn shorten_middle(text: &str, room: f64, style: &TextStyle) -> String {
    let letters: Vec<char> = text.chars().collect();
    let with = |kept: usize| -> String {
        let (front, back) = (kept.div_ceil(2), kept / 2);
        let end = letters.len() - back;
        letters[..front].iter().chain(&['.'; 3]).chain(&letters[end..]).collect()
    };
    // No text of more letters than that fits, and each is laid out.
    let most = letters.len().min((room / style.height * 4.0).max(0.0) as usize);
    if most == letters.len() && Canvas::text_width(text, style) <= room {
        return text.into();
    }
    let kept = (0..most).rev().find(|kept| Canvas::text_width(&with(*kept), style) <= room);
    kept.map_or_else(String::new, with)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lengths_have_four_digits_in_a_fitting_unit() {
        let format = |longest: f64, length: f64| Unit::for_longest(longest, true).format(length);
        assert_eq!(format(2.0, 1.25), "1.25 m");
        assert_eq!(format(2.0, 1.234_56), "1.235 m");
        assert_eq!(format(0.3, 0.0123), "12.3 mm");
        assert_eq!(format(52_000.0, 12_345.678), "12.35 km");
        assert_eq!(format(200.0, 100.0), "100 m");
        assert_eq!(format(0.0, 0.0), "0 m");
        assert_eq!(format(1e-7, 1e-7), "1.000e-7 m");
        assert_eq!(Unit::for_longest(0.3, false).format(0.0123), "0.0123");
        assert_eq!(Unit::for_longest(1e9, false).format(1e9), "1.000e9");
    }

    #[test]
    fn long_titles_are_shortened() {
        let style = TextStyle { height: 10.0, stroke: 1.0, color: [0; 3] };
        assert_eq!(shorten("shoe", 1000.0, &style), "shoe");
        let short = shorten("a very long name of a scene", 100.0, &style);
        assert!(short.starts_with("a very") && short.ends_with("..."), "{short}");
        assert!(Canvas::text_width(&short, &style) <= 100.0);
    }

    #[test]
    fn long_names_keep_their_ends() {
        let style = TextStyle { height: 10.0, stroke: 1.0, color: [0; 3] };
        assert_eq!(shorten_middle("left", 1000.0, &style), "left");
        for name in ["training/images/left/0001".to_string(), "é".repeat(100_000) + "x0001"] {
            let short = shorten_middle(&name, 120.0, &style);
            assert!(short.contains("...") && short.ends_with("0001"), "{short}");
            assert!(Canvas::text_width(&short, &style) <= 120.0);
        }
        assert_eq!(shorten_middle("left", 1.0, &style), "");
        assert_eq!(shorten_middle("", 100.0, &style), "");
    }
}
