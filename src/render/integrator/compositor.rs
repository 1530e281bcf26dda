//! Transparency: rays pass through surfaces, whose light is composited front to back.

use crate::integrator::area_light_hits::AreaLightHit;
use crate::integrator::frame::Frame;
use crate::integrator::light_layers::{LightLayer, LightLayers, SampleLayers};
use crate::integrator::light_parts::{LightSplit, NoisyLight, SampleParts, SeenFeatures};
use crate::integrator::path_rays::PathRays;
use crate::integrator::paths::{Escape, MAX_PATH_RADIANCE, MAX_RADIANCE, PathLight, SecondaryRay, Wave};
use crate::integrator::shading_batch::{ShadingBatch, ShadingPoint};
use crate::integrator::surface::soa::{LANES, set3, vec3};
use blinn_core::geometry::Rgb;
use glam::Vec3;

#[cfg(test)]
mod tests;

/// Less transmittance than this counts as none: white behind it would change black by less than half a byte.
const OPAQUE_TRANSMITTANCE: f32 = 1.0 / (1 << 13) as f32;

/// Composites the light of a batch of paths, surface by surface.
pub(crate) struct Compositor<'a> {
    pub rays: PathRays<'a>,
    /// For each path the t where its ray hits the ground, until it is shaded; empty without a ground.
    pub ground_t: Vec<Option<f64>>,
    /// For each path the light so far, and the share of light from behind that still arrives.
    light: Vec<PathLight>,
    /// The noisy light and the surfaces of each path; empty where light is not split.
    parts: Vec<SampleParts>,
    split: LightSplit,
    /// The light of each path by layer; empty where that is not wanted.
    layers: Vec<PathLayers>,
    /// The light of glowing surfaces that each path meets; empty where it is not wanted.
    emission: Vec<Rgb>,
    /// Features of what each path sees in mirrors and behind glass; empty where they are not wanted.
    seen: Vec<SeenFeatures>,
    /// Maximum radiance of surfaces along secondary rays.
    max_radiance: f32,
    /// The area lights that the rays have not passed yet, sorted by path.
    area_light_hits: Vec<AreaLightHit>,
}

