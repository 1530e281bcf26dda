//! Display colours of Blender's OpenColorIO configuration, written by `docs/scripts/view_reference.py`.

/// A scene-linear Rec.709 colour, and the sRGB-encoded colour that the view shows for it.
pub(super) struct Reference {
    pub linear: [f32; 3],
    pub encoded: [f32; 3],
}

pub(super) fn agx() -> Vec<Reference> {
    parse(include_str!("testdata/agx.csv"))
}

pub(super) fn filmic() -> Vec<Reference> {
    parse(include_str!("testdata/filmic.csv"))
}

pub(super) fn neutral() -> Vec<Reference> {
    parse(include_str!("testdata/neutral.csv"))
}

/// Colours with Blender's names of the looks of AgX that they are shown with.
pub(super) fn looks() -> Vec<(&'static str, Reference)> {
    let csv: &'static str = include_str!("testdata/looks.csv");
    let row = |line: &'static str| {
        let (look, numbers) = line.split_once(',').unwrap();
        (look, parse_line(numbers))
    };
    csv.lines().map(row).collect()
}

/// Colours with Blender's names of the views and of Filmic's looks that they are shown with.
pub(super) fn filmic_looks() -> Vec<(&'static str, &'static str, Reference)> {
    let csv: &'static str = include_str!("testdata/filmic_looks.csv");
    let row = |line: &'static str| {
        let (view, rest) = line.split_once(',').unwrap();
        let (look, numbers) = rest.split_once(',').unwrap();
        (view, look, parse_line(numbers))
    };
    csv.lines().map(row).collect()
}

/// Reads lines of six numbers: linear r, g, b, encoded r, g, b.
fn parse(csv: &str) -> Vec<Reference> {
    let rows: Vec<Reference> = csv.lines().map(parse_line).collect();
    assert!(rows.len() >= 10, "{} reference colours", rows.len());
    rows
}

fn parse_line(line: &str) -> Reference {
    let numbers: Vec<f32> = line.split(',').map(|number| number.parse().unwrap()).collect();
    let &[r, g, b, ref encoded @ ..] = &numbers[..] else { panic!("{line}") };
    Reference { linear: [r, g, b], encoded: encoded.try_into().unwrap() }
}
