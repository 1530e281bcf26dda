//! Plots as SVG text.

use std::fmt::Write;

use blinn_output::escape_html;

/// Stroke of the axes.
pub(super) const AXIS_STYLE: &str = "stroke=\"var(--edge)\"";
/// Stroke of the grid lines.
pub(super) const GRID_STYLE: &str = "stroke=\"var(--line)\"";

/// Colours of data series. The order in the legend distinguishes them, too.
const COLORS: [&str; 7] = [
    "var(--series-0)",
    "var(--series-1)",
    "var(--series-2)",
    "var(--series-3)",
    "var(--series-4)",
    "var(--series-5)",
    "var(--series-6)",
];

/// The colour of series `i`.
pub(super) fn color(i: usize) -> &'static str {
    COLORS[i % COLORS.len()]
}

/// A linear or logarithmic scale from values to coordinates.
#[derive(Clone, Copy)]
pub(super) struct Scale {
    low: f64,
    high: f64,
    from: f64,
    to: f64,
    log: bool,
}

impl Scale {
    /// Maps `low` to `from` and `high` to `to`.
    pub fn linear((low, high): (f64, f64), (from, to): (f64, f64)) -> Scale {
        Scale { low, high, from, to, log: false }
    }

    /// The same logarithmically. Values must be positive.
    pub fn log((low, high): (f64, f64), (from, to): (f64, f64)) -> Scale {
        Scale { low: libm::log10(low), high: libm::log10(high), from, to, log: true }
    }

    /// The coordinate of `v`, clamped to the range.
    pub fn at(&self, v: f64) -> f64 {
        let v = if self.log { libm::log10(v) } else { v };
        let t = if self.high > self.low { (v - self.low) / (self.high - self.low) } else { 0.5 };
        self.from + t.clamp(0.0, 1.0) * (self.to - self.from)
    }
}

/// About five round numbers from 0 to `high`.
pub(super) fn round_ticks(high: f64) -> Vec<f64> {
    let rough = high / 4.0;
    if !(rough > 0.0 && rough.is_finite()) {
        return vec![0.0];
    }
    let power = libm::pow(10.0, libm::floor(libm::log10(rough)));
    let step = [1.0, 2.0, 5.0, 10.0].map(|m| m * power).into_iter().find(|s| *s >= rough).unwrap_or(rough);
    (0..=8).map(|i| f64::from(i) * step).take_while(|v| *v <= high * 1.0001).collect()
}

/// An SVG drawing.
pub(super) struct Svg {
    text: String,
}

impl Svg {
    /// A drawing of this size with a label for screen readers.
    pub fn new(width: f64, height: f64, label: &str) -> Svg {
        let label = escape_html(label);
        let text = format!(
            "<svg role=\"img\" aria-label=\"{label}\" width=\"{width}\" height=\"{height}\" \
             viewBox=\"0 0 {width} {height}\" xmlns=\"http://www.w3.org/2000/svg\">\n"
        );
        Svg { text }
    }

    /// A line.
    pub fn line(&mut self, (x0, y0): (f64, f64), (x1, y1): (f64, f64), style: &str) {
        let _ = writeln!(
            self.text,
            "<line x1=\"{x0:.1}\" y1=\"{y0:.1}\" x2=\"{x1:.1}\" y2=\"{y1:.1}\" {style}/>"
        );
    }

    /// A rectangle with a tooltip.
    pub fn bar(&mut self, (x, y): (f64, f64), (width, height): (f64, f64), fill: &str, title: &str) {
        let title = escape_html(title);
        let _ = writeln!(
            self.text,
            "<rect x=\"{x:.1}\" y=\"{y:.1}\" width=\"{width:.1}\" height=\"{height:.1}\" fill=\"{fill}\">\
             <title>{title}</title></rect>"
        );
    }

    /// A dot with a tooltip.
    pub fn dot(&mut self, (x, y): (f64, f64), fill: &str, title: &str) {
        let title = escape_html(title);
        let _ = writeln!(
            self.text,
            "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"4\" fill=\"{fill}\"><title>{title}</title></circle>"
        );
    }

    /// Text that starts (`start`), is centred (`middle`) or ends (`end`) at a point.
    pub fn text(&mut self, (x, y): (f64, f64), anchor: &str, text: &str) {
        let text = escape_html(text);
        let _ = writeln!(self.text, "<text x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"{anchor}\">{text}</text>");
    }

    /// A row of names with their colours, to the right of a point.
    pub fn legend(&mut self, (mut x, y): (f64, f64), entries: impl Iterator<Item = (String, &'static str)>) {
        for (name, color) in entries {
            self.bar((x, y - 9.0), (10.0, 10.0), color, &name);
            self.text((x + 14.0, y), "start", &name);
            x += 34.0 + 6.6 * name.chars().count() as f64;
        }
    }

    /// The SVG text.
    pub fn finish(self) -> String {
        self.text + "</svg>\n"
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round() {
        assert_eq!(round_ticks(10.0), [0.0, 5.0, 10.0]);
        assert_eq!(round_ticks(3.9), [0.0, 1.0, 2.0, 3.0]);
        assert_eq!(round_ticks(0.0), [0.0]);
        assert_eq!(round_ticks(f64::NAN), [0.0]);
        assert!(round_ticks(1e300).len() > 1 && round_ticks(1e-300).len() > 1);
    }

    #[test]
    fn scales_clamp_to_their_range() {
        let log = Scale::log((10.0, 1000.0), (0.0, 100.0));
        assert!((log.at(100.0) - 50.0).abs() < 1e-9);
        assert_eq!(log.at(1e9), 100.0);
        assert_eq!(Scale::linear((1.0, 1.0), (0.0, 10.0)).at(1.0), 5.0);
    }
}
