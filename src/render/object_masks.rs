//! Masks of objects: the pixels where each object is visible, and those that it would cover alone (amodal).

use std::collections::BTreeMap;

use glam::{DVec2, UVec2};
use rayon::prelude::*;

use crate::integrator::{Frame, ObjectHit, Sample, Scratch, trace_objects};
use crate::pixel_mask::{MaskRect, PixelMask};
use crate::progress::ProgressMonitor;
use crate::settings::RenderSettings;
use blinn_core::cancellation::Cancelled;

/// The masks of an object, in pixels of the full picture.
#[derive(Clone, Debug, PartialEq)]
pub struct ObjectMask {
    /// Number of the object, from 1.
    pub object: u32,
    /// Pixels whose centres see the object first, as in [`Aov::ObjectId`](crate::integrator::Aov::ObjectId).
    pub visible: PixelMask,
    /// Pixels whose centres would see the object if it were alone.
    pub amodal: PixelMask,
}

/// Rows that are traced at once. Their parts of masks are joined before the next are traced.
const BAND: usize = 64;

/// Traces the masks of all objects with a pixel in `window`, sorted by object. The window may reach beyond the picture.
/// Pixels beyond the picture have no visible object.
///
/// # Errors
/// [`Cancelled`] if `monitor` cancels.
pub fn render_object_masks(
    frame: &Frame,
    settings: &RenderSettings,
    window: MaskRect,
    monitor: &dyn ProgressMonitor,
) -> Result<Vec<ObjectMask>, Cancelled> {
    let shown = MaskRect::from(settings.window());
    let trace_row = |scratch: &mut Scratch, y: i32| {
        if monitor.is_cancelled() {
            return Vec::new();
        }
        let samples: Vec<Sample> =
            (window.x..window.right()).map(|x| centre_sample(settings, x, y)).collect();
        let mut hits: Vec<(u32, i32, bool)> = Vec::new();
        trace_objects(frame, &samples, scratch, |sample, ObjectHit { object, is_first }| {
            let x = window.x + sample as i32;
            hits.push((object, x, is_first && shown.contains(x, y)));
        });
        row_masks(hits, y)
    };
    let mut masks: BTreeMap<u32, ObjectMask> = BTreeMap::new();
    for top in (window.y..window.bottom()).step_by(BAND) {
        let bottom = top.saturating_add(BAND as i32).min(window.bottom());
        let rows: Vec<Vec<(u32, RowMask)>> =
            (top..bottom).into_par_iter().map_init(Scratch::default, trace_row).collect();
        if monitor.is_cancelled() {
            return Err(Cancelled);
        }
        for (object, row) in rows.into_iter().flatten() {
            let mask = masks.entry(object).or_insert_with(|| ObjectMask {
                object,
                visible: PixelMask::default(),
                amodal: PixelMask::default(),
            });
            mask.visible.extend(row.visible);
            mask.amodal.extend(row.amodal);
        }
    }
    Ok(masks.into_values().collect())
}

/// The masks of an object in one row.
#[derive(Default)]
struct RowMask {
    visible: PixelMask,
    amodal: PixelMask,
}

/// The masks of each object in row `y`, from its hits: object, column, and true for the first hit of a pixel.
fn row_masks(mut hits: Vec<(u32, i32, bool)>, y: i32) -> Vec<(u32, RowMask)> {
    hits.sort_unstable();
    let mut masks: Vec<(u32, RowMask)> = Vec::new();
    for (object, x, is_visible) in hits {
        if masks.last().is_none_or(|(last, _)| *last != object) {
            masks.push((object, RowMask::default()));
        }
        if let Some((_, mask)) = masks.last_mut() {
            mask.amodal.add(x, y);
            if is_visible {
                mask.visible.add(x, y);
            }
        }
    }
    masks
}

/// A sample at the centre of a pixel that may be beyond the picture.
fn centre_sample(settings: &RenderSettings, x: i32, y: i32) -> Sample {
    let film_x = (f64::from(x) + 0.5) / f64::from(settings.width);
    let down = (f64::from(y) + 0.5) / f64::from(settings.height);
    Sample {
        x: film_x,
        y: 1.0 - down,
        footprint: [0.0; 2],
        pixel: UVec2::ZERO,
        index: 0,
        aperture: DVec2::ZERO,
    }
}
