//! Renders layers of AOVs.

use glam::UVec2;
use rayon::prelude::*;

use crate::film::AovLayer;
use crate::integrator::{Aov, Frame, NeighbourFrames, Sample, Scratch, add_flow, first_hits};
use crate::progress::ProgressMonitor;
use crate::settings::RenderSettings;
use blinn_core::cancellation::Cancelled;
use blinn_scene::ObjectSpaces;

/// Renders layers of the first surface at each pixel's centre. Flow is 0: it needs [`render_moving_aovs`]. So is light, which
/// [`render_light_layers`](crate::render_light_layers) renders.
///
/// # Errors
/// [`Cancelled`] if `monitor` cancels.
pub fn render_aovs(
    frame: &Frame,
    aovs: &[Aov],
    settings: &RenderSettings,
    monitor: &dyn ProgressMonitor,
) -> Result<Vec<AovLayer>, Cancelled> {
    render_moving_aovs(frame, &NeighbourFrames::default(), aovs, settings, monitor)
}

/// Renders layers as [`render_aovs`] does, with the flow to the frames before and after.
///
/// # Errors
/// [`Cancelled`] if `monitor` cancels.
pub fn render_moving_aovs(
    frame: &Frame,
    neighbours: &NeighbourFrames,
    aovs: &[Aov],
    settings: &RenderSettings,
    monitor: &dyn ProgressMonitor,
) -> Result<Vec<AovLayer>, Cancelled> {
    // Saves tracing rays for no layer.
    if aovs.is_empty() {
        return Ok(Vec::new());
    }
    let spaces =
        aovs.iter().any(|aov| aov.needs_object_spaces()).then(|| ObjectSpaces::new(frame.posed.scene));
    let has_flow = aovs.iter().any(|aov| aov.is_flow());
    let window = settings.window();
    let rows: Vec<Vec<Vec<f32>>> = (window.y..window.y + window.height)
        .into_par_iter()
        .map_init(Scratch::default, |scratch, y| {
            let mut layers = vec![Vec::new(); aovs.len()];
            if monitor.is_cancelled() {
                return layers;
            }
            let columns = window.x..window.x + window.width;
            let samples: Vec<Sample> = columns.map(|x| settings.centre_sample(UVec2::new(x, y))).collect();
            let mut row = first_hits(frame, &samples, scratch);
            if has_flow {
                let size = (settings.width, settings.height);
                add_flow(frame, neighbours, size, &mut row, scratch);
            }
            for first in row {
                for (aov, out) in aovs.iter().zip(&mut layers) {
                    aov.evaluate(frame, spaces.as_ref(), &first, out);
                }
            }
            layers
        })
        .collect();
    if monitor.is_cancelled() {
        return Err(Cancelled);
    }
    let layer = |(i, &aov): (usize, &Aov)| {
        let row_length = window.width as usize * aov.channel_count();
        let mut values = vec![0f32; rows.len() * row_length];
        let out = values.par_chunks_mut(row_length.max(1));
        out.zip(&rows).for_each(|(out, row)| out.copy_from_slice(&row[i]));
        AovLayer { aov, values }
    };
    Ok(aovs.iter().enumerate().map(layer).collect())
}
