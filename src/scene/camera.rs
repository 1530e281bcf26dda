//! The lecture's camera, which generates eye rays and their differentials.

use glam::{DMat3, DVec2, DVec3};

use super::ThinLens;
use blinn_core::geometry::{Basis, Ray, RayDifferential};

/// How the view rectangle is projected.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
pub enum Projection {
    /// Every eye ray starts at the view point.
    Perspective,
    /// Every eye ray runs along the view direction.
    Orthographic,
}

/// Clipping planes perpendicular to the view direction, by their distances in metres.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct ClipPlanes {
    /// Nothing nearer is visible.
    pub near: f64,
    /// Nothing farther is visible. May be infinite.
    pub far: f64,
}

impl ClipPlanes {
    /// No clipping: everything in front of the view point is visible.
    pub const OFF: ClipPlanes = ClipPlanes { near: 0.0, far: f64::INFINITY };
}

/// The lecture's camera. World coordinates, metres.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Camera {
    /// View point e.
    pub view_point: DVec3,
    /// Basis u, v, w.
    pub basis: Basis,
    /// Width of the view rectangle.
    pub view_width: f64,
    /// Height of the view rectangle.
    pub view_height: f64,
    /// Centre of the view rectangle along u and v; 0 unless the principal point is off-centre.
    pub view_centre: DVec2,
    /// Projection distance d, from e to the view rectangle. 1 where it has no effect.
    pub proj_distance: f64,
    /// Perspective or orthographic.
    pub projection: Projection,
    /// Clipping planes.
    pub clip: ClipPlanes,
    /// The lens of a depth of field; `None` is a pinhole, which sees everything sharp.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub lens: Option<ThinLens>,
}

/// The eye rays of a camera through the centre of its lens.
#[derive(Clone, Copy, Debug)]
pub struct EyeRays {
    e: DVec3,
    u: DVec3,
    v: DVec3,
    /// d·w, or w of an orthographic camera.
    d: DVec3,
    /// l and b.
    low: DVec2,
    /// r − l and t − b.
    size: DVec2,
    projection: Projection,
}

impl EyeRays {
    /// Returns [`Camera::eye_ray`].
    #[inline]
    pub fn at(&self, x: f64, y: f64) -> Ray {
        let across = self.u * (self.low.x + self.size.x * x) + self.v * (self.low.y + self.size.y * y);
        let (o, d) = match self.projection {
            Projection::Perspective => (self.e, across - self.d),
            Projection::Orthographic => (self.e + across, -self.d),
        };
        Ray { o: o.as_vec3(), d: d.as_vec3() }
    }
}

impl Camera {
    /// Returns the eye ray through the centre of the lens and film position (x, y), relative to `centre`.
    ///
    /// Both coordinates are in 0…1, x to the right and y *upward*: pixel (i, j) of n_x by n_y has its
    /// centre at ((i + ½)/n_x, (j + ½)/n_y).
    ///
    /// With l, r = view_centre.x ∓ view_width/2 and b, t = view_centre.y ∓ view_height/2:
    /// `u = l + (r − l)·x`, `v = b + (t − b)·y`.
    /// - Perspective: `s = e + u·u + v·v − d·w`; origin e, direction s − e.
    /// - Orthographic: origin e + u·u + v·v, direction −w.
    #[inline]
    pub fn eye_ray(&self, x: f64, y: f64, centre: DVec3) -> Ray {
        self.eye_rays(centre).at(x, y)
    }

    /// Returns what all of [`Camera::eye_ray`] relative to `centre` share.
    #[inline]
    pub fn eye_rays(&self, centre: DVec3) -> EyeRays {
        let half_size = 0.5 * DVec2::new(self.view_width, self.view_height);
        let low = self.view_centre - half_size;
        EyeRays {
            e: self.view_point - centre,
            u: self.basis.u,
            v: self.basis.v,
            d: match self.projection {
                Projection::Perspective => self.basis.w * self.proj_distance,
                Projection::Orthographic => self.basis.w,
            },
            low,
            size: self.view_centre + half_size - low,
            projection: self.projection,
        }
    }

