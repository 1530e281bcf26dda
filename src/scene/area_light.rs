//! Area lights: rectangles and discs that emit on one side, as files describe them and posed in the world.

use glam::{DAffine3, DVec3, Vec3};

use blinn_core::geometry::Rgb;

/// The outline of an area light.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AreaLightShape {
    /// A rectangle.
    Rect,
    /// An ellipse.
    Disk,
}

impl AreaLightShape {
    /// Returns the name of the shape in `EXT_lights_area`.
    pub fn name(self) -> &'static str {
        match self {
            AreaLightShape::Rect => "rect",
            AreaLightShape::Disk => "disk",
        }
    }
}

/// An area light of the file. It lies in the xy plane of its node and emits along −Z.
#[derive(Clone, Debug, PartialEq)]
pub struct AreaLight {
    /// Name in the file.
    pub name: String,
    /// Node that places it. Of the node's scale, the largest component scales both sides.
    pub node: u32,
    /// Outline.
    pub shape: AreaLightShape,
    /// Width along x and height along y, in metres; of a disc, its diameters.
    pub size: [f32; 2],
    /// Linear colour.
    pub color: Rgb,
    /// Emitted radiance in the file's unit: nits.
    pub intensity: f32,
}

/// A posed area light: Lambertian, and dark from behind. Positions are relative to the posed scene's centre.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PosedAreaLight {
    /// Outline.
    pub shape: AreaLightShape,
    /// Centre.
    pub centre: Vec3,
    /// From the centre to the middle of the right edge, in metres.
    pub half_x: Vec3,
    /// From the centre to the middle of the upper edge, perpendicular to `half_x`.
    pub half_y: Vec3,
    /// Unit normal of the side that emits.
    pub normal: Vec3,
    /// Emitted radiance.
    pub radiance: Rgb,
}

impl PosedAreaLight {
    /// Poses a light of `size` (width and height in metres) with a node's transform, which is relative to the centre of the
    /// scene. `None` if the light has no area.
    pub fn new(
        shape: AreaLightShape,
        size: [f32; 2],
        node: &DAffine3,
        radiance: Rgb,
    ) -> Option<PosedAreaLight> {
        let m = node.matrix3;
        let scale = [m.x_axis, m.y_axis, m.z_axis].map(DVec3::length).into_iter().fold(0.0, f64::max);
        // A node's transform may shear or mirror; the light stays a rectangle that emits along −Z.
        let z = m.z_axis.try_normalize()?;
        let y = m.y_axis.reject_from_normalized(z).try_normalize()?;
        let x = y.cross(z);
        let half = |axis: DVec3, size: f32| (axis * (0.5 * scale * f64::from(size))).as_vec3();
        let light = PosedAreaLight {
            shape,
            centre: node.translation.as_vec3(),
            half_x: half(x, size[0]),
            half_y: half(y, size[1]),
            normal: (-z).as_vec3(),
            radiance,
        };
        (light.area() > 0.0 && light.area().is_finite() && light.centre.is_finite()).then_some(light)
    }

    /// Returns a light at `centre` that emits along `direction`. `None` if it has no area or no direction.
    pub fn facing(
        shape: AreaLightShape,
        size: [f32; 2],
        centre: DVec3,
        direction: DVec3,
        radiance: Rgb,
    ) -> Option<PosedAreaLight> {
        let z = -direction.try_normalize()?;
        let up = if z.y.abs() < 0.999 { DVec3::Y } else { DVec3::Z };
        let x = up.cross(z).try_normalize()?;
        let matrix3 = glam::DMat3::from_cols(x, z.cross(x), z);
        PosedAreaLight::new(shape, size, &DAffine3 { matrix3, translation: centre }, radiance)
    }

    /// Returns the area in square metres.
    pub fn area(&self) -> f32 {
        let sides = 4.0 * self.half_x.length() * self.half_y.length();
        match self.shape {
            AreaLightShape::Rect => sides,
            AreaLightShape::Disk => sides * std::f32::consts::FRAC_PI_4,
        }
    }

