//! A comparison as text and as JSON.

use serde_json::{Value, json};

use super::comparison::{Comparison, Heading};
use super::length::{LengthUnit, bounds_text, length_text};
use crate::info::inline;
use crate::plural::plural;
use blinn_output::compare::{DifferenceSummary, ElementKind, JsonDifference, ObjectChange, ObjectDifference};
use blinn_render::PixelRect;

/// Longest value that a line of text shows in full, in characters.
const MAX_VALUE: usize = 60;

/// The comparison as lines of text.
pub fn to_text(heading: &Heading, comparison: &Comparison) -> String {
    let Heading { old, new, .. } = heading;
    let verdict = if comparison.is_different() { "different" } else { "equal" };
    let mut out = format!("{verdict}: {} and {}\n", old.display(), new.display());
    if let Some(mismatch) = &comparison.mismatch {
        out += &format!("  {mismatch}\n");
    }
    for view in &comparison.views {
        let summary = &view.summary;
        if summary.changed == 0 {
            let noise = if view.noise > 0 { " but for noise" } else { "" };
            out += &format!("  {}: equal{noise}\n", view.name);
            continue;
        }
        let percent = 100.0 * summary.changed as f64 / (f64::from(view.width) * f64::from(view.height));
        let boxes: Vec<String> = summary.boxes.iter().take(4).map(rect_text).collect();
        let more = summary.boxes.len() + summary.more_boxes - boxes.len();
        let more = if more > 0 { format!(" and {more} more") } else { String::new() };
        out += &format!(
            "  {}: {} pixels ({percent:.2} %), {}, in {}{more}\n",
            view.name,
            summary.changed,
            amount_text(summary, heading.flip),
            boxes.join(" ")
        );
    }
    for object in &comparison.objects {
        let change = object_text(object, comparison.unit);
        let place = place_text(object, comparison.unit);
        out += &format!("  object '{}': {change}{place}\n", object.name);
    }
    if let Some(distance) = comparison.accepted_distance {
        let pictures = if comparison.ignores_pictures { "; pictures do not count" } else { "" };
        let distance = length_text(distance, comparison.unit);
        out += &format!("  surfaces up to {distance} apart are accepted{pictures}\n");
    }
    for property in &comparison.properties {
        out += &format!("  {}: {}\n", property.path, values_text(property));
    }
    for property in &comparison.information {
        out += &format!("  {}: {} (does not count)\n", property.path, values_text(property));
    }
    if let Some(hint) = &comparison.hint {
        out += &format!("  hint: {hint}\n");
    }
    out
}

/// The differences of two scenes on one line: `2 of 4 views, 1 object, 3 properties`.
pub fn summary(comparison: &Comparison) -> String {
    let Comparison { views, objects, properties, .. } = comparison;
    let changed =
        views.iter().filter(|view| view.summary.changed > 0 && !comparison.ignores_pictures).count();
    let has_contents = !comparison.pictures_decide;
    let properties = match properties.len() {
        1 => "1 property".into(),
        more => format!("{more} properties"),
    };
    joined([
        comparison.mismatch.clone(),
        (changed > 0).then(|| format!("{changed} of {}", plural(views.len() as u64, "view"))),
        (has_contents && !objects.is_empty()).then(|| plural(objects.len() as u64, "object")),
        (has_contents && !comparison.properties.is_empty()).then_some(properties),
    ])
}

/// The size of differences: `by up to 0.454`, or `FLIP mean 0.232, max 0.454`.
pub fn amount_text(summary: &DifferenceSummary, is_flip: bool) -> String {
    if is_flip {
        return format!("FLIP mean {:.3}, max {:.3}", summary.mean, summary.max);
    }
    // Light may differ by less than the display shows.
    if summary.max < 0.0005 {
        return "by less than 0.001".into();
    }
    format!("by up to {:.3}", summary.max)
}

fn rect_text(rect: &PixelRect) -> String {
    format!("{},{},{},{}", rect.x, rect.y, rect.width, rect.height)
}

/// The place of a change, where it is not the whole object.
fn place_text(object: &ObjectDifference, unit: LengthUnit) -> String {
    let has_place = match object.change {
        ObjectChange::Added { .. } | ObjectChange::Removed { .. } => false,
        ObjectChange::Rebuilt { surface_distance, .. } => surface_distance > 0.0,
        ObjectChange::Reversed { .. } => true,
        ObjectChange::Changed { moved, .. } => moved > 0,
    };
    if !has_place || object.bounds.is_empty() {
        return String::new();
    }
    format!(", {}", bounds_text(&object.bounds, unit))
}

/// Everything that changed of an object, as a part of a sentence.
pub fn object_text(object: &ObjectDifference, unit: LengthUnit) -> String {
    let renamed = object.renamed.as_ref().map(|name| format!("renamed to '{name}'"));
    let change = Some(change_text(&object.change, object.elements, unit)).filter(|change| !change.is_empty());
    joined([renamed, change])
}

