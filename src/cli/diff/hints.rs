//! Hints for scenes that are in other units or have another up axis.

use glam::DVec3;

use blinn_core::geometry::Aabb;
use blinn_scene::UpAxis;

/// Factors between metres, centimetres, millimetres, inches and feet.
const FACTORS: [f64; 8] = [1000.0, 100.0, 10.0, 25.4, 2.54, 12.0, 304.8, 30.48];
/// Largest distance of the corners of boxes that are the same, as a share of their size.
const NEAR: f64 = 1e-3;

/// The second scene, and how it is read.
#[derive(Clone, Copy)]
pub struct NewScene {
    pub bounds: Aabb,
    pub up: UpAxis,
    pub scale: f64,
}

/// Names the options with which the second scene has the bounds of the first one; `None` if it has them, or if none helps.
pub fn hint(old: &Aabb, new: NewScene) -> Option<String> {
    if old.is_empty() || new.bounds.is_empty() || is_near(old, &new.bounds) {
        return None;
    }
    let factors = || FACTORS.into_iter().flat_map(|factor| [factor, 1.0 / factor]);
    let of_scale = |bounds: Aabb| factors().find(|factor| is_near(old, &scaled(&bounds, *factor)));
    let turned = turned(&new.bounds, new.up);
    let (turns, factor) = if let Some(factor) = of_scale(new.bounds) {
        (false, factor)
    } else if is_near(old, &turned) {
        (true, 1.0)
    } else {
        (true, of_scale(turned)?)
    };
    let axis = match new.up {
        UpAxis::Y => "z",
        UpAxis::Z => "y",
    };
    let up = turns.then(|| ("has another up axis".to_string(), format!("--new-up {axis}")));
    let scale = (factor != 1.0).then(|| {
        let size = format!("is {} times as large", (1.0 / factor) as f32);
        (size, format!("--new-scale {}", (new.scale * factor) as f32))
    });
    let (facts, options): (Vec<String>, Vec<String>) = up.into_iter().chain(scale).unzip();
    Some(format!("the second scene {}: {}", facts.join(" and "), options.join(" ")))
}

fn scaled(bounds: &Aabb, factor: f64) -> Aabb {
    Aabb { min: bounds.min * factor, max: bounds.max * factor }
}

/// The bounds if the other axis of the file were up.
fn turned(bounds: &Aabb, up: UpAxis) -> Aabb {
    let z_up = UpAxis::Z.rotation();
    let rotation = match up {
        UpAxis::Y => z_up,
        UpAxis::Z => z_up.transpose(),
    };
    let (a, b): (DVec3, DVec3) = (rotation * bounds.min, rotation * bounds.max);
    Aabb { min: a.min(b), max: a.max(b) }
}

fn is_near(a: &Aabb, b: &Aabb) -> bool {
    let apart = (a.min - b.min).abs().max((a.max - b.max).abs()).max_element();
    apart <= NEAR * a.extent().max_element()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_and_axes_are_named() {
        let old = Aabb { min: DVec3::new(-40.0, -5.0, -25.0), max: DVec3::new(40.0, 30.0, 20.0) };
        let hint = |bounds: Aabb, up: UpAxis, scale: f64| hint(&old, NewScene { bounds, up, scale });
        assert_eq!(hint(old, UpAxis::Y, 1.0), None);
        assert_eq!(hint(scaled(&old, 0.9), UpAxis::Y, 1.0), None);
        let text = hint(scaled(&old, 0.001), UpAxis::Y, 1.0);
        assert_eq!(text.as_deref(), Some("the second scene is 0.001 times as large: --new-scale 1000"));
        let text = hint(scaled(&old, 1.0 / 25.4), UpAxis::Z, 0.001);
        let expected = "the second scene is 0.03937008 times as large: --new-scale 0.0254";
        assert_eq!(text.as_deref(), Some(expected));
        // Stored with z up, (x, y, z) is (x, -z, y).
        let stored = turned(&old, UpAxis::Z);
        assert_eq!((stored.min, stored.max), (DVec3::new(-40.0, -20.0, -5.0), DVec3::new(40.0, 25.0, 30.0)));
        let text = hint(stored, UpAxis::Y, 1.0);
        assert_eq!(text.as_deref(), Some("the second scene has another up axis: --new-up z"));
        let text = hint(scaled(&turned(&old, UpAxis::Y), 1000.0), UpAxis::Z, 1.0);
        let expected =
            "the second scene has another up axis and is 1000 times as large: --new-up y --new-scale 0.001";
        assert_eq!(text.as_deref(), Some(expected));
    }
}
