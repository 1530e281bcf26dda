//! Dashes of hidden edges: they run on along lines of edges, whatever the length of each.

use super::edge_selection::ScreenEdge;

/// Length of a dash and of the gap behind it, in widths of the line.
const DASH: f64 = 5.0;
const GAP: f64 = 3.0;
/// Dashes of thinner lines are those of lines this wide, in pixels.
const MIN_WIDTH: f64 = 1.0;

/// Returns true where a dash is, at a distance in pixels along a line of a width in pixels.
pub(super) fn is_dash(along: f64, width: f64) -> bool {
    // Edges that lead against their line count downward from 0.
    (along.abs() / width.max(MIN_WIDTH)).rem_euclid(DASH + GAP) < DASH
}

/// Sets the starts of an object's edges, whose vertices are given. Lines pass vertices at which two edges meet, and end at
/// others; closed ones start at their first edge.
pub(super) fn add_starts(ends: &[[u32; 2]], edges: &mut [ScreenEdge]) {
    let mut at_vertex: Vec<(u32, u32)> = Vec::with_capacity(2 * ends.len());
    for (edge, [a, b]) in ends.iter().enumerate() {
        at_vertex.push((*a, edge as u32));
        at_vertex.push((*b, edge as u32));
    }
    at_vertex.sort_unstable();
    let meeting = |vertex: u32| {
        let first = at_vertex.partition_point(|(v, _)| *v < vertex);
        let count = at_vertex[first..].iter().take_while(|(v, _)| *v == vertex).count();
        &at_vertex[first..first + count]
    };
    let mut is_done = vec![false; edges.len()];
    let mut follow = |first: u32, from: u32| {
        let (mut edge, mut vertex, mut start) = (first, from, 0.0);
        while !is_done[edge as usize] {
            is_done[edge as usize] = true;
            let [a, b] = ends[edge as usize];
            let length = edges[edge as usize].segment.length;
            // The segment starts at the edge's first end; it may lead against the line.
            edges[edge as usize].start = if a == vertex { start } else { -(start + length) };
            start += length;
            vertex = if a == vertex { b } else { a };
            let [(_, x), (_, y)] = meeting(vertex) else { break };
            edge = if *x == edge { *y } else { *x };
        }
    };
    for edge in 0..ends.len() as u32 {
        for end in ends[edge as usize] {
            if meeting(end).len() != 2 {
                follow(edge, end);
            }
        }
    }
    // Lines that are left are closed.
    for edge in 0..ends.len() as u32 {
        follow(edge, ends[edge as usize][0]);
    }
}
