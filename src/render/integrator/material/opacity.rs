//! Opacity, transmission and base colour of a material at a point.

use glam::Vec4Swizzles;

use crate::integrator::surface::texture_eval::TextureEvalContext;
use blinn_core::geometry::Rgb;
use blinn_scene::{AlphaMode, Material, PosedScene, Reflectance};

/// Opacity of a material: 0 or 1 for MASK, 0…1 for BLEND. Masks are cut from the finest texels: mip levels would show a
/// distant fence as all there or all gone.
pub(crate) fn opacity(posed: &PosedScene, material: &Material, ctx: &TextureEvalContext) -> f32 {
    let unclamped = |ctx: &TextureEvalContext| {
        let texture = material.base_color.texture.as_ref().filter(|_| material.alpha_from_base);
        ctx.scalar(posed, &material.alpha) * ctx.color().w * ctx.alpha(posed, texture)
    };
    match material.alpha_mode {
        AlphaMode::Opaque => 1.0,
        AlphaMode::Mask(cutoff) => f32::from(unclamped(&ctx.without_footprint()) >= cutoff),
        AlphaMode::Blend => unclamped(ctx).clamp(0.0, 1.0),
    }
}

/// Share of light that passes straight through a surface, by colour: what its opacity leaves, and tinted what it transmits.
/// The surface of a solid (a body) has half of the tint, the square root, because light passes two of them.
pub(crate) fn transmittance(
    posed: &PosedScene,
    material: &Material,
    ctx: &TextureEvalContext,
    is_body: bool,
) -> Rgb {
    let opacity = opacity(posed, material, ctx);
    let weight = transmission_weight(posed, material, ctx);
    let tint = || {
        let color = material.transmission_color.unwrap_or_else(|| base_color(posed, material, ctx));
        if is_body { Rgb::from_array(color.max(Rgb::ZERO).to_array().map(f32::sqrt)) } else { color }
    };
    let transmitted = if weight > 0.0 { weight * tint() } else { Rgb::ZERO };
    Rgb::splat(1.0 - opacity) + transmitted * opacity
}

/// The share of what a dielectric would scatter that passes through instead; 0 for metals.
pub(crate) fn transmission_weight(posed: &PosedScene, material: &Material, ctx: &TextureEvalContext) -> f32 {
    if !material.transmits() {
        return 0.0;
    }
    let metallic = match &material.reflectance {
        Reflectance::MetallicRoughness { metallic, .. } => ctx.scalar(posed, metallic).clamp(0.0, 1.0),
        _ => 0.0,
    };
    ctx.scalar(posed, &material.transmission).clamp(0.0, 1.0) * (1.0 - metallic)
}

/// Base × texture × vertex colour, linear RGB.
pub(crate) fn base_color(posed: &PosedScene, material: &Material, ctx: &TextureEvalContext) -> Rgb {
    let texel = ctx.texture(posed, material.base_color.texture.as_ref(), material.base_color_semantics());
    material.base_color.factor * texel.xyz() * ctx.color().xyz()
}
