//! Colours of vertices and instances: linear RGB or RGBA.

use ::gltf::json::accessor::ComponentType;
use ::gltf::json::validation::Checked;
use glam::{Vec3, Vec4};

use super::accessor::{Accessor, Elements};
use crate::error::Warnings;

/// Numbers of components that a colour may have.
pub(super) const COMPONENTS: &[usize] = &[3, 4];

/// Largest plausible component of floats. Larger ones are bytes, as in OBJ files.
const MAX_COLOR: f32 = 10.0;

/// Deviations from 0 to 1 without a warning.
const ROUNDING: f32 = 1e-3;

/// Returns true for an accessor whose colours are normalized once they exceed 1.
pub(super) fn may_be_unmarked(accessor: &::gltf::json::Accessor) -> bool {
    let kind = match accessor.component_type {
        Checked::Valid(kind) => kind.0,
        Checked::Invalid => return true,
    };
    !accessor.normalized && matches!(kind, ComponentType::U8 | ComponentType::U16)
}

/// Warning of integer colours that are read as normalized.
pub(super) const UNMARKED: &str = "integer colours are not marked as normalized; used them as normalized";

/// Reads colours, from 0 to 1. Non-finite components become 1, which keeps the material's colour. Integers
/// stand for 0 to 1, even if the accessor is not marked as normalized, and so do floats from 0 to 255.
/// Others are clamped, as the specification requires.
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
        warnings.add(location, UNMARKED);
    }
    let mut replaced = 0usize;
    for color in colors.iter_mut().filter(|c| !c.is_finite()) {
        *color = Vec4::from(color.to_array().map(|x| if x.is_finite() { x } else { 1.0 }));
        replaced += 1;
    }
    if replaced > 0 {
        warnings.add(location, format_args!("{replaced} colours have non-finite components; used 1"));
    }
    if !matches!(accessor.component_type, ComponentType::U8 | ComponentType::U16 | ComponentType::U32) {
        clamp(&mut colors, location, warnings);
    }
    colors
}

/// Reads displacements of colours, and returns true if they are integers that had to be read as normalized.
/// Displacements of three components leave alpha.
pub(super) fn displacements(accessor: &Accessor<'_>, elements: Elements<'_>) -> (Vec<Vec4>, bool) {
    let read = |normalized: bool| match accessor.components {
        4 => accessor.floats_as(normalized, elements),
        _ => {
            let rgb: Vec<Vec3> = accessor.floats_as(normalized, elements);
            rgb.into_iter().map(|c| c.extend(0.0)).collect()
        }
    };
    let colors: Vec<Vec4> = read(accessor.normalized);
    let is_integer = accessor.component_type != ComponentType::F32;
    let is_unmarked =
        is_integer && !accessor.normalized && colors.iter().any(|c| c.abs().max_element() > 1.0);
    if is_unmarked { (read(true), true) } else { (colors, false) }
}

/// Scales bytes to 1 and clamps what is still out of range. All components are finite.
fn clamp(colors: &mut [Vec4], location: &str, warnings: &mut Warnings) {
    let extent = colors.iter().fold((Vec4::ZERO, Vec4::ZERO), |(min, max), c| (min.min(*c), max.max(*c)));
    let (min, max) = (extent.0.min_element(), extent.1.max_element());
    if min >= 0.0 && max <= 1.0 {
        return;
    }
    let are_bytes = || colors.iter().all(|c| c.fract() == Vec4::ZERO && c.min_element() >= 0.0);
    // Simplified meshes have averages of bytes.
    if max > 1.0 && max <= 255.0 && (max > MAX_COLOR || are_bytes()) {
        warnings.add(location, "colours exceed 1: read as bytes from 0 to 255");
        for color in &mut *colors {
            // A missing alpha is 1 in byte colours too.
            let alpha = if color.w > 1.0 { color.w / 255.0 } else { color.w };
            *color = (color.truncate() / 255.0).extend(alpha);
        }
    } else if max > 1.0 + ROUNDING {
        warnings.add(location, format_args!("colours have the value {max}, expected 0 to 1; used 1"));
    }
    if min < -ROUNDING {
        warnings.add(location, format_args!("colours have the value {min}, expected 0 to 1; used 0"));
    }
    colors.iter_mut().for_each(|c| *c = c.clamp(Vec4::ZERO, Vec4::ONE));
}

fn rgba(accessor: &Accessor<'_>, elements: Elements<'_>) -> Vec<Vec4> {
    match accessor.components {
        4 => accessor.floats(elements),
        _ => accessor.floats::<3, Vec3>(elements).into_iter().map(|c| c.extend(1.0)).collect(),
    }
}
