//! Integrators: from eye rays to colours.
//!
//! An integrator gets the samples of a tile at once and traces them in batches. Start with [`Phong`], the lecture's
//! shading model.

mod ambient_occlusion;
mod ambient_rays;
mod aov;
mod area_light_hits;
mod area_light_rays;
mod area_lighting;
mod back_sides;
mod blinn_phong;
mod block_lobes;
mod caustics;
mod compositor;
mod cryptomatte;
mod diffuse_rays;
mod direct_light;
mod edge_rays;
mod emitters;
mod environment_lighting;
mod environment_occlusion;
mod first_hit;
mod flow;
mod frame;
mod gather;
mod ground_plane;
mod highlight_limits;
mod last_bounce;
mod layer_split;
mod layers;
mod light_beyond;
mod light_choice;
mod light_layers;
mod light_parts;
mod light_points;
mod light_tree;
mod lobe_light;
mod lobe_samples;
mod material;
mod media;
mod microfacet_highlights;
mod object_hits;
mod path_rays;
mod paths;
mod phong;
mod point_layers;
mod reflection_rays;
mod sample;
mod sampler;
mod scratch;
mod secondary_rays;
mod shading_batch;
mod shadow_rays;
mod surface;
mod transmitted_highlights;
mod visibility;

use blinn_core::geometry::Rgba;

pub use aov::Aov;
pub use blinn_phong::specular_lobe;
pub use cryptomatte::{MatteCoverage, MatteKind, trace_mattes};
pub(crate) use edge_rays::{EdgePoint, visible_points};
pub use emitters::Emitters;
pub(crate) use first_hit::have_hits;
pub use first_hit::{FirstHit, first_hits};
pub use flow::{NeighbourFrames, add_flow};
pub use frame::{AmbientOcclusion, DEFAULT_BOUNCES, Frame};
pub use light_layers::{LightLayer, LightLayers, SampleLayers};
pub use light_parts::{LightSplit, NoisyLight, SampleParts, SeenFeatures, SurfaceFeatures};
pub use material::coefficients::{Coefficients, MaterialOverrides};
pub use material::hit_filter::MaterialHitFilter;
pub use material::specular_layers::SpecularLayers;
pub use object_hits::{ObjectHit, trace_objects};
pub use phong::{Phong, Stage};
pub use sample::Sample;
pub(crate) use sample::SampleDimension;
pub use sampler::{LowDiscrepancySampler, Sampler};
pub use scratch::Scratch;
pub use surface::round_hit::nearest_on_axis;
pub use surface::surface_point::SurfacePoint;
pub use surface::triangle_plane::barycentrics;
pub use visibility::{SurfaceTarget, sees};

/// Computes the colours of samples: linear RGB premultiplied by alpha, 0 where nothing is hit.
pub trait Integrator: Sync {
    /// Writes the colour of each sample to `out`. `sampler` is the one that placed the samples.
    fn render(
        &self,
        frame: &Frame,
        samples: &[Sample],
        sampler: &LowDiscrepancySampler,
        scratch: &mut Scratch,
        out: &mut [Rgba],
    );

    /// Writes the light of each sample to `out`, by part. The default is light without noise.
    fn render_parts(
        &self,
        frame: &Frame,
        samples: &[Sample],
        sampler: &LowDiscrepancySampler,
        scratch: &mut Scratch,
        split: LightSplit,
        out: &mut [SampleParts],
    ) {
        let _ = split;
        let mut colors = vec![Rgba::ZERO; out.len()];
        self.render(frame, samples, sampler, scratch, &mut colors);
        for (out, color) in out.iter_mut().zip(colors) {
            *out = SampleParts::exact(color);
        }
    }

    /// Writes the light of each sample to `out`, by layer and, with `split`, also by part. The default is nothing.
    fn render_layers(
        &self,
        frame: &Frame,
        samples: &[Sample],
        sampler: &LowDiscrepancySampler,
        scratch: &mut Scratch,
        split: Option<LightSplit>,
        out: &mut [SampleLayers],
    ) {
        let _ = (frame, samples, sampler, scratch, split);
        out.fill(SampleLayers::default());
    }

    /// False if all samples between the film positions `low` and `high` are certainly 0, so that they need not be
    /// rendered.
    fn may_hit(&self, frame: &Frame, low: [f64; 2], high: [f64; 2]) -> bool {
        let _ = (frame, low, high);
        true
    }
}
