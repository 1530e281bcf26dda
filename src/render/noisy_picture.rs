//! Pictures whose noise is not yet removed, to measure the filter alone.

use crate::film::{PixelRect, Pixels};
use crate::integrator::{Frame, Integrator};
use crate::memory::RenderMemory;
use crate::progress::ProgressMonitor;
use crate::reconstruction::{AllLight, PixelParts};
use crate::settings::RenderSettings;
use crate::strips::{Reconstruction, render_rows};
use blinn_core::cancellation::Cancelled;

/// A whole picture in parts, with its noise: 0.2 kB for each pixel, where [`render`](crate::render) holds some rows.
pub struct NoisyPicture {
    settings: RenderSettings,
    pixels: Vec<PixelParts>,
}

impl NoisyPicture {
    /// Renders all samples. A crop of the settings is ignored.
    ///
    /// # Errors
    /// [`Cancelled`] if `monitor` cancels.
    pub fn render(
        frame: &Frame,
        integrator: &dyn Integrator,
        settings: &RenderSettings,
        monitor: &dyn ProgressMonitor,
    ) -> Result<NoisyPicture, Cancelled> {
        let settings = RenderSettings { crop: None, ..*settings };
        let window = settings.window();
        let mut pixels = vec![PixelParts::default(); window.width as usize * window.height as usize];
        let memory = RenderMemory::default();
        render_rows::<AllLight>(&memory, frame, integrator, &settings, window, &mut pixels, monitor)?;
        Ok(NoisyPicture { settings, pixels })
    }

    /// Removes the noise of random estimators as [`Denoise::On`](crate::Denoise::On) does, of the frame that was rendered.
    ///
    /// # Errors
    /// [`Cancelled`] if `monitor` cancels.
    pub fn filter(&self, frame: &Frame, monitor: &dyn ProgressMonitor) -> Result<Pixels, Cancelled> {
        let window = self.settings.window();
        let PixelRect { width, height, .. } = window;
        let mut colors = Vec::with_capacity(self.pixels.len());
        for first in (0..height).step_by(AllLight::ROWS as usize) {
            let end = first.saturating_add(AllLight::ROWS).min(height);
            let from = first.saturating_sub(AllLight::MARGIN);
            let to = end.saturating_add(AllLight::MARGIN).min(height);
            let held = PixelRect { y: from, height: to - from, ..window };
            let pixels = &self.pixels[from as usize * width as usize..to as usize * width as usize];
            let strip = (first - from) as usize..(end - from) as usize;
            colors.extend(AllLight::reconstruct(pixels, held, strip, &self.settings, frame, monitor)?);
        }
        Ok(Pixels { width, height, colors })
    }
}
