//! Scales scenes to unit size, as datasets of many objects need.

use glam::{DMat4, DVec3};

use super::PosedScene;

/// The shape that a scene is fitted into, centred at the origin.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
pub enum UnitShape {
    /// A cube with sides of 1, by the scene's bounding box.
    Cube,
    /// A sphere of radius 1, by the scene's bounding sphere.
    Sphere,
}

/// A translation followed by a scaling: p ↦ `scale` (p − `centre`).
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Normalization {
    /// The point that becomes the origin.
    pub centre: DVec3,
    /// Units per metre. Positive.
    pub scale: f64,
}

impl Normalization {
    /// Changes nothing.
    pub const IDENTITY: Normalization = Normalization { centre: DVec3::ZERO, scale: 1.0 };

    /// Fits the bounds of a scene over its clip into a shape. A scene without extent is only moved.
    pub fn new(shape: UnitShape, posed: &PosedScene) -> Normalization {
        let (centre, size) = match shape {
            UnitShape::Cube => {
                let bounds = posed.clip_bounds();
                if bounds.is_empty() {
                    return Normalization::IDENTITY;
                }
                (bounds.centre(), bounds.extent().max_element())
            }
            UnitShape::Sphere => {
                let sphere = posed.clip_sphere();
                (sphere.centre, sphere.radius)
            }
        };
        let scale = 1.0 / size;
        let is_valid = scale > 0.0 && scale.is_finite() && centre.is_finite();
        Normalization { centre, scale: if is_valid { scale } else { 1.0 } }
    }

    /// The matrix of the inverse.
    pub fn inverse(&self) -> DMat4 {
        DMat4::from_scale_rotation_translation(
            DVec3::splat(1.0 / self.scale),
            Default::default(),
            self.centre,
        )
    }

    /// Transforms a point.
    pub fn point(&self, p: DVec3) -> DVec3 {
        (p - self.centre) * self.scale
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_inverse_undoes_it() {
        let normalization = Normalization { centre: DVec3::new(1.0, -2.0, 3.0), scale: 0.25 };
        let p = DVec3::new(5.0, 6.0, 7.0);
        assert_eq!(normalization.point(p), DVec3::new(1.0, 2.0, 1.0));
        assert!((normalization.inverse().transform_point3(normalization.point(p)) - p).length() < 1e-12);
        assert_eq!(Normalization::IDENTITY.point(p), p);
    }
}
