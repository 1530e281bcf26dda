//! The lobes of a block of points: which of them spawn rays, and the environment's light over those that are too weak to.

use crate::integrator::compositor::Compositor;
use crate::integrator::frame::Frame;
use crate::integrator::material::ggx::NARROW_ALPHA;
use crate::integrator::material::ggx_lobe::LOBE_LANES;
use crate::integrator::material::lobe_lookups::LobeBlock;
use crate::integrator::paths::PathStates;
use crate::integrator::shading_batch::{ShadingBatch, ShadingPoint};
use crate::integrator::surface::point_block::PointBlock;
use crate::integrator::surface::soa::{LANES, mask, set_lanes, set3, vec3};
use blinn_core::geometry::Rgb;
use blinn_core::simd::{AutovecKernel, SimdLevel};
use blinn_scene::Environment;

/// Lobes of a smaller importance are weak: they spawn no rays unless they are narrow, and look the environment up once.
pub(crate) const STRONG_IMPORTANCE: f32 = 0.15;
/// Smallest importance of a point or of a ray that it spawns.
pub(crate) const MIN_IMPORTANCE: f32 = 1.0 / 512.0;

/// Returns the probability that a lobe spawns a ray; 0 if it looks the environment up instead.
///
/// Surfaces seen in a reflection show only their strong reflections: others would double the rays with each wave. A lookup
/// shows the environment even where other surfaces hide it. With ambient occlusion (`occludes_environment`) that would be
/// seen below objects on glossy floors: then weak lobes spawn rays by Russian roulette.
#[inline(always)]
pub(crate) fn survival_probability(
    importance: f32,
    is_narrow: bool,
    wave: u32,
    occludes_environment: bool,
) -> f32 {
    let is_seen = is_narrow & (wave == 0);
    let threshold = if is_seen | occludes_environment { MIN_IMPORTANCE } else { STRONG_IMPORTANCE };
    let weak = if is_seen { 1.0 } else { importance / STRONG_IMPORTANCE };
    if importance >= threshold { weak.min(1.0) } else { 0.0 }
}

/// Sets of points of a block, as bit masks.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct BlockLobes {
    /// Points at which a lobe or a refracting surface is strong or narrow enough to spawn rays, and layered points.
    pub spawning: u32,
    /// Points whose microfacets look the environment up.
    facet_lookups: u32,
    /// Points whose coat looks the environment up.
    coat_lookups: u32,
}

impl BlockLobes {
    /// Classifies the lobes of the block whose first point is `first`.
    pub fn classify(
        frame: &Frame,
        compositor: &Compositor,
        batch: &ShadingBatch,
        first: usize,
        wave: u32,
    ) -> BlockLobes {
        let mut lobes = BlockLobes::default();
        let (block, _) = batch.soa.lane(first);
        let points = batch.block_points(first);
        if block.reflecting_lanes(points.len()) != 0 {
            let lanes = LobeLanes::new(frame, compositor, block, points, batch.has_transmission);
            let occludes_environment = frame.occludes_environment();
            let lobes = &mut lobes;
            frame.simd().run(Classify { block, lanes: &lanes, wave, occludes_environment, lobes });
        }
        lobes
    }

    /// Adds the environment's light over the lobes that look it up.
    pub fn add_looked_up_light(&self, simd: SimdLevel, environment: &Environment, block: &mut PointBlock) {
        for (points, is_coat) in [(self.facet_lookups, false), (self.coat_lookups, true)] {
            if points != 0 {
                simd.run(AddLookedUpLight { points, is_coat, environment, block });
            }
        }
    }
}

/// Inputs of the classification, by lane.
struct LobeLanes {
    /// Share of each point's light that arrives at the origin of its path's ray.
    throughput: [[f32; LANES]; 3],
    /// Importance of the path.
    importance: [f32; LANES],
    /// The points that reflect, as a bit mask, as are the following.
    reflecting: u32,
    /// Points at which light is refracted.
    refracting: u32,
    /// Points whose paths may still be reflected.
    continuing: u32,
}

impl LobeLanes {
    const ZERO: LobeLanes = LobeLanes {
        throughput: [[0.0; LANES]; 3],
        importance: [0.0; LANES],
        reflecting: 0,
        refracting: 0,
        continuing: 0,
    };

