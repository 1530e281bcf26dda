//! Edges over pictures.

use std::time::Instant;

use crate::empty_images::empty_reason;
use crate::empty_reason::EmptyReason;
use crate::error::SessionError;
use crate::posed_frame::SceneSetup;
use blinn_core::cancellation::{CancelToken, Cancelled};
use blinn_core::geometry::Rgba;
use blinn_render::integrator::Frame;
use blinn_render::{EdgeCache, PixelRect, Pixels, RenderMemory, RenderSettings, render_edges};

/// Renders the edges of a frame, if the options want any.
pub(crate) fn picture_edges(
    setup: &SceneSetup,
    cache: &EdgeCache,
    frame: &Frame,
    settings: &RenderSettings,
) -> Result<Option<Pixels>, SessionError> {
    let Some(style) = setup.plan.options.edges.style() else { return Ok(None) };
    let start = Instant::now();
    let memory = RenderMemory::default();
    let edges = render_edges(&memory, frame, &style, cache, settings, &setup.cancel)?;
    setup.log.stage_since("edges", start, "");
    Ok(Some(edges))
}

/// Returns the reason why a drawing of edges alone shows nothing; `None` if it shows something.
pub(crate) fn empty_drawing(
    frame: &Frame,
    settings: &RenderSettings,
    edges: Option<&Pixels>,
    cancel: &CancelToken,
) -> Result<Option<EmptyReason>, Cancelled> {
    if edges.is_some_and(|edges| !is_blank(edges)) {
        return Ok(None);
    }
    let reason = empty_reason(frame, settings, &blank(settings), cancel)?;
    Ok(reason.map(|reason| match reason {
        // There is something in view, and its alpha and its size decide nothing.
        EmptyReason::Transparent
        | EmptyReason::PointsOff
        | EmptyReason::LinesOff
        | EmptyReason::ThinRounds => EmptyReason::NoEdges,
        reason => reason,
    }))
}

/// Returns true if a picture shows nothing.
pub(crate) fn is_blank(picture: &Pixels) -> bool {
    picture.colors.iter().all(|color| color.w <= 0.0)
}

/// Returns a picture of nothing.
pub(crate) fn blank(settings: &RenderSettings) -> Pixels {
    let PixelRect { width, height, .. } = settings.window();
    Pixels { width, height, colors: vec![Rgba::ZERO; width as usize * height as usize] }
}
