//! Rays, hits and triangles that `blinn rays --dump FILE.npz --triangles` wrote.

use std::collections::HashMap;
use std::path::Path;

use blinn::accel::{Coherence, RayBatch, ShadowRayBatch};
use blinn::geometry::HitId;
use blinn_scenes::{GeneratedInstance, GeneratedMesh, GeneratedScene};
use glam::Vec3;

use crate::engines::HitDistances;
use crate::npz::NpzFile;
use crate::rays::{Batch, MARGIN, RaySet};

/// The content of an archive.
pub struct RayDump {
    /// All triangles as one mesh without shared vertices, in the order of the archive.
    pub scene: GeneratedScene,
    pub sets: Vec<DumpedSet>,
    /// Width and height of the image in pixels.
    pub size: (u32, u32),
}

/// The rays of one kind with the hits that the archive holds.
pub struct DumpedSet {
    pub rays: RaySet,
    pub expected: HitDistances,
}

/// The columns of an archive.
struct Columns {
    kind: Vec<u8>,
    tile: Vec<[u32; 1]>,
    pixel: Vec<[u32; 2]>,
    origin: Vec<[f32; 3]>,
    direction: Vec<[f32; 3]>,
    t_min: Vec<[f32; 1]>,
    t_max: Vec<[f32; 1]>,
    culls: Vec<bool>,
    source: Vec<[u32; 2]>,
    t: Vec<[f32; 1]>,
    occluded: Vec<bool>,
}

/// The kinds of rays that ask for any hit.
const ANY: [&str; 3] = ["shadow", "sun", "ao"];

impl RayDump {
    /// Reads an archive.
    pub fn read(path: &Path) -> Result<RayDump, String> {
        let located = |error: String| format!("{}: {error}", path.display());
        let file = NpzFile::open(path)?;
        let columns = Columns::read(&file).map_err(located)?;
        let mut scene = soup(&file).map_err(|e| located(format!("{e}; dump with --triangles")))?;
        scene.name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let ids = file.integers::<2>("triangle_id").map_err(located)?;
        let ids: HashMap<[u32; 2], u32> = ids.into_iter().zip(0..).collect();
        let extent = extent(&scene.meshes[0]);
        let mut sets = Vec::new();
        for (kind, name) in file.texts("kinds").map_err(located)?.into_iter().enumerate() {
            let rows: Vec<usize> =
                (0..columns.kind.len()).filter(|&i| columns.kind[i] as usize == kind).collect();
            if !rows.is_empty() {
                sets.push(columns.set(name, &rows, &ids, extent));
            }
        }
        let side = |axis: usize| columns.pixel.iter().map(|pixel| pixel[axis] + 1).max().unwrap_or(0);
        Ok(RayDump { scene, sets, size: (side(0), side(1)) })
    }
}

impl Columns {
    fn read(file: &NpzFile) -> Result<Columns, String> {
        let columns = Columns {
            kind: file.bytes("kind")?.to_vec(),
            tile: file.integers("tile")?,
            pixel: file.integers("pixel")?,
            origin: file.floats("origin")?,
            direction: file.floats("direction")?,
            t_min: file.floats("t_min")?,
            t_max: file.floats("t_max")?,
            culls: file.flags("cull_back_faces")?,
            source: file.integers("source")?,
            t: file.floats("t")?,
            occluded: file.flags("occluded")?,
        };
        let n = columns.kind.len();
        let lengths = [
            columns.tile.len(),
            columns.pixel.len(),
            columns.origin.len(),
            columns.direction.len(),
            columns.t_min.len(),
            columns.t_max.len(),
            columns.culls.len(),
            columns.source.len(),
            columns.t.len(),
            columns.occluded.len(),
        ];
        if lengths.iter().any(|&length| length != n) {
            return Err(format!("the arrays have different lengths: {lengths:?}"));
        }
        Ok(columns)
    }

    /// The set of some rows, a batch for each tile.
    fn set(&self, name: String, rows: &[usize], ids: &HashMap<[u32; 2], u32>, extent: f32) -> DumpedSet {
        let is_any = ANY.contains(&name.as_str());
        let length = Vec3::from(self.direction[rows[0]]).length().max(f32::MIN_POSITIVE);
        let margin = if name == "eye" { 0.0 } else { MARGIN * extent / length };
        let mut rays = RaySet { name, batches: Vec::new(), packet_order: Vec::new(), margin };
        let mut expected = Vec::new();
        for rows in rows.chunk_by(|&a, &b| self.tile[a] == self.tile[b]) {
            let batch = if is_any {
                Batch::Any(self.occlusion_batch(rows, ids))
            } else {
                Batch::Closest(self.ray_batch(rows))
            };
            rays.batches.push(batch);
            rays.packet_order.push(self.square_order(rows));
            let result = |&i: &usize| match (is_any, self.occluded[i]) {
                (false, _) => self.t[i][0],
                (true, true) => 0.0,
                (true, false) => f32::INFINITY,
            };
            expected.push(rows.iter().map(result).collect());
        }
        DumpedSet { rays, expected }
    }

