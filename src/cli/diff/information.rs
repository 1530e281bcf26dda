//! Differences of properties that do not make scenes different.

use blinn_output::compare::JsonDifference;
use serde_json::Value;

/// Rounding errors of bounds, as a share of their coordinates.
const ROUNDING_ERROR: f64 = 4.0 * f32::EPSILON as f64;

/// Returns true for the name of the generator, and for bounds that are apart by no more than their precision. With a
/// tolerance of distances, also for numbers of triangles, points and lines, and for bounds within the tolerance.
pub fn is_information(difference: &JsonDifference, tolerance: Option<f64>) -> bool {
    match difference.path.as_str() {
        "generator" => true,
        "triangles" | "triangles_stored" | "triangles_without_area" | "points" | "lines" => {
            tolerance.is_some()
        }
        "bounds.min" | "bounds.max" => {
            let (old, new) = (coordinates(&difference.old), coordinates(&difference.new));
            let is_near = |(a, b): (&f64, &f64)| {
                let precision = ROUNDING_ERROR * a.abs().max(b.abs());
                (a - b).abs() <= tolerance.unwrap_or(0.0).max(precision)
            };
            old.len() == 3 && new.len() == 3 && old.iter().zip(&new).all(is_near)
        }
        _ => false,
    }
}

fn coordinates(value: &Option<Value>) -> Vec<f64> {
    let list = value.as_ref().and_then(Value::as_array);
    list.into_iter().flatten().filter_map(Value::as_f64).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn names_of_generators_and_rounding_are_information() {
        let is_information = |path: &str, old: Value, new: Value, tolerance| {
            is_information(&JsonDifference { path: path.into(), old: Some(old), new: Some(new) }, tolerance)
        };
        assert!(is_information("generator", json!("a"), json!("b"), None));
        assert!(!is_information("format", json!("STL"), json!("glTF"), Some(1.0)));
        assert!(!is_information("triangles", json!(1), json!(2), None));
        assert!(is_information("triangles", json!(1), json!(2), Some(0.0)));
        assert!(is_information("points", json!(1), json!(2), Some(0.0)));
        let bounds = |x: f64| json!([x, -5.0, 25.0]);
        assert!(is_information("bounds.min", bounds(-40.0), bounds(-39.999_999), None));
        assert!(!is_information("bounds.min", bounds(-40.0), bounds(-40.0006), None));
        assert!(is_information("bounds.min", bounds(-40.0), bounds(-40.0006), Some(0.001)));
        assert!(!is_information("bounds.min", json!(null), bounds(0.0), Some(0.001)));
    }
}
