//! From lists, strips and fans to triangles.

use ::gltf::json::mesh::Mode;

use crate::import::error::LoadError;

/// The order in which vertices are used.
#[derive(Debug)]
pub(super) enum Order {
    /// One after the other.
    Counting(u32),
    /// By index; `restart` ends a strip where there is no such vertex.
    Listed { indices: Vec<u32>, restart: u32 },
}

/// True for the modes that have an inside.
pub(super) fn is_surface(mode: Mode) -> bool {
    matches!(mode, Mode::Triangles | Mode::TriangleStrip | Mode::TriangleFan)
}

/// How many triangles `count` vertices in a row can make at most.
pub(super) fn most_triangles(mode: Mode, count: u64) -> u64 {
    if mode == Mode::Triangles { count / 3 } else { count.saturating_sub(2) }
}

/// The triangles, all of whose indices are below `vertices`. Those that a strip or fan only turns
/// a corner with are left out.
pub(super) fn triangles(
    mode: Mode,
    order: &Order,
    vertices: u32,
    place: &dyn Fn() -> String,
) -> Result<Vec<[u32; 3]>, LoadError> {
    let mut out = Vec::new();
    match order {
        Order::Counting(n) => assemble(mode, *n as usize, |i| i as u32, &mut out),
        Order::Listed { indices, restart } => {
            let wild = |&i: &u32| i >= vertices && i != *restart;
            if let Some(at) = indices.iter().position(wild) {
                let rule = format!("element {at} is vertex {}, and there are {vertices}", indices[at]);
                return Err(LoadError::invalid(place(), rule));
            }
            for run in indices.split(|&i| i >= vertices) {
                assemble(mode, run.len(), |i| run[i], &mut out);
            }
        }
    }
    Ok(out)
}

/// Triangles of one uninterrupted run, wound as the specification says.
fn assemble(mode: Mode, count: usize, at: impl Fn(usize) -> u32, out: &mut Vec<[u32; 3]>) {
    let strung = |[a, b, c]: &[u32; 3]| a != b && b != c && c != a;
    match mode {
        Mode::Triangles => out.extend((0..count / 3).map(|t| [at(3 * t), at(3 * t + 1), at(3 * t + 2)])),
        Mode::TriangleStrip => {
            let corner = |t| [at(t), at(t + 1 + t % 2), at(t + 2 - t % 2)];
            out.extend((0..count.saturating_sub(2)).map(corner).filter(strung));
        }
        Mode::TriangleFan => {
            let corner = |t| [at(t + 1), at(t + 2), at(0)];
            out.extend((0..count.saturating_sub(2)).map(corner).filter(strung));
        }
        Mode::Points | Mode::Lines | Mode::LineLoop | Mode::LineStrip => {}
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn listed(mode: Mode, indices: &[u32], vertices: u32) -> Result<Vec<[u32; 3]>, String> {
        let order = Order::Listed { indices: indices.to_vec(), restart: 255 };
        triangles(mode, &order, vertices, &|| "here".into()).map_err(|e| e.to_string())
    }

    #[test]
    fn strips_and_fans_keep_their_winding() {
        let four = Order::Counting(4);
        let of = |mode| triangles(mode, &four, 4, &String::new).unwrap();
        assert_eq!(of(Mode::TriangleStrip), [[0, 1, 2], [1, 3, 2]]);
        assert_eq!(of(Mode::TriangleFan), [[1, 2, 0], [2, 3, 0]]);
        assert_eq!(of(Mode::Triangles), [[0, 1, 2]]);
        assert!(of(Mode::Lines).is_empty());
    }

    #[test]
    fn restarts_and_corners_leave_no_triangles() {
        let strip = listed(Mode::TriangleStrip, &[0, 1, 2, 255, 3, 4, 5, 5], 6).unwrap();
        assert_eq!(strip, [[0, 1, 2], [3, 4, 5]]);
        // 255 is a vertex like any other where there are as many.
        assert_eq!(listed(Mode::Triangles, &[0, 1, 255], 256).unwrap(), [[0, 1, 255]]);
    }

    #[test]
    fn wild_indices_are_named() {
        let error = listed(Mode::Triangles, &[0, 1, 3], 3).unwrap_err();
        assert_eq!(error, "here: element 2 is vertex 3, and there are 3");
    }
}
