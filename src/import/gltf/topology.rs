//! Primitive topology: triangle lists, strips and fans to triangles, with primitive restart.

use ::gltf::json::mesh::Mode;

use crate::error::LoadError;

/// The order in which a primitive uses its vertices.
#[derive(Debug)]
pub(super) enum VertexOrder {
    /// In stored order, of this number of vertices.
    Sequential(u32),
    /// By index. The index `restart` starts a new strip or fan unless it is a vertex.
    Indexed { indices: Vec<u32>, restart: u32 },
}

impl VertexOrder {
    /// Number of vertices, each as often as it is used.
    pub fn len(&self) -> usize {
        match self {
            VertexOrder::Sequential(n) => *n as usize,
            VertexOrder::Indexed { indices, .. } => indices.len(),
        }
    }

    /// Checks that all indices are below `vertices` or restart a strip.
    fn check(&self, vertices: u32, location: &dyn Fn() -> String) -> Result<(), LoadError> {
        let VertexOrder::Indexed { indices, restart } = self else { return Ok(()) };
        let is_invalid = |&i: &u32| i >= vertices && i != *restart;
        let Some(at) = indices.iter().position(is_invalid) else { return Ok(()) };
        let message =
            format!("element {at} is index {}, but there are only {vertices} vertices", indices[at]);
        Err(LoadError::invalid(location(), message))
    }
}

/// Numbers of vertices and triangles.
#[derive(Clone, Copy, Debug)]
pub(super) struct MeshSize {
    pub vertices: u64,
    pub triangles: u64,
}

/// Returns true for modes made of triangles.
pub(super) fn is_surface(mode: Mode) -> bool {
    matches!(mode, Mode::Triangles | Mode::TriangleStrip | Mode::TriangleFan)
}

/// Upper bound of the triangles or lines of `count` vertices.
pub(super) fn max_triangles(mode: Mode, count: u64) -> u64 {
    match mode {
        Mode::Triangles => count / 3,
        Mode::TriangleStrip | Mode::TriangleFan => count.saturating_sub(2),
        Mode::Lines => count / 2,
        Mode::LineStrip | Mode::LineLoop => count,
        Mode::Points => 0,
    }
}

/// Assembles the triangles; all their indices are below `vertices`. Degenerate triangles of strips and fans
/// are dropped.
pub(super) fn triangles(
    mode: Mode,
    order: &VertexOrder,
    vertices: u32,
    location: &dyn Fn() -> String,
) -> Result<Vec<[u32; 3]>, LoadError> {
    let mut out = Vec::new();
    match order {
        VertexOrder::Sequential(n) => assemble(mode, *n as usize, |i| i as u32, &mut out),
        VertexOrder::Indexed { indices, .. } => {
            order.check(vertices, location)?;
            for run in indices.split(|&i| i >= vertices) {
                assemble(mode, run.len(), |i| run[i], &mut out);
            }
        }
    }
    Ok(out)
}

/// Assembles the triangles of one strip, fan or list, in the winding of the specification.
fn assemble(mode: Mode, count: usize, at: impl Fn(usize) -> u32, out: &mut Vec<[u32; 3]>) {
    let is_distinct = |[a, b, c]: &[u32; 3]| a != b && b != c && c != a;
    match mode {
        Mode::Triangles => out.extend((0..count / 3).map(|t| [at(3 * t), at(3 * t + 1), at(3 * t + 2)])),
        Mode::TriangleStrip => {
            let corner = |t| [at(t), at(t + 1 + t % 2), at(t + 2 - t % 2)];
            out.extend((0..count.saturating_sub(2)).map(corner).filter(is_distinct));
        }
        Mode::TriangleFan => {
            let corner = |t| [at(t + 1), at(t + 2), at(0)];
            out.extend((0..count.saturating_sub(2)).map(corner).filter(is_distinct));
        }
        Mode::Points | Mode::Lines | Mode::LineLoop | Mode::LineStrip => {}
    }
}

/// Returns the vertices of points, each as often as it is used.
pub(super) fn points(
    order: &VertexOrder,
    vertices: u32,
    location: &dyn Fn() -> String,
) -> Result<Vec<u32>, LoadError> {
    order.check(vertices, location)?;
    Ok(match order {
        VertexOrder::Sequential(n) => (0..*n).collect(),
        VertexOrder::Indexed { indices, .. } => indices.iter().copied().filter(|&i| i < vertices).collect(),
    })
}

