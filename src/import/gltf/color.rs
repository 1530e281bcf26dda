//! Colours of vertices and of copies: linear, three or four numbers each.

use ::gltf::json::accessor::ComponentType;
use glam::{Vec3, Vec4};

use super::accessor::{Accessor, Pick};
use crate::import::error::Warnings;

/// How many numbers a colour may have.
pub(super) const WIDTHS: &[usize] = &[3, 4];

/// Reads colours of one of [`WIDTHS`]; what is no number counts as 1, which leaves the material's colour as
/// it is. Integers stand for 0 to 1, also where the file forgets to say so.
pub(super) fn read(
    mut accessor: Accessor<'_>,
    pick: Pick<'_>,
    place: &str,
    warnings: &mut Warnings,
) -> Vec<Vec4> {
    let mut colors = numbers(&accessor, pick);
    let integers = matches!(accessor.component, ComponentType::U8 | ComponentType::U16);
    // Ones of 0 and 1 alone may mean it.
    if integers && !accessor.normalized && colors.iter().any(|c| c.max_element() > 1.0) {
        accessor.normalized = true;
        colors = numbers(&accessor, pick);
        warnings.add(place, "its integers are not said to be normalised, and were read as if they were");
    }
    let mut odd = 0usize;
    for color in colors.iter_mut().filter(|c| !c.is_finite()) {
        *color = Vec4::from(color.to_array().map(|x| if x.is_finite() { x } else { 1.0 }));
        odd += 1;
    }
    if odd > 0 {
        warnings
            .add(place, format_args!("{odd} of its colours have numbers that are not finite, taken as 1"));
    }
    colors
}

fn numbers(accessor: &Accessor<'_>, pick: Pick<'_>) -> Vec<Vec4> {
    match accessor.width {
        4 => accessor.floats(pick),
        _ => accessor.floats::<3, Vec3>(pick).into_iter().map(|c| c.extend(1.0)).collect(),
    }
}
