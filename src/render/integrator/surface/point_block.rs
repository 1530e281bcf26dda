//! A block of shading points as structure of arrays: position, normals, coefficients and light of each point.

use std::ops::Range;

use glam::{DVec3, Vec3};

use crate::integrator::layers::layered_points::LayeredPoints;
use crate::integrator::material::coefficient_lanes::CoefficientLanes;
use crate::integrator::material::coefficients::Coefficients;
use crate::integrator::material::specular_antialiasing::SpecularAntialiasing;
use crate::integrator::surface::highlights::Highlights;
use crate::integrator::surface::ray_differentials::{
    BarycentricDifferentials, TriangleCoords, alpha2_increase,
};
use crate::integrator::surface::soa::{
    HIT_LANES, LANES, LaneArray, LaneArray3, ZERO3_F32, ZERO3_F64, dvec3, mask, set3, vec3,
};
use crate::integrator::surface::specular_normal::specular_normal;
use crate::integrator::surface::surface_hit::{Ray8, SurfaceHit, SurfaceHit8};
use blinn_core::geometry::Rgb;

/// Up to [`LANES`] points. Lanes behind the last point hold any value.
#[derive(Clone)]
pub(crate) struct PointBlock {
    pub p: LaneArray3<f32>,
    /// Origins of rays that leave the points and do not graze the triangle.
    pub ray_origin: LaneArray3<f32>,
    /// Offsets from `ray_origin` to the smooth surface.
    pub terminator_offset: LaneArray3<f32>,
    /// Directions of the path rays that hit the points, not normalised.
    pub d: LaneArray3<f32>,
    /// Barycentrics: [`TriangleCoords::b`].
    pub b: LaneArray3<f32>,
    /// [`TriangleCoords::differentials`].
    pub differentials: [LaneArray<f32>; BarycentricDifferentials::LEN],
    /// Geometric normals.
    pub n_g: LaneArray3<f64>,
    /// Interpolated vertex normals.
    pub n_v: LaneArray3<f64>,
    /// Shading normals; [`NO_NORMAL`] where the surface is fully transparent.
    pub n: LaneArray3<f64>,
    /// Normals of specular lobes: n, or [`specular_normal`]. Set together with `v`.
    pub n_specular: LaneArray3<f64>,
    /// True if they may differ from n. Lobes then end at the triangle.
    pub has_turned_normals: bool,
    /// Unit directions towards the path rays' origins. [`PointBlock::compute_view_dirs`] sets them, in blocks with
    /// highlights or reflections.
    pub v: LaneArray3<f64>,
    /// True if k_s of any point is not 0.
    pub has_specular: bool,
    /// Coefficients: k_s and p after specular antialiasing, and k_d and k_s as far as specular layers let light through.
    pub k: CoefficientLanes,
    /// The points that reflect their surroundings, as a bit mask. The following are set for these points only.
    pub reflecting: u32,
    /// Increase of α² by the normals that the sample covers: twice their variance.
    pub alpha2_increase: LaneArray<f32>,
    /// k_r of the microfacets, by colour.
    pub k_r: LaneArray3<f32>,
    /// α of the microfacets' lobe, widened by the normals that the sample covers.
    pub lobe_alpha: LaneArray<f32>,
    /// k_r of the clear coat.
    pub k_r_coat: LaneArray<f32>,
    /// α of the coat's lobe, widened in the same way.
    pub coat_alpha: LaneArray<f32>,
    /// Share of light that reaches the diffuse base.
    pub base_share: LaneArray<f32>,
    /// The lobes that reflect lights in place of k_s and p.
    pub highlights: Highlights,
    /// The points with other layers. Their lobes take the place of `highlights`.
    pub layered: LayeredPoints,
    /// L so far.
    pub radiance: LaneArray3<f32>,
    /// L so far without shadows; used by shadow catchers.
    pub unshadowed: LaneArray3<f32>,
    /// Light from the current light source.
    pub current_light: LaneArray3<f32>,
    /// The part of it that specular lobes reflect, where light is split.
    pub current_specular: LaneArray3<f32>,
    /// Noisy light that matte surfaces reflect, as far as it is in `radiance`, where light is split.
    pub noisy_diffuse: LaneArray3<f32>,
    /// Noisy light that specular lobes reflect, likewise.
    pub noisy_specular: LaneArray3<f32>,
}

