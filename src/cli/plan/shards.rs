//! `-o NAME{shard}.tar`: the images of all scenes in WebDataset's tar files.

use std::ops::Range;
use std::path::{Path, PathBuf};

use super::frames::FrameSet;
use crate::args::values::ShardSize;
use crate::usage::UsageError;
use blinn_core::worded;
use blinn_session::{PathTemplate, TemplateFields};

/// The size without --shard-size.
const DEFAULT_SIZE: ShardSize = ShardSize::Images(1000);

/// Assignment of scenes to archives. An archive holds whole scenes.
#[derive(Clone, Debug)]
pub struct ShardPlan {
    template: PathTemplate,
    /// The most that an archive needs to hold; 1 for archives of limited bytes.
    scenes_per_shard: usize,
    /// The most bytes of an archive, if they decide how many scenes it holds.
    max_bytes: Option<u64>,
    names: SampleNames,
}

/// The form of the names of samples.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum SampleNames {
    /// After number and name of the scene, as in `00000012-tower-0003.png`.
    #[default]
    Scene,
    /// As in BOP's archives: after the numbers of scene and image, as in `000012_000003.rgb.png`.
    Bop,
}

impl ShardPlan {
    /// Resolves the archives of `-o pattern`. `None` if these are none.
    ///
    /// # Errors
    /// The pattern has no number, or the number of images of a scene is unknown.
    pub fn new(
        pattern: &str,
        size: Option<ShardSize>,
        frames: &FrameSet,
    ) -> Result<Option<ShardPlan>, UsageError> {
        if !is_shard_pattern(pattern) {
            return match size {
                Some(_) => Err(UsageError(worded!(
                    "`shard-size` applies only to archives; set `output` to a name such as shards/{{shard:05}}.tar"
                ))),
                None => Ok(None),
            };
        }
        let template = PathTemplate::parse(pattern);
        if !template.has_shard_number() {
            return Err(UsageError(worded!(
                "`output` {}: archives are numbered; put {{shard:05}} into the name",
                pattern
            )));
        }
        if !template.has_only_shard_number() {
            return Err(UsageError(worded!(
                "`output` {}: an archive holds many scenes and frames; use no other placeholder than {{shard}}",
                pattern
            )));
        }
        let Some(frames) = frames.known() else {
            return Err(UsageError(worded!(
                "`frames`: the number of frames of each scene must be known for archives; list them, such as \
                 `frames`=1-24"
            )));
        };
        let (scenes_per_shard, max_bytes) = match size.unwrap_or(DEFAULT_SIZE) {
            ShardSize::Images(count) => (count as usize / frames.len().max(1), None),
            ShardSize::Bytes(bytes) => (1, Some(bytes)),
        };
        let scenes_per_shard = scenes_per_shard.max(1);
        Ok(Some(ShardPlan { template, scenes_per_shard, max_bytes, names: SampleNames::default() }))
    }

    /// Names samples in another way.
    pub fn with_names(self, names: SampleNames) -> ShardPlan {
        ShardPlan { names, ..self }
    }

    /// The name of an image with `extension`.
    pub fn image(&self, scene: &Path, index: usize, frame: i64, extension: &str) -> PathBuf {
        let key = self.sample_key(scene, index, frame);
        let name = match self.names {
            SampleNames::Scene => format!("{key}.{extension}"),
            SampleNames::Bop => format!("{key}.rgb.{extension}"),
        };
        name.into()
    }

    /// The name that the files of a sample share: WebDataset separates it from the rest at the first dot.
    pub fn sample_key(&self, scene: &Path, index: usize, frame: i64) -> String {
        match self.names {
            SampleNames::Scene => {
                let stem = scene.file_stem().unwrap_or_default().to_string_lossy();
                let plain = |c: char| if c.is_ascii_alphanumeric() || c == '-' { c } else { '_' };
                let stem: String = stem.chars().take(40).map(plain).collect();
                format!("{index:08}-{stem}-{frame:04}")
            }
            SampleNames::Bop => format!("{index:06}_{frame:06}"),
        }
    }

    /// The folder of all archives; `None` if they have several.
    pub fn folder(&self) -> Option<PathBuf> {
        let folder = |shard| self.numbered(shard).parent().map(Path::to_path_buf);
        folder(0).filter(|first| folder(1).as_ref() == Some(first))
    }

    /// The most bytes of an archive, if they decide how many scenes it holds. Then the archive of a scene is not known before
    /// all scenes before it are rendered.
    pub fn max_bytes(&self) -> Option<u64> {
        self.max_bytes
    }

    /// The number, from 0, of the archive of the `index`-th scene, from 1.
    pub fn number(&self, index: usize) -> usize {
        index.saturating_sub(1) / self.scenes_per_shard
    }

    /// The archive of the `index`-th scene, from 1.
    pub fn file(&self, index: usize) -> PathBuf {
        self.numbered(self.number(index))
    }

    /// The archive with a number from 0.
    pub fn numbered(&self, shard: usize) -> PathBuf {
        self.template.expand(&TemplateFields { scene: Path::new(""), index: 0, frame: 0, camera: "", shard })
    }

    /// The indices from 0 of the scenes that share an archive with the `index`-th, from 1.
    pub fn neighbours(&self, index: usize, scenes: usize) -> Range<usize> {
        let shard = self.number(index);
        self.scenes(shard..shard + 1, scenes)
    }

