//! Shadow rays: the visibility of a light from the points that face it.

use glam::{DVec3, Vec3};

use crate::integrator::area_light_rays::{AreaLightRays, ComputeAreaLightRays};
use crate::integrator::caustics::OpaqueBodies;
use crate::integrator::frame::Frame;
use crate::integrator::material::hit_filter::MaterialHitFilter;
use crate::integrator::sample::{SampleDimension, SampleStream};
use crate::integrator::shading_batch::ShadingBatch;
use crate::integrator::surface::soa::{LANES, vec3};
use blinn_accel::{Coherence, HitFilter, ShadowRayBatch};
use blinn_core::geometry::{HitId, Rgb};
use blinn_scene::PosedLightKind;

/// A ray from a point to a light that shines on it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ShadowRay {
    /// Index of the point.
    pub point: usize,
    /// Unit direction to the light's centre.
    pub l_centre: DVec3,
    pub origin: Vec3,
    /// True if the light is in front of the point's triangle, and not only of the smooth surface.
    pub light_in_front: bool,
}

/// The shadow rays of one light, and memory to trace them and the rays of ambient occlusion.
#[derive(Default)]
pub(crate) struct ShadowBuffers {
    pub rays: Vec<ShadowRay>,
    /// The share of light that each ray finds unblocked, by colour.
    pub visibility: Vec<Rgb>,
    pub traced_rays: ShadowRayBatch,
    pub occluded: Vec<bool>,
    /// From points on an area light to its centre.
    emitter_rays: ShadowRayBatch,
    emitter_visibility: Vec<Rgb>,
}

/// Traces the shadow rays to a light and stores their visibility.
pub(crate) fn trace_visibility(
    frame: &Frame,
    light_index: usize,
    batch: &ShadingBatch,
    stream: SampleStream,
    buffers: &mut ShadowBuffers,
) {
    if frame.lights[light_index].radius > 0.0 {
        trace_area_light(frame, light_index, batch, stream, buffers);
    } else {
        trace_centre_visibility(frame, light_index, batch, buffers);
    }
}

/// Multiplies the current light at the points by the visibility of their shadow rays.
pub(crate) fn apply_visibility(batch: &mut ShadingBatch, buffers: &ShadowBuffers) {
    let blocked = |(_, visibility): &(_, &Rgb)| **visibility != Rgb::ONE;
    for (ray, &visibility) in buffers.rays.iter().zip(&buffers.visibility).filter(blocked) {
        let (block, lane) = batch.soa.lane_mut(ray.point);
        block.apply_visibility(lane, visibility);
    }
}

/// Multiplies the specular part of the current light at the points by the visibility of their shadow rays.
pub(crate) fn apply_specular_visibility(batch: &mut ShadingBatch, buffers: &ShadowBuffers) {
    let blocked = |(_, visibility): &(_, &Rgb)| **visibility != Rgb::ONE;
    for (ray, &visibility) in buffers.rays.iter().zip(&buffers.visibility).filter(blocked) {
        let (block, lane) = batch.soa.lane_mut(ray.point);
        block.apply_specular_visibility(lane, visibility);
    }
}

/// Traces the shadow rays to the centre of a light and stores their visibility: the sharp shadows of a light without extent.
pub(crate) fn trace_centre_visibility(
    frame: &Frame,
    light_index: usize,
    batch: &ShadingBatch,
    buffers: &mut ShadowBuffers,
) {
    let light = &frame.lights[light_index];
    let ShadowBuffers { rays, traced_rays, .. } = buffers;
    traced_rays.clear();
    let position = light.position();
    traced_rays.coherence = match light.kind {
        PosedLightKind::Directional { direction } => Coherence::Direction(-direction),
        _ => Coherence::Origin(position.unwrap_or_default()),
    };
    traced_rays.from.extend(rays.iter().map(|ray| ray.origin));
    traced_rays.source.extend(rays.iter().map(|ray| batch.excluded_triangle(ray.point, ray.light_in_front)));
    traced_rays.to.resize(rays.len(), position.unwrap_or_default());
    trace_shadow_rays(frame, traced_rays, &mut buffers.occluded, &mut buffers.visibility);
    if frame.opaque_ground_height().is_none() {
        return;
    }
    for (ray, visibility) in buffers.rays.iter().zip(&mut buffers.visibility) {
        let to_light = position.map_or(ray.l_centre, |p| p.as_dvec3() - ray.origin.as_dvec3());
        if frame.ground_blocks(ray.origin, to_light, position.is_none()) {
            *visibility = Rgb::ZERO;
        }
    }
}

