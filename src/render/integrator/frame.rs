//! A frame: the posed scene, its acceleration structure, camera and lights, and how they are shaded.

use std::hint::black_box;
use std::sync::Arc;

use glam::{DAffine3, DVec2, DVec3, Vec3};

use crate::integrator::emitters::Emitters;
use crate::integrator::material::coefficients::{Coefficients, MaterialOverrides};
use crate::integrator::media::{Crossing, Medium, MediumStack, Wavelength};
use crate::integrator::sample::Sample;
use crate::integrator::surface::triangle_plane::TrianglePlane;
use blinn_accel::{Accel, Coherence, RayBatch, RoundSizes};
use blinn_core::geometry::{HitId, Ray, RayDifferential, Rgb};
use blinn_core::simd::SimdLevel;
use blinn_scene::{
    Camera, Environment, Ground, Material, PosedAreaLight, PosedLight, PosedScene, Projection,
    ResolvedLighting, SkyIrradiance,
};

/// [`Frame::bounces`] of a new frame.
pub const DEFAULT_BOUNCES: u8 = 4;

/// Everything that one picture is made from.
#[derive(Clone, Debug)]
pub struct Frame<'a> {
    /// The scene at the frame's time.
    pub posed: &'a PosedScene<'a>,
    /// Its acceleration structure.
    pub accel: &'a Accel,
    /// The lecture's camera.
    pub camera: Camera,
    /// Lights in the lecture's units.
    pub lights: Vec<PosedLight>,
    /// Area lights. Secondary rays meet them, eye rays and shadow rays pass.
    pub area_lights: Vec<PosedAreaLight>,
    /// The glowing surfaces that light others. Without it, only rays that meet them find their light.
    pub emitters: Option<Arc<Emitters>>,
    /// The lecture's I_a.
    pub ambient: Rgb,
    /// Replaces I_a by the light of a sky, which depends on the normal: the ambient irradiance of `environment`.
    pub sky: Option<SkyIrradiance>,
    /// The radiance of the same light from infinitely far away, which specular lobes and escaping rays meet, in the scene's
    /// coordinates; `None` is black.
    pub environment: Option<Environment>,
    /// The light that eye rays meet which pass the scene, in the scene's coordinates; `None` is nothing, which leaves
    /// pixels transparent.
    pub background: Option<Environment>,
    /// Maximum number of reflections along a path; a path may meet glass three times as often. 0: the lecture alone.
    pub bounces: u8,
    /// Maximum number of diffuse bounces along a path. With one or more, traced light takes the place of I_a.
    pub indirect: u8,
    /// True if indirect light includes what specular surfaces send to matte ones.
    pub caustics: bool,
    /// Coefficients that replace those of all materials.
    pub overrides: MaterialOverrides,
    /// True: eye rays pass through back faces of single-sided materials.
    pub cull_back_faces: bool,
    /// False: no light is ever blocked.
    pub shadows: bool,
    /// Scale of the colours of unlit materials: the inverse of the exposure, which does not affect them.
    pub unlit_scale: f32,
    /// Weights the ambient term by its visibility; `None`: all of it arrives.
    pub ambient_occlusion: Option<AmbientOcclusion>,
    /// A ground plane below the scene.
    pub ground: Option<Ground>,
    /// The sizes of points and lines along eye rays: they are not drawn in a new frame.
    pub rounds: RoundSizes,
    /// From the scene to the world: the identity unless [`Frame::with_scene_motion`] has moved it.
    pub scene_to_world: DAffine3,
}

/// Settings of ambient occlusion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AmbientOcclusion {
    /// Rays for each pixel, divided among its samples; each sample has at least one.
    pub samples: u32,
    /// Only surfaces nearer than this many metres occlude; infinite: all do.
    pub distance: f64,
}