/// A change of an object as a part of a sentence; empty if it has only another name.
fn change_text(change: &ObjectChange, elements: ElementKind, unit: LengthUnit) -> String {
    let counted = |count: u64| plural(count, elements.noun());
    match change {
        ObjectChange::Added { count } => format!("added, {}", counted(*count)),
        ObjectChange::Removed { count } => format!("removed, {}", counted(*count)),
        ObjectChange::Rebuilt { counts: [old, new], differing, surface_distance, attributes, material } => {
            let count = if old == new {
                let count = differing[0].max(differing[1]);
                format!("{count} of {} {}", counted(*new), if count == 1 { "differs" } else { "differ" })
            } else {
                format!("{old} → {}", counted(*new))
            };
            let (parts, place) = match elements {
                ElementKind::Triangles => ("surfaces", "on the same surface"),
                ElementKind::Points => ("points", "at the same places"),
                ElementKind::Lines => ("lines", "on the same lines"),
                ElementKind::Mixed => ("elements", "at the same places"),
            };
            let distance = if *surface_distance == 0.0 {
                place.to_string()
            } else {
                format!("{parts} up to {} apart", length_text(*surface_distance, unit))
            };
            joined([Some(count), Some(distance), attributes_text(*attributes), material_text(*material)])
        }
        ObjectChange::Reversed { triangles: count, attributes, material } => {
            let wind = if *count == 1 { "winds" } else { "wind" };
            let reversed = format!("{} {wind} the other way (front and back are swapped)", counted(*count));
            joined([Some(reversed), attributes_text(*attributes), material_text(*material)])
        }
        ObjectChange::Changed { moved, max_distance, attributes, material } => {
            let moved = (*moved > 0)
                .then(|| format!("{} moved by up to {}", counted(*moved), length_text(*max_distance, unit)));
            joined([moved, attributes_text(*attributes), material_text(*material)])
        }
    }
}

fn attributes_text(changed: bool) -> Option<String> {
    changed.then(|| "normals, texture coordinates or colours changed".into())
}

fn material_text(changed: bool) -> Option<String> {
    changed.then(|| "material changed".into())
}

fn joined<const N: usize>(parts: [Option<String>; N]) -> String {
    parts.into_iter().flatten().collect::<Vec<_>>().join(", ")
}

/// The old and the new value.
fn values_text(property: &JsonDifference) -> String {
    match (&property.old, &property.new) {
        (Some(old), Some(new)) => format!("{} → {}", value_text(old), value_text(new)),
        (Some(old), None) => format!("removed, {}", value_text(old)),
        (None, Some(new)) => format!("added, {}", value_text(new)),
        (None, None) => String::new(),
    }
}

/// A value on one line, shortened.
pub fn value_text(value: &Value) -> String {
    let text = inline(value);
    match text.char_indices().nth(MAX_VALUE) {
        Some((end, _)) => format!("{}…", &text[..end]),
        None => text,
    }
}

/// The comparison as JSON.
pub fn to_json(heading: &Heading, comparison: &Comparison) -> Value {
    let rect = |r: &PixelRect| json!({"x": r.x, "y": r.y, "width": r.width, "height": r.height});
    let views = comparison.views.iter().map(|view| {
        let summary = &view.summary;
        let objects = view.objects.iter().map(|(i, r)| {
            let name = comparison.objects.get(*i).map(|object| object.name.as_str());
            json!({"name": name, "box": rect(r)})
        });
        json!({
            "name": view.name,
            "width": view.width,
            "height": view.height,
            "changed_pixels": summary.changed,
            "noise_pixels": view.noise,
            "max": finite(summary.max),
            "mean": finite(summary.mean),
            "boxes": summary.boxes.iter().map(rect).collect::<Vec<_>>(),
            "more_boxes": summary.more_boxes,
            "objects": objects.collect::<Vec<_>>(),
        })
    });
    let property = |p: &JsonDifference| json!({"path": p.path, "old": p.old, "new": p.new});
    json!({
        "old": heading.old.to_string_lossy(),
        "new": heading.new.to_string_lossy(),
        "equal": !comparison.is_different(),
        "metric": if heading.flip { "flip" } else { "difference" },
        "tolerance": heading.tolerance,
        "mismatch": comparison.mismatch,
        "views": views.collect::<Vec<_>>(),
        "objects": comparison.objects.iter().map(object_json).collect::<Vec<_>>(),
        "properties": comparison.properties.iter().map(property).collect::<Vec<_>>(),
        "information": comparison.information.iter().map(property).collect::<Vec<_>>(),
        "hint": comparison.hint,
        "accepted_distance": comparison.accepted_distance,
        "pictures_count": !comparison.ignores_pictures,
        // The unit of distances and bounds.
        "length_unit": match comparison.unit {
            LengthUnit::Metre => Some("m"),
            LengthUnit::Unknown => None,
        },
        "up": "y",
    })
}

