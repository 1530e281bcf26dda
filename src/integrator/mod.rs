//! From eye rays to colours.
//!
//! An integrator sees a whole tile of samples and asks the accelerator for batches; it never sees
//! files or trees.

mod ambient_occlusion;
mod aov;
mod cryptomatte;
mod direct_light;
mod ground_plane;
mod material;
mod phong;
mod point;
mod sample_stream;
mod sampler;
mod shading_batch;
mod shadow_rays;
mod surface;

use glam::{DAffine3, DVec3, UVec2};

use crate::accel::{Accel, HitBatch, RayBatch, SegmentBatch};
use crate::geometry::{RayDifferential, Rgb, Rgba};
use crate::scene::{Camera, Ground, PosedLight, PosedScene, ResolvedLighting, SkyIrradiance};

pub use ambient_occlusion::AmbientOcclusion;
pub use aov::{Aov, FirstHit, first_hits};
pub use cryptomatte::{MatteCoverage, MatteKind, trace_mattes};
pub use material::coefficients::{Coefficients, MaterialOverrides, lobe};
pub use material::hit_filter::MaterialHitFilter;
pub use phong::{Phong, Stage};
pub(crate) use sampler::morton;
pub use sampler::{LowDiscrepancySampler, Sampler};
pub use surface::surface_point::SurfacePoint;

/// Everything that one picture is made from.
#[derive(Clone, Debug)]
pub struct Frame<'a> {
    /// The scene at its moment.
    pub posed: &'a PosedScene<'a>,
    /// Its trees.
    pub accel: &'a Accel,
    /// The lecture's camera.
    pub camera: Camera,
    /// Lights, in the lecture's units.
    pub lights: Vec<PosedLight>,
    /// I_a.
    pub ambient: Rgb,
    /// An I_a for every direction, in place of the even one.
    pub sky: Option<SkyIrradiance>,
    /// Coefficients given on the command line.
    pub overrides: MaterialOverrides,
    /// True: eye rays do not see back faces of single-sided materials.
    pub cull_back_faces: bool,
    /// False: every light reaches everything.
    pub shadows: bool,
    /// Weights the ambient term by how much of it arrives; `None`: all of it does.
    pub ambient_occlusion: Option<AmbientOcclusion>,
    /// A ground below the scene.
    pub ground: Option<Ground>,
    /// Scene to world: moves nothing unless the frame was [`Frame::with_scene_motion`].
    pub scene_to_world: DAffine3,
}

/// A sample of a pixel, at a place on the film: x to the right and y upward, both 0…1 over the whole
/// picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// To the right.
    pub x: f64,
    /// Upward.
    pub y: f64,
    /// The pixel, counted from the upper left corner of the whole picture.
    pub pixel: UVec2,
    /// Which of the pixel's samples.
    pub index: u32,
    /// Width and height of the film that it stands for: what is finer is averaged. 0 for a point.
    pub size: [f64; 2],
}

/// Memory that an integrator reuses from tile to tile.
#[derive(Default)]
pub struct Scratch {
    pub(crate) rays: RayBatch,
    pub(crate) hits: HitBatch,
    pub(crate) segments: SegmentBatch,
    pub(crate) free: Vec<Rgb>,
    pub(crate) blocked: Vec<bool>,
    /// From places on a light to its centre.
    pub(crate) within: SegmentBatch,
    pub(crate) within_free: Vec<Rgb>,
    pub(crate) kept: shading_batch::Kept,
}

/// Turns samples into colours: linear RGB premultiplied by alpha, 0 where nothing is seen.
pub trait Integrator: Sync {
    /// Writes a colour for each sample. `sampler` is the one that scene_to_world them.
    fn render(
        &self,
        frame: &Frame,
        samples: &[Sample],
        sampler: &LowDiscrepancySampler,
        scratch: &mut Scratch,
        out: &mut [Rgba],
    );

    /// False where all samples between two places on the film, x and y, are 0 for sure: they need not be
    /// asked for.
    fn may_hit(&self, frame: &Frame, low: [f64; 2], high: [f64; 2]) -> bool {
        let _ = (frame, low, high);
        true
    }
}

impl<'a> Frame<'a> {
    /// A frame lit as resolved, with shadows, single-sided back faces unseen and no coefficient
    /// overridden.
    pub fn new(
        posed: &'a PosedScene<'a>,
        accel: &'a Accel,
        camera: Camera,
        lit: &ResolvedLighting,
    ) -> Frame<'a> {
        Frame {
            posed,
            accel,
            camera,
            lights: lit.rig.lights.clone(),
            ambient: lit.rig.ambient,
            sky: lit.rig.sky,
            overrides: MaterialOverrides::default(),
            cull_back_faces: true,
            shadows: true,
            ambient_occlusion: None,
            ground: None,
            scene_to_world: DAffine3::IDENTITY,
        }
    }

    /// The same frame with the scene moved by a rotation and a shift, while camera, lights and sky
    /// stand still. It is those that are moved, the other way: the scene's trees stay as they are,
    /// and rays meet them as ever. A ground takes a turn about the vertical through its middle alone.
    pub fn with_scene_motion(mut self, motion: &DAffine3) -> Frame<'a> {
        if *motion == DAffine3::IDENTITY {
            return self;
        }
        let back = motion.inverse();
        self.camera = self.camera.transformed(&back);
        self.lights = self.lights.iter().map(|light| light.transformed(&back, self.posed.centre)).collect();
        self.scene_to_world = *motion * self.scene_to_world;
        self
    }

    /// Fills `rays` with the eye rays of `samples`, cut at the camera's planes.
    pub(crate) fn eye_rays(&self, samples: &[Sample], rays: &mut RayBatch) {
        use crate::accel::Coherence;
        use crate::scene::Projection;
        rays.clear();
        rays.cull_back_faces = self.cull_back_faces;
        let per_t = self.camera.depth_per_t();
        rays.t_min = (self.camera.clip.near / per_t) as f32;
        rays.t_max = (self.camera.clip.far / per_t) as f32;
        for s in samples {
            let ray = self.camera.eye_ray(s.x, s.y, self.posed.centre);
            rays.push(ray.o, ray.d);
        }
        rays.coherence = match (self.camera.projection, rays.is_empty()) {
            (_, true) => Coherence::None,
            (Projection::Perspective, _) => Coherence::Origin(rays.origins[0]),
            (Projection::Orthographic, _) => Coherence::Direction(rays.directions[0]),
        };
    }

    /// False where samples between two places on the film, x and y, see neither scene nor ground.
    pub(crate) fn may_hit(&self, low: [f64; 2], high: [f64; 2]) -> bool {
        let at = |x: f64, y: f64| self.camera.eye_ray(x, y, self.posed.centre);
        let around = || [at(low[0], low[1]), at(high[0], low[1]), at(high[0], high[1]), at(low[0], high[1])];
        self.ground.is_some() || self.accel.may_meet(&around())
    }

    /// I_a at a surface of shading normal `n`.
    pub(crate) fn ambient_at(&self, n: DVec3) -> Rgb {
        self.sky.map_or(self.ambient, |sky| sky.ambient(self.scene_to_world.matrix3 * n))
    }

    /// How an eye ray changes over a film of this size that it stands for; `None` for a point.
    pub(crate) fn differential(&self, [x, y]: [f64; 2]) -> Option<RayDifferential> {
        (x != 0.0 || y != 0.0).then(|| self.camera.ray_differential(x, y))
    }
}