    /// Returns the emitted power by colour: π · area · radiance.
    pub fn power(&self) -> Rgb {
        self.radiance * (std::f32::consts::PI * self.area())
    }

    /// Returns this light moved by a rigid motion, in a scene with that centre.
    pub fn transformed(&self, motion: &DAffine3, centre: DVec3) -> PosedAreaLight {
        let direction = |d: Vec3| (motion.matrix3 * d.as_dvec3()).as_vec3();
        PosedAreaLight {
            centre: (motion.transform_point3(self.centre.as_dvec3() + centre) - centre).as_vec3(),
            half_x: direction(self.half_x),
            half_y: direction(self.half_y),
            normal: direction(self.normal),
            ..*self
        }
    }

    /// Returns the distance along the ray from `o` in the unit direction `d` at which it meets the side that emits.
    pub fn intersect(&self, o: Vec3, d: Vec3) -> Option<f32> {
        let towards = -d.dot(self.normal);
        if !(towards > 0.0) {
            return None;
        }
        let t = (o - self.centre).dot(self.normal) / towards;
        if !(t > 0.0) {
            return None;
        }
        let offset = o + d * t - self.centre;
        let x = offset.dot(self.half_x) / self.half_x.length_squared();
        let y = offset.dot(self.half_y) / self.half_y.length_squared();
        let inside = match self.shape {
            AreaLightShape::Rect => x.abs() <= 1.0 && y.abs() <= 1.0,
            AreaLightShape::Disk => x * x + y * y <= 1.0,
        };
        inside.then_some(t)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{DMat3, DQuat};

    fn posed(shape: AreaLightShape, size: [f32; 2], matrix3: DMat3) -> PosedAreaLight {
        let node = DAffine3 { matrix3, translation: DVec3::new(0.0, 0.0, 5.0) };
        PosedAreaLight::new(shape, size, &node, Rgb::splat(2.0)).unwrap()
    }

    #[test]
    fn the_largest_scale_counts_for_both_sides() {
        let scale = DMat3::from_diagonal(DVec3::new(0.5, 1.0, -3.0));
        let light = posed(AreaLightShape::Rect, [2.0, 1.0], scale);
        assert_eq!((light.half_x.length(), light.half_y.length()), (3.0, 1.5));
        assert_eq!((light.area(), light.power()), (18.0, Rgb::splat(36.0 * std::f32::consts::PI)));
        let disk = posed(AreaLightShape::Disk, [2.0, 2.0], DMat3::IDENTITY);
        assert!((disk.area() - std::f32::consts::PI).abs() < 1e-6);
    }

    #[test]
    fn sheared_and_mirrored_nodes_keep_rectangles_that_emit_along_their_z() {
        let turn = DMat3::from_quat(DQuat::from_rotation_y(0.7));
        let shear = DMat3::from_cols(DVec3::X, DVec3::new(0.5, 1.0, 0.4), DVec3::new(0.2, 0.0, 1.0));
        for matrix3 in [turn, turn * shear, turn * DMat3::from_diagonal(DVec3::new(-1.0, 1.0, 1.0)), -turn] {
            let light = posed(AreaLightShape::Rect, [2.0, 1.0], matrix3);
            let down = -matrix3.z_axis.normalize().as_vec3();
            assert!(light.normal.abs_diff_eq(down, 1e-6), "{matrix3}");
            assert!(light.half_x.dot(light.half_y).abs() < 1e-6, "{matrix3}");
            assert!(light.half_x.dot(light.normal).abs() < 1e-6, "{matrix3}");
            assert!(light.half_y.dot(light.normal).abs() < 1e-6, "{matrix3}");
            assert!((light.half_x.length() / light.half_y.length() - 2.0).abs() < 1e-5, "{matrix3}");
        }
    }

    #[test]
    fn nodes_that_leave_no_area_have_no_light() {
        let light = |matrix3, size, centre| {
            let node = DAffine3 { matrix3, translation: centre };
            PosedAreaLight::new(AreaLightShape::Rect, size, &node, Rgb::ONE)
        };
        let flat = DMat3::from_diagonal(DVec3::new(1.0, 1.0, 0.0));
        let line = DMat3::from_cols(DVec3::X, DVec3::Z, DVec3::Z);
        for matrix3 in [DMat3::ZERO, flat, line, DMat3::NAN, DMat3::from_diagonal(DVec3::splat(1e300))] {
            assert_eq!(light(matrix3, [1.0; 2], DVec3::ZERO), None, "{matrix3}");
        }
        for size in [[0.0, 1.0], [f32::INFINITY, 1.0], [f32::NAN, 1.0], [f32::MAX, f32::MAX]] {
            assert_eq!(light(DMat3::IDENTITY, size, DVec3::ZERO), None, "{size:?}");
        }
        assert_eq!(light(DMat3::IDENTITY, [1.0; 2], DVec3::NAN), None);
        assert!(light(DMat3::IDENTITY, [1.0; 2], DVec3::ZERO).is_some());
    }

    #[test]
    fn rays_meet_only_the_side_that_emits() {
        let rect = posed(AreaLightShape::Rect, [2.0, 4.0], DMat3::IDENTITY);
        let disk = posed(AreaLightShape::Disk, [2.0, 4.0], DMat3::IDENTITY);
        let up = |light: &PosedAreaLight, x, y| light.intersect(Vec3::new(x, y, 1.0), Vec3::Z);
        assert_eq!((up(&rect, 0.9, 1.9), up(&rect, 1.1, 0.0), up(&rect, 0.0, -2.1)), (Some(4.0), None, None));
        assert_eq!(
            (up(&disk, 0.0, 1.9), up(&disk, 0.9, 1.9), up(&disk, 0.9, 0.0)),
            (Some(4.0), None, Some(4.0))
        );
        for light in [rect, disk] {
            assert_eq!(light.intersect(Vec3::new(0.0, 0.0, 9.0), Vec3::NEG_Z), None, "from behind");
            assert_eq!(light.intersect(Vec3::new(0.0, 0.0, 9.0), Vec3::Z), None, "away from it");
            assert_eq!(light.intersect(Vec3::ZERO, Vec3::X), None, "along it");
            assert_eq!(light.intersect(Vec3::ZERO, Vec3::NEG_Z), None, "away from its front");
        }
    }

    #[test]
    fn lights_face_their_direction_with_a_horizontal_lower_edge() {
        for direction in [DVec3::NEG_Y, DVec3::Y, DVec3::new(1.0, -2.0, 0.5), DVec3::X] {
            let size = [3.0, 1.0];
            let light =
                PosedAreaLight::facing(AreaLightShape::Rect, size, DVec3::ONE, direction, Rgb::ONE).unwrap();
            assert!(light.normal.abs_diff_eq(direction.normalize().as_vec3(), 1e-6), "{direction}");
            assert!(light.half_x.y.abs() < 1e-6 && (light.half_x.length() - 1.5).abs() < 1e-6, "{direction}");
        }
        let nowhere =
            PosedAreaLight::facing(AreaLightShape::Rect, [1.0; 2], DVec3::ONE, DVec3::ZERO, Rgb::ONE);
        assert_eq!(nowhere, None);
    }

    #[test]
    fn motions_move_lights_about_the_centre_of_the_scene() {
        let light = posed(AreaLightShape::Rect, [2.0, 4.0], DMat3::IDENTITY);
        let centre = DVec3::new(1.0, 0.0, 0.0);
        let moved = light.transformed(&DAffine3::from_rotation_y(std::f64::consts::FRAC_PI_2), centre);
        assert!(moved.centre.abs_diff_eq(Vec3::new(4.0, 0.0, -1.0), 1e-6), "{}", moved.centre);
        assert!(moved.normal.abs_diff_eq(Vec3::NEG_X, 1e-6) && (moved.area() - light.area()).abs() < 1e-5);
    }
}
