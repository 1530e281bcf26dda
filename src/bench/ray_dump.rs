//! The rays of a benchmark with their hits as NumPy arrays, for other engines.

use std::path::{Path, PathBuf};

use super::npz::{NpyArray, NpyType};
use super::rays::{RaySet, RaySets, TileBatch};
use super::record::MeasureError;
use super::stage::BenchStage;
use blinn_accel::{Accel, AccelSettings, Coherence, RayBatch, ShadowRayBatch, SimdLevel};
use blinn_core::geometry::{Hit, HitId, Ray};
use blinn_core::worded;
use blinn_import::{LoadOptions, Warning};
use blinn_render::RenderSettings;
use blinn_render::integrator::{Frame, MaterialHitFilter, SurfacePoint};
use blinn_scene::{Lighting, PoseSettings, PosedScene, View, pose};
use blinn_session::load_scene;

/// Bytes of all arrays for each ray.
const BYTES_PER_RAY: u64 = 75;
/// Bytes of all arrays for each triangle.
const BYTES_PER_TRIANGLE: u64 = 44;
/// The most bytes of an archive, which are in memory as a whole.
const MAX_BYTES: u64 = 4_000_000_000;

/// Settings of [`dump_rays`].
#[derive(Clone, Debug)]
pub struct DumpSettings {
    /// How the file is imported.
    pub load: LoadOptions,
    /// Converts .blend files, as [`blinn_session::load_scene`] says.
    pub blender: Option<PathBuf>,
    /// Width and height of the image in pixels.
    pub size: (u32, u32),
    /// The stages whose rays are collected.
    pub stages: Vec<BenchStage>,
    /// True if the scene's triangles are collected, too.
    pub triangles: bool,
    /// The SIMD level of ray traversal.
    pub simd: SimdLevel,
}

/// The arrays of a dump.
#[derive(Debug)]
pub struct RayDump {
    /// The arrays.
    pub arrays: Vec<NpyArray>,
    /// The number of rays.
    pub rays: usize,
    /// Warnings of the import.
    pub warnings: Vec<Warning>,
}

/// Collects the rays of a scene's default view, in tiles, as `blinn bench` traces them, with their hits.
///
/// # Errors
/// The scene cannot be imported or seen, or the arrays would have more than 4 GB.
pub fn dump_rays(file: &Path, settings: &DumpSettings) -> Result<RayDump, MeasureError> {
    let (scene, warnings) = load_scene(file, &settings.load, settings.blender.as_deref())?;
    let (width, height) = settings.size;
    let rays = u64::from(width) * u64::from(height) * settings.stages.len() as u64;
    let triangles = if settings.triangles { scene.instanced_triangle_count() } else { 0 };
    let bytes =
        rays.saturating_mul(BYTES_PER_RAY).saturating_add(triangles.saturating_mul(BYTES_PER_TRIANGLE));
    if bytes > MAX_BYTES {
        return Err(MeasureError::Rejected(worded!(
            "up to {} rays and {} triangles are too many for an .npz file; use a smaller `size`, fewer \
             `kinds` or no `triangles`",
            rays,
            triangles
        )));
    }
    let posed = pose(&scene, &PoseSettings::default())?;
    let build = AccelSettings { simd: settings.simd, ..AccelSettings::default() };
    let (accel, _) = Accel::build(&posed, &build);
    let (camera, _) = View::default().resolve(&posed, width, height)?;
    let lit = Lighting::default().resolve(&posed, &camera);
    let frame = Frame::new(&posed, &accel, camera, &lit);
    let render = RenderSettings { width, height, ..RenderSettings::default() };
    let mut columns = Columns::default();
    let mut sets = RaySets::new(&frame, &render);
    while let Some(set) = sets.next_set() {
        if settings.stages.contains(&set.stage) {
            columns.add(&frame, set);
        }
    }
    let rays = columns.kind.len();
    let mut arrays = columns.into_arrays();
    if settings.triangles {
        arrays.extend(triangle_arrays(&posed));
    }
    Ok(RayDump { arrays, rays, warnings })
}

/// The elements of all arrays in little-endian order.
#[derive(Default)]
struct Columns {
    kind: Vec<u8>,
    tile: Vec<u8>,
    pixel: Vec<u8>,
    origin: Vec<u8>,
    direction: Vec<u8>,
    t_min: Vec<u8>,
    t_max: Vec<u8>,
    cull_back_faces: Vec<u8>,
    source: Vec<u8>,
    t: Vec<u8>,
    id: Vec<u8>,
    barycentrics: Vec<u8>,
    occluded: Vec<u8>,
}

fn push_u32(out: &mut Vec<u8>, values: impl IntoIterator<Item = u32>) {
    values.into_iter().for_each(|value| out.extend(value.to_le_bytes()));
}

fn push_f32(out: &mut Vec<u8>, values: impl IntoIterator<Item = f32>) {
    push_u32(out, values.into_iter().map(f32::to_bits));
}

