//! A font of strokes for labels: printable ASCII, Latin letters with accents, and a few signs, in any size.
//!
//! Glyphs stand on a grid with the baseline at y = 2, lowercase letters up to y = 6 and capitals up to y = 8. Each
//! stroke is a letter and points of two digits, x and y. `L` joins its points by lines. `O` is a quadratic B-spline
//! from the first to the last point, with the others as its control points; `C` is a closed one.

use glam::DVec2;
use unicode_normalization::UnicodeNormalization;

use super::accents::{self, Place};

/// Height of capitals in grid units.
pub const CAP_HEIGHT: f64 = 6.0;
/// The baseline, in grid units.
const BASELINE: f64 = 2.0;
/// Space between glyphs in grid units.
const SPACING: f64 = 1.8;
/// Top of small letters, of capitals and of tall small letters.
const X_TOP: f64 = 6.0;
const CAP_TOP: f64 = 8.0;
/// Space between a letter and a mark over it.
const MARK_GAP: f64 = 0.9;
/// Size of marks over letters.
const MARK_SCALE: f64 = 0.75;
/// Lines that stand for each curve between two knots.
const CURVE_STEPS: u32 = 6;

/// Width in grid units and strokes of a character.
struct Glyph(f64, &'static str);

/// A line of text as polylines.
pub struct TextStrokes {
    /// Points in units of the height of capitals, from the left end of the baseline, y upward.
    pub strokes: Vec<Vec<DVec2>>,
    /// Width in the same units.
    pub width: f64,
}

/// Lays out a line of text. Characters without a glyph become boxes.
pub fn layout(text: &str) -> TextStrokes {
    let mut strokes = Vec::new();
    let mut x = 0.0;
    // The letter that marks belong to.
    let mut letter = Letter { left: 0.0, width: 0.0, top: CAP_TOP };
    let mut characters = text.nfd().peekable();
    while let Some(c) = characters.next() {
        if let Some((place, path)) = accents::mark(c) {
            letter.draw_mark(place, path, &mut strokes);
            continue;
        }
        let is_below_mark =
            characters.peek().and_then(|c| accents::mark(*c)).is_some_and(|(place, _)| place == Place::Above);
        let Glyph(width, path) = glyph(if is_below_mark { without_dot(c) } else { c });
        letter = Letter { left: x, width, top: if is_low(c) { X_TOP } else { CAP_TOP } };
        let to_text = |p: DVec2| (p + DVec2::new(x, -BASELINE)) / CAP_HEIGHT;
        strokes.extend(polylines(path, to_text));
        x += width + SPACING;
    }
    TextStrokes { strokes, width: (x - SPACING).max(0.0) / CAP_HEIGHT }
}

/// A letter that has been laid out, in grid units.
struct Letter {
    left: f64,
    width: f64,
    top: f64,
}

impl Letter {
    /// Draws a mark over or under the letter. Another one over it stands higher.
    fn draw_mark(&mut self, place: Place, path: &str, strokes: &mut Vec<Vec<DVec2>>) {
        let (bottom, scale) = match place {
            Place::Above => (self.top + MARK_GAP, MARK_SCALE),
            Place::Below => (0.0, 1.0),
        };
        let middle = DVec2::new(self.left + 0.5 * self.width, bottom - BASELINE);
        strokes.extend(polylines(path, |p| (middle + (p - DVec2::new(2.0, 0.0)) * scale) / CAP_HEIGHT));
        if place == Place::Above {
            self.top += MARK_GAP + 2.0 * MARK_SCALE;
        }
    }
}

fn polylines(path: &str, place: impl Fn(DVec2) -> DVec2) -> Vec<Vec<DVec2>> {
    let strokes = path.split(' ').filter(|stroke| !stroke.is_empty());
    strokes.map(|stroke| points(stroke).into_iter().map(&place).collect()).collect()
}

/// True for small letters without an ascender.
fn is_low(c: char) -> bool {
    c.is_lowercase() && !"bdfhkltþðđ".contains(c)
}

/// The letter below a mark: i and j lose their dots.
fn without_dot(c: char) -> char {
    match c {
        'i' => 'ı',
        'j' => 'ȷ',
        _ => c,
    }
}

/// The points of a stroke, curves as lines.
fn points(stroke: &str) -> Vec<DVec2> {
    let digits: Vec<f64> = stroke.bytes().skip(1).map(|b| f64::from(b.wrapping_sub(b'0'))).collect();
    let given: Vec<DVec2> = digits.as_chunks::<2>().0.iter().map(|[x, y]| DVec2::new(*x, *y)).collect();
    match stroke.as_bytes().first() {
        Some(b'O') => spline(&given),
        Some(b'C') => closed_spline(&given),
        _ => given,
    }
}

fn spline(points: &[DVec2]) -> Vec<DVec2> {
    let [start, controls @ .., end] = points else { return points.to_vec() };
    let mut curve = vec![*start];
    let mut from = *start;
    for (i, &control) in controls.iter().enumerate() {
        let to = controls.get(i + 1).map_or(*end, |next| control.midpoint(*next));
        add_curve(&mut curve, from, control, to);
        from = to;
    }
    curve
}

fn closed_spline(controls: &[DVec2]) -> Vec<DVec2> {
    let Some(last) = controls.last() else { return Vec::new() };
    let start = last.midpoint(controls[0]);
    spline(&[&[start], controls, &[start]].concat())
}

/// Adds a quadratic Bézier curve.
fn add_curve(curve: &mut Vec<DVec2>, from: DVec2, control: DVec2, to: DVec2) {
    curve.extend((1..=CURVE_STEPS).map(|i| {
        let t = f64::from(i) / f64::from(CURVE_STEPS);
        from.lerp(control, t).lerp(control.lerp(to, t), t)
    }));
}

fn glyph(c: char) -> Glyph {
    let (width, strokes) = match c {
        ' ' => (1.6, ""),
        '!' => (0.0, "L0804 L0202"),
        '"' => (1.0, "L0806 L1816"),
        '#' => (4.0, "L1218 L3238 L0444 L0646"),
        '$' => (4.0, "O4748080545420203 L2921"),
        '%' => (4.0, "L0248 C08181606 C34444232"),
        '&' => (4.0, "L420728360403123244"),
        '\'' => (0.0, "L0806"),
        '(' => (1.0, "O18070311"),
        ')' => (1.0, "O08171301"),
        '*' => (4.0, "L2824 L0547 L0745"),
        '+' => (4.0, "L0545 L2327"),
        ',' => (0.6, "L1201"),
        '-' | '−' | '–' => (3.0, "L0535"),
        '.' => (0.0, "L0202"),
        '/' => (3.0, "L0238"),
        '0' => (4.0, "C08484202"),
        '1' => (2.0, "L062822"),
        '2' => (4.0, "O0608484502 L0242"),
        '3' => (4.0, "O0708484515 O1545420203"),
        '4' => (4.0, "L32380444"),
        '5' => (4.0, "L480805 O0546420203"),
        '6' => (4.0, "O48080242460604"),
        '7' => (4.0, "L084812"),
        '8' => (4.0, "C08484505 C05454202"),
        '9' => (4.0, "O02424808044446"),
        ':' => (0.0, "L0202 L0505"),
        ';' => (0.6, "L1201 L1515"),
        '<' => (3.0, "L370533"),
        '=' => (4.0, "L0444 L0646"),
        '>' => (3.0, "L073503"),
        '?' => (3.0, "O0708383515 L1514 L1212"),
        '@' => (4.0, "O424448080232 C16363414"),
        'A' => (4.0, "L022842 L1434"),
        'B' => (4.0, "L0208 O08484505 O05454202"),
        'C' => (4.0, "O474808024243"),
        'D' => (4.0, "L0208 O08484202"),
        'E' => (3.6, "L38080232 L0535"),
        'F' => (3.4, "L380802 L0535"),
        'G' => (4.0, "O474808024245 L4525"),
        'H' => (4.0, "L0208 L4248 L0545"),
        'I' => (0.0, "L0208"),
        'J' => (3.0, "O38320204"),
        'K' => (4.0, "L0208 L4804 L1542"),
        'L' => (3.4, "L080232"),
        'M' => (4.6, "L0208254842"),
        'N' => (4.0, "L02084248"),
        'O' => (4.0, "C08484202"),
        'P' => (4.0, "L0208 O08484404"),
        'Q' => (4.0, "C08484202 L2442"),
        'R' => (4.0, "L0208 O08484505 L2542"),
        'S' => (4.0, "O4748080545420203"),
        'T' => (4.0, "L0848 L2822"),
        'U' => (4.0, "O08024248"),
        'V' => (4.0, "L082248"),
        'W' => (4.6, "L0812263248"),
        'X' => (4.0, "L0248 L0842"),
        'Y' => (4.0, "L082548 L2522"),
        'Z' => (4.0, "L08480242"),
        '[' => (1.0, "L18080111"),
        '\\' => (3.0, "L0832"),
        ']' => (1.0, "L08181101"),
        '^' => (4.0, "L062846"),
        '_' => (4.0, "L0141"),
        '`' => (1.0, "L0817"),
        'a' => (3.0, "C06363202 L3632"),
        'b' => (3.0, "L0802 C06363202"),
        'c' => (3.0, "O36060232"),
        'd' => (3.0, "L3832 C06363202"),
        'e' => (3.0, "L0434 O3436060232"),
        'f' => (2.2, "O281815 L1512 L0626"),
        'g' => (3.0, "C06363202 O363000"),
        'h' => (3.0, "L0802 O04063632"),
        'i' => (0.0, "L0602 L0808"),
        'j' => (1.0, "O161000 L1818"),
        'k' => (3.0, "L0802 L3603 L1432"),
        'l' => (0.0, "L0802"),
        'm' => (4.4, "L0602 O04062622 O24264642"),
        'n' => (3.0, "L0602 O04063632"),
        'o' => (3.0, "C06363202"),
        'p' => (3.0, "L0600 C06363202"),
        'q' => (3.0, "L3630 C06363202"),
        'r' => (2.0, "L0602 O040626"),
        's' => (3.0, "O360604343202"),
        't' => (2.0, "L1813 O131222 L0626"),
        'u' => (3.0, "O06023236 L3632"),
        'v' => (4.0, "L062246"),
        'w' => (4.4, "L0612243246"),
        'x' => (3.0, "L0632 L0236"),
        'y' => (4.0, "L0622 L4610"),
        'z' => (3.0, "L06360232"),
        '{' => (2.0, "L28171605141221"),
        '|' => (0.0, "L0901"),
        '}' => (2.0, "L08171625141201"),
        '~' => (4.0, "O0405254546"),
        '×' => (3.4, "L0336 L0633"),
        '‘' | '’' => (0.0, "L0806"),
        '“' | '”' => (1.0, "L0806 L1816"),
        '—' => (5.0, "L0555"),
        '·' => (0.0, "L0505"),
        '°' => (2.0, "C08282606"),
        'µ' | 'μ' => (3.0, "L0600 O06023236 L3632"),
        'ß' => (4.0, "L0207 O0708383515 O1545422212"),
        'æ' => (6.0, "C06363202 L3632 L3464 O6466363262"),
        'Æ' => (6.0, "L0238 L68383262 L3555 L1535"),
        'œ' => (6.0, "C06363202 L3464 O6466363262"),
        'Œ' => (6.0, "C08383202 L68383262 L3555"),
        'ø' => (3.0, "C06363202 L0137"),
        'Ø' => (4.0, "C08484202 L0149"),
        'đ' => (3.0, "L3832 C06363202 L1747"),
        'Đ' | 'Ð' => (4.0, "L0208 O08484202 L0525"),
        'ð' => (3.0, "C06363202 L1836 L0727"),
        'þ' => (3.0, "L0800 C06363202"),
        'Þ' => (4.0, "L0208 O07474404"),
        'ł' => (2.0, "L1812 L0426"),
        'Ł' => (3.4, "L080232 L0426"),
        'ı' => (0.0, "L0602"),
        'ȷ' => (1.0, "O161000"),
        _ => (3.0, "L0208383202"),
    };
    Glyph(width, strokes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_printable_character_has_a_glyph_inside_its_cell() {
        let others = "×‘“—·°µßæÆœŒøØđĐðþÞłŁıȷ".chars();
        for c in (0x21..0x7fu8).map(char::from).chain(others) {
            let Glyph(width, path) = glyph(c);
            assert!(path != "L0208383202", "{c} has no glyph");
            for stroke in path.split(' ') {
                assert!(stroke.len() % 2 == 1 && stroke.len() >= 5, "{c}: {stroke}");
                let inside = |p: &DVec2| p.x <= width + 1.0 && (0.0..=9.0).contains(&p.y);
                assert!(points(stroke).iter().all(inside), "{c}: {stroke}");
            }
        }
    }

    #[test]
    fn glyphs_are_distinct() {
        let all: Vec<char> = (0x21..0x7fu8).map(char::from).collect();
        for (i, a) in all.iter().enumerate() {
            for b in &all[i + 1..] {
                let zero_and_o = *a == '0' && *b == 'O';
                assert!(zero_and_o || glyph(*a).1 != glyph(*b).1, "{a} and {b}");
            }
        }
    }

    #[test]
    fn accented_letters_are_as_wide_as_plain_ones_and_have_marks_over_or_under_them() {
        for (accented, plain) in
            [("Ä", "A"), ("é", "e"), ("ñ", "n"), ("Å", "A"), ("ř", "r"), ("î", "ı"), ("ž", "z")]
        {
            let (marked, bare) = (layout(accented), layout(plain));
            assert_eq!(marked.width, bare.width, "{accented}");
            let (letter, mark) = marked.strokes.split_at(bare.strokes.len());
            assert_eq!(letter, bare.strokes, "{accented}");
            let top = |strokes: &[Vec<DVec2>]| strokes.iter().flatten().map(|p| p.y).fold(f64::MIN, f64::max);
            let lowest = mark.iter().flatten().map(|p| p.y).fold(f64::MAX, f64::min);
            assert!(!mark.is_empty() && lowest > top(letter), "{accented}");
        }
        let cedilla = layout("ç").strokes;
        assert!(cedilla.iter().flatten().any(|p| p.y < 0.0) && layout("ç").width == layout("c").width);
        // Composed and decomposed names look the same; two marks stand over each other.
        assert_eq!(layout("ü").strokes, layout("u\u{308}").strokes);
        assert_eq!(layout("ấ").strokes.len(), layout("â").strokes.len() + 1);
    }

    #[test]
    fn text_is_laid_out_from_left_to_right() {
        assert_eq!(layout("").width, 0.0);
        let [one, two] = ["H", "HH"].map(|text| layout(text).width);
        assert!((two - 2.0 * one - SPACING / CAP_HEIGHT).abs() < 1e-12);
        let strokes = layout("T").strokes;
        assert_eq!(strokes[0], [DVec2::new(0.0, 1.0), DVec2::new(4.0 / 6.0, 1.0)]);
    }
}