    /// The number of archives of `scenes` scenes, at most.
    pub fn count(&self, scenes: usize) -> usize {
        scenes.div_ceil(self.scenes_per_shard)
    }

    /// The indices from 0 of the scenes in a range of archives.
    pub fn scenes(&self, shards: Range<usize>, scenes: usize) -> Range<usize> {
        let at = |shard: usize| shard.saturating_mul(self.scenes_per_shard).min(scenes);
        at(shards.start)..at(shards.end)
    }
}

/// True for the names of archives.
pub fn is_shard_pattern(pattern: &str) -> bool {
    pattern.to_ascii_lowercase().ends_with(".tar")
}

/// The name of the image in an archive: `.jpg` of `{shard}.jpg.tar`, else `.png`.
pub fn image_name(pattern: &str) -> String {
    let inner = &pattern[..pattern.len().saturating_sub(".tar".len())];
    let name = Path::new(inner).file_name().unwrap_or_default();
    match Path::new(name).extension().and_then(|extension| extension.to_str()) {
        Some(extension) if !extension.contains('}') => format!("a.{extension}"),
        _ => "a.png".into(),
    }
}

/// The number of the scene in the key of a sample.
pub fn scene_of_key(key: &str) -> Option<usize> {
    key.split(['-', '_']).next()?.parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;
    use blinn_session::PlannedFrame;

    #[test]
    fn archives_hold_whole_scenes() {
        let frames = FrameSet::List((1..=12).map(|number| PlannedFrame::at(number, 0.0)).collect());
        let plan =
            ShardPlan::new("out/{shard:05}.tar", Some(ShardSize::Images(40)), &frames).unwrap().unwrap();
        assert_eq!(plan.file(3), Path::new("out/00000.tar"));
        assert_eq!(plan.file(4), Path::new("out/00001.tar"));
        assert_eq!(plan.count(7), 3);
        assert_eq!(plan.scenes(1..3, 7), 3..7);
        assert_eq!((plan.neighbours(4, 7), plan.neighbours(7, 7)), (3..6, 6..7));
        let small = ShardPlan::new("{shard}.tar", Some(ShardSize::Images(5)), &frames).unwrap().unwrap();
        assert_eq!((small.count(7), small.file(7)), (7, PathBuf::from("6.tar")));
        for (pattern, message) in [
            ("a.tar", "put {shard:05}"),
            ("{stem}-{shard}.tar", "no other placeholder"),
            ("#{shard}.tar", "no other"),
        ] {
            assert!(ShardPlan::new(pattern, None, &frames).unwrap_err().0.contains(message), "{pattern}");
        }
        assert!(ShardPlan::new("a.png", None, &frames).unwrap().is_none());
        assert!(
            ShardPlan::new("a.png", Some(ShardSize::Bytes(5)), &frames)
                .unwrap_err()
                .0
                .contains("`shard-size`")
        );
    }

    #[test]
    fn keys_have_no_dots_and_are_distinct() {
        let frames = FrameSet::List(vec![PlannedFrame::at(1, 0.0)]);
        let plan = ShardPlan::new("{shard}.tar", None, &frames).unwrap().unwrap();
        let key = |scene: &str, index, frame| plan.sample_key(Path::new(scene), index, frame);
        assert_eq!(key("a/tower.v2.glb", 12, 3), "00000012-tower_v2-0003");
        assert_eq!(key("ä/stühle 1.obj", 1, -3), "00000001-st_hle_1--003");
        assert_ne!(key("a.glb", 1, 11), key("a.glb", 11, 1));
        assert!(key(&"x".repeat(500), usize::MAX, i64::MIN).len() < 100);
        assert_eq!(plan.image(Path::new("a.glb"), 1, 2, "jpg"), Path::new("00000001-a-0002.jpg"));
        assert_eq!(scene_of_key(&key("7_8.glb", 12, 3)), Some(12));
        let bop = plan.clone().with_names(SampleNames::Bop);
        assert_eq!(bop.image(Path::new("tower.v2.glb"), 12, 3, "png"), Path::new("000012_000003.rgb.png"));
        assert_eq!(scene_of_key(&bop.sample_key(Path::new("a.glb"), 1_000_000, 3)), Some(1_000_000));
        assert_eq!((scene_of_key("a_1"), scene_of_key("")), (None, None));
    }

    #[test]
    fn archives_may_share_a_folder() {
        let frames = FrameSet::List(vec![PlannedFrame::at(1, 0.0)]);
        let folder = |pattern: &str| ShardPlan::new(pattern, None, &frames).unwrap().unwrap().folder();
        assert_eq!(folder("a/b/{shard}.tar"), Some("a/b".into()));
        assert_eq!(folder("{shard}.tar"), Some("".into()));
        assert_eq!(folder("a/{shard}/{shard}.tar"), None);
    }

    #[test]
    fn the_format_of_images_stands_before_the_extension() {
        for (pattern, name) in
            [("s/{shard:05}.tar", "a.png"), ("{shard}.jpg.tar", "a.jpg"), ("x.y/{shard}.exr.TAR", "a.exr")]
        {
            assert!(is_shard_pattern(pattern));
            assert_eq!(image_name(pattern), name, "{pattern}");
        }
        assert!(!is_shard_pattern("a.png"));
    }
}
