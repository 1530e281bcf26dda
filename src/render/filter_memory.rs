//! The memory that reconstructing noisy light takes.

use crate::lens_blur::LensBlur;
use crate::reconstruction::AllLight;
use crate::rough_reflections::RoughReflections;
use crate::settings::{NoiseSources, RenderSettings};
use crate::strips::strip_bytes;

/// Returns the bytes that [`render`](crate::render) takes to reconstruct noisy light, beside the picture, where some or all of
/// `noise` is in a frame.
pub fn noise_filter_bytes(settings: &RenderSettings, noise: &NoiseSources) -> u64 {
    let bytes = |noise: &NoiseSources| {
        if settings.filters_lens_blur(noise) {
            strip_bytes::<LensBlur>(settings)
        } else if settings.filters_all_light(noise) {
            strip_bytes::<AllLight>(settings)
        } else if settings.filters_rough_reflections(noise) {
            strip_bytes::<RoughReflections>(settings)
        } else {
            0
        }
    };
    noise.each().iter().map(bytes).max().unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::settings::{AdaptiveSampling, Denoise};

    const ALL: NoiseSources = NoiseSources { random_light: true, rough_metals: true, lens: true };

    #[test]
    fn only_filters_that_may_run_take_memory() {
        let settings = RenderSettings { denoise: Denoise::Auto, ..RenderSettings::default() };
        let bytes = |noise: NoiseSources| noise_filter_bytes(&settings, &noise);
        let [light, metals, lens] = ALL.each().map(bytes);
        assert!(light > 0 && metals > 0 && lens > light, "{light} {metals} {lens}");
        assert_eq!(bytes(NoiseSources::default()), 0);
        assert_eq!(bytes(NoiseSources { lens: false, ..ALL }), light.max(metals));
        let adaptive = Some(AdaptiveSampling { threshold: 0.1, ev: 0.0 });
        for unfiltered in [
            RenderSettings { denoise: Denoise::Off, ..settings },
            RenderSettings { samples: 1, ..settings },
            RenderSettings { adaptive, ..settings },
        ] {
            assert_eq!(noise_filter_bytes(&unfiltered, &ALL), 0, "{unfiltered:?}");
        }
    }

    #[test]
    fn memory_does_not_grow_with_the_height_of_large_pictures() {
        let bytes = |width, height| {
            let settings =
                RenderSettings { width, height, denoise: Denoise::Auto, ..RenderSettings::default() };
            noise_filter_bytes(&settings, &ALL)
        };
        assert_eq!(bytes(640, 1000), bytes(640, 2000));
        assert!(bytes(640, 100) < bytes(640, 1000) && bytes(640, 1000) < bytes(1280, 1000));
    }
}
