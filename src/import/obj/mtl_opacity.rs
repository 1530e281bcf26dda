//! The opacity of MTL materials. `d` is the opacity. `Tr` is 1 − d for some programs and d for others, and a third kind
//! writes the opacity as the fourth number of Kd, so that the statements of a file are judged together.

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

/// Returns the opacity of each of a file's materials from its statements.
pub(super) fn resolve(
    statements: &[OpacityStatements],
    writer: MtlWriter,
    place: &str,
    warnings: &mut Warnings,
) -> Vec<Option<f32>> {
    let tr_is_opacity = tr_is_opacity(statements, writer);
    // Constants that say nothing.
    let tr_is_constant = statements.iter().filter_map(|o| o.tr).all(|tr| tr == 0.0);
    let kd_is_padding = statements.iter().filter_map(|o| o.kd).all(|kd| kd == 0.0);
    let opacity = |&OpacityStatements { d, tr, tr_is_later, line, kd }: &OpacityStatements| {
        let tr = tr.map(|tr| if tr_is_opacity { tr } else { 1.0 - tr });
        match (d, tr) {
            (Some(d), Some(_)) if tr_is_constant => Some(d),
            (Some(d), Some(tr)) => {
                if (d - tr).abs() > SAME {
                    let line = format!("{place}, line {line}");
                    warnings.add(line, "both d and Tr are given: used the later one");
                }
                Some(if tr_is_later { tr } else { d })
            }
            (d, tr) => d.or(tr).or(kd.filter(|_| !kd_is_padding)),
        }
    };
    statements.iter().map(opacity).collect()
}

/// Returns true if `Tr` is the opacity, everywhere in a file: if `Tr 1` without `d` would hide a material, or if `Tr`
/// repeats `d`; else if the program is known to write it.
fn tr_is_opacity(statements: &[OpacityStatements], writer: MtlWriter) -> bool {
    let would_hide =
        statements.iter().any(|o| o.d.is_none() && o.tr.is_some_and(|tr| (tr - 1.0).abs() <= SAME));
    let both = || statements.iter().filter_map(|o| o.d.zip(o.tr));
    let repeats = |(d, tr): (f32, f32)| (d - tr).abs() <= SAME;
    let completes = |(d, tr): (f32, f32)| (d - (1.0 - tr)).abs() <= SAME;
    let all_repeat = both().any(|pair| !completes(pair)) && both().all(repeats);
    would_hide || all_repeat || matches!(writer, MtlWriter::Vtk | MtlWriter::Jmol)
}