impl<'a> Compositor<'a> {
    /// Starts with all rays at their origins.
    pub fn new(frame: &Frame, rays: PathRays<'a>) -> Compositor<'a> {
        let paths = rays.batch().len();
        let area_light_hits = rays.area_light_hits(frame);
        Compositor {
            area_light_hits,
            parts: Vec::new(),
            split: LightSplit::All,
            layers: Vec::new(),
            emission: Vec::new(),
            seen: Vec::new(),
            max_radiance: if frame.traces_full_paths() { MAX_PATH_RADIANCE } else { MAX_RADIANCE },
            ground_t: frame.intersect_ground(rays.batch(), rays.is_secondary),
            rays,
            light: vec![PathLight { transmittance: Rgb::ONE, ..PathLight::NONE }; paths],
        }
    }

    /// Splits the light of all paths into parts.
    pub fn split(&mut self, split: LightSplit) {
        self.parts = vec![SampleParts::default(); self.light.len()];
        self.split = split;
        if split == LightSplit::All {
            self.collect_seen();
        }
    }

    /// Collects what the paths see.
    pub fn collect_seen(&mut self) {
        self.seen = vec![SeenFeatures::default(); self.light.len()];
    }

    /// Collects the light of all paths by layer.
    pub fn collect_layers(&mut self) {
        self.layers = vec![PathLayers::default(); self.light.len()];
    }

    /// True if light is collected by layer.
    pub fn collects_layers(&self) -> bool {
        !self.layers.is_empty()
    }

    /// Collects the light of the glowing surfaces that all paths meet.
    pub fn collect_emission(&mut self) {
        self.emission = vec![Rgb::ZERO; self.light.len()];
    }

    /// True if all noisy light is split from the rest.
    pub fn splits_all(&self) -> bool {
        !self.parts.is_empty() && self.split == LightSplit::All
    }

    /// Adds the area lights in front of the current hits to the light of the paths.
    pub fn add_area_light_hits(&mut self) {
        if self.area_light_hits.is_empty() {
            return;
        }
        let mut ahead = std::mem::take(&mut self.area_light_hits);
        let mut rays = self.rays.iter().peekable();
        let light = &mut self.light;
        let states = self.rays.states;
        ahead.retain(|area_light| {
            let path = area_light.path;
            while rays.next_if(|ray| ray.path < path).is_some() {}
            // The ray of a finished path is not there any more.
            let Some(ray) = rays.peek().filter(|ray| ray.path == path) else { return false };
            if !ray.hit.is_miss() && ray.hit.t < area_light.t {
                return true;
            }
            let p = ray.ray.o + ray.ray.d * area_light.t;
            let arrives = light[path].transmittance * states.medium_transmittance_to(path, p);
            light[path].emitted += arrives * area_light.radiance;
            false
        });
        self.area_light_hits = ahead;
    }

    /// The share of the light of point `i` of `batch` that arrives at the origin of its path's current ray.
    #[inline(always)]
    pub fn throughput(&self, batch: &ShadingBatch, i: usize) -> Rgb {
        let (block, lane) = batch.soa.lane(i);
        self.transmittance_to(batch.points[i].path, vec3(&block.p, lane)) * block.k.opacity[lane]
    }

    /// The share of light from point `p` along a path that arrives at the origin of the path's current ray.
    #[inline(always)]
    pub fn transmittance_to(&self, path: usize, p: Vec3) -> Rgb {
        self.light[path].transmittance * self.rays.states.medium_transmittance_to(path, p)
    }

    /// Composites the shaded points of the current surfaces, which have spawned `rays` and left out those of `unseen`, and moves
    /// the rays of paths that are not opaque yet behind their hits. False if there are none.
    pub fn composite(
        &mut self,
        frame: &Frame,
        batch: &ShadingBatch,
        rays: &[SecondaryRay],
        unseen: &[(usize, f32)],
    ) -> bool {
        let mut any_transparent = false;
        // Features of what rays see take the place of those of the surfaces that spawn them.
        let mut seen_elsewhere = vec![0.0; self.seen.len()];
        for (path, share) in rays.iter().map(|ray| (ray.parent, ray.seen_share)).chain(unseen.iter().copied())
        {
            if let Some(sum) = seen_elsewhere.get_mut(path) {
                *sum += share;
            }
        }
        let has_features = self.collects_features();
        for (block_index, points) in batch.points.chunks(LANES).enumerate() {
            let first = block_index * LANES;
            let (block, _) = batch.soa.lane(first);
            let surfaces = CompositedBlock::new(frame, batch, first, points);
            for (lane, point) in points.iter().enumerate() {
                // The remainder lets the compiler drop the bounds checks.
                let lane = lane % LANES;
                let mut radiance: Rgb = vec3(&surfaces.radiance, lane);
                let mut medium = Rgb::ONE;
                if self.rays.is_secondary {
                    medium = self.rays.states.medium_transmittance_to(point.path, vec3(&block.p, lane));
                    radiance *= medium;
                }
                let light = &mut self.light[point.path];
                let before = light.transmittance;
                let behind = before * vec3(&surfaces.transmittance, lane);
                light.radiance += before * radiance;
                if behind.max_element() < OPAQUE_TRANSMITTANCE {
                    light.transmittance = Rgb::ZERO;
                } else {
                    light.transmittance = behind;
                    any_transparent = true;
                }
                if has_features {
                    let share = CompositedShare { before, medium, behind };
                    self.add_features(frame, batch, first + lane, &share, &seen_elsewhere);
                }
            }
        }
        if !any_transparent {
            return false;
        }
        let light = &self.light;
        self.rays.continue_behind(|path| light[path].transmittance.max_element() > 0.0);
        !self.rays.is_empty()
    }

    /// True if more than the light of the paths is collected.
    fn collects_features(&self) -> bool {
        !(self.parts.is_empty() && self.layers.is_empty() && self.emission.is_empty() && self.seen.is_empty())
    }

    /// Adds what is collected besides the light of point `i` to its path. `seen_elsewhere` is the share of each path's features
    /// that rays see.
    fn add_features(
        &mut self,
        frame: &Frame,
        batch: &ShadingBatch,
        i: usize,
        share: &CompositedShare,
        seen_elsewhere: &[f32],
    ) {
        let path = batch.points[i].path;
        let &CompositedShare { before, medium, behind } = share;
        let stopped = (before - behind).element_sum() * (1.0 / 3.0);
        if let Some(parts) = self.parts.get_mut(path) {
            add_parts(parts, frame, batch, i, before, stopped);
        }
        if let Some(layers) = self.layers.get_mut(path) {
            layers.add(frame, batch, i, before);
        }
        if let Some(emission) = self.emission.get_mut(path) {
            let (k_e, _) = batch.layered_ke_ka(i);
            *emission += before * medium * batch.coefficients(i).opacity * k_e;
        }
        if let Some(seen) = self.seen.get_mut(path) {
            let k = batch.coefficients(i);
            let surface =
                SeenFeatures { albedo: k.color, normal: batch.n(i).as_vec3(), coverage: 0.0, known: 1.0 };
            let share = (stopped - seen_elsewhere[path]).max(0.0);
            seen.add(&surface, share);
            seen.add_light(k.k_e, share);
            seen.coverage += stopped;
        }
    }

    /// Adds the light that secondary rays found to the paths that spawned them.
    pub fn add_secondary(&mut self, wave: &Wave, secondary: Compositor) {
        let Compositor { light: found, seen, emission, .. } = secondary;
        for ((ray, found), mut seen) in wave.rays.iter().zip(&found).zip(seen) {
            let Some(to) = self.seen.get_mut(ray.parent).filter(|_| ray.seen_share > 0.0) else { continue };
            let escaped = 1.0 - seen.coverage;
            if let Escape::Radiance(radiance) = ray.escape {
                seen.add_light(radiance, escaped);
            }
            seen.known += escaped;
            seen.add_light(found.emitted, 1.0);
            seen.coverage = 0.0;
            to.add(&seen, ray.seen_share);
        }
        let contributions = wave.contributions(&found, self.max_radiance);
        for (i, (ray, added)) in wave.rays.iter().zip(contributions).enumerate() {
            let light = &mut self.light[ray.parent];
            light.radiance += added.radiance;
            let is_noisy = self.split == LightSplit::All || ray.is_rough;
            if let Some(SampleParts { noisy, .. }) = self.parts.get_mut(ray.parent).filter(|_| is_noisy) {
                *(if ray.is_diffuse { &mut noisy.indirect } else { &mut noisy.specular }) += added.radiance;
            }
            light.transmittance += added.transmittance;
            if let Some(layers) = self.layers.get_mut(ray.parent) {
                let emitted = emission.get(i).map_or(Rgb::ZERO, |&emission| emission + found[i].emitted);
                let direct = (emitted * ray.weight).min(added.radiance);
                layers.add_secondary(ray, added.radiance, direct, is_noisy && !self.parts.is_empty());
            }
        }
    }

    /// True if what the paths see is collected.
    pub fn collects_seen(&self) -> bool {
        !self.seen.is_empty()
    }

    /// The light of all paths.
    pub fn into_light(self) -> Vec<PathLight> {
        self.light
    }

    /// The light of all paths, and the same by layer.
    pub fn into_layers(mut self) -> Vec<(PathLight, SampleLayers)> {
        let path_layers = std::mem::take(&mut self.layers);
        let (light, parts) = self.into_parts();
        let parts = parts.into_iter().chain(std::iter::repeat(SampleParts::default()));
        let layered = path_layers.into_iter().zip(parts).map(|(path, parts)| SampleLayers {
            layers: path.layers,
            parts,
            noisy_direct: path.noisy_direct,
        });
        light.into_iter().zip(layered).collect()
    }

    /// The light of all paths, and its noisy parts with the surfaces.
    pub fn into_parts(mut self) -> (Vec<PathLight>, Vec<SampleParts>) {
        for (parts, seen) in self.parts.iter_mut().zip(self.seen) {
            parts.surface.seen = seen;
        }
        (self.light, self.parts)
    }
}

/// The light of a path by layer.
#[derive(Clone, Copy, Default)]
struct PathLayers {
    layers: LightLayers,
    /// [`SampleLayers::noisy_direct`].
    noisy_direct: NoisyLight,
}

impl PathLayers {
    /// Adds the light of point `i`, of which `before` arrives.
    fn add(&mut self, frame: &Frame, batch: &ShadingBatch, i: usize, before: Rgb) {
        if batch.points[i].is_shadow_catcher {
            return;
        }
        let arrives = before * batch.coefficients(i).opacity;
        let layers = batch.layers.get(i);
        self.layers += layers * arrives;
        let (block, lane) = batch.soa.lane(i);
        self.noisy_direct.specular += arrives * vec3(&block.noisy_specular, lane);
        let noisy: Rgb = vec3(&block.noisy_diffuse, lane);
        // The ambient term is noisy with ambient occlusion.
        let has_noisy_ambient = frame.ambient_occlusion.is_some() && frame.indirect == 0;
        let ambient = if has_noisy_ambient { layers[LightLayer::DiffuseIndirect] } else { Rgb::ZERO };
        self.noisy_direct.direct += arrives * (noisy - ambient);
    }