impl Columns {
    fn add(&mut self, frame: &Frame, set: &RaySet) {
        let filter = &MaterialHitFilter(frame.posed);
        let kind = BenchStage::ALL.iter().position(|stage| *stage == set.stage).unwrap_or_default() as u8;
        for (i, tile) in set.tiles.iter().enumerate() {
            let count = tile.batch.len();
            self.kind.extend(std::iter::repeat_n(kind, count));
            push_u32(&mut self.tile, std::iter::repeat_n(i as u32, count));
            push_u32(&mut self.pixel, tile.pixels.iter().flat_map(|pixel| [pixel.x, pixel.y]));
            match &tile.batch {
                TileBatch::Closest(rays) => {
                    let mut hits = Vec::new();
                    frame.accel.intersect(rays, filter, &mut hits);
                    self.add_closest(frame, rays, &hits);
                }
                TileBatch::Any(rays) => {
                    let mut occluded = Vec::new();
                    frame.accel.occluded(rays, filter, &mut occluded);
                    self.add_any(rays, &occluded);
                }
            }
        }
    }

    fn add_closest(&mut self, frame: &Frame, rays: &RayBatch, hits: &[Hit]) {
        for (i, hit) in hits.iter().enumerate() {
            let ray = Ray { o: rays.origins[i], d: rays.directions[i] };
            let b = match hit.is_miss() {
                true => [0.0; 2],
                false => SurfacePoint::at(frame.posed, hit, ray).barycentrics(),
            };
            push_f32(&mut self.origin, ray.o.to_array());
            push_f32(&mut self.direction, ray.d.to_array());
            push_f32(&mut self.t_min, [rays.t_min]);
            push_f32(&mut self.t_max, [rays.t_max]);
            self.cull_back_faces.push(u8::from(rays.cull_back_faces));
            self.add_id(HitId::NONE, *hit, b);
            self.occluded.push(0);
        }
    }

    fn add_any(&mut self, rays: &ShadowRayBatch, occluded: &[bool]) {
        for (i, &occluded) in occluded.iter().enumerate() {
            let from = rays.from[i];
            let (d, t_max) = match rays.coherence {
                Coherence::Direction(d) => (d, f32::INFINITY),
                Coherence::Origin(light) => (light - from, 1.0),
                Coherence::None => (rays.to[i] - from, 1.0),
            };
            push_f32(&mut self.origin, from.to_array());
            push_f32(&mut self.direction, d.to_array());
            push_f32(&mut self.t_min, [0.0]);
            push_f32(&mut self.t_max, [t_max]);
            self.cull_back_faces.push(0);
            self.add_id(rays.source[i], Hit::MISS, [0.0; 2]);
            self.occluded.push(u8::from(occluded));
        }
    }

    fn add_id(&mut self, source: HitId, hit: Hit, b: [f32; 2]) {
        push_u32(&mut self.source, [source.instance, source.triangle]);
        push_f32(&mut self.t, [hit.t]);
        push_u32(&mut self.id, [hit.id.instance, hit.id.triangle]);
        push_f32(&mut self.barycentrics, b);
    }

    fn into_arrays(self) -> Vec<NpyArray> {
        let n = self.kind.len();
        let array = |name, element, width: usize, data| {
            let shape = if width == 1 { vec![n] } else { vec![n, width] };
            NpyArray { name, element, shape, data }
        };
        use NpyType::{Bool, F32, U8, U32};
        vec![
            kind_names(),
            array("kind", U8, 1, self.kind),
            array("tile", U32, 1, self.tile),
            array("pixel", U32, 2, self.pixel),
            array("origin", F32, 3, self.origin),
            array("direction", F32, 3, self.direction),
            array("t_min", F32, 1, self.t_min),
            array("t_max", F32, 1, self.t_max),
            array("cull_back_faces", Bool, 1, self.cull_back_faces),
            array("source", U32, 2, self.source),
            array("t", F32, 1, self.t),
            array("id", U32, 2, self.id),
            array("barycentrics", F32, 2, self.barycentrics),
            array("occluded", Bool, 1, self.occluded),
        ]
    }
}

/// The name of each number in the array `kind`.
fn kind_names() -> NpyArray {
    let length = BenchStage::ALL.iter().map(|stage| stage.name().len()).max().unwrap_or(1);
    let mut data = Vec::new();
    for stage in BenchStage::ALL {
        let padding = std::iter::repeat_n(0, length - stage.name().len());
        data.extend(stage.name().bytes().chain(padding));
    }
    NpyArray { name: "kinds", element: NpyType::Bytes(length), shape: vec![BenchStage::ALL.len()], data }
}

/// The vertices of all visible triangles in the coordinates of the rays, and their ids.
fn triangle_arrays(posed: &PosedScene) -> [NpyArray; 2] {
    let (mut vertices, mut ids) = (Vec::new(), Vec::new());
    let mut count = 0;
    let is_visible = |&instance: &u32| posed.instances[instance as usize].visible;
    for instance in (0..posed.instances.len() as u32).filter(is_visible) {
        for triangle in 0..posed.mesh(instance).triangles.len() as u32 {
            let corners = posed.world_triangle(HitId { instance, triangle });
            push_f32(&mut vertices, corners.iter().flat_map(|corner| corner.to_array()));
            push_u32(&mut ids, [instance, triangle]);
            count += 1;
        }
    }
    [
        NpyArray {
            name: "triangle_vertices",
            element: NpyType::F32,
            shape: vec![count, 3, 3],
            data: vertices,
        },
        NpyArray { name: "triangle_id", element: NpyType::U32, shape: vec![count, 2], data: ids },
    ]
}