/// Assembles line segments; all their indices are below `vertices`.
pub(super) fn lines(
    mode: Mode,
    order: &VertexOrder,
    vertices: u32,
    location: &dyn Fn() -> String,
) -> Result<Vec<[u32; 2]>, LoadError> {
    order.check(vertices, location)?;
    let mut out = Vec::new();
    match order {
        VertexOrder::Sequential(n) => assemble_lines(mode, *n as usize, |i| i as u32, &mut out),
        VertexOrder::Indexed { indices, .. } => {
            for run in indices.split(|&i| i >= vertices) {
                assemble_lines(mode, run.len(), |i| run[i], &mut out);
            }
        }
    }
    Ok(out)
}

/// Assembles the segments of one line strip, loop or list.
fn assemble_lines(mode: Mode, count: usize, at: impl Fn(usize) -> u32, out: &mut Vec<[u32; 2]>) {
    match mode {
        Mode::Lines => out.extend((0..count / 2).map(|i| [at(2 * i), at(2 * i + 1)])),
        Mode::LineStrip | Mode::LineLoop => {
            out.extend((1..count).map(|i| [at(i - 1), at(i)]));
            // The loop of two vertices is their one segment.
            if mode == Mode::LineLoop && count > 2 {
                out.push([at(count - 1), at(0)]);
            }
        }
        Mode::Points | Mode::Triangles | Mode::TriangleStrip | Mode::TriangleFan => {}
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn indexed(mode: Mode, indices: &[u32], vertices: u32) -> Result<Vec<[u32; 3]>, String> {
        let order = VertexOrder::Indexed { indices: indices.to_vec(), restart: 255 };
        triangles(mode, &order, vertices, &|| "here".into()).map_err(|e| e.to_string())
    }

    #[test]
    fn strips_and_fans_keep_their_winding() {
        let four = VertexOrder::Sequential(4);
        let of = |mode| triangles(mode, &four, 4, &String::new).unwrap();
        assert_eq!(of(Mode::TriangleStrip), [[0, 1, 2], [1, 3, 2]]);
        assert_eq!(of(Mode::TriangleFan), [[1, 2, 0], [2, 3, 0]]);
        assert_eq!(of(Mode::Triangles), [[0, 1, 2]]);
        assert!(of(Mode::Lines).is_empty());
    }

    #[test]
    fn primitive_restart_and_degenerate_triangles_are_skipped() {
        let strip = indexed(Mode::TriangleStrip, &[0, 1, 2, 255, 3, 4, 5, 5], 6).unwrap();
        assert_eq!(strip, [[0, 1, 2], [3, 4, 5]]);
        // 255 is an ordinary index if there are that many vertices.
        assert_eq!(indexed(Mode::Triangles, &[0, 1, 255], 256).unwrap(), [[0, 1, 255]]);
    }

    #[test]
    fn lines_strips_and_loops_become_segments() {
        let of = |mode, indices: &[u32]| {
            let order = VertexOrder::Indexed { indices: indices.to_vec(), restart: 255 };
            lines(mode, &order, 6, &String::new).unwrap()
        };
        assert_eq!(of(Mode::Lines, &[0, 1, 2, 3, 4]), [[0, 1], [2, 3]]);
        assert_eq!(of(Mode::LineStrip, &[0, 1, 2, 255, 3, 4]), [[0, 1], [1, 2], [3, 4]]);
        assert_eq!(of(Mode::LineLoop, &[0, 1, 2, 255, 3, 4]), [[0, 1], [1, 2], [2, 0], [3, 4]]);
        let order = VertexOrder::Indexed { indices: vec![4, 255, 4, 1], restart: 255 };
        assert_eq!(points(&order, 6, &String::new).unwrap(), [4, 4, 1]);
        assert!(lines(Mode::Lines, &order, 4, &String::new).is_err());
    }

    #[test]
    fn invalid_indices_are_errors() {
        let error = indexed(Mode::Triangles, &[0, 1, 3], 3).unwrap_err();
        assert_eq!(error, "here: element 2 is index 3, but there are only 3 vertices");
    }
}
