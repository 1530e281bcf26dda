//! The rays that a benchmark traces, in a batch for each tile of the image: eye rays, and rays from their hits.

mod generate;
mod ray_set;

pub use generate::RaySets;
pub use ray_set::{MeanSteps, RaySet, TileBatch, TileRays};
