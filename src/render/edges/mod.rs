//! Edges of meshes as lines over a picture: sharp edges, silhouettes, borders of open surfaces, or all edges of triangles.
//!
//! The edges of a mesh are found once ([`mesh_edges`]). For each picture those that the style selects are projected
//! ([`edge_selection`]) and sorted into cells ([`screen_grid`]). Samples, in groups that lie close together
//! ([`sample_order`]), are tested against the lines near them ([`line_tests`]). Those that a line covers trace a ray to the
//! point of the edge that is nearest in the picture: the edge is visible if nothing lies in front of that point. The two
//! triangles beside an edge never hide it.

mod batch_lines;
mod dashes;
mod edge_film;
mod edge_selection;
mod line_tests;
mod mesh_edges;
mod projection;
mod sample_order;
mod screen_grid;

use std::collections::HashMap;
use std::sync::{Arc, Mutex, PoisonError};

use crate::film::Pixels;
use crate::integrator::Frame;
use crate::memory::RenderMemory;
use crate::progress::ProgressMonitor;
use crate::settings::RenderSettings;
use blinn_core::cancellation::Cancelled;
use blinn_core::geometry::{Rgb, Rgba};
use blinn_scene::Scene;
use edge_selection::select_edges;
use mesh_edges::MeshEdges;
use screen_grid::ScreenGrid;

/// The edges that are drawn: those of any chosen kind.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
pub struct EdgeKinds {
    /// All edges of polygons.
    pub all: bool,
    /// Edges at which the surface turns by more than an angle, and borders.
    pub feature: bool,
    /// Edges between faces that the camera sees from the front and from the back, and borders.
    pub silhouette: bool,
    /// Borders of open surfaces.
    pub boundary: bool,
}

/// The width of edges.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum EdgeWidth {
    /// Pixels.
    Pixels(f64),
    /// Metres in the world.
    Metres(f64),
}

/// How edges that a surface hides are drawn.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
pub enum HiddenEdges {
    /// Not at all.
    #[default]
    Off,
    /// As dashes.
    Dashed,
    /// As transparent lines.
    Faint,
}

/// How edges are drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EdgeStyle {
    /// The edges that are drawn.
    pub kinds: EdgeKinds,
    /// Angle in degrees above which an edge is sharp.
    pub angle: f64,
    /// Colour, linear. `None` for those that files have, and black where they have none.
    pub color: Option<Rgb>,
    /// Width.
    pub width: EdgeWidth,
    /// Edges behind surfaces.
    pub hidden: HiddenEdges,
}

/// The edges of a scene's meshes, which pictures of the scene share. Empty until they are needed.
#[derive(Debug, Default)]
pub struct EdgeCache(Mutex<HashMap<Vec<u32>, Arc<MeshEdges>>>);

impl EdgeCache {
    /// Returns the edges of meshes that form one object.
    fn get(&self, scene: &Scene, meshes: &[u32]) -> Arc<MeshEdges> {
        let mut cache = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(edges) = cache.get(meshes) {
            return edges.clone();
        }
        let edges =
            Arc::new(MeshEdges::new(&meshes.iter().map(|&m| &scene.meshes[m as usize]).collect::<Vec<_>>()));
        cache.insert(meshes.to_vec(), edges.clone());
        edges
    }
}

/// Least samples per pixel of edges: their rays are few, and lines show steps that surfaces do not.
const MIN_SAMPLES: u32 = 16;

/// Renders the edges that the frame's camera sees, premultiplied by alpha, transparent where there are none.
///
/// # Errors
/// [`Cancelled`] if `monitor` cancels.
pub fn render_edges(
    memory: &RenderMemory,
    frame: &Frame,
    style: &EdgeStyle,
    cache: &EdgeCache,
    settings: &RenderSettings,
    monitor: &dyn ProgressMonitor,
) -> Result<Pixels, Cancelled> {
    let settings = &RenderSettings { samples: settings.samples.max(MIN_SAMPLES), ..*settings };
    let edges = select_edges(frame, style, cache, settings, monitor)?;
    let grid = ScreenGrid::new(edges, settings);
    edge_film::render(memory, frame, style, &grid, settings, monitor)
}

/// Draws edges over a picture of the same size.
pub fn draw_edges(picture: &mut Pixels, edges: &Pixels) {
    for (color, edge) in picture.colors.iter_mut().zip(&edges.colors) {
        if edge.w > 0.0 {
            *color = *edge + *color * (1.0 - edge.w);
        }
    }
}

/// A premultiplied colour.
fn premultiplied(color: Rgb, alpha: f32) -> Rgba {
    (color * alpha).extend(alpha)
}
