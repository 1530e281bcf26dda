//! The reasons why an image shows nothing of the scene.

use blinn_core::option_words::word_options;

/// The reason why an image shows nothing.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum EmptyReason {
    /// The scene has no objects.
    NoObjects,
    /// No triangle has an area.
    NoArea,
    /// The file hides all objects, at all times.
    Hidden,
    /// Alpha hides all objects, at all times.
    AllTransparent,
    /// All objects are hidden or scaled to 0 at this time.
    HiddenNow,
    /// Alpha hides everything in view.
    Transparent,
    /// Nothing in view has edges of the kinds that are drawn.
    NoEdges,
    /// The rendered region shows only background.
    Crop,
    /// The near plane cuts off everything in view.
    NearPlane,
    /// The far plane cuts off everything in view.
    FarPlane,
    /// The camera is inside an object and sees only back faces.
    Inside,
    /// The camera sees only back faces.
    BackFaces,
    /// The camera looks away from the scene.
    LooksAway,
    /// Only points are in view, which are not drawn.
    PointsOff,
    /// Only lines are in view, which are not drawn.
    LinesOff,
    /// Only points and lines are in view, which are thinner than a pixel.
    ThinRounds,
    /// The scene is smaller than a pixel.
    TooSmall,
    /// No object lies in view.
    NothingInView,
}

/// Words for edges that are not there. Points and lines have none.
pub(crate) const NO_EDGES: &str =
    "no surface in view has such edges; use `edges feature,silhouette` or a smaller `edge-angle`";

impl EmptyReason {
    /// The reason and the option that helps, as a part of a sentence.
    fn text(self) -> &'static str {
        match self {
            EmptyReason::NoObjects => "the scene has no objects",
            EmptyReason::NoArea => {
                "no triangle has an area and finite coordinates; check the file with blinn info"
            }
            EmptyReason::Hidden => {
                "the file hides all objects (KHR_node_visibility); show them in the program that wrote it"
            }
            EmptyReason::AllTransparent => {
                "alpha hides all objects; make their materials opaque (alpha 1), or check the file with blinn info"
            }
            EmptyReason::HiddenNow => {
                "all objects are hidden or scaled to 0 at this time; use another `time` or `frame`"
            }
            EmptyReason::Transparent => {
                "alpha hides everything in view; use another `time` or `frame`, or check the file with blinn info"
            }
            EmptyReason::NoEdges => NO_EDGES,
            EmptyReason::Crop => "the region of `crop` shows only background; move it",
            EmptyReason::NearPlane => "the near plane cuts off everything in view; use `clip off`",
            EmptyReason::FarPlane => "the far plane cuts off everything in view; use `clip off`",
            EmptyReason::Inside => {
                "the camera is inside an object and sees only back faces; use `cull off`, or move it out"
            }
            EmptyReason::BackFaces => {
                "the camera sees only back faces; use `cull off`, or move it to the other side"
            }
            EmptyReason::LooksAway => "the camera looks away from the scene; use `look-at` or `orbit`",
            EmptyReason::PointsOff => "only points are in view, which `point-size off` leaves out",
            EmptyReason::LinesOff => "only lines are in view, which `line-width off` leaves out",
            EmptyReason::ThinRounds => {
                "only points and lines thinner than a pixel are in view; set `point-size` and `line-width` in pixels, such as 2px"
            }
            EmptyReason::TooSmall => {
                "the scene is smaller than a pixel at this time; use `zoom`, `look-at` or another `time`"
            }
            EmptyReason::NothingInView => "no object lies in view; use `look-at` or `orbit`",
        }
    }
}

impl std::fmt::Display for EmptyReason {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        f.write_str(&word_options(self.text()))
    }
}
