//! The layers of a picture beside its colour: rendered, and scaled with the scene.

use glam::Vec3;

use blinn_core::geometry::Rgb;
use blinn_render::display::{Background, Display};
use blinn_render::integrator::{Aov, LightLayers};
use blinn_render::{AovLayer, Pixels};
use blinn_scene::Normalization;

/// The layers of the light of a picture. That of the environment holds the colour of the background, too.
pub fn light_layers(
    aovs: &[Aov],
    light: &[LightLayers],
    pixels: &Pixels,
    display: &Display,
) -> Vec<AovLayer> {
    let background = |i: usize| match display.background {
        Background::Color(color) => color * (1.0 - pixels.colors[i].w),
        Background::Transparent => Rgb::ZERO,
    };
    let layer = |aov: Aov| {
        let values = light.iter().enumerate().flat_map(|(i, light)| {
            let own = aov.light().map_or(Rgb::ZERO, |layer| light[layer]);
            let behind = if aov == Aov::Environment { background(i) } else { Rgb::ZERO };
            (own + behind).to_array()
        });
        AovLayer { aov, values: values.collect() }
    };
    aovs.iter().map(|&aov| layer(aov)).collect()
}

/// Scales the layers that hold lengths and positions.
pub fn normalize_layers(layers: &mut [AovLayer], normalization: &Normalization) {
    for layer in layers {
        match layer.aov {
            Aov::Depth | Aov::Distance | Aov::CameraPosition => {
                layer.values.iter_mut().for_each(|x| *x = (f64::from(*x) * normalization.scale) as f32);
            }
            Aov::Position => {
                for p in layer.values.as_chunks_mut::<3>().0 {
                    // Where nothing is hit, the position is 0.
                    if *p != [0.0; 3] {
                        *p = normalization.point(Vec3::from_array(*p).as_dvec3()).as_vec3().to_array();
                    }
                }
            }
            _ => {}
        }
    }
}