/// JSON has no infinity: a difference that is not finite is `null`.
fn finite(value: f64) -> Value {
    if value.is_finite() { json!(value) } else { Value::Null }
}

fn object_json(object: &ObjectDifference) -> Value {
    let corner = |v: glam::DVec3| if object.bounds.is_empty() { Value::Null } else { json!(v.to_array()) };
    let mut value = json!({
        "name": object.name,
        "renamed": object.renamed,
        "bounds": {"min": corner(object.bounds.min), "max": corner(object.bounds.max)},
    });
    // The names of counts say what is counted: `triangles`, `differing_points`, `moved_lines`.
    let elements = format!("{}s", object.elements.noun());
    let more = match &object.change {
        ObjectChange::Added { count } => json!({"change": "added", elements: count}),
        ObjectChange::Removed { count } => json!({"change": "removed", elements: count}),
        ObjectChange::Rebuilt { counts, differing, surface_distance, attributes, material } => json!({
            "change": "rebuilt",
            elements.clone(): counts,
            format!("differing_{elements}"): differing,
            "surface_distance": finite(*surface_distance),
            "attributes": attributes,
            "material": material,
        }),
        ObjectChange::Reversed { triangles, attributes, material } => json!({
            "change": "reversed",
            "triangles": triangles,
            "attributes": attributes,
            "material": material,
        }),
        ObjectChange::Changed { moved, max_distance, attributes, material } => json!({
            "change": "changed",
            format!("moved_{elements}"): moved,
            "max_distance": finite(*max_distance),
            "attributes": attributes,
            "material": material,
        }),
    };
    if let (Value::Object(value), Value::Object(more)) = (&mut value, more) {
        value.extend(more);
    }
    value
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn changes_are_described_in_words() {
        let change_text = |change: &ObjectChange, elements| change_text(change, elements, LengthUnit::Metre);
        let changed = |moved, attributes, material| {
            let change = ObjectChange::Changed { moved, max_distance: 0.001, attributes, material };
            change_text(&change, ElementKind::Triangles)
        };
        assert_eq!(changed(1, false, false), "1 triangle moved by up to 1.0 mm");
        assert_eq!(
            changed(0, true, true),
            "normals, texture coordinates or colours changed, material changed"
        );
        let rebuilt = |counts, differing, surface_distance, material| {
            let change =
                ObjectChange::Rebuilt { counts, differing, surface_distance, attributes: false, material };
            change_text(&change, ElementKind::Triangles)
        };
        assert_eq!(rebuilt([3, 2], [2, 1], 0.0, false), "3 → 2 triangles, on the same surface");
        assert_eq!(
            rebuilt([9, 9], [1, 1], 0.001, true),
            "1 of 9 triangles differs, surfaces up to 1.0 mm apart, material changed"
        );
        let reversed = ObjectChange::Reversed { triangles: 2, attributes: false, material: true };
        assert_eq!(
            change_text(&reversed, ElementKind::Triangles),
            "2 triangles wind the other way (front and back are swapped), material changed"
        );
        let added = |elements| change_text(&ObjectChange::Added { count: 1 }, elements);
        assert_eq!(added(ElementKind::Triangles), "added, 1 triangle");
        assert_eq!(added(ElementKind::Points), "added, 1 point");
        let moved =
            ObjectChange::Changed { moved: 2, max_distance: 0.001, attributes: false, material: false };
        assert_eq!(change_text(&moved, ElementKind::Lines), "2 lines moved by up to 1.0 mm");
        let rebuilt = ObjectChange::Rebuilt {
            counts: [3, 2],
            differing: [2, 1],
            surface_distance: 0.001,
            attributes: false,
            material: false,
        };
        assert_eq!(change_text(&rebuilt, ElementKind::Points), "3 → 2 points, points up to 1.0 mm apart");
        assert_eq!(change_text(&rebuilt, ElementKind::Mixed), "3 → 2 elements, elements up to 1.0 mm apart");
    }

    #[test]
    fn differences_are_counted_on_one_line() {
        let property = JsonDifference { path: "lights".into(), old: None, new: None };
        let object = ObjectDifference {
            name: "sheet".into(),
            renamed: None,
            elements: ElementKind::Points,
            bounds: Default::default(),
            change: ObjectChange::Added { count: 1 },
        };
        let mut comparison = Comparison { objects: vec![object], ..Comparison::default() };
        assert_eq!(summary(&comparison), "1 object");
        comparison.properties = vec![property.clone()];
        assert_eq!(summary(&comparison), "1 object, 1 property");
        comparison.properties.push(property);
        assert_eq!(summary(&comparison), "1 object, 2 properties");
    }

    #[test]
    fn long_values_are_shortened() {
        let long = value_text(&json!("é".repeat(100)));
        assert_eq!(long.chars().count(), MAX_VALUE + 1);
        assert_eq!(value_text(&json!({"a": "b\nc", "base": [0.1f32, 1.0]})), "a b c, base 0.1 1");
    }
}