    /// Adds the light that a ray found, of which `direct` comes from light sources and glowing surfaces.
    fn add_secondary(&mut self, ray: &SecondaryRay, light: Rgb, direct: Rgb, is_noisy: bool) {
        let noisy = &mut self.noisy_direct;
        let (direct_layer, indirect_layer, noisy_direct) = if ray.is_diffuse {
            (LightLayer::DiffuseDirect, LightLayer::DiffuseIndirect, &mut noisy.indirect)
        } else {
            (LightLayer::SpecularDirect, LightLayer::SpecularIndirect, &mut noisy.specular)
        };
        self.layers[direct_layer] += direct;
        self.layers[indirect_layer] += light - direct;
        if is_noisy {
            *noisy_direct += direct;
        }
    }
}

/// Adds the noisy light and the features of point `i` to those of its path, whose transmittance before the point and whose share
/// that stops there are given.
fn add_parts(
    parts: &mut SampleParts,
    frame: &Frame,
    batch: &ShadingBatch,
    i: usize,
    before: Rgb,
    stopped: f32,
) {
    let point = &batch.points[i];
    if point.is_shadow_catcher {
        return;
    }
    let k = batch.coefficients(i);
    let (block, lane) = batch.soa.lane(i);
    let arrives = before * k.opacity;
    parts.noisy.direct += arrives * vec3(&block.noisy_diffuse, lane);
    parts.noisy.specular += arrives * vec3(&block.noisy_specular, lane);
    let surface = &mut parts.surface;
    surface.diffuse_color += arrives * (k.k_d + batch.transmitted(i));
    if frame.refracts(point.id, &k) {
        surface.specular_color += arrives;
    } else if block.reflects(lane) {
        let k_r: Rgb = vec3(&block.k_r, lane);
        surface.specular_color += arrives * (k_r + Rgb::splat(block.k_r_coat[lane]));
    }
    surface.sheen_color += arrives * block.layered.get(lane).map_or(Rgb::ZERO, |point| point.k_a);
    surface.alpha += k.layers.alpha * stopped;
    let p: Vec3 = vec3(&block.p, lane);
    surface.albedo += k.color * stopped;
    surface.normal += block.n(lane).as_vec3() * stopped;
    surface.position += p * stopped;
    surface.coverage += stopped;
}

/// The surface points of a block as they are composited.
struct CompositedBlock {
    /// Light from the points.
    radiance: [[f32; LANES]; 3],
    /// Share of the light from behind that passes.
    transmittance: [[f32; LANES]; 3],
}

/// How much of a path's light comes from a point and from behind it.
struct CompositedShare {
    /// Transmittance in front of the point, without `medium`.
    before: Rgb,
    /// Transmittance of the medium that the path's ray crosses.
    medium: Rgb,
    /// Transmittance behind the point.
    behind: Rgb,
}

impl CompositedBlock {
    /// The block of `points`, of which the first has index `first`.
    #[inline(always)]
    fn new(frame: &Frame, batch: &ShadingBatch, first: usize, points: &[ShadingPoint]) -> CompositedBlock {
        let (block, _) = batch.soa.lane(first);
        let opacity = &block.k.opacity;
        let mut composited =
            CompositedBlock { radiance: [[0.0; LANES]; 3], transmittance: [[0.0; LANES]; 3] };
        let CompositedBlock { radiance, transmittance } = &mut composited;
        for c in 0..3 {
            for i in 0..LANES {
                radiance[c][i] = block.radiance[c][i] * opacity[i];
                transmittance[c][i] = 1.0 - opacity[i];
            }
        }
        // Most surfaces transmit nothing.
        if batch.has_transmission {
            for (lane, point) in points.iter().enumerate() {
                let k = block.k.get(lane);
                // Refracted rays carry the other light.
                if k.k_t != Rgb::ZERO && !frame.refracts(point.id, &k) {
                    let transmitted = k.k_t * batch.base_share(first + lane);
                    let uncovered = vec3(transmittance, lane);
                    set3(transmittance, lane, (uncovered + transmitted * k.opacity).to_array());
                }
            }
        }
        if frame.has_shadow_catcher() {
            for (lane, _) in points.iter().enumerate().filter(|(_, point)| point.is_shadow_catcher) {
                let lit = lit_share(vec3(&block.radiance, lane), vec3(&block.unshadowed, lane));
                set3(radiance, lane, [0.0; 3]);
                set3(transmittance, lane, (Rgb::ONE - (Rgb::ONE - lit) * opacity[lane]).to_array());
            }
        }
        composited
    }
}

/// The share of light that shadows leave, by colour; 1 where there is no light.
fn lit_share(light: Rgb, unshadowed: Rgb) -> Rgb {
    let share = |light: f32, all: f32| if all > 0.0 { (light / all).clamp(0.0, 1.0) } else { 1.0 };
    Rgb::new(share(light.x, unshadowed.x), share(light.y, unshadowed.y), share(light.z, unshadowed.z))
}
