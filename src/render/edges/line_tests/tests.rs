//! Lines over samples, against each line in turn.

use glam::{DVec2, DVec3, UVec2, Vec4};

use super::*;
use crate::edges::EdgeWidth;
use crate::edges::batch_lines::BatchLines;
use crate::edges::edge_selection::{EdgeColors, ScreenEdge, ScreenEdges};
use crate::edges::projection::Segment;
use crate::edges::sample_order::SampleOrder;
use crate::edges::screen_grid::ScreenGrid;
use crate::settings::RenderSettings;
use blinn_core::geometry::{Basis, HitId};
use blinn_core::simd::SimdLevel;
use blinn_scene::{Camera, ClipPlanes, Projection};

const EDGES: u32 = 300;
const SAMPLES: usize = 21;
/// Pixels that are tested together, some of which are no neighbours.
const BATCH: usize = 20;

/// A reproducible number from 0 to 1.
fn number(i: u32) -> f64 {
    f64::from(i.wrapping_mul(2_654_435_761).rotate_left(13).wrapping_mul(2_246_822_519) >> 8)
        / f64::from(1 << 24)
}

fn projector(projection: Projection, width: EdgeWidth, settings: &RenderSettings) -> Projector {
    let camera = Camera {
        view_point: DVec3::ZERO,
        basis: Basis::from_view(DVec3::NEG_Z, DVec3::Y).unwrap(),
        view_width: f64::from(settings.width) / f64::from(settings.height),
        view_height: 1.0,
        view_centre: DVec2::ZERO,
        proj_distance: 1.0,
        projection,
        clip: ClipPlanes::OFF,
        lens: None,
    };
    Projector::new(&camera, DVec3::ZERO, width, settings)
}

/// Short and long edges, and points. Many have the same depths.
fn edges(settings: &RenderSettings) -> Vec<ScreenEdge> {
    let edge = |i: u32| {
        let at = |k: u32| DVec2::new(number(i * 8 + k), number(i * 8 + k + 1));
        let a = at(0) * DVec2::new(f64::from(settings.width) + 4.0, f64::from(settings.height) + 4.0) - 2.0;
        let b = a + (at(2) - 0.5) * [0.0, 1.5, 1.5, 20.0][i as usize % 4];
        let depth = |k: u32| f64::from(1 + (number(i * 8 + k) * 4.0) as u32) * 0.25;
        let depths = if i.is_multiple_of(3) { [depth(4); 2] } else { [depth(4), depth(5)] };
        let segment = Segment { ends: [a, b], depths, skipped: 0.0, length: a.distance(b) };
        ScreenEdge { segment, beside: [HitId::NONE; 2], start: 0.0 }
    };
    (0..EDGES).map(edge).collect()
}

/// The depths and edges of all lines over a sample, in order.
fn all_over(grid: &ScreenGrid, position: DVec2) -> Vec<(f64, u32)> {
    let mut over = Vec::new();
    for (i, edge) in (0..).zip(&grid.edges) {
        let ([a, b], [from, to]) = (edge.segment.ends, edge.segment.depths);
        let along = b - a;
        let length2 = along.length_squared();
        let s = if length2 > 0.0 { ((position - a).dot(along) / length2).clamp(0.0, 1.0) } else { 0.0 };
        let linear = from + (to - from) * s;
        let half_width = grid.projector.half_width(linear);
        if (a + along * s).distance_squared(position) <= half_width * half_width {
            over.push((grid.projector.depth(linear), i));
        }
    }
    over.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    over
}

/// The same as the kernels find them for the samples of a batch of pixels, one after the other.
fn found_over(
    grid: &ScreenGrid,
    simd: SimdLevel,
    pixels: &[UVec2],
    positions: &[DVec2],
) -> Vec<Vec<(f64, u32)>> {
    let (mut order, mut lines) = (SampleOrder::default(), BatchLines::default());
    let mut groups = Vec::new();
    order.sort(grid, pixels, positions.iter().copied());
    for (cell, samples) in order.cells() {
        let cell = lines.add_cell(grid, cell);
        for samples in samples.chunks(LANES) {
            let samples = samples.iter().map(|key| (key.index(), order.position(key.index())));
            groups.push(SampleGroup::new(cell.clone(), samples));
        }
    }
    let mut over = vec![Vec::new(); positions.len()];
    let mut found = Vec::new();
    loop {
        found.clear();
        let (lines, boxes, projector) = (lines.lines(), lines.boxes(), &grid.projector);
        simd.run(FindCoveringLines { lines, boxes, projector, groups: &groups, found: &mut found });
        if found.is_empty() {
            return over;
        }
        groups.iter_mut().for_each(SampleGroup::close);
        for covering in &found {
            let group = &mut groups[covering.group];
            let sample = group.samples[covering.lane] as usize;
            over[sample].push((covering.depth(), lines[covering.line].edge));
            group.continue_behind(covering.lane, covering.key);
        }
    }
}

#[test]
fn lines_over_samples_are_found_in_order() {
    // Several cells.
    let settings = RenderSettings { width: 45, height: 30, ..RenderSettings::default() };
    let mut count = 0;
    for projection in [Projection::Perspective, Projection::Orthographic] {
        for width in [EdgeWidth::Pixels(1.0), EdgeWidth::Metres(0.2)] {
            let projector = projector(projection, width, &settings);
            let colors = EdgeColors { palette: vec![Vec4::W], of_edges: Vec::new() };
            let grid = ScreenGrid::new(ScreenEdges { edges: edges(&settings), projector, colors }, &settings);
            let pixels: Vec<UVec2> = settings.window().pixels().collect();
            for (batch, pixels) in (0..).zip(pixels.chunks(BATCH)) {
                // Samples lie as far away as the filter reaches.
                let offset = |k: u32| 3.0 * DVec2::new(number(k), number(k + 1)) - 1.5;
                let position = |i: u32| {
                    let centre = pixels[i as usize / SAMPLES].as_dvec2() + 0.5;
                    centre + offset(batch * 4096 + 2 * i)
                };
                let positions: Vec<DVec2> = (0..(pixels.len() * SAMPLES) as u32).map(position).collect();
                let expected: Vec<_> = positions.iter().map(|at| all_over(&grid, *at)).collect();
                count += expected.iter().map(Vec::len).sum::<usize>();
                for simd in SimdLevel::ALL.into_iter().filter(|level| level.is_supported()) {
                    assert!(found_over(&grid, simd, pixels, &positions) == expected, "{batch} {simd:?}");
                }
            }
        }
    }
    assert!(count > 10_000, "{count}");
}