/// The shading normal of points that no light reaches: n·l > 0 for no l.
const NO_NORMAL: DVec3 = DVec3::ZERO;

impl PointBlock {
    pub const ZERO: PointBlock = PointBlock {
        p: ZERO3_F32,
        ray_origin: ZERO3_F32,
        terminator_offset: ZERO3_F32,
        d: ZERO3_F32,
        b: ZERO3_F32,
        differentials: [[0.0; LANES + HIT_LANES]; BarycentricDifferentials::LEN],
        n_g: ZERO3_F64,
        n_v: ZERO3_F64,
        n: ZERO3_F64,
        n_specular: ZERO3_F64,
        has_turned_normals: false,
        v: ZERO3_F64,
        has_specular: false,
        k: CoefficientLanes::ZERO,
        reflecting: 0,
        alpha2_increase: [0.0; LANES + HIT_LANES],
        k_r: ZERO3_F32,
        lobe_alpha: [0.0; LANES + HIT_LANES],
        k_r_coat: [0.0; LANES + HIT_LANES],
        coat_alpha: [0.0; LANES + HIT_LANES],
        base_share: [0.0; LANES + HIT_LANES],
        highlights: Highlights::ZERO,
        layered: LayeredPoints::NONE,
        radiance: ZERO3_F32,
        unshadowed: ZERO3_F32,
        current_light: ZERO3_F32,
        current_specular: ZERO3_F32,
        noisy_diffuse: ZERO3_F32,
        noisy_specular: ZERO3_F32,
    };

    /// Shading normal of point `i`.
    #[inline(always)]
    pub fn n(&self, i: usize) -> DVec3 {
        dvec3(&self.n, i)
    }

    /// Normal of the specular lobes of point `i`.
    #[inline(always)]
    pub fn n_specular(&self, i: usize) -> DVec3 {
        dvec3(&self.n_specular, i)
    }

    /// Unit direction from point `i` towards the path ray's origin.
    #[inline(always)]
    pub fn v(&self, i: usize) -> DVec3 {
        dvec3(&self.v, i)
    }

    /// Position of point `i` on its triangle.
    #[inline(always)]
    pub fn coords(&self, i: usize) -> TriangleCoords {
        TriangleCoords {
            b: self.b.each_ref().map(|b| b[i]),
            differentials: BarycentricDifferentials::from_array(self.differentials.each_ref().map(|s| s[i])),
        }
    }

    /// The hit that point `i` was made from.
    #[inline(always)]
    pub fn hit(&self, i: usize) -> SurfaceHit {
        SurfaceHit {
            p: vec3(&self.p, i),
            ray_origin: vec3(&self.ray_origin, i),
            terminator_offset: vec3(&self.terminator_offset, i),
            n_g: dvec3(&self.n_g, i),
            n_v: dvec3(&self.n_v, i),
            coords: self.coords(i),
        }
    }

    /// Returns the increase of α² of each point's highlight by the curvature of the smooth surface.
    #[inline(always)]
    pub fn curvature_alpha2_increase(&self) -> [f32; LANES] {
        let mut increase = [0.0; LANES];
        for (increase, dn) in
            increase.iter_mut().zip(&self.differentials[BarycentricDifferentials::DN_SQUARED])
        {
            *increase = alpha2_increase(*dn);
        }
        increase
    }

    /// Change of the interpolated vertex normal of point `i` from one sample to the next, in radians.
    #[inline(always)]
    pub fn normal_change(&self, i: usize) -> f32 {
        let dn_squared = self.differentials[BarycentricDifferentials::DN_SQUARED][i];
        // NaN where the triangle is seen edge-on.
        if dn_squared > 0.0 { (0.5 * dn_squared).sqrt().min(1.0) } else { 0.0 }
    }

