//! The kinds of generated scenes.

use std::fmt;
use std::str::FromStr;

use super::scene::GeneratedScene;
use super::{forest, interior, scan, stadium, stress};

/// The kinds of generated scenes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SceneKind {
    /// A scanned object: a closed, noisy, organic surface with detail at every scale.
    Scan,
    /// A hall with columns, furniture and statues: large walls beside tiny triangles.
    Interior,
    /// A small dense object in a large sparse environment (teapot in a stadium).
    Stadium,
    /// Many instances of few trees.
    Forest,
    /// Long thin triangles, all diagonal.
    Slivers,
    /// Random triangles.
    Soup,
    /// Coincident grids.
    Layers,
}

impl SceneKind {
    /// All kinds.
    pub const ALL: [SceneKind; 7] = [
        SceneKind::Scan,
        SceneKind::Interior,
        SceneKind::Stadium,
        SceneKind::Forest,
        SceneKind::Slivers,
        SceneKind::Soup,
        SceneKind::Layers,
    ];

    /// Generates a scene of `triangles` stored triangles, at least [`SceneKind::min_triangles`]. Closed surfaces have an
    /// even number of triangles, so an odd number is lowered by one. In a forest the number is that of all kinds of
    /// trees together.
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

    /// The minimum number of stored triangles.
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
            format!("'{word}' is not a kind of scene; use one of {}", all.join(", "))
        })
    }
}
