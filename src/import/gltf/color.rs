//! Colours of vertices and instances: linear RGB or RGBA.

use ::gltf::json::accessor::ComponentType;
use glam::{Vec3, Vec4};

use super::accessor::{Accessor, Elements};
use crate::import::error::Warnings;

/// Numbers of components that a colour may have.
pub(super) const COMPONENTS: &[usize] = &[3, 4];

/// Reads colours. Non-finite components become 1, which keeps the material's colour. Integers stand for 0 to
/// 1, even if the accessor is not marked as normalized.
pub(super) fn read(
    mut accessor: Accessor<'_>,
    elements: Elements<'_>,
    location: &str,
    warnings: &mut Warnings,
) -> Vec<Vec4> {
    let mut colors = rgba(&accessor, elements);
    let is_integer = matches!(accessor.component_type, ComponentType::U8 | ComponentType::U16);
    // Integers of 0 and 1 alone may be meant as such.
    if is_integer && !accessor.normalized && colors.iter().any(|c| c.max_element() > 1.0) {
        accessor.normalized = true;
        colors = rgba(&accessor, elements);
        warnings.add(location, "integer colours are not marked as normalized; used them as normalized");
    }
    let mut replaced = 0usize;
    for color in colors.iter_mut().filter(|c| !c.is_finite()) {
        *color = Vec4::from(color.to_array().map(|x| if x.is_finite() { x } else { 1.0 }));
        replaced += 1;
    }
    if replaced > 0 {
        warnings.add(location, format_args!("{replaced} colours have non-finite components; used 1"));
    }
    colors
}

fn rgba(accessor: &Accessor<'_>, elements: Elements<'_>) -> Vec<Vec4> {
    match accessor.components {
        4 => accessor.floats(elements),
        _ => accessor.floats::<3, Vec3>(elements).into_iter().map(|c| c.extend(1.0)).collect(),
    }
}
