//! The stages that a benchmark measures.

use serde::{Deserialize, Serialize};

/// A measured stage of rendering.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum BenchStage {
    /// Importing the file.
    Load,
    /// Building the BVHs.
    Build,
    /// Closest hits of eye rays through the pixel centres.
    Eye,
    /// Any hits between the eye rays' hits and a point light.
    Shadow,
    /// Any hits from the eye rays' hits toward a light at infinity.
    Sun,
    /// Any hits of a cosine-distributed segment of limited length from each of the eye rays' hits: ambient occlusion.
    #[serde(rename = "ao")]
    AmbientOcclusion,
    /// Closest hits of the eye rays' mirror directions.
    Reflection,
    /// Closest hits of a cosine-distributed ray from each of the eye rays' hits. Version 1 of the results called it
    /// `incoherent`.
    #[serde(alias = "incoherent")]
    Bounce1,
    /// Closest hits of a cosine-distributed ray from each hit of [`BenchStage::Bounce1`].
    Bounce2,
    /// Closest hits of a cosine-distributed ray from each hit of [`BenchStage::Bounce2`].
    Bounce3,
    /// Closest hits of a cosine-distributed ray from each hit of [`BenchStage::Bounce3`].
    Bounce4,
    /// Rendering a frame: rays, shading, film.
    Frame,
    /// Removing the noise of a picture with one bounce of indirect light: the filter alone.
    Denoise,
    /// Encoding the frame as PNG.
    Encode,
}

impl BenchStage {
    /// All stages in order.
    pub const ALL: [BenchStage; 14] = [
        BenchStage::Load,
        BenchStage::Build,
        BenchStage::Eye,
        BenchStage::Shadow,
        BenchStage::Sun,
        BenchStage::AmbientOcclusion,
        BenchStage::Reflection,
        BenchStage::Bounce1,
        BenchStage::Bounce2,
        BenchStage::Bounce3,
        BenchStage::Bounce4,
        BenchStage::Frame,
        BenchStage::Denoise,
        BenchStage::Encode,
    ];

    /// The stages of diffuse bounces by depth.
    pub const BOUNCES: [BenchStage; 4] =
        [BenchStage::Bounce1, BenchStage::Bounce2, BenchStage::Bounce3, BenchStage::Bounce4];

    /// The name in tables and files.
    pub fn name(self) -> &'static str {
        match self {
            BenchStage::Load => "load",
            BenchStage::Build => "build",
            BenchStage::Eye => "eye",
            BenchStage::Shadow => "shadow",
            BenchStage::Sun => "sun",
            BenchStage::AmbientOcclusion => "ao",
            BenchStage::Reflection => "reflection",
            BenchStage::Bounce1 => "bounce1",
            BenchStage::Bounce2 => "bounce2",
            BenchStage::Bounce3 => "bounce3",
            BenchStage::Bounce4 => "bounce4",
            BenchStage::Frame => "frame",
            BenchStage::Denoise => "denoise",
            BenchStage::Encode => "encode",
        }
    }

    /// Returns true if the stage traces rays and does nothing else.
    pub fn traces_rays(self) -> bool {
        (BenchStage::Eye..=BenchStage::Bounce4).contains(&self)
    }

    /// Returns true if other numbers of samples per pixel are other work.
    pub fn has_samples(self) -> bool {
        matches!(self, BenchStage::Frame | BenchStage::Denoise)
    }

    /// Returns true if the work depends on the size of the image.
    pub fn has_size(self) -> bool {
        self >= BenchStage::Eye
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stages_are_in_order_and_files_use_their_names() {
        assert!(BenchStage::ALL.is_sorted());
        for stage in BenchStage::ALL {
            assert_eq!(serde_json::to_string(&stage).unwrap(), format!("\"{}\"", stage.name()));
        }
        assert_eq!(serde_json::from_str::<BenchStage>("\"incoherent\"").unwrap(), BenchStage::Bounce1);
        assert_eq!(BenchStage::ALL.into_iter().filter(|stage| stage.traces_rays()).count(), 9);
    }
}
