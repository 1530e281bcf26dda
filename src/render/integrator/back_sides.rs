//! The back sides of points that transmit light diffusely (KHR_materials_diffuse_transmission): paper, leaves, wax.
//!
//! Such a point is a matte surface for light from behind as well. Its back side is a shading point of its own, turned around,
//! whose k_d and k_a are what is transmitted. All light reaches it as it reaches others.

use glam::DVec3;

use crate::integrator::frame::Frame;
use crate::integrator::material::coefficients::{BaseTerms, Coefficients};
use crate::integrator::media::beer_lambert;
use crate::integrator::shading_batch::{BatchBuffers, ShadingBatch};
use crate::integrator::surface::shading_triangle::{MaterialTraits, ShadingTriangle};
use crate::integrator::surface::soa::{dvec3, set3, vec3};
use blinn_core::geometry::{HitId, Rgb};

/// The back sides of some points of a batch.
pub(crate) struct BackSides<'s> {
    pub batch: ShadingBatch<'s>,
    /// The index of each in the batch of the front sides.
    fronts: Vec<usize>,
}

impl<'s> BackSides<'s> {
    /// The back sides of the points of a batch that light shines through, before any light but k_a I_a; `None` if there are none.
    /// The shares of light of all layers are known.
    pub fn of(
        frame: &Frame,
        front: &ShadingBatch,
        base_radiance: impl Fn(BaseTerms, DVec3) -> Rgb,
    ) -> Option<BackSides<'s>> {
        let fronts: Vec<usize> =
            front.soa.layered_points().filter(|&i| front.transmitted(i) != Rgb::ZERO).collect();
        if fronts.is_empty() {
            return None;
        }
        let mut batch = ShadingBatch::new(&mut BatchBuffers::default());
        batch.spawns_at_triangles = front.spawns_at_triangles;
        batch.is_back = true;
        for &i in &fronts {
            let point = front.points[i];
            let (from, lane) = front.soa.lane(i);
            let n_g = -dvec3(&from.n_g, lane);
            let material = frame.posed.mesh(point.id.instance).material;
            let traits = MaterialTraits::new(&frame.posed.materials[material as usize]);
            let triangle = ShadingTriangle::with_traits(frame.posed, point.id, &traits);
            let b: glam::Vec3 = vec3(&from.b, lane);
            let k_d = front.transmitted(i);
            // Without a ray, the thickness of a body stands for the way through it.
            let k_a = k_d * frame.thickness_transmittance(point.id, -n_g);
            let k = Coefficients { k_a, k_d, ..Coefficients::matte(k_d, from.k.get(lane).opacity) };
            let n = -from.n(lane);
            let (to, at) = batch.soa.append(1);
            set3(&mut to.p, at, [from.p[0][lane], from.p[1][lane], from.p[2][lane]]);
            set3(&mut to.d, at, [from.d[0][lane], from.d[1][lane], from.d[2][lane]]);
            set3(&mut to.ray_origin, at, front.origin_behind(i).to_array());
            set3(&mut to.terminator_offset, at, triangle.terminator_offset(b, n_g).to_array());
            set3(&mut to.n_g, at, n_g.to_array());
            set3(&mut to.n_v, at, (-dvec3(&from.n_v, lane)).to_array());
            to.set_material(at, n, &k, base_radiance(k.base_terms(), n));
            batch.points.push(point);
        }
        Some(BackSides { batch, fronts })
    }

    /// Adds the light of the back sides to that of the points.
    pub fn add_to(&self, front: &mut ShadingBatch) {
        for (back, &i) in self.fronts.iter().enumerate() {
            front.add_light_of(i, &self.batch, back);
        }
    }
}

impl Frame<'_> {
    /// The share of light that is left behind the thickness of the body that triangle `id` belongs to, seen from the side of `n_g`;
    /// 1 from the inside, and for thin walls.
    fn thickness_transmittance(&self, id: HitId, n_g: DVec3) -> Rgb {
        match self.material(id).volume {
            Some(volume) if self.is_body(id) && self.is_front(id, n_g) => {
                beer_lambert(volume.absorption() * volume.thickness)
            }
            _ => Rgb::ONE,
        }
    }
}
