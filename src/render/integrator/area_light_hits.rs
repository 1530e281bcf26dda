//! Area lights that secondary rays meet.

use glam::{DVec3, Vec3};

use crate::integrator::frame::Frame;
use crate::integrator::material::ggx::MIRROR_ALPHA;
use crate::integrator::material::highlight_lobe::reflection_pdf;
use crate::integrator::paths::AreaLightHits;
use blinn_core::geometry::Rgb;

/// An area light that a secondary ray meets.
pub(crate) struct AreaLightHit {
    /// Index of the path.
    pub path: usize,
    /// Distance along the ray.
    pub t: f32,
    /// The light that counts.
    pub radiance: Rgb,
}

impl Frame<'_> {
    /// Finds the area lights along a ray from `o` in the unit direction `d`, in any order.
    pub(crate) fn intersect_area_lights(
        &self,
        path: usize,
        o: Vec3,
        d: Vec3,
        counts: AreaLightHits,
        hits: &mut Vec<AreaLightHit>,
    ) {
        if counts == AreaLightHits::Ignored {
            return;
        }
        for light in &self.area_lights {
            let Some(t) = light.intersect(o, d) else { continue };
            let of_shadow_ray = t * t / (-d.dot(light.normal) * light.area());
            let weight = counts.weight(of_shadow_ray);
            if weight > 0.0 {
                hits.push(AreaLightHit { path, t, radiance: light.radiance * weight });
            }
        }
    }
}

/// How the ray in direction `l` of a lobe meets area lights. `probability` is that with which the lobe spawns the ray.
pub(crate) fn area_light_hits(n: DVec3, l: DVec3, v: DVec3, alpha: f64, probability: f32) -> AreaLightHits {
    if alpha < MIRROR_ALPHA {
        return AreaLightHits::Counted;
    }
    let alpha2 = (alpha * alpha) as f32;
    AreaLightHits::Weighted(probability * reflection_pdf(n.as_vec3(), l.as_vec3(), v.as_vec3(), alpha2))
}
