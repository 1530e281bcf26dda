//! Samples the lines of edges.

use std::ops::Range;

use glam::{DVec2, UVec2};

use super::edge_selection::{EdgeColors, ScreenEdge};
use super::screen_grid::ScreenGrid;
use super::{EdgeStyle, HiddenEdges, dashes, premultiplied};
use crate::film::Pixels;
use crate::integrator::{EdgePoint, Frame, Sample, visible_points};
use crate::memory::{RenderMemory, TileScratch};
use crate::progress::ProgressMonitor;
use crate::sample_generator::SampleGenerator;
use crate::settings::RenderSettings;
use crate::tiles::{BATCH_SAMPLES, render_tiles};
use blinn_core::cancellation::Cancelled;
use blinn_core::geometry::Rgba;

/// Opacity of hidden edges that are faint.
const FAINT: f32 = 0.25;

/// Renders the edges of a picture.
pub(super) fn render(
    memory: &RenderMemory,
    frame: &Frame,
    style: &EdgeStyle,
    grid: &ScreenGrid,
    settings: &RenderSettings,
    monitor: &dyn ProgressMonitor,
) -> Result<Pixels, Cancelled> {
    // Edges are drawn sharp, as seen through the centre of the lens.
    let generator = SampleGenerator::new(settings, None);
    let pass = EdgePass { frame, style, grid, generator: &generator, settings };
    render_tiles(memory, settings, monitor, |tile, scratch| {
        let pixels: Vec<UVec2> = tile.pixels().collect();
        let [first, last] = tile.corners();
        if grid.is_empty_between(first, last) {
            return Vec::new();
        }
        pass.render(&pixels, scratch, monitor)
    })
}

struct EdgePass<'a> {
    frame: &'a Frame<'a>,
    style: &'a EdgeStyle,
    grid: &'a ScreenGrid,
    generator: &'a SampleGenerator<'a>,
    settings: &'a RenderSettings,
}

/// The point of an edge that is nearest to a sample in the picture.
#[derive(Clone, Copy)]
struct CoveringPoint {
    edge: u32,
    at: DVec2,
    depth: f64,
    /// True if the edge is drawn there also where it is hidden.
    shows_hidden: bool,
}

/// Edges over the samples of pixels.
struct CoveredSamples {
    /// The opacity of edges at each sample; 0 where there is none.
    alphas: Vec<f32>,
    /// The edge at each sample that an edge covers.
    edges: Vec<u32>,
}