/// Soft shadows of a light with a radius. Each sample of a pixel tests one point of the disc that the light presents to
/// the surface point; the mean over the samples is the visible share of the light.
fn trace_area_light(
    frame: &Frame,
    light_index: usize,
    batch: &ShadingBatch,
    stream: SampleStream,
    buffers: &mut ShadowBuffers,
) {
    let light = &frame.lights[light_index];
    let ShadowBuffers { rays, traced_rays, .. } = buffers;
    traced_rays.clear();
    traced_rays.coherence = Coherence::None;
    // True below the horizon of the smooth surface or of the ground.
    let mut hidden = Vec::with_capacity(rays.len());
    let mut computed = AreaLightRays::ZERO;
    for rays in rays.chunks(LANES) {
        for (i, ray) in rays.iter().enumerate() {
            let (block, lane) = batch.soa.lane(ray.point);
            computed.load(i, block, lane, ray.l_centre);
        }
        let u = points_of_light(frame, light_index, batch, stream, rays);
        let scene_radius = frame.posed.bounding_radius();
        frame.simd().run(ComputeAreaLightRays { light, u: &u, scene_radius, rays: &mut computed });
        for (i, ray) in rays.iter().enumerate() {
            let (from, to) = (vec3(&computed.from, i), vec3(&computed.to, i));
            traced_rays.push(from, to, batch.excluded_triangle(ray.point, computed.in_front[i]));
            hidden.push(!computed.is_facing[i]);
        }
    }
    if frame.opaque_ground_height().is_some() {
        let to_infinity = light.position().is_none();
        for (hidden, (from, to)) in hidden.iter_mut().zip(traced_rays.from.iter().zip(&traced_rays.to)) {
            *hidden |= frame.ground_blocks(*from, to.as_dvec3() - from.as_dvec3(), to_infinity);
        }
    }
    trace_shadow_rays(frame, traced_rays, &mut buffers.occluded, &mut buffers.visibility);
    for (visibility, _) in buffers.visibility.iter_mut().zip(&hidden).filter(|(_, hidden)| **hidden) {
        *visibility = Rgb::ZERO;
    }
    if let Some(centre) = light.position() {
        block_hidden_emitters(frame, centre, buffers);
    }
}

/// The points of the unit square for the rays of points to one light.
fn points_of_light(
    frame: &Frame,
    light_index: usize,
    batch: &ShadingBatch,
    stream: SampleStream,
    rays: &[ShadowRay],
) -> [[f32; LANES]; 2] {
    let mut positions = [None; LANES];
    for (position, ray) in positions.iter_mut().zip(rays) {
        *position = stream.sequence_position(batch.points[ray.point].path, 1);
    }
    let dimension = SampleDimension::Light(light_index);
    let alone = |i: usize| stream.get_2d(batch.points[rays[i].point].path, dimension);
    stream.points_of_lanes(frame.simd(), dimension, &positions, rays.len(), alone)
}

/// Blocks the points of an area light that its centre does not see: a light that is wider than its fixture, or nearer to a
/// wall than its radius, would shine through.
fn block_hidden_emitters(frame: &Frame, centre: Vec3, buffers: &mut ShadowBuffers) {
    let ShadowBuffers { visibility, traced_rays, occluded, emitter_rays, emitter_visibility, .. } = buffers;
    let visible: Vec<usize> = (0..traced_rays.len()).filter(|&i| visibility[i] != Rgb::ZERO).collect();
    emitter_rays.clear();
    emitter_rays.coherence = Coherence::Origin(centre);
    for &i in &visible {
        emitter_rays.push(traced_rays.to[i], centre, HitId::NONE);
    }
    trace_shadow_rays(frame, emitter_rays, occluded, emitter_visibility);
    for (&i, &from_centre) in visible.iter().zip(emitter_visibility.iter()) {
        visibility[i] *= from_centre;
    }
}

/// Traces `rays` and stores the share of light that passes each, by colour.
fn trace_shadow_rays(
    frame: &Frame,
    rays: &ShadowRayBatch,
    occluded: &mut Vec<bool>,
    visibility: &mut Vec<Rgb>,
) {
    visibility.clear();
    let filter = MaterialHitFilter(frame.posed);
    if frame.accel.has_translucent() {
        let blocks_glass = frame.leaves_out_caustics();
        let opaque_bodies = OpaqueBodies { filter: MaterialHitFilter(frame.posed), blocks_glass };
        let filter: &dyn HitFilter = if frame.indirect > 0 { &opaque_bodies } else { &filter };
        frame.accel.transmittance(rays, filter, visibility);
    } else {
        frame.accel.occluded(rays, &filter, occluded);
        visibility.extend(occluded.iter().map(|&occluded| if occluded { Rgb::ZERO } else { Rgb::ONE }));
    }
}

impl ShadowBuffers {
    /// Traces `traced_rays` in a scene without translucent surfaces and stores which are occluded.
    pub fn trace_occlusion(&mut self, frame: &Frame) {
        frame.accel.occluded(&self.traced_rays, &MaterialHitFilter(frame.posed), &mut self.occluded);
    }

    /// Traces `traced_rays` and stores their visibility.
    pub fn trace(&mut self, frame: &Frame) {
        trace_shadow_rays(frame, &self.traced_rays, &mut self.occluded, &mut self.visibility);
    }
}
