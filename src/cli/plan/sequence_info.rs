//! Properties of the scenes and their frames that output files depend on.

/// Properties of the frames of each scene.
#[derive(Clone, Copy, Debug, Default)]
pub struct SequenceInfo {
    /// True for numbered frames, false for a single image.
    pub is_sequence: bool,
    /// True if there may be several scenes.
    pub is_batch: bool,
    /// The name of images in a folder, if the command or the formats of a dataset decide it.
    pub image_name: Option<&'static str>,
    /// True if the frames are the cameras of a list.
    pub has_cameras: bool,
    /// True if the frames are those of an animation in the file.
    pub is_clip: bool,
    /// Frames per second if given.
    pub fps: Option<f64>,
    /// The option that restricts rendering to some of the frames.
    pub subset_option: Option<&'static str>,
    /// True if the content appears to rotate clockwise as seen from above.
    pub clockwise: bool,
}
