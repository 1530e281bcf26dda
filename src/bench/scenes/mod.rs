//! Scenes to measure with: made by rule, so that no download is needed and every machine has the
//! same bytes. Random numbers are hashes, and every sine and root is libm's or IEEE's. Nothing here
//! knows the renderer: two measurements compare only where their scenes are the same to the bit.

mod forest;
mod glb;
mod interior;
mod mesh;
pub(super) mod noise;
mod obj;
mod scan;
mod shapes;
mod stadium;
mod stress;
mod vector;

use std::fmt;
use std::str::FromStr;

pub use glb::write_glb;
pub use mesh::GeneratedMesh;
pub use obj::write_obj;

/// What is seen, from where, and by which light. Metres, +Y up.
#[derive(Clone, Debug)]
pub struct GeneratedScene {
    /// Its kind.
    pub name: String,
    /// Meshes, each in its own frame.
    pub meshes: Vec<GeneratedMesh>,
    /// What is drawn.
    pub instances: Vec<GeneratedInstance>,
    /// The eye.
    pub eye: [f32; 3],
    /// What the eye looks at.
    pub target: [f32; 3],
    /// Vertical field of view in degrees.
    pub yfov: f32,
    /// A point light.
    pub light: [f32; 3],
    /// The way that sunlight travels.
    pub sun: [f32; 3],
    /// True: written with a texture on every mesh.
    pub textured: bool,
}

/// A mesh in a place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GeneratedInstance {
    /// Index of the mesh.
    pub mesh: usize,
    /// Columns of the local-to-world transform: x, y, z axes and the origin.
    pub columns: [[f32; 3]; 4],
}

impl GeneratedInstance {
    /// The mesh as it stands in its own frame.
    pub fn identity(mesh: usize) -> GeneratedInstance {
        let columns = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.0; 3]];
        GeneratedInstance { mesh, columns }
    }

    /// Where a local point is in the world.
    pub fn point(&self, p: [f32; 3]) -> [f32; 3] {
        let [x, y, z, o] = self.columns;
        [0, 1, 2].map(|a| x[a] * p[0] + y[a] * p[1] + z[a] * p[2] + o[a])
    }

    /// A local normal in the world; transforms here only turn, scale evenly and move.
    pub fn normal(&self, n: [f32; 3]) -> [f32; 3] {
        let [x, y, z, _] = self.columns;
        vector::unit([0, 1, 2].map(|a| x[a] * n[0] + y[a] * n[1] + z[a] * n[2]))
    }
}

impl GeneratedScene {
    /// Triangles as drawn.
    pub fn drawn_triangles(&self) -> usize {
        self.instances.iter().map(|i| self.meshes[i.mesh].triangles.len()).sum()
    }

    /// Triangles as stored.
    pub fn stored_triangles(&self) -> usize {
        self.meshes.iter().map(|m| m.triangles.len()).sum()
    }

    /// A fingerprint of every number in it (FNV-1a), for tests.
    pub fn hash(&self) -> u64 {
        let mut hash = mesh::Fnv::default();
        for mesh in &self.meshes {
            mesh.add_to(&mut hash);
        }
        for instance in &self.instances {
            hash.add(instance.mesh as u32);
            instance.columns.iter().flatten().for_each(|x| hash.add(x.to_bits()));
        }
        for x in [self.eye, self.target, self.light, self.sun].iter().flatten() {
            hash.add(x.to_bits());
        }
        hash.value()
    }
}

/// The kinds of scenes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SceneKind {
    /// A scanned object: one closed, noisy, organic surface with detail at every scale.
    Scan,
    /// A hall with columns, furniture and statues: huge walls beside tiny triangles.
    Interior,
    /// A tiny dense object in a huge sparse place.
    Stadium,
    /// Many instances of few trees.
    Forest,
    /// Long thin triangles, all diagonal.
    Slivers,
    /// Triangles anywhere, anyhow.
    Soup,
    /// Flat grids that lie in the very same place.
    Layers,
}

impl SceneKind {
    /// All of them.
    pub const ALL: [SceneKind; 7] = [
        SceneKind::Scan,
        SceneKind::Interior,
        SceneKind::Stadium,
        SceneKind::Forest,
        SceneKind::Slivers,
        SceneKind::Soup,
        SceneKind::Layers,
    ];

    /// Makes the scene with `triangles` triangles as stored; surfaces without a border have an even
    /// count, so an odd one is lowered by one. A forest has `triangles` in all its kinds of trees
    /// together. Scenes have a least size, [`SceneKind::min_triangles`].
    pub fn generate(self, triangles: usize) -> GeneratedScene {
        let triangles = triangles.max(self.min_triangles()) & !1;
        let mut scene = match self {
            SceneKind::Scan => scan::scene(triangles),
            SceneKind::Interior => interior::scene(triangles),
            SceneKind::Stadium => stadium::scene(triangles),
            SceneKind::Forest => forest::scene(triangles),
            SceneKind::Slivers => stress::slivers(triangles),
            SceneKind::Soup => stress::soup(triangles),
            SceneKind::Layers => stress::layers(triangles),
        };
        scene.name = self.to_string();
        scene
    }

    /// The fewest triangles that make this scene.
    pub fn min_triangles(self) -> usize {
        match self {
            SceneKind::Scan => 48,
            SceneKind::Interior => 50_000,
            SceneKind::Stadium => 4_000,
            SceneKind::Forest => 2_000,
            SceneKind::Slivers | SceneKind::Soup | SceneKind::Layers => 64,
        }
    }
}

impl fmt::Display for SceneKind {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(match self {
            SceneKind::Scan => "scan",
            SceneKind::Interior => "interior",
            SceneKind::Stadium => "stadium",
            SceneKind::Forest => "forest",
            SceneKind::Slivers => "slivers",
            SceneKind::Soup => "soup",
            SceneKind::Layers => "layers",
        })
    }
}

impl FromStr for SceneKind {
    type Err = String;

    fn from_str(word: &str) -> Result<SceneKind, String> {
        SceneKind::ALL.into_iter().find(|kind| kind.to_string() == word).ok_or_else(|| {
            let all: Vec<String> = SceneKind::ALL.iter().map(SceneKind::to_string).collect();
            format!("no kind of scene '{word}'; there are {}", all.join(", "))
        })
    }
}

/// A count of triangles in words: `70k`, `1.1m`.
pub fn format_triangle_count(triangles: usize) -> String {
    let n = triangles as f64;
    if triangles < 999_500 { format!("{:.0}k", n / 1e3) } else { format!("{:.1}m", n / 1e6) }
}

/// A count of triangles: `70000`, `70k`, `1.1m`.
///
/// # Errors
/// Says what is no such count, and what would be.
pub fn parse_triangle_count(word: &str) -> Result<usize, String> {
    let lower = word.to_ascii_lowercase();
    let (digits, scale) = match lower.as_bytes().last() {
        Some(b'k') => (&lower[..lower.len() - 1], 1e3),
        Some(b'm') => (&lower[..lower.len() - 1], 1e6),
        _ => (&lower[..], 1.0),
    };
    match digits.parse::<f64>() {
        Ok(n) if n > 0.0 && n * scale <= 1e9 => Ok((n * scale).round() as usize),
        _ => Err(format!("'{word}' is no count of triangles: write 70k, 1.1m or 70000, at most 1000m")),
    }
}
