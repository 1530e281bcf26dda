//! Heat maps of the traversal steps of eye rays.

use base64::Engine;
use base64::prelude::BASE64_STANDARD;

use super::svg::Svg;
use blinn_output::{encode_png, escape_html, heat_color, heat_map_max, preview_layer};
use blinn_render::AovLayer;

/// The heat map of a scene, as `blinn render --heatmap steps` renders it.
#[derive(Clone, Debug)]
pub struct HeatMap {
    name: String,
    png: Vec<u8>,
    /// Steps of the brightest colour.
    max: f32,
    /// Mean steps per ray.
    mean: f64,
}

impl HeatMap {
    /// Renders a layer of [`blinn_render::integrator::Aov::Steps`] of this size.
    ///
    /// # Errors
    /// The PNG encoder fails.
    pub fn new(scene: &str, layer: &AovLayer, size: (u32, u32)) -> std::io::Result<HeatMap> {
        let rays = layer.values.len() / layer.aov.channel_count();
        let sum: f64 = layer.values.iter().map(|&v| f64::from(v)).sum();
        Ok(HeatMap {
            name: scene.into(),
            png: encode_png(size, &preview_layer(layer))?,
            max: heat_map_max(layer),
            mean: sum / rays.max(1) as f64,
        })
    }

    /// The HTML figure with a colour scale.
    pub(super) fn figure(&self) -> String {
        let HeatMap { name, png, max, mean } = self;
        let mut scale = Svg::new(300.0, 30.0, "Traversal steps by colour");
        const SCALE_BARS: u8 = 60;
        for i in 0..SCALE_BARS {
            let [r, g, b] = heat_color(f32::from(i) / f32::from(SCALE_BARS - 1));
            let fill = format!("#{r:02x}{g:02x}{b:02x}");
            scale.bar((f64::from(i) * 5.0, 0.0), (5.2, 12.0), &fill, "");
        }
        scale.text((0.0, 26.0), "start", "0");
        scale.text((300.0, 26.0), "end", &format!("{max:.0} steps"));
        format!(
            "<figure><img alt=\"Heat map of {name}\" width=\"440\" src=\"data:image/png;base64,{}\">{}<figcaption>{name}: \
             {mean:.1} steps per ray</figcaption></figure>\n",
            BASE64_STANDARD.encode(png),
            scale.finish(),
            name = escape_html(name),
        )
    }
}