    fn ray_batch(&self, rows: &[usize]) -> RayBatch {
        let origins: Vec<Vec3> = rows.iter().map(|&i| self.origin[i].into()).collect();
        let directions: Vec<Vec3> = rows.iter().map(|&i| self.direction[i].into()).collect();
        let coherence = match (shared(&origins), shared(&directions)) {
            (Some(origin), _) => Coherence::Origin(origin),
            (None, Some(direction)) => Coherence::Direction(direction),
            (None, None) => Coherence::None,
        };
        let (t_min, t_max) = (self.t_min[rows[0]][0], self.t_max[rows[0]][0]);
        // No peer culls, and the mesh is double-sided.
        RayBatch { coherence, origins, directions, t_min, t_max, ..RayBatch::default() }
    }

    /// Rays to a sun go on for ever. Others end after their direction, at a light if that is one point.
    fn occlusion_batch(&self, rows: &[usize], ids: &HashMap<[u32; 2], u32>) -> ShadowRayBatch {
        let from: Vec<Vec3> = rows.iter().map(|&i| self.origin[i].into()).collect();
        let directions: Vec<Vec3> = rows.iter().map(|&i| self.direction[i].into()).collect();
        let to: Vec<Vec3> = from.iter().zip(&directions).map(|(from, d)| from + d).collect();
        let coherence = match shared(&directions) {
            Some(direction) if self.t_max[rows[0]][0].is_infinite() => Coherence::Direction(direction),
            _ => common_end(&from, &to).map_or(Coherence::None, Coherence::Origin),
        };
        let source = |&i: &usize| {
            ids.get(&self.source[i]).map_or(HitId::NONE, |&triangle| HitId { instance: 0, triangle })
        };
        let source = rows.iter().map(source).collect();
        ShadowRayBatch { coherence, from, to, source, ..ShadowRayBatch::default() }
    }

    /// The order of squares of 4 × 4 pixels.
    fn square_order(&self, rows: &[usize]) -> Vec<u32> {
        let mut order: Vec<u32> = (0..rows.len() as u32).collect();
        order.sort_by_key(|&k| {
            let [x, y] = self.pixel[rows[k as usize]];
            (y / 4, x / 4, y % 4, x % 4)
        });
        order
    }
}

/// The vector that all are, if there is one.
fn shared(vectors: &[Vec3]) -> Option<Vec3> {
    let first = *vectors.first()?;
    vectors.iter().all(|v| *v == first).then_some(first)
}

/// The point where all rays end, up to rounding.
fn common_end(from: &[Vec3], to: &[Vec3]) -> Option<Vec3> {
    let first = *to.first()?;
    let is_near = |(from, to): (&Vec3, &Vec3)| {
        let size = from.abs().max(first.abs()).max_element();
        (to - first).abs().max_element() <= 4.0 * f32::EPSILON * size
    };
    from.iter().zip(to).all(is_near).then_some(first)
}

/// The triangles as a mesh.
fn soup(file: &NpzFile) -> Result<GeneratedScene, String> {
    let corners = file.floats::<9>("triangle_vertices")?;
    let positions: Vec<[f32; 3]> = corners
        .iter()
        .flat_map(|t| *t.as_chunks::<3>().0.first_chunk::<3>().unwrap_or(&[[0.0; 3]; 3]))
        .collect();
    let triangles = (0..corners.len() as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    let mesh = GeneratedMesh { positions, triangles, ..GeneratedMesh::default() };
    Ok(GeneratedScene {
        name: String::new(),
        meshes: vec![mesh],
        instances: vec![GeneratedInstance::identity(0)],
        eye: [0.0; 3],
        target: [0.0; 3],
        yfov: 40.0,
        light: [0.0; 3],
        sun_direction: [0.0, -1.0, 0.0],
        textured: false,
    })
}

/// The longest side of a mesh's bounds.
fn extent(mesh: &GeneratedMesh) -> f32 {
    let points = || mesh.positions.iter().map(|&p| Vec3::from(p));
    let (low, high) =
        (points().fold(Vec3::INFINITY, Vec3::min), points().fold(Vec3::NEG_INFINITY, Vec3::max));
    (high - low).max_element().max(0.0)
}
