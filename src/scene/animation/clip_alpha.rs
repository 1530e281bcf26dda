//! Upper bounds of alpha over an animation clip: finds triangles that MASK or BLEND hides completely at every time.

use crate::texture::sampling::TextureRef;
use crate::texture::texels::TextureChannel;
use crate::{
    AlphaMode, Animation, ChannelTarget, Interpolation, Keyframes, Material, MaterialProperty, Mesh, Scene,
    TextureSlot,
};

/// The materials of a scene that may hide triangles.
#[derive(Clone, Debug, Default)]
pub(super) struct ClipAlpha {
    /// One for each material; `None` where alpha hides nothing.
    materials: Vec<Option<MaterialAlpha>>,
}

/// The alpha of a material over the clip.
#[derive(Clone, Copy, Debug)]
struct MaterialAlpha {
    /// Greatest alpha factor.
    factor: f32,
    /// Lowest cutoff of MASK; `None` for BLEND.
    cutoff: Option<f32>,
    /// True if an animation moves the texture of the base colour.
    texture_moves: bool,
}

/// Relative rounding error of the alpha bound.
const ROUNDING: f32 = 1e-5;

impl ClipAlpha {
    /// Bounds the alpha of each material over the `active` animations.
    pub fn new(scene: &Scene, active: &[&Animation]) -> ClipAlpha {
        let mut materials: Vec<_> = scene.materials.iter().map(MaterialAlpha::at_rest).collect();
        let mut driven = vec![Driven::default(); materials.len()];
        for channel in active.iter().flat_map(|a| &a.channels) {
            let ChannelTarget::Material(i, property) = channel.target else { continue };
            if let Some(alpha) = &mut materials[i as usize] {
                let first = &mut driven[i as usize];
                alpha.include(&scene.materials[i as usize], property, &channel.keyframes, first);
            }
        }
        ClipAlpha { materials }
    }

    /// Returns true if alpha may hide triangles of a mesh.
    pub fn may_hide(&self, mesh: &Mesh) -> bool {
        matches!(self.materials.get(mesh.material as usize), Some(Some(_)))
    }

    /// Returns true if a point of the triangle may be visible at some time.
    pub fn may_show(&self, scene: &Scene, mesh: &Mesh, corners: [u32; 3]) -> bool {
        let material = mesh.material as usize;
        let Some(Some(alpha)) = self.materials.get(material) else { return true };
        let vertex_alpha = |c: u32| match mesh.colors.get(c as usize) {
            Some(color) if !mesh.morphs_alpha(c) => color.w,
            _ => 1.0,
        };
        let [a, b, c] = corners.map(vertex_alpha);
        let mut bound = alpha.factor.max(0.0) * a.max(b).max(c).max(0.0);
        if !alpha.shows(bound) {
            return false;
        }
        let of = &scene.materials[material];
        let base = of.base_color.texture.filter(|_| of.alpha_from_base).map(|t| (t, TextureChannel::A));
        for (texture, channel) in [base, of.alpha.texture].into_iter().flatten() {
            let is_animated = alpha.texture_moves && base.is_some_and(|(t, _)| t == texture);
            let moves = is_animated || mesh.morphs_uvs(texture.uv_set);
            bound *= max_texel(scene, mesh, corners, &texture, channel, moves);
        }
        alpha.shows(bound)
    }
}

/// The properties of a material whose rest values an animation has replaced.
#[derive(Clone, Copy, Default)]
struct Driven {
    factor: bool,
    cutoff: bool,
}

impl MaterialAlpha {
    fn at_rest(material: &Material) -> Option<MaterialAlpha> {
        let cutoff = match material.alpha_mode {
            AlphaMode::Opaque => return None,
            AlphaMode::Mask(cutoff) => Some(cutoff),
            AlphaMode::Blend => None,
        };
        Some(MaterialAlpha { factor: material.alpha.factor, cutoff, texture_moves: false })
    }

    /// Includes the values of an animated property.
    fn include(
        &mut self,
        material: &Material,
        property: MaterialProperty,
        keyframes: &Keyframes,
        driven: &mut Driven,
    ) {
        use TextureSlot::{Base, Diffuse};
        match property {
            MaterialProperty::Base | MaterialProperty::Diffuse if material.has_base_property(property) => {
                let greatest = extreme(keyframes, 3, f32::max, f32::INFINITY);
                self.factor = if driven.factor { self.factor.max(greatest) } else { greatest };
                driven.factor = true;
            }
            MaterialProperty::AlphaCutoff => {
                let lowest = extreme(keyframes, 0, f32::min, f32::NEG_INFINITY);
                let rest = self.cutoff.filter(|_| driven.cutoff);
                self.cutoff = self.cutoff.map(|_| rest.map_or(lowest, |rest| rest.min(lowest)));
                driven.cutoff = true;
            }
            MaterialProperty::Offset(Base | Diffuse)
            | MaterialProperty::Rotation(Base | Diffuse)
            | MaterialProperty::Scale(Base | Diffuse) => self.texture_moves = true,
            _ => {}
        }
    }

    /// Returns true if a point with this alpha may be visible.
    fn shows(&self, alpha: f32) -> bool {
        // Also true for NaN.
        match self.cutoff {
            Some(cutoff) => !(alpha < cutoff * (1.0 - ROUNDING)),
            None => !(alpha <= 0.0),
        }
    }
}

/// Returns the extreme value of a component over all keyframes; `unknown` where splines may overshoot it.
fn extreme(keyframes: &Keyframes, component: usize, select: fn(f32, f32) -> f32, unknown: f32) -> f32 {
    let values = keyframes.values.iter().skip(component).step_by(keyframes.width.max(1)).copied();
    let is_zero = values.clone().all(|v| v == 0.0);
    match keyframes.interpolation {
        Interpolation::CubicSpline if !is_zero => unknown,
        _ => values.reduce(select).unwrap_or(unknown),
    }
}

/// Returns an upper bound of a texture's channel on a triangle.
fn max_texel(
    scene: &Scene,
    mesh: &Mesh,
    corners: [u32; 3],
    of: &TextureRef,
    channel: TextureChannel,
    moves: bool,
) -> f32 {
    let texture = &scene.textures[of.texture as usize];
    let image = &scene.images[texture.image as usize];
    let max_mip = image.max_mip(channel);
    if moves || max_mip.max() <= 0.0 {
        return max_mip.max();
    }
    let bounds = of.transform.bounds_of_triangle(mesh.uvs_at(corners, of.uv_set));
    let [across, down] = texture.texel_ranges(bounds, [image.width, image.height]);
    let ranges = across.iter().flat_map(|x| down.iter().map(move |y| (x, y)));
    ranges.map(|(x, y)| max_mip.max_over(x, y)).fold(f32::NEG_INFINITY, f32::max)
}
