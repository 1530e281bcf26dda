//! The rays of a stage: tracing them, hashing their hits and counting traversal steps.

use glam::UVec2;
use rayon::prelude::*;

use crate::stage::BenchStage;
use crate::work_hash::WorkHash;
use blinn_accel::{Accel, HitBatch, RayBatch, ShadowRayBatch, TraversalStats};
use blinn_render::integrator::MaterialHitFilter;
use blinn_scene::PosedScene;

/// Traversal steps are counted in about this many tiles, since counting is slow.
const COUNTED_TILES: usize = 64;

/// The rays of a stage, in a batch for each tile.
#[derive(Clone, Debug)]
pub struct RaySet {
    /// The stage.
    pub stage: BenchStage,
    /// The tiles in the order of [`blinn_render::Film::tiles`].
    pub tiles: Vec<TileRays>,
}

/// The rays of a tile.
#[derive(Clone, Debug)]
pub struct TileRays {
    /// The rays.
    pub batch: TileBatch,
    /// The pixel of each ray.
    pub pixels: Vec<UVec2>,
}

/// A batch of rays for one of the queries of [`Accel`].
#[derive(Clone, Debug)]
pub enum TileBatch {
    /// For closest hits.
    Closest(RayBatch),
    /// For occlusion.
    Any(ShadowRayBatch),
}

impl TileBatch {
    /// The number of rays.
    pub fn len(&self) -> usize {
        match self {
            TileBatch::Closest(rays) => rays.len(),
            TileBatch::Any(segments) => segments.len(),
        }
    }

    /// Returns true without rays.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

/// Mean numbers of nodes, blocks and triangles that a ray visits if it is traced alone.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct MeanSteps {
    /// Inner nodes of eight boxes.
    pub nodes: f64,
    /// Blocks of up to four triangles.
    pub blocks: f64,
    /// Triangles.
    pub triangles: f64,
}

/// Memory for the answers of a tile.
#[derive(Default)]
struct Answers {
    hits: HitBatch,
    occluded: Vec<bool>,
}

impl RaySet {
    /// The number of rays.
    pub fn len(&self) -> u64 {
        self.tiles.iter().map(|tile| tile.batch.len() as u64).sum()
    }

    /// Returns true without rays.
    pub fn is_empty(&self) -> bool {
        self.tiles.iter().all(|tile| tile.batch.is_empty())
    }

    /// Traces all rays on the current thread pool. Returns the number of hits or of occluded segments.
    pub fn trace(&self, accel: &Accel, posed: &PosedScene) -> u64 {
        let filter = &MaterialHitFilter(posed);
        let count = |answers: &mut Answers, tile: &TileRays| match &tile.batch {
            TileBatch::Closest(rays) => {
                accel.intersect(rays, filter, &mut answers.hits);
                answers.hits.iter().filter(|hit| !hit.is_miss()).count() as u64
            }
            TileBatch::Any(segments) => {
                accel.occluded(segments, filter, &mut answers.occluded);
                answers.occluded.iter().filter(|&&occluded| occluded).count() as u64
            }
        };
        self.tiles.par_iter().map_init(Answers::default, count).sum()
    }

    /// Traces all rays and hashes the hits: a hash for each tile, combined in the order of the tiles.
    pub fn hash(&self, accel: &Accel, posed: &PosedScene) -> WorkHash {
        let filter = &MaterialHitFilter(posed);
        let hash = |answers: &mut Answers, tile: &TileRays| match &tile.batch {
            TileBatch::Closest(rays) => {
                accel.intersect(rays, filter, &mut answers.hits);
                WorkHash::of_hits(&answers.hits)
            }
            TileBatch::Any(segments) => {
                accel.occluded(segments, filter, &mut answers.occluded);
                WorkHash::of_occlusion(&answers.occluded)
            }
        };
        let hashes: Vec<WorkHash> = self.tiles.par_iter().map_init(Answers::default, hash).collect();
        WorkHash::combine(hashes)
    }

    /// Counts traversal steps of the rays of about 64 tiles, spread evenly. `None` without rays.
    pub fn mean_steps(&self, accel: &Accel, posed: &PosedScene) -> Option<MeanSteps> {
        let filter = &MaterialHitFilter(posed);
        let counted: Vec<&TileRays> =
            self.tiles.iter().step_by(self.tiles.len().div_ceil(COUNTED_TILES).max(1)).collect();
        let count = |tile: &&TileRays| -> (u64, [u64; 3]) {
            let stats: Vec<TraversalStats> = match &tile.batch {
                TileBatch::Closest(rays) => {
                    accel.intersect_with_stats(rays, filter).into_iter().map(|(_, stats)| stats).collect()
                }
                TileBatch::Any(segments) => {
                    accel.occluded_with_stats(segments, filter).into_iter().map(|(_, stats)| stats).collect()
                }
            };
            let sum =
                stats.iter().fold([0; 3], |sum, s| add(sum, [s.nodes, s.blocks, s.triangles].map(u64::from)));
            (stats.len() as u64, sum)
        };
        let add_counts = |(n, a): (u64, [u64; 3]), (m, b)| (n + m, add(a, b));
        let (rays, sums) = counted.par_iter().map(count).reduce(|| (0, [0; 3]), add_counts);
        let [nodes, blocks, triangles] = sums.map(|sum| sum as f64 / rays as f64);
        (rays > 0).then_some(MeanSteps { nodes, blocks, triangles })
    }

    /// The closest hits of each tile. Empty for tiles of segments.
    pub(super) fn hits(&self, accel: &Accel, posed: &PosedScene) -> Vec<HitBatch> {
        let filter = &MaterialHitFilter(posed);
        let trace = |tile: &TileRays| {
            let mut hits = HitBatch::new();
            if let TileBatch::Closest(rays) = &tile.batch {
                accel.intersect(rays, filter, &mut hits);
            }
            hits
        };
        self.tiles.par_iter().map(trace).collect()
    }
}

fn add(a: [u64; 3], b: [u64; 3]) -> [u64; 3] {
    std::array::from_fn(|i| a[i] + b[i])
}
