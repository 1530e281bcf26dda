//! Points (`p`) and lines (`l`): one mesh of each kind for every object and material.

use std::collections::HashMap;

use glam::{Vec3, Vec4};

use crate::compact::compact;
use blinn_scene::{Mesh, Rounds};

/// The points or lines of one object and material.
#[derive(Debug)]
pub(super) struct RoundGroup {
    pub object: u32,
    /// Index into the materials of the file.
    pub material: Option<u32>,
    /// The vertices of points, or of the ends of each segment.
    pub vertices: Vec<u32>,
    pub is_points: bool,
}

/// All groups, in the order of their first elements.
#[derive(Debug, Default)]
pub(super) struct RoundGroups {
    pub groups: Vec<RoundGroup>,
    of_key: HashMap<(u32, Option<u32>, bool), usize>,
}

impl RoundGroups {
    /// Adds a `p` or `l`.
    pub fn add(&mut self, object: u32, material: Option<u32>, is_points: bool, vertices: &[u32]) {
        let new = self.groups.len();
        let group = *self.of_key.entry((object, material, is_points)).or_insert(new);
        if group == new {
            self.groups.push(RoundGroup { object, material, vertices: Vec::new(), is_points });
        }
        let out = &mut self.groups[group].vertices;
        match vertices {
            _ if is_points => out.extend_from_slice(vertices),
            // A line of one vertex is a dot.
            [only] => out.extend([*only; 2]),
            _ => vertices.windows(2).for_each(|ends| out.extend_from_slice(ends)),
        }
    }
}

impl RoundGroup {
    /// Returns the mesh of the group, without material, from the vertices of the file and their colours, if there are some.
    pub fn into_mesh(self, name: &str, positions: &[Vec3], colors: &[Vec4]) -> Mesh {
        let mut lines = Vec::new();
        let used = if self.is_points {
            self.vertices
        } else {
            lines = self.vertices.as_chunks::<2>().0.to_vec();
            compact(&mut lines)
        };
        let color = |&v: &u32| colors[v as usize];
        Mesh {
            name: name.to_string(),
            positions: used.iter().map(|&v| positions[v as usize]).collect(),
            colors: if colors.is_empty() { Vec::new() } else { used.iter().map(color).collect() },
            rounds: if self.is_points { Rounds::Points } else { Rounds::Lines(lines) },
            ..Mesh::default()
        }
    }
}