    /// The inputs of the `points` of a block, at least 1.
    #[inline(always)]
    fn new(
        frame: &Frame,
        compositor: &Compositor,
        block: &PointBlock,
        points: &[ShadingPoint],
        has_transmission: bool,
    ) -> LobeLanes {
        let reflecting = block.reflecting_lanes(points.len());
        let mut lanes = LobeLanes { reflecting, ..LobeLanes::ZERO };
        for i in set_lanes(reflecting) {
            let transmittance = compositor.transmittance_to(points[i].path, vec3(&block.p, i));
            set3(&mut lanes.throughput, i, transmittance.to_array());
        }
        for channel in &mut lanes.throughput {
            for i in 0..LANES {
                channel[i] *= block.k.opacity[i];
            }
        }
        let states = compositor.rays.states;
        if let PathStates::Secondary(_) = states {
            for i in set_lanes(reflecting) {
                lanes.importance[i] = states.importance(points[i].path);
                lanes.continuing |= u32::from(states.may_reflect(points[i].path)) << i;
            }
        } else {
            // All eye rays have one state.
            let path = points[0].path;
            lanes.importance = [states.importance(path); LANES];
            lanes.continuing = if states.may_reflect(path) { reflecting } else { 0 };
        }
        if has_transmission {
            for i in set_lanes(reflecting) {
                let refracts = frame.refracts(points[i].id, &block.k.get(i));
                lanes.refracting |= u32::from(refracts) << i;
            }
        }
        lanes
    }
}

/// [`BlockLobes::classify`].
struct Classify<'a> {
    block: &'a PointBlock,
    lanes: &'a LobeLanes,
    wave: u32,
    /// True if weak lobes may spawn rays: see [`survival_probability`].
    occludes_environment: bool,
    lobes: &'a mut BlockLobes,
}

impl AutovecKernel for Classify<'_> {
    #[inline(always)]
    fn run(self) {
        let Classify { block, lanes, wave, occludes_environment, lobes } = self;
        let mut is_visible = [false; LANES];
        let mut facets = LayerSets::NONE;
        let mut coat = LayerSets::NONE;
        for i in 0..LANES {
            let throughput = vec3(&lanes.throughput, i);
            is_visible[i] = !(lanes.importance[i] * throughput.max_element() < MIN_IMPORTANCE);
            let k_r_coat = Rgb::splat(block.k_r_coat[i]);
            let is_set = |mask: u32| mask >> i & 1 != 0;
            let lobe = |k_r: Rgb, is_narrow: bool| {
                let importance = lanes.importance[i] * (throughput * k_r).max_element();
                let survives = survival_probability(importance, is_narrow, wave, occludes_environment) > 0.0;
                let is_traced = is_set(lanes.continuing) & survives;
                let is_lit = (k_r.x != 0.0) | (k_r.y != 0.0) | (k_r.z != 0.0);
                (is_lit, !is_traced & (importance < STRONG_IMPORTANCE))
            };
            (facets.lit[i], facets.weak[i]) =
                lobe(vec3(&block.k_r, i), block.k.layers.alpha[i] <= NARROW_ALPHA);
            (coat.lit[i], coat.weak[i]) = lobe(k_r_coat, block.k.layers.coat_alpha[i] <= NARROW_ALPHA);
        }
        let points = lanes.reflecting & mask(&is_visible);
        let reflecting = points & !lanes.refracting;
        // Layered points request all light of their lobes one by one.
        let layered = reflecting & block.layered.mask();
        let plain = reflecting & !layered;
        *lobes = BlockLobes {
            spawning: (points & lanes.refracting) | layered | (plain & (facets.strong() | coat.strong())),
            facet_lookups: plain & facets.lookups(),
            coat_lookups: plain & coat.lookups(),
        };
    }
}

/// Points that have a layer, and those where it is weak.
struct LayerSets {
    lit: [bool; LANES],
    weak: [bool; LANES],
}

impl LayerSets {
    const NONE: LayerSets = LayerSets { lit: [false; LANES], weak: [false; LANES] };

    #[inline(always)]
    fn lookups(&self) -> u32 {
        mask(&self.lit) & mask(&self.weak)
    }

    #[inline(always)]
    fn strong(&self) -> u32 {
        mask(&self.lit) & !mask(&self.weak)
    }
}

/// [`BlockLobes::add_looked_up_light`] of one layer.
struct AddLookedUpLight<'a> {
    /// The points with such a lobe, as a bit mask.
    points: u32,
    is_coat: bool,
    environment: &'a Environment,
    block: &'a mut PointBlock,
}

