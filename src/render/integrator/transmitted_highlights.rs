//! Light sources that are seen through rough glass: microfacets of a body refract light from the other side to the
//! viewer, as they do with the surroundings.
//!
//! The shadow ray starts behind the surface and passes other glass straight.

use glam::DVec3;

use crate::integrator::compositor::Compositor;
use crate::integrator::frame::Frame;
use crate::integrator::highlight_limits::max_share;
use crate::integrator::layers::dielectric_boundary::{BoundaryFilm, DielectricBoundary};
use crate::integrator::material::highlight_lobe::transmitted_lobe;
use crate::integrator::media::Wavelength;
use crate::integrator::sample::SampleStream;
use crate::integrator::shading_batch::ShadingBatch;
use crate::integrator::shadow_rays::{ShadowBuffers, ShadowRay, trace_centre_visibility};
use crate::integrator::surface::highlights::MIN_HIGHLIGHT_ALPHA;
use crate::integrator::surface::soa::{dvec3, set3, vec3};
use blinn_core::geometry::Rgb;

/// A point of rough glass.
struct RoughGlass {
    /// Index of the point.
    point: usize,
    n: DVec3,
    n_g: DVec3,
    v: DVec3,
    /// α² of the microfacets.
    alpha2: f64,
    /// The boundary for the colours of the path: once, or for each channel.
    boundaries: Vec<(Rgb, DielectricBoundary)>,
    /// Factor of transmitted light, apart from Fresnel's.
    weight: Rgb,
    /// Maximum radiance of a light over its irradiance.
    max_share: f32,
}

/// Adds the light of all sources behind points of rough glass to the radiance of the points.
pub(crate) fn add_transmitted_highlights(
    frame: &Frame,
    compositor: &Compositor,
    batch: &mut ShadingBatch,
    stream: SampleStream,
    shadow: &mut ShadowBuffers,
) {
    if frame.lights.is_empty() || !batch.has_transmission {
        return;
    }
    let mut points: Vec<RoughGlass> =
        (0..batch.points.len()).filter_map(|i| RoughGlass::new(frame, compositor, batch, i)).collect();
    if stream.wave > 0 && !frame.traces_full_paths() {
        points.iter_mut().for_each(|point| point.limit(frame, batch));
    }
    if points.is_empty() {
        return;
    }
    for (index, light) in frame.lights.iter().enumerate() {
        let mut lit = Vec::new();
        shadow.rays.clear();
        for point in &points {
            let (block, lane) = batch.soa.lane(point.point);
            let sample = light.sample(vec3(&block.p, lane));
            let light = point.transmitted(sample.l, light.intensity * sample.attenuation);
            if light.max_element() > 0.0 {
                let origin = batch.origin_behind(point.point);
                let ray = ShadowRay { point: point.point, l_centre: sample.l, origin, light_in_front: false };
                shadow.rays.push(ray);
                lit.push(light);
            }
        }
        if frame.shadows {
            trace_centre_visibility(frame, index, batch, shadow);
        } else {
            shadow.visibility.clear();
            shadow.visibility.resize(lit.len(), Rgb::ONE);
        }
        for ((ray, visibility), light) in shadow.rays.iter().zip(&shadow.visibility).zip(lit) {
            let (block, lane) = batch.soa.lane_mut(ray.point);
            let radiance = vec3(&block.radiance, lane) + light * *visibility;
            set3(&mut block.radiance, lane, radiance.to_array());
        }
    }
}

impl RoughGlass {
    /// Point `i` of a batch, if it refracts light in a lobe.
    fn new(frame: &Frame, compositor: &Compositor, batch: &ShadingBatch, i: usize) -> Option<RoughGlass> {
        let point = &batch.points[i];
        let k = batch.coefficients(i);
        if !k.layers.has_highlights || !frame.refracts(point.id, &k) {
            return None;
        }
        let state = compositor.rays.states.get(point.path)?;
        let alpha = k.layers.alpha;
        if alpha == 0.0 {
            return None;
        }
        let entering = batch.is_front(i)?;
        let crossing = |wavelength| frame.cross(&state.media, point.id, entering, wavelength);
        let of_path = crossing(state.wavelength);
        let (block, lane) = batch.soa.lane(i);
        let film = block.layered.get(lane).and_then(|point| point.film);
        let boundary = |eta: f64| DielectricBoundary {
            eta,
            f90: k.layers.dielectric_f90,
            film: film.map(|film| BoundaryFilm { film: film.over(&k.layers), share: film.share, entering }),
        };
        // Lights have no size, and so no image behind smooth glass: narrower lobes fade out.
        let scale = (alpha / MIN_HIGHLIGHT_ALPHA).min(1.0);
        let alpha = alpha.clamp(MIN_HIGHLIGHT_ALPHA, 1.0);
        Some(RoughGlass {
            point: i,
            n: block.n_specular(lane),
            n_g: dvec3(&block.n_g, lane),
            v: block.v(lane),
            alpha2: f64::from(alpha * alpha),
            boundaries: match of_path.disperses && state.wavelength == Wavelength::White {
                true => Wavelength::CHANNELS.map(|of| (of.mask(), boundary(crossing(of).eta))).to_vec(),
                false => vec![(Rgb::ONE, boundary(of_path.eta))],
            },
            weight: k.surface_tint() * (k.transmission_weight * scale),
            max_share: f32::INFINITY,
        })
    }

    /// Limits the highlight of each light.
    fn limit(&mut self, frame: &Frame, batch: &ShadingBatch) {
        let (block, lane) = batch.soa.lane(self.point);
        let mut sum = 0.0;
        for light in &frame.lights {
            let sample = light.sample(vec3(&block.p, lane));
            let irradiance = (light.intensity * sample.attenuation).element_sum() / 3.0;
            sum += irradiance * self.n.dot(sample.l).abs() as f32;
        }
        self.max_share = max_share(sum);
    }

    /// The radiance that goes to the viewer of a light in direction `l` with irradiance I/r².
    fn transmitted(&self, l: DVec3, irradiance: Rgb) -> Rgb {
        let cos = -self.n.dot(l);
        if !(cos > 0.0 && self.n_g.dot(l) < 0.0 && irradiance.max_element() > 0.0) {
            return Rgb::ZERO;
        }
        let shares = self.boundaries.iter().map(|(colors, boundary)| {
            let [lobe, v_h] = transmitted_lobe(self.n, l, self.v, self.alpha2, boundary.eta);
            let transmittance = Rgb::ONE - boundary.reflectance(v_h);
            (transmittance * lobe as f32).min(Rgb::splat(self.max_share * cos as f32)) * *colors
        });
        self.weight * irradiance * shares.reduce(|sum, share| sum + share).unwrap_or_default()
    }
}