impl<'a> Frame<'a> {
    /// A frame with the given lighting, with shadows and back-face culling, without overrides.
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
            area_lights: lit.rig.area_lights.clone(),
            emitters: lit.rig.glowing_surfaces.then(|| Emitters::new(posed).map(Arc::new)).flatten(),
            ambient: lit.rig.ambient,
            sky: lit.rig.sky,
            environment: lit.rig.environment.clone(),
            background: None,
            bounces: DEFAULT_BOUNCES,
            indirect: 0,
            caustics: false,
            overrides: MaterialOverrides::default(),
            cull_back_faces: true,
            shadows: true,
            unlit_scale: 1.0,
            ambient_occlusion: None,
            ground: None,
            rounds: RoundSizes::NONE,
            scene_to_world: DAffine3::IDENTITY,
        }
    }

    /// The same frame with the scene moved by a rotation and a translation, while camera, lights and sky stand still. It
    /// moves camera and lights by the inverse instead, so that the acceleration structure stays valid. Rotations about the
    /// vertical through a ground plane's centre are the only motions that keep the ground right.
    pub fn with_scene_motion(mut self, motion: &DAffine3) -> Frame<'a> {
        if *motion == DAffine3::IDENTITY {
            return self;
        }
        let inverse = motion.inverse();
        self.camera = self.camera.transformed(&inverse);
        self.lights =
            self.lights.iter().map(|light| light.transformed(&inverse, self.posed.centre)).collect();
        let centre = self.posed.centre;
        self.area_lights = self.area_lights.iter().map(|light| light.transformed(&inverse, centre)).collect();
        let rotate = |environment: Environment| environment.rotated(inverse.matrix3);
        self.environment = self.environment.map(rotate);
        self.background = self.background.map(rotate);
        self.scene_to_world = *motion * self.scene_to_world;
        self
    }

    /// The SIMD level that rays are traced and points are shaded with.
    pub(crate) fn simd(&self) -> SimdLevel {
        self.accel.simd()
    }

    /// The eye ray of a sample.
    #[inline]
    pub(crate) fn eye_ray(&self, sample: &Sample) -> Ray {
        self.camera.lens_ray(sample.x, sample.y, sample.aperture, self.posed.centre)
    }

    /// Fills `rays` with the eye rays of `samples`, between the camera's clip planes.
    pub(crate) fn generate_eye_rays(&self, samples: &[Sample], rays: &mut RayBatch) {
        rays.clear();
        rays.cull_back_faces = self.cull_back_faces;
        rays.rounds = self.rounds;
        let depth_per_t = self.camera.depth_per_t();
        rays.t_min = (self.camera.clip.near / depth_per_t) as f32;
        rays.t_max = (self.camera.clip.far / depth_per_t) as f32;
        if self.camera.lens.is_none() {
            let eye = self.camera.eye_rays(self.posed.centre);
            rays.origins.extend(samples.iter().map(|s| eye.at(s.x, s.y).o));
            rays.directions.extend(samples.iter().map(|s| eye.at(s.x, s.y).d));
        } else {
            for ray in samples.iter().map(|s| self.eye_ray(s)) {
                rays.push(ray.o, ray.d);
            }
        }
        let through_centre = samples.iter().all(|sample| sample.aperture == DVec2::ZERO);
        rays.coherence = match (self.camera.projection, through_centre && !rays.is_empty()) {
            (_, false) => Coherence::None,
            (Projection::Perspective, _) => Coherence::Origin(rays.origins[0]),
            (Projection::Orthographic, _) => Coherence::Direction(rays.directions[0]),
        };
    }

    /// The light of the background at a sample; `None` if there is none.
    #[inline]
    pub(crate) fn background_radiance(&self, sample: &Sample) -> Option<Rgb> {
        self.background.as_ref().map(|background| self.radiance_beyond(background, sample))
    }

    fn radiance_beyond(&self, background: &Environment, sample: &Sample) -> Rgb {
        let d = self.eye_ray(sample).d.as_dvec3();
        let length = d.length();
        let [x, y] = self.camera.ray_differential(sample.footprint[0], sample.footprint[1]).d;
        // The part of the view rectangle that the sample covers, seen from the eye.
        let solid_angle = x.cross(y).dot(d).abs() / (length * length * length);
        background.radiance((d / length).as_vec3(), solid_angle as f32)
    }

    /// False if eye rays between the film positions `low` and `high` certainly hit neither the scene nor the ground, and
    /// there is no background.
    pub(crate) fn may_hit(&self, low: [f64; 2], high: [f64; 2]) -> bool {
        let ray = |x: f64, y: f64| self.camera.eye_ray(x, y, self.posed.centre);
        let corners =
            || [ray(low[0], low[1]), ray(high[0], low[1]), ray(high[0], high[1]), ray(low[0], high[1])];
        let has_lens = self.camera.lens.is_some();
        has_lens || self.background.is_some() || self.ground.is_some() || self.accel.may_intersect(&corners())
    }

    /// True if whole paths of light are traced, as in Cycles: with indirect light.
    pub(crate) fn traces_full_paths(&self) -> bool {
        self.indirect > 0
    }

    /// True if random estimators find the light of sources with an area, or indirect light.
    pub(crate) fn has_area_sources(&self) -> bool {
        self.indirect > 0
            || self.emitters.is_some()
            || !self.area_lights.is_empty()
            || self.environment_sources().is_some()
    }

    /// The environment, if it lights surfaces and has light sources.
    pub(crate) fn environment_sources(&self) -> Option<&Environment> {
        self.environment.as_ref().filter(|environment| self.sky.is_some() && environment.has_light_sources())
    }

    /// True if a metal may reflect in a lobe that is wider than a mirror's.
    pub(crate) fn has_rough_metals(&self) -> bool {
        self.reflections_enabled() && self.posed.materials.iter().any(|material| material.is_rough_metal())
    }

    /// True if pictures of the frame may be noisy: with other random numbers, more than edges and textures changes.
    pub fn may_be_noisy(&self) -> bool {
        self.has_random_light() || self.has_rough_metals() || self.camera.lens.is_some()
    }

    /// True if random estimators find part of the light.
    pub(crate) fn has_random_light(&self) -> bool {
        self.has_area_sources()
            || self.ambient_occlusion.is_some()
            || self.lights.iter().any(|light| light.radius > 0.0)
    }

    /// I_a at a surface with shading normal `n`; 0 where indirect light is traced.
    #[inline]
    pub(crate) fn ambient_at(&self, n: DVec3) -> Rgb {
        if self.indirect > 0 {
            return Rgb::ZERO;
        }
        self.opaque_sky().map_or(self.ambient, |sky| sky.ambient(self.scene_to_world.matrix3 * n))
    }

    /// The sky, opaque to the compiler, which would else compute its constant term before a match, from arbitrary bytes if there
    /// is none: subnormal numbers, which are slow.
    #[inline]
    pub(crate) fn opaque_sky(&self) -> Option<&SkyIrradiance> {
        black_box(self.sky.as_ref())
    }

    /// Returns true if objects hide the environment from surfaces: with ambient occlusion or indirect light.
    #[inline]
    pub(crate) fn occludes_environment(&self) -> bool {
        (self.ambient_occlusion.is_some() || self.indirect > 0) && self.environment.is_some()
    }

    /// The light that diffuse rays meet which pass the scene, where it is the same in all directions.
    pub(crate) fn ambient_radiance(&self) -> Rgb {
        self.sky.map_or(self.ambient, |_| self.environment.as_ref().map_or(Rgb::ZERO, Environment::mean))
    }

    /// The environment that the ambient light comes from, without its light sources, unless it is a constant I_a.
    pub(crate) fn ambient_environment(&self) -> Option<Environment> {
        let environment = self.environment.as_ref().filter(|_| self.sky.is_some())?;
        environment.as_uniform().is_none().then(|| environment.ambient_part())
    }

    /// True if surfaces reflect and refract their surroundings. Any override of coefficients turns that off: glass is then
    /// thin.
    pub(crate) fn reflections_enabled(&self) -> bool {
        self.bounces > 0 && self.overrides == MaterialOverrides::default()
    }

    /// True if a triangle belongs to the surface of a solid (a body), and not to a thin wall.
    #[inline]
    pub(crate) fn is_body(&self, id: HitId) -> bool {
        // The ground has no triangles.
        id != HitId::NONE && self.posed.mesh(id.instance).is_body
    }

    /// True if the light that a point of triangle `id` with coefficients `k` transmits is carried by refracted rays. Other
    /// surfaces let it pass straight.
    #[inline]
    pub(crate) fn refracts(&self, id: HitId, k: &Coefficients) -> bool {
        // Where reflections are disabled no point has layers.
        k.transmission_weight > 0.0 && k.layers.reflects && self.is_body(id)
    }

    /// The material of a triangle's mesh.
    pub(crate) fn material(&self, id: HitId) -> &Material {
        &self.posed.materials[self.posed.mesh(id.instance).material as usize]
    }

    /// The inside of the body that a triangle belongs to.
    fn medium(&self, id: HitId) -> Medium {
        let instance = &self.posed.scene.instances[id.instance as usize];
        let material = self.material(id);
        let absorption = material.volume.map_or(Rgb::ZERO, |volume| volume.absorption());
        Medium {
            body: instance.object,
            ior: material.ior(),
            half_spread: material.half_spread_of_ior(),
            absorption,
        }
    }

    /// True if `n_g`, a geometric normal of triangle `id`, is that of its front face.
    pub(crate) fn is_front(&self, id: HitId, n_g: DVec3) -> bool {
        let flips_winding = self.posed.instances[id.instance as usize].transform.flips_winding;
        let plane = TrianglePlane::new(self.posed.world_triangle(id), flips_winding);
        plane.front_normal.is_none_or(|n| n.dot(n_g) > 0.0)
    }

    /// Crosses the surface of the body that a triangle belongs to, from the outside if a path is `entering`. Surfaces of
    /// Blender's files refract as if there were no other bodies: Blender renders them so.
    pub(crate) fn cross(
        &self,
        media: &MediumStack,
        id: HitId,
        entering: bool,
        wavelength: Wavelength,
    ) -> Crossing {
        let medium = self.medium(id);
        let crossing = media.cross(medium, entering, wavelength);
        if !self.posed.scene.source.is_blender() {
            return crossing;
        }
        let alone = MediumStack::EMPTY.cross(medium, entering, wavelength);
        Crossing { behind: crossing.behind, ..alone }
    }

    /// The ray differential of an eye ray over a footprint on the film; `None` for a point.
    pub(crate) fn ray_differential(&self, [x, y]: [f64; 2]) -> Option<RayDifferential> {
        (x != 0.0 || y != 0.0).then(|| self.camera.ray_differential(x, y))
    }
}

/// A distance from `p` that is beyond a sphere about the origin in every direction.
#[inline(always)]
pub(crate) fn distance_beyond(p: Vec3, radius: f64) -> f64 {
    1.01 * (p.as_dvec3().length() + radius) + f64::from(f32::MIN_POSITIVE)
}