impl AutovecKernel for AddLookedUpLight<'_> {
    #[inline(always)]
    fn run(self) {
        let AddLookedUpLight { points, is_coat, environment, block } = self;
        for first in (0..LANES).step_by(LOBE_LANES) {
            let points = points >> first;
            if points & ((1 << LOBE_LANES) - 1) == 0 {
                continue;
            }
            let mut lobes = LobeBlock::ZERO;
            let mut weight = [[0.0; LOBE_LANES]; 3];
            for i in 0..LOBE_LANES {
                // The remainder lets the compiler drop the bounds checks.
                let lane = (first + i) % LANES;
                let alpha = if is_coat { block.coat_alpha[lane] } else { block.lobe_alpha[lane] };
                let n = block.n_specular(lane).as_vec3();
                // Other lanes may hold any value.
                let used = points >> i & 1 != 0;
                lobes.set(i, n, block.v(lane).as_vec3(), if used { alpha } else { 1.0 });
                let k_r = match is_coat {
                    true => Rgb::splat(block.k_r_coat[lane]),
                    false => vec3(&block.k_r, lane) * block.k.layers.occlusion[lane],
                };
                set3(&mut weight, i, k_r.to_array());
            }
            let radiance = lobes.radiance(environment);
            for i in 0..LOBE_LANES {
                let lane = (first + i) % LANES;
                let before = vec3(&block.radiance, lane);
                let after = before + vec3(&weight, i) * radiance[i];
                let used = points >> i & 1 != 0;
                set3(&mut block.radiance, lane, if used { after } else { before }.to_array());
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::integrator::material::ggx_lobe::Lobe;
    use crate::integrator::material::lobe_lookups::LobeLookups;

    /// Each lane has another kind of lobe. Lanes from 8 on reflect nothing.
    #[test]
    fn weak_lobes_look_up_and_others_spawn_rays() {
        let mut block = PointBlock::ZERO;
        let mut lanes = LobeLanes { reflecting: 0xff, continuing: 0xff & !(1 << 4), ..LobeLanes::ZERO };
        for i in 0..LANES {
            set3(&mut lanes.throughput, i, [1.0; 3]);
            lanes.importance[i] = 1.0;
            set3(&mut block.k_r, i, [0.05, 0.02, 0.01]);
            (block.k.layers.alpha[i], block.k.layers.coat_alpha[i]) = (1.0, 1.0);
        }
        // Strong microfacets, narrow ones, a narrow coat, glass, no reflections left, a path of little importance, no lobe.
        set3(&mut block.k_r, 0, [0.1, 0.3, 0.1]);
        block.k.layers.alpha[1] = 0.0;
        (block.k_r_coat[2], block.k.layers.coat_alpha[2]) = (0.05, 0.0);
        lanes.refracting = 1 << 3;
        lanes.importance[5] = 1e-3;
        set3(&mut block.k_r, 6, [0.0; 3]);
        let classify = |wave: u32, occludes_environment: bool, simd: SimdLevel| {
            let mut lobes = BlockLobes::default();
            simd.run(Classify {
                block: &block,
                lanes: &lanes,
                wave,
                occludes_environment,
                lobes: &mut lobes,
            });
            lobes
        };
        for simd in SimdLevel::ALL.into_iter().filter(|simd| simd.is_supported()) {
            let seen = BlockLobes { spawning: 0b1111, facet_lookups: 0b1001_0100, coat_lookups: 0 };
            let reflected = BlockLobes { spawning: 0b1001, facet_lookups: 0b1001_0110, coat_lookups: 0b100 };
            assert_eq!((classify(0, false, simd), classify(1, false, simd)), (seen, reflected));
            let occluded = BlockLobes { spawning: 0b1000_1111, facet_lookups: 0b1_0000, coat_lookups: 0 };
            assert_eq!((classify(0, true, simd), classify(1, true, simd)), (occluded, occluded));
        }
    }

    #[test]
    fn the_light_of_a_block_is_that_of_single_lookups() {
        let environment = Environment::from_function(16, 1, |d| Rgb::new(1.0 + d.x, 2.0 + d.y, 1.5 - d.z));
        let mut block = PointBlock::ZERO;
        let mut lookups = [LobeLookups::default(), LobeLookups::default()];
        for i in 0..LANES {
            let [n, v] = [0.0, 0.9].map(|turn| {
                DVec3::new((i as f64 * 0.37).sin(), (i as f64 * 0.7 + turn).cos(), turn + 0.2).normalize()
            });
            set3(&mut block.n_specular, i, n.to_array());
            set3(&mut block.v, i, v.to_array());
            set3(&mut block.k_r, i, [0.05, 0.04, 0.03]);
            set3(&mut block.radiance, i, [0.25; 3]);
            block.k.layers.occlusion[i] = 0.5;
            block.k_r_coat[i] = 0.1;
            (block.lobe_alpha[i], block.coat_alpha[i]) = (0.02 * i as f32, 0.6);
            for (lookups, alpha) in lookups.iter_mut().zip([block.lobe_alpha[i], block.coat_alpha[i]]) {
                lookups.push(&Lobe { n, v, alpha: alpha.into(), f0: 0.04 });
            }
        }
        // Twenty lobes of the microfacets, one of the coat.
        let lobes = BlockLobes { spawning: 0, facet_lookups: 0x000f_ffff, coat_lookups: 1 << 3 };
        for simd in SimdLevel::ALL.into_iter().filter(|simd| simd.is_supported()) {
            let [facets, coat] = lookups.each_ref().map(|lookups| lookups.radiance(simd, &environment));
            let mut block = block.clone();
            lobes.add_looked_up_light(simd, &environment, &mut block);
            for i in 0..LANES {
                let mut expected = Rgb::splat(0.25);
                if i < 20 {
                    expected += Rgb::new(0.05, 0.04, 0.03) * 0.5 * facets[i];
                }
                if i == 3 {
                    expected += Rgb::splat(0.1) * coat[i];
                }
                assert_eq!(vec3(&block.radiance, i), expected, "{i}");
            }
        }
    }
}
