//! The colour space in which Blender's AgX works: E-Gamut, Rec.2020 and its inset primaries.
//!
//! [`agx`](super::agx) names the sources of the constants.

pub(super) type Matrix = [[f64; 3]; 3];

/// `config`: linear Rec.709 to linear FilmLight E-Gamut, through XYZ.
pub(super) const SCENE_TO_EGAMUT: [[f32; 3]; 3] = [
    [0.559_371_1, 0.304_783_34, 0.135_845_56],
    [0.076_220_706, 0.787_971_8, 0.135_807_47],
    [0.065_526_71, 0.164_546_76, 0.769_926_5],
];
pub(super) const MID_GREY: f64 = 0.18;
/// `eary`: range of the nodes, in stops around mid grey.
pub(super) const NODE_STOPS: [f64; 2] = [-10.0, 15.0];

/// `eary`: E-Gamut to Rec.2020, through XYZ.
pub(super) const EGAMUT_TO_REC2020: Matrix = [
    [1.1375888732024795, 0.008350502199667596, -0.14593224524702436],
    [-0.019087164934078887, 1.2153160485727783, -0.19624465667571286],
    [-0.09732562628887605, -0.10088823705990786, 1.1983626362736137],
];
/// `config` and `eary`: Rec.2020 with its primaries rotated (2.14°, −1.23°, −3.05°) and moved inwards
/// (by 0.330, 0.281, 0.125).
pub(super) const INSET: Matrix = [
    [0.856627153315983, 0.0951212405381588, 0.0482516061458583],
    [0.137318972929847, 0.761241990602591, 0.101439036467562],
    [0.11189821299995, 0.0767994186031903, 0.811302368396859],
];
/// `eary`: luminance weights of Rec.2020 for the 2015 colour matching functions.
const LUMA_REC2020: [f64; 3] = [0.2658180370250449, 0.59846986045365, 0.1357121025213052];

pub(super) fn mul(m: &Matrix, c: [f64; 3]) -> [f64; 3] {
    m.map(|row| dot(row, c))
}

pub(super) fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

pub(super) fn min_channel(c: [f64; 3]) -> f64 {
    c[0].min(c[1]).min(c[2])
}

/// Gamut guard rail: moves a colour outside Rec.2020 along grey until it is inside, then scales it to
/// its luminance. `eary`'s luminance, compensated by the opponent colour's, simplifies to 2 Y − min.
pub(super) fn guard_rec2020(c: [f64; 3]) -> [f64; 3] {
    let (low, luma) = (min_channel(c), dot(LUMA_REC2020, c));
    if low >= 0.0 {
        return c;
    }
    let ratio = (2.0 * luma - low) / (2.0 * (luma - low));
    c.map(|v| (v - low) * ratio)
}

/// Returns the light of the nodes along an axis.
pub(super) fn axis<const N: usize>() -> [f64; N] {
    let low = libm::log2(MID_GREY) + NODE_STOPS[0];
    let step = (NODE_STOPS[1] - NODE_STOPS[0]) / (N - 1) as f64;
    std::array::from_fn(|i| libm::exp2(low + step * i as f64))
}