    /// Stores a group of hits from lane `at` on.
    #[inline(always)]
    pub fn store_hits(&mut self, at: usize, rays: &Ray8, hits: &SurfaceHit8) {
        store(&mut self.p, at, &hits.p);
        store(&mut self.ray_origin, at, &hits.ray_origin);
        store(&mut self.terminator_offset, at, &hits.terminator_offset);
        store(&mut self.d, at, &rays.d);
        store(&mut self.b, at, &hits.b);
        store(&mut self.differentials, at, &hits.differentials);
        store(&mut self.n_g, at, &hits.n_g);
        store(&mut self.n_v, at, &hits.n_v);
    }

    /// Stores the hit of a ray of direction `d` in lane `at`.
    #[inline(always)]
    pub fn store_hit(&mut self, at: usize, d: Vec3, hit: &SurfaceHit) {
        set3(&mut self.p, at, hit.p.to_array());
        set3(&mut self.ray_origin, at, hit.ray_origin.to_array());
        set3(&mut self.terminator_offset, at, hit.terminator_offset.to_array());
        set3(&mut self.d, at, d.to_array());
        set3(&mut self.b, at, hit.coords.b);
        set3(&mut self.n_g, at, hit.n_g.to_array());
        set3(&mut self.n_v, at, hit.n_v.to_array());
        for (to, value) in self.differentials.iter_mut().zip(hit.coords.differentials.to_array()) {
            to[at] = value;
        }
    }

    /// Sets what point `i` has before any light is evaluated: its shading normal, its coefficients, and its radiance
    /// k_e + k_a I_a.
    #[inline(always)]
    pub fn set_material(&mut self, i: usize, n: DVec3, k: &Coefficients, base_radiance: Rgb) {
        set3(&mut self.n, i, if k.opacity == 0.0 { NO_NORMAL } else { n }.to_array());
        self.k.set(i, k);
        self.has_specular |= k.k_s != Rgb::ZERO;
        self.set_base_radiance(i, base_radiance);
    }

    /// Sets what follows from the coefficients of the points in the given lanes, and the increase of α² by the normals that
    /// each covers. Sets their shading normals to the vertex normals, unless a normal map has set them. The lanes behind may
    /// hold any value then.
    #[inline(always)]
    pub fn finish_coefficients(
        &mut self,
        lanes: &Range<usize>,
        alpha2_increase: &[f32; LANES],
        has_normal_map: bool,
    ) {
        let (mut specular, mut reflecting) = ([false; LANES], [false; LANES]);
        for i in 0..LANES {
            let [r, g, b] = self.k.k_s.each_ref().map(|c| c[i] != 0.0);
            specular[i] = r | g | b;
            reflecting[i] = self.k.layers.reflects[i];
        }
        let in_range = (u32::MAX >> (LANES - lanes.len())) << lanes.start;
        self.has_specular |= mask(&specular) & in_range != 0;
        self.reflecting |= mask(&reflecting) & in_range;
        let first = lanes.start;
        for i in 0..LANES {
            let before = self.alpha2_increase[i];
            self.alpha2_increase[i] = if i < first { before } else { alpha2_increase[i] };
        }
        for axis in 0..3 {
            for i in 0..LANES {
                let before = self.n[axis][i];
                let n = if has_normal_map { before } else { self.n_v[axis][i] };
                // `NO_NORMAL` where the surface is not visible.
                let n = if self.k.opacity[i] != 0.0 { n } else { 0.0 };
                self.n[axis][i] = if i < first { before } else { n };
            }
        }
    }

    /// True if point `i` reflects its surroundings.
    #[inline(always)]
    pub fn reflects(&self, i: usize) -> bool {
        self.reflecting >> i & 1 != 0
    }

    /// Makes point `i` matte: it reflects no surroundings, and all light reaches its base.
    pub fn remove_specular_layers(&mut self, i: usize) {
        self.reflecting &= !(1 << i);
        self.k.layers.reflects[i] = false;
        self.set_base_radiance(i, vec3(&self.k.k_e, i));
    }

    /// The points among the first `count`, at least 1, that reflect their surroundings, as a bit mask.
    #[inline(always)]
    pub fn reflecting_lanes(&self, count: usize) -> u32 {
        self.reflecting & (u32::MAX >> (LANES - count))
    }