    /// Returns the eye ray through film position (x, y) and a point of the aperture, in metres to the right and upward from the
    /// centre of the lens. It meets [`Camera::eye_ray`] at the distance in focus, and has the same differential and the same
    /// depth per t. Without a lens it is the same ray.
    #[inline]
    pub fn lens_ray(&self, x: f64, y: f64, aperture: DVec2, centre: DVec3) -> Ray {
        let Ray { o, d } = self.eye_ray(x, y, centre);
        let Some(lens) = &self.lens else { return Ray { o, d } };
        let across = self.basis.u * aperture.x + self.basis.v * aperture.y;
        let turned = d.as_dvec3() - across * (self.depth_per_t() / lens.focus_distance);
        Ray { o: (o.as_dvec3() + across).as_vec3(), d: turned.as_vec3() }
    }

    /// Returns the differential of eye rays for a film step of `x` to the right and `y` upward, in the
    /// units of [`Camera::eye_ray`]. Eye rays are linear in both, so it is the same for all rays.
    pub fn ray_differential(&self, x: f64, y: f64) -> RayDifferential {
        let steps = [self.basis.u * (self.view_width * x), self.basis.v * (self.view_height * y)];
        match self.projection {
            Projection::Perspective => RayDifferential { o: [DVec3::ZERO; 2], d: steps },
            Projection::Orthographic => RayDifferential { o: steps, d: [DVec3::ZERO; 2] },
        }
    }

    /// Returns the coordinates of a world position along u, v and w, relative to the view point: the camera space of
    /// OpenGL and glTF, with x to the right, y upward and z backward.
    pub fn to_camera(&self, p: DVec3) -> DVec3 {
        let axes = DMat3::from_cols(self.basis.u, self.basis.v, self.basis.w);
        axes.inverse() * (p - self.view_point)
    }

    /// Returns the film position of a world position, in the units of [`Camera::eye_ray`]; `None` unless it is in front
    /// of the view point.
    pub fn project(&self, p: DVec3) -> Option<DVec2> {
        let p = self.to_camera(p);
        let scale = match self.projection {
            Projection::Perspective => self.proj_distance / -p.z,
            Projection::Orthographic => 1.0,
        };
        let size = DVec2::new(self.view_width, self.view_height);
        let film = (p.truncate() * scale - self.view_centre) / size + 0.5;
        (p.z < 0.0 && film.is_finite()).then_some(film)
    }

    /// Returns the radius of the circle that a point at this depth is blurred to, in heights of the picture: 0 without a lens. The
    /// depth may be infinite.
    pub fn circle_of_confusion(&self, depth: f64) -> f64 {
        let Some(lens) = self.lens else { return 0.0 };
        let at_view_rectangle = match self.projection {
            // |1/depth − 1/focus|, seen at the projection distance.
            Projection::Perspective => (1.0 / depth - 1.0 / lens.focus_distance).abs() * self.proj_distance,
            Projection::Orthographic => (1.0 - depth / lens.focus_distance).abs(),
        };
        lens.aperture_radius * at_view_rectangle / self.view_height
    }

    /// Returns this camera with 0 in place of −0.
    pub fn with_positive_zeros(&self) -> Camera {
        let Basis { u, v, w } = self.basis;
        let basis = Basis { u: u + 0.0, v: v + 0.0, w: w + 0.0 };
        let (view_point, view_centre) = (self.view_point + 0.0, self.view_centre + 0.0);
        Camera { view_point, basis, view_centre, ..*self }
    }

    /// Returns the depth along −w of one unit of an eye ray's t.
    pub fn depth_per_t(&self) -> f64 {
        match self.projection {
            Projection::Perspective => self.proj_distance,
            Projection::Orthographic => 1.0,
        }
    }
}