impl EdgePass<'_> {
    /// Returns the colours of pixels.
    fn render(
        &self,
        pixels: &[UVec2],
        scratch: &mut TileScratch,
        monitor: &dyn ProgressMonitor,
    ) -> Vec<Rgba> {
        let n = self.generator.samples_per_pixel();
        let mut colors = vec![Rgba::ZERO; pixels.len()];
        // Most pixels have no edges.
        let mut near = Vec::new();
        let mut with_edges: Vec<(usize, Range<usize>)> = Vec::new();
        for (i, &pixel) in pixels.iter().enumerate() {
            let start = near.len();
            near.extend(self.grid.near(pixel).iter().filter(|&&edge| self.is_near(edge, pixel)));
            if near.len() > start {
                with_edges.push((i, start..near.len()));
            }
        }
        for batch in with_edges.chunks((BATCH_SAMPLES / n).max(1)) {
            if monitor.is_cancelled() {
                break;
            }
            let batch_pixels: Vec<UVec2> = batch.iter().map(|(i, _)| pixels[*i]).collect();
            self.generator.generate(self.frame.simd(), &batch_pixels, &mut scratch.samples);
            let covered = self.alphas(batch, &near, scratch);
            let samples = covered.alphas.chunks_exact(n).zip(covered.edges.chunks_exact(n));
            for ((i, _), (alphas, edges)) in batch.iter().zip(samples) {
                colors[*i] = self.mean_color(alphas, edges);
            }
        }
        colors
    }

    /// Returns the colour of a pixel from the opacities at its samples and the edges that cover them.
    fn mean_color(&self, alphas: &[f32], edges: &[u32]) -> Rgba {
        let EdgeColors { palette, of_edges } = &self.grid.colors;
        let scale = self.frame.unlit_scale;
        if of_edges.is_empty() {
            let alpha = alphas.iter().sum::<f32>() / alphas.len() as f32;
            return premultiplied(palette[0].truncate() * scale, alpha);
        }
        let covered = alphas.iter().zip(edges).filter(|(alpha, _)| **alpha > 0.0);
        let sum: Rgba = covered
            .map(|(alpha, &edge)| {
                let color = palette[of_edges[edge as usize] as usize];
                premultiplied(color.truncate() * scale, alpha * color.w)
            })
            .sum();
        sum / alphas.len() as f32
    }

    /// Returns true if samples of a pixel may lie on an edge's line.
    fn is_near(&self, edge: u32, pixel: UVec2) -> bool {
        let edge = &self.grid.edges[edge as usize];
        let centre = pixel.as_dvec2() + 0.5;
        let (at, _) = nearest(edge, centre);
        let [a, b] = edge.segment.depths.map(|depth| self.grid.projector.half_width(depth));
        // The corner of a filter is 1.42 radii away.
        at.distance(centre) <= a.max(b) + 1.42 * self.settings.filter.radius() + 0.01
    }

    /// Returns the opacity of edges at the samples of pixels, whose edges are ranges of `near`.
    fn alphas(
        &self,
        batch: &[(usize, Range<usize>)],
        near: &[u32],
        scratch: &mut TileScratch,
    ) -> CoveredSamples {
        let samples = &scratch.samples;
        let n = self.generator.samples_per_pixel();
        let mut alphas = vec![0.0; samples.len()];
        let mut edges = vec![0; samples.len()];
        let mut covering = Vec::new();
        // The samples on lines whose edges are not known to be visible, with the edges that are left, nearest first.
        let mut open: Vec<(usize, Range<usize>)> = Vec::new();
        for ((_, range), (first, samples)) in batch.iter().zip((0..).step_by(n).zip(samples.chunks_exact(n)))
        {
            for (i, sample) in samples.iter().enumerate() {
                let start = covering.len();
                let at = self.pixel_position(sample);
                covering.extend(near[range.clone()].iter().filter_map(|&edge| self.cover(edge, at)));
                if covering.len() > start {
                    covering[start..].sort_by(|a, b| a.depth.total_cmp(&b.depth).then(a.edge.cmp(&b.edge)));
                    open.push((first + i, start..covering.len()));
                }
            }
        }
        while !open.is_empty() {
            let point = |(sample, range): &(usize, Range<usize>)| {
                let CoveringPoint { edge, at, depth, .. } = covering[range.start];
                let [x, y] = self.film_position(at);
                EdgePoint {
                    sample: Sample { x, y, footprint: [0.0; 2], ..samples[*sample] },
                    depth,
                    beside: self.grid.edges[edge as usize].beside,
                }
            };
            let points: Vec<EdgePoint> = open.iter().map(point).collect();
            let visible = visible_points(self.frame, &points, &mut scratch.integrator);
            let mut visible = visible.into_iter();
            open.retain_mut(|(sample, range)| {
                let alpha = &mut alphas[*sample];
                let point = &covering[range.start];
                if visible.next() == Some(true) {
                    *alpha = 1.0;
                    edges[*sample] = point.edge;
                    return false;
                }
                if point.shows_hidden {
                    edges[*sample] = point.edge;
                    *alpha = if self.style.hidden == HiddenEdges::Faint { FAINT } else { 1.0 };
                }
                range.start += 1;
                *alpha < 1.0 && range.start < range.end
            });
        }
        CoveredSamples { alphas, edges }
    }

    /// Returns the point of an edge that is nearest to a position in pixels, if the edge's line covers the position.
    #[inline(always)]
    fn cover(&self, index: u32, position: DVec2) -> Option<CoveringPoint> {
        let edge = &self.grid.edges[index as usize];
        let (at, s) = nearest(edge, position);
        let [a, b] = edge.segment.depths;
        let linear = a + (b - a) * s;
        let half_width = self.grid.projector.half_width(linear);
        if at.distance_squared(position) > half_width * half_width {
            return None;
        }
        let shows_hidden = match self.style.hidden {
            HiddenEdges::Off => false,
            HiddenEdges::Faint => true,
            HiddenEdges::Dashed => {
                let along = edge.start + edge.segment.skipped + at.distance(edge.segment.ends[0]);
                dashes::is_dash(along, 2.0 * half_width)
            }
        };
        Some(CoveringPoint { edge: index, at, depth: self.grid.projector.depth(linear), shows_hidden })
    }

    /// Returns the position of a sample in pixels from the upper left corner.
    fn pixel_position(&self, sample: &Sample) -> DVec2 {
        DVec2::new(
            sample.x * f64::from(self.settings.width),
            (1.0 - sample.y) * f64::from(self.settings.height),
        )
    }

    fn film_position(&self, at: DVec2) -> [f64; 2] {
        [at.x / f64::from(self.settings.width), 1.0 - at.y / f64::from(self.settings.height)]
    }
}

/// Returns the point of an edge that is nearest to a position in the picture, and where between its ends it lies.
#[inline(always)]
fn nearest(edge: &ScreenEdge, position: DVec2) -> (DVec2, f64) {
    let [a, b] = edge.segment.ends;
    let along = b - a;
    let length2 = along.length_squared();
    let s = if length2 > 0.0 { ((position - a).dot(along) / length2).clamp(0.0, 1.0) } else { 0.0 };
    (a + along * s, s)
}