    /// Widens the highlights of the points from `first` on by the increase of α² of each.
    #[inline(always)]
    pub fn apply_specular_antialiasing(&mut self, first: usize, antialiasing: &SpecularAntialiasing) {
        if antialiasing.is_identity() {
            return;
        }
        let mut scale = [1.0; LANES];
        for i in 0..LANES {
            let before = self.k.shininess[i];
            let lobe = antialiasing.widen(before, self.alpha2_increase[i]);
            self.k.shininess[i] = if i < first { before } else { lobe.shininess };
            scale[i] = if i < first { 1.0 } else { lobe.k_s_scale };
        }
        for k_s in &mut self.k.k_s {
            for i in 0..LANES {
                k_s[i] *= scale[i];
            }
        }
    }

    /// Sets the radiance of point `i`, with and without shadows, to k_e + k_a I_a.
    #[inline(always)]
    pub fn set_base_radiance(&mut self, i: usize, base_radiance: Rgb) {
        set3(&mut self.radiance, i, base_radiance.to_array());
        set3(&mut self.unshadowed, i, base_radiance.to_array());
    }

    /// Computes v, the unit directions towards the path rays' origins, and the normals of specular lobes: n, or
    /// [`specular_normal`] if `turns_normals`.
    #[inline(always)]
    pub fn compute_view_dirs(&mut self, turns_normals: bool) {
        for i in 0..LANES {
            let d = vec3(&self.d, i).as_dvec3();
            let v = -(d * d.length_recip());
            set3(&mut self.v, i, v.to_array());
        }
        self.n_specular = self.n;
        self.has_turned_normals = turns_normals;
        if turns_normals {
            for i in 0..LANES {
                let n = specular_normal(self.n(i), dvec3(&self.n_g, i), self.v(i));
                set3(&mut self.n_specular, i, n.to_array());
            }
        }
    }

    /// Multiplies the current light at point `i` by its visibility.
    #[inline(always)]
    pub fn apply_visibility(&mut self, i: usize, visibility: Rgb) {
        let unshadowed = vec3(&self.current_light, i);
        set3(&mut self.current_light, i, (visibility * unshadowed).to_array());
    }

    /// Multiplies the specular part of the current light at point `i` by its visibility.
    #[inline(always)]
    pub fn apply_specular_visibility(&mut self, i: usize, visibility: Rgb) {
        let unshadowed: Rgb = vec3(&self.current_specular, i);
        set3(&mut self.current_specular, i, (visibility * unshadowed).to_array());
    }

    /// Turns the diffuse part of the current light, in `current_specular`, into the specular part.
    #[inline(always)]
    pub fn leave_specular_light(&mut self) {
        for axis in 0..3 {
            for i in 0..LANES {
                self.current_specular[axis][i] = self.current_light[axis][i] - self.current_specular[axis][i];
            }
        }
    }

    /// Adds the current light to the noisy light.
    pub fn accumulate_noisy(&mut self) {
        for axis in 0..3 {
            for i in 0..LANES {
                let specular = self.current_specular[axis][i];
                self.noisy_specular[axis][i] += specular;
                self.noisy_diffuse[axis][i] += self.current_light[axis][i] - specular;
            }
        }
    }

    /// Makes the current light 0.
    #[inline(always)]
    pub fn clear_current_light(&mut self) {
        self.current_light = ZERO3_F32;
        self.current_specular = ZERO3_F32;
    }

    /// Adds the current light to the radiance.
    #[inline(always)]
    pub fn accumulate(&mut self) {
        add(&mut self.radiance, &self.current_light);
    }

    /// Adds the current light to the radiance without shadows.
    #[inline(always)]
    pub fn accumulate_unshadowed(&mut self) {
        add(&mut self.unshadowed, &self.current_light);
    }
}

#[inline(always)]
fn store<T: Copy, const N: usize>(to: &mut [LaneArray<T>; N], at: usize, from: &[[T; HIT_LANES]; N]) {
    // The remainder lets the compiler drop the bounds checks.
    let at = at % LANES;
    for k in 0..N {
        for i in 0..HIT_LANES {
            to[k][at + i] = from[k][i];
        }
    }
}

#[inline(always)]
fn add(to: &mut LaneArray3<f32>, more: &LaneArray3<f32>) {
    for axis in 0..3 {
        for i in 0..LANES {
            to[axis][i] += more[axis][i];
        }
    }
}
