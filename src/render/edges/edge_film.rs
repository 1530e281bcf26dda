//! Samples the lines of edges.

use glam::{DVec2, UVec2};

use super::batch_lines::{BatchLines, LANES, Line};
use super::edge_selection::EdgeColors;
use super::line_tests::{CoveringLine, FindCoveringLines, SampleGroup};
use super::sample_order::SampleOrder;
use super::screen_grid::ScreenGrid;
use super::{EdgeStyle, HiddenEdges, dashes, premultiplied};
use crate::film::Pixels;
use crate::integrator::{EdgePoint, Frame, Sample, visible_points};
use crate::memory::{RenderMemory, TileScratch};
use crate::progress::ProgressMonitor;
use crate::sample_generator::SampleGenerator;
use crate::settings::RenderSettings;
use crate::tiles::render_tiles;
use blinn_core::cancellation::Cancelled;
use blinn_core::geometry::Rgba;

/// Opacity of hidden edges that are faint.
const FAINT: f32 = 0.25;

/// Samples of a batch, most of whose neighbours are in the batch as well.
const BATCH_SAMPLES: usize = 4096;

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

/// Memory for the batches of a tile.
#[derive(Default)]
struct BatchMemory {
    order: SampleOrder,
    lines: BatchLines,
    groups: Vec<SampleGroup>,
    found: Vec<CoveringLine>,
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
        let has_edges = |i: &usize| !self.grid.edges_in(self.grid.cell(pixels[*i])).is_empty();
        let with_edges: Vec<usize> = (0..pixels.len()).filter(has_edges).collect();
        let mut memory = BatchMemory::default();
        for batch in with_edges.chunks((BATCH_SAMPLES / n).max(1)) {
            if monitor.is_cancelled() {
                break;
            }
            let batch_pixels: Vec<UVec2> = batch.iter().map(|&i| pixels[i]).collect();
            self.generator.generate(self.frame.simd(), &batch_pixels, &mut scratch.samples);
            let covered = self.alphas(&batch_pixels, &mut memory, scratch);
            let samples = covered.alphas.chunks_exact(n).zip(covered.edges.chunks_exact(n));
            for (&i, (alphas, edges)) in batch.iter().zip(samples) {
                colors[i] = self.mean_color(alphas, edges);
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

    /// Returns the opacity of edges at the samples of pixels.
    fn alphas(
        &self,
        pixels: &[UVec2],
        memory: &mut BatchMemory,
        scratch: &mut TileScratch,
    ) -> CoveredSamples {
        let (simd, projector) = (self.frame.simd(), &self.grid.projector);
        let samples = &scratch.samples;
        self.group_samples(pixels, samples, memory);
        let BatchMemory { lines, groups, found, .. } = memory;
        let mut alphas = vec![0.0; samples.len()];
        let mut edges = vec![0; samples.len()];
        // The nearest lines over samples first, then those behind lines that are hidden.
        loop {
            found.clear();
            let (lines, boxes) = (lines.lines(), lines.boxes());
            simd.run(FindCoveringLines { lines, boxes, projector, groups: &groups[..], found: &mut *found });
            if found.is_empty() {
                return CoveredSamples { alphas, edges };
            }
            let point = |covering: &CoveringLine| {
                let line = &lines[covering.line];
                let [x, y] = self.film_position(line.at(covering.s));
                let sample = samples[groups[covering.group].samples[covering.lane] as usize];
                EdgePoint {
                    sample: Sample { x, y, footprint: [0.0; 2], ..sample },
                    depth: covering.depth(),
                    beside: self.grid.edges[line.edge as usize].beside,
                }
            };
            let points: Vec<EdgePoint> = found.iter().map(point).collect();
            let visible = visible_points(self.frame, &points, &mut scratch.integrator);
            groups.iter_mut().for_each(SampleGroup::close);
            for (covering, is_visible) in found.iter().zip(visible) {
                let group = &mut groups[covering.group];
                let line = &lines[covering.line];
                let sample = group.samples[covering.lane] as usize;
                if is_visible {
                    (alphas[sample], edges[sample]) = (1.0, line.edge);
                    continue;
                }
                if self.shows_hidden(line, covering.s) {
                    let alpha = if self.style.hidden == HiddenEdges::Faint { FAINT } else { 1.0 };
                    (alphas[sample], edges[sample]) = (alpha, line.edge);
                }
                if alphas[sample] < 1.0 {
                    group.continue_behind(covering.lane, covering.key);
                }
            }
        }
    }

    /// Groups the samples of pixels that lie close together.
    fn group_samples(&self, pixels: &[UVec2], samples: &[Sample], memory: &mut BatchMemory) {
        let BatchMemory { order, lines, groups, .. } = memory;
        lines.clear();
        groups.clear();
        order.sort(self.grid, pixels, samples.iter().map(|sample| self.pixel_position(sample)));
        for (cell, samples) in order.cells() {
            let cell = lines.add_cell(self.grid, cell);
            groups.extend(samples.chunks(LANES).map(|samples| {
                let samples = samples.iter().map(|key| (key.index(), order.position(key.index())));
                SampleGroup::new(cell.clone(), samples)
            }));
        }
    }

    /// Returns true if a hidden edge is drawn at a point of its line.
    fn shows_hidden(&self, line: &Line, s: f64) -> bool {
        match self.style.hidden {
            HiddenEdges::Off => false,
            HiddenEdges::Faint => true,
            HiddenEdges::Dashed => {
                let edge = &self.grid.edges[line.edge as usize];
                let along = edge.start + edge.segment.skipped + line.at(s).distance(line.start);
                dashes::is_dash(along, 2.0 * line.half_width_at(&self.grid.projector, s))
            }
        }
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
