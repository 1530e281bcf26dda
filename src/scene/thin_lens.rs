//! The thin lens of a camera with a depth of field (Cook, Porter and Carpenter, “Distributed Ray Tracing”, SIGGRAPH 1984).

use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, TAU};

use glam::DVec2;

/// A lens with an aperture: only points at the distance in focus are sharp. Metres, radians.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct ThinLens {
    /// Radius of the aperture; that of the circle through its corners, if it is a polygon.
    pub aperture_radius: f64,
    /// Distance of the plane in focus along the view direction.
    pub focus_distance: f64,
    /// Number of corners of the aperture: 3 or more; else it is a disc.
    pub blades: u32,
    /// Counter-clockwise rotation of the polygon.
    pub rotation: f64,
    /// Height over width of the aperture: 2 makes highlights half as wide, as an anamorphic lens does.
    pub ratio: f64,
}

impl ThinLens {
    /// Returns a lens with a round aperture.
    pub fn round(aperture_radius: f64, focus_distance: f64) -> ThinLens {
        ThinLens { aperture_radius, focus_distance, blades: 0, rotation: 0.0, ratio: 1.0 }
    }

    /// Returns the point of the aperture, in metres to the right and upward, for a point of the unit square. Equal areas of the
    /// square are equal areas of the aperture.
    pub fn aperture_point(&self, [a, b]: [f32; 2]) -> DVec2 {
        let square = DVec2::new(f64::from(a), f64::from(b));
        let unit = if self.blades < 3 { disc_point(square) } else { self.polygon_point(square) };
        DVec2::new(unit.x / self.ratio, unit.y) * self.aperture_radius
    }

    /// Maps the unit square to a regular polygon with corners on the unit circle: a fan of triangles about the centre.
    fn polygon_point(&self, square: DVec2) -> DVec2 {
        let corners = f64::from(self.blades);
        let blade = (square.x * corners).floor();
        // Uniform barycentrics of a triangle.
        let from_centre = (square.x * corners - blade).sqrt();
        let along = square.y * from_centre;
        let corner = |k: f64| {
            let angle = self.rotation + (k - 0.5) * TAU / corners;
            DVec2::new(libm::cos(angle), libm::sin(angle))
        };
        corner(blade) * (from_centre - along) + corner(blade + 1.0) * along
    }
}

/// Maps the unit square to the unit disc by concentric squares (Shirley and Chiu, “A Low Distortion Map Between Disk and
/// Square”, 1997).
fn disc_point(square: DVec2) -> DVec2 {
    let DVec2 { x, y } = 2.0 * square - 1.0;
    if x == 0.0 && y == 0.0 {
        return DVec2::ZERO;
    }
    let (r, angle) =
        if x.abs() > y.abs() { (x, FRAC_PI_4 * (y / x)) } else { (y, FRAC_PI_2 - FRAC_PI_4 * (x / y)) };
    DVec2::new(libm::cos(angle), libm::sin(angle)) * r
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Mean of a function over the aperture, by points at the centres of a grid of the unit square.
    fn mean(lens: &ThinLens, f: impl Fn(DVec2) -> f64) -> f64 {
        const N: u32 = 256;
        let at = |i: u32| (i as f32 + 0.5) / N as f32;
        let points = (0..N * N).map(|i| lens.aperture_point([at(i % N), at(i / N)]));
        points.map(f).sum::<f64>() / f64::from(N * N)
    }

    #[test]
    fn a_disc_is_covered_evenly() {
        let lens = ThinLens::round(2.0, 1.0);
        assert!((mean(&lens, |p| p.length_squared()) - 2.0).abs() < 1e-3);
        assert!(mean(&lens, |p| p.x).abs() < 1e-3 && mean(&lens, |p| p.y).abs() < 1e-3);
        // A quarter of the area lies within half the radius.
        assert!((mean(&lens, |p| f64::from(p.length() < 1.0)) - 0.25).abs() < 5e-3);
    }

    #[test]
    fn a_polygon_is_covered_evenly_and_has_its_corners_on_the_circle() {
        for blades in 3..9 {
            let lens = ThinLens { blades, rotation: 0.3, ..ThinLens::round(1.0, 1.0) };
            let n = f64::from(blades);
            // The polar moment of a regular polygon over its area.
            let expected = 0.5 * (1.0 - 2.0 / 3.0 * libm::sin(std::f64::consts::PI / n).powi(2));
            assert!((mean(&lens, |p| p.length_squared()) - expected).abs() < 1e-3, "{blades}");
            let far = |[a, b]: [f32; 2]| lens.aperture_point([a, b]).length();
            assert!((far([1.0f32.next_down(), 0.0]) - 1.0).abs() < 1e-5);
            assert!(far([1.0f32.next_down(), 0.5]) < libm::cos(std::f64::consts::PI / n) + 1e-5);
        }
    }

    #[test]
    fn a_ratio_narrows_the_aperture() {
        let lens = ThinLens { ratio: 2.0, ..ThinLens::round(1.0, 1.0) };
        assert!((mean(&lens, |p| p.x * p.x) - 0.0625).abs() < 1e-3);
        assert!((mean(&lens, |p| p.y * p.y) - 0.25).abs() < 1e-3);
    }
}
