//! The opacity of MTL materials. `d` is the opacity. `Tr` is 1 − d for some programs and d for others, and a third kind
//! writes the opacity as the fourth number of Kd, so that the statements of a file are judged together.

use super::mtl::MtlMaterial;
use super::mtl_writer::MtlWriter;
use crate::error::Warnings;

/// The statements of a material about its opacity.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct OpacityStatements {
    pub d: Option<f32>,
    pub tr: Option<f32>,
    /// True if `Tr` follows `d`.
    pub tr_is_later: bool,
    /// Line of the later of them.
    pub line: u64,
    /// Fourth number of Kd.
    pub kd: Option<f32>,
}

/// Largest difference of values that mean the same: 3ds Max writes four decimals.
const SAME: f32 = 1e-3;

/// Sets the opacities of a file's materials.
pub(super) fn resolve(
    materials: &mut [MtlMaterial],
    writer: MtlWriter,
    place: &str,
    warnings: &mut Warnings,
) {
    let all = || materials.iter().map(|material| material.opacity);
    let tr_is_opacity = tr_is_opacity(&all, writer);
    // Constants that say nothing.
    let tr_is_constant = all().filter_map(|o| o.tr).all(|tr| tr == 0.0);
    let kd_is_padding = all().filter_map(|o| o.kd).all(|kd| kd == 0.0);
    for material in materials {
        let OpacityStatements { d, tr, tr_is_later, line, kd } = material.opacity;
        let tr = tr.map(|tr| if tr_is_opacity { tr } else { 1.0 - tr });
        material.d = match (d, tr) {
            (Some(d), Some(_)) if tr_is_constant => Some(d),
            (Some(d), Some(tr)) => {
                if (d - tr).abs() > SAME {
                    let line = format!("{place}, line {line}");
                    warnings.add(line, "both d and Tr are given: used the later one");
                }
                Some(if tr_is_later { tr } else { d })
            }
            (d, tr) => d.or(tr).or(kd.filter(|_| !kd_is_padding)),
        };
    }
}

/// Returns true if `Tr` is the opacity, everywhere in a file: if `Tr 1` without `d` would hide a material, or if `Tr`
/// repeats `d`; else if the program is known to write it.
fn tr_is_opacity<I: Iterator<Item = OpacityStatements>>(all: &impl Fn() -> I, writer: MtlWriter) -> bool {
    let would_hide = all().any(|o| o.d.is_none() && o.tr.is_some_and(|tr| (tr - 1.0).abs() <= SAME));
    let both = || all().filter_map(|o| o.d.zip(o.tr));
    let repeats = |(d, tr): (f32, f32)| (d - tr).abs() <= SAME;
    let completes = |(d, tr): (f32, f32)| (d - (1.0 - tr)).abs() <= SAME;
    let all_repeat = both().any(|pair| !completes(pair)) && both().all(repeats);
    would_hide || all_repeat || matches!(writer, MtlWriter::Vtk | MtlWriter::Jmol)
}

#[cfg(test)]
mod tests {
    use super::super::mtl::{self, MtlContext};
    use super::*;

    /// The opacities of all materials, and the number of warnings.
    fn opacities(text: &str) -> (Vec<Option<f32>>, usize) {
        let mut warnings = Warnings::default();
        let materials = mtl::parse(text, "a.mtl", "", MtlContext::default(), &mut warnings);
        (materials.iter().map(|m| m.d).collect(), warnings.into_vec().len())
    }

    #[test]
    fn statements_of_a_file_are_judged_together() {
        let meshlab = "#\n# Converted by Meshlab Group\n#\n";
        let jmol = "# Created by Jmol 14.32.83\n";
        for (text, expected) in [
            // `Tr 1` would hide what is opaque.
            ("newmtl a\nTr .25\nnewmtl b\nTr 1\n", vec![Some(0.25), Some(1.0)]),
            (&format!("{meshlab}newmtl a\nTr .25\nnewmtl b\nTr 1\n"), vec![Some(0.25), Some(1.0)]),
            (&format!("{meshlab}newmtl a\nTr .25\nnewmtl b\nTr 0\n"), vec![Some(0.75), Some(1.0)]),
            (&format!("{meshlab}newmtl a\nTr .25\n"), vec![Some(0.75)]),
            (&format!("{jmol}newmtl a\nTr .25\n"), vec![Some(0.25)]),
            // With `d`, the file says what `Tr` is.
            ("newmtl a\nd .25\nTr .25\nnewmtl b\nTr .1\n", vec![Some(0.25), Some(0.1)]),
            ("newmtl a\nd .25\nTr .75\nnewmtl b\nTr .1\n", vec![Some(0.25), Some(0.9)]),
            ("newmtl a\nd 1\nTr 1\n", vec![Some(1.0)]),
            // A constant beside `d` says nothing.
            ("newmtl a\nd .6\nTr 0\nnewmtl b\nTr 0\nd .3\n", vec![Some(0.6), Some(0.3)]),
            // The fourth number of Kd, unless another statement gives the opacity, or it is always 0.
            ("newmtl a\nKd 1 1 1 .4\nnewmtl b\nKd 1 1 1 .4\nd .5\n", vec![Some(0.4), Some(0.5)]),
            ("newmtl a\nKd 1 1 1 .4\nnewmtl b\nKd 1 1 1 0\n", vec![Some(0.4), Some(0.0)]),
            ("newmtl a\nKd 1 1 1 0\nnewmtl b\nKd 1 0 1\n", vec![None, None]),
            ("newmtl a\nKd 1 1 1 2\nnewmtl b\nKd 1 1 1 x\n", vec![None, None]),
        ] {
            assert_eq!(opacities(text).0, expected, "{text}");
        }
        assert_eq!(opacities("newmtl a\nd .5\nTr .25\n"), (vec![Some(0.75)], 1));
        assert_eq!(opacities("newmtl a\nTr .25\nd .5\n"), (vec![Some(0.5)], 1));
    }
}
