//! Properties of materials, lights, cameras and environments that animations can drive.
//!
//! Source: KHR_animation_pointer and the glTF object model.

use glam::{Vec2, Vec3};

use super::keyframes::Keyframes;
use crate::{
    AlphaMode, AreaLight, EnvironmentProperty, FileCamera, FileEnvironment, FileProjection, Light, LightKind,
    Material, Reflectance, ScalarInput, TextureRef,
};

/// A property of a material.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum MaterialProperty {
    /// Base colour and alpha (4 components).
    Base,
    /// Diffuse colour and alpha of the specular-glossiness model (4 components).
    Diffuse,
    /// Specular colour of the specular-glossiness model (3 components).
    SpecularF0,
    /// Glossiness factor.
    Glossiness,
    /// Metallic factor.
    Metallic,
    /// Roughness factor.
    Roughness,
    /// Cutoff of an alpha mask.
    AlphaCutoff,
    /// Emitted colour (3 components).
    Emission,
    /// Emission strength.
    EmissionStrength,
    /// Scale of the normal map.
    NormalScale,
    /// Strength of the occlusion map.
    OcclusionStrength,
    /// Index of refraction.
    Ior,
    /// Weight of the specular reflection.
    Specular,
    /// Colour of the specular reflection (3 components).
    SpecularColor,
    /// Transmission.
    Transmission,
    /// Clear coat.
    Clearcoat,
    /// Roughness of the clear coat.
    ClearcoatRoughness,
    /// Scale of the clear coat's normal map.
    ClearcoatNormalScale,
    /// Strength of the anisotropy.
    AnisotropyStrength,
    /// Rotation of the anisotropy, in radians.
    AnisotropyRotation,
    /// Colour of the sheen (3 components).
    SheenColor,
    /// Roughness of the sheen.
    SheenRoughness,
    /// Share of the surface that has a thin film.
    Iridescence,
    /// Index of refraction of the thin film.
    IridescenceIor,
    /// Thickness of the thin film in nanometres where the texture is 0.
    IridescenceMinThickness,
    /// Thickness of the thin film in nanometres where the texture is 1.
    IridescenceMaxThickness,
    /// Share of the light that is transmitted diffusely.
    DiffuseTransmission,
    /// Colour of the light that is transmitted diffusely (3 components).
    DiffuseTransmissionColor,
    /// Dispersion of a body.
    Dispersion,
    /// Thickness of a volume, in metres.
    Thickness,
    /// Colour of the light after the attenuation distance in a volume (3 components).
    AttenuationColor,
    /// Attenuation distance of a volume, in metres.
    AttenuationDistance,
    /// Offset of a slot's texture coordinates (2 components).
    Offset(TextureSlot),
    /// Rotation of a slot's texture coordinates, in radians.
    Rotation(TextureSlot),
    /// Scale of a slot's texture coordinates (2 components).
    Scale(TextureSlot),
}

/// A texture slot of a material.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum TextureSlot {
    /// Base colour and alpha.
    Base,
    /// Diffuse colour and alpha of the specular-glossiness model.
    Diffuse,
    /// Specular colour and glossiness.
    SpecularGlossiness,
    /// Metallic and roughness.
    MetallicRoughness,
    /// Normal map.
    Normal,
    /// Occlusion.
    Occlusion,
    /// Emission.
    Emission,
    /// Weight of the specular reflection.
    Specular,
    /// Colour of the specular reflection.
    SpecularColor,
    /// Transmission.
    Transmission,
    /// Clear coat.
    Clearcoat,
    /// Roughness of the clear coat.
    ClearcoatRoughness,
    /// Normal map of the clear coat.
    ClearcoatNormal,
    /// Anisotropy.
    Anisotropy,
    /// Colour of the sheen.
    SheenColor,
    /// Roughness of the sheen.
    SheenRoughness,
    /// Share of the surface that has a thin film.
    Iridescence,
    /// Thickness of the thin film.
    IridescenceThickness,
    /// Share of the light that is transmitted diffusely.
    DiffuseTransmission,
    /// Colour of the light that is transmitted diffusely.
    DiffuseTransmissionColor,
    /// Thickness of a volume, which no material has: rays find the thickness of a body.
    Thickness,
}

/// A property of a light.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum LightProperty {
    /// Linear colour (3 components).
    Color,
    /// Intensity in the file's unit.
    Intensity,
    /// Range in metres.
    Range,
    /// Inner half angle of a spot light, in radians.
    InnerCone,
    /// Outer half angle of a spot light, in radians.
    OuterCone,
    /// Blender's blend of a spot light: 1 − inner / outer half angle.
    Blend,
}

/// A property of a camera.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum CameraProperty {
    /// Vertical field of view in radians.
    Yfov,
    /// Width over height.
    Aspect,
    /// Half the width of an orthographic view, in metres.
    Xmag,
    /// Half the height of an orthographic view, in metres.
    Ymag,
    /// Distance of the near plane.
    Znear,
    /// Distance of the far plane.
    Zfar,
}

impl MaterialProperty {
    /// Returns the number of components.
    pub fn width(self) -> usize {
        match self {
            MaterialProperty::Base | MaterialProperty::Diffuse => 4,
            MaterialProperty::Emission | MaterialProperty::SpecularColor | MaterialProperty::SpecularF0 => 3,
            MaterialProperty::AttenuationColor
            | MaterialProperty::SheenColor
            | MaterialProperty::DiffuseTransmissionColor => 3,
            MaterialProperty::Offset(_) | MaterialProperty::Scale(_) => 2,
            _ => 1,
        }
    }
}

impl LightProperty {
    /// Returns the number of components.
    pub fn width(self) -> usize {
        if self == LightProperty::Color { 3 } else { 1 }
    }
}

impl Material {
    /// Sets a property, clamped to its range: keys may exceed it, and so may splines between keys. Ignores
    /// properties that the material does not have.
    pub(super) fn set_property(&mut self, property: MaterialProperty, v: &[f64]) {
        let at = |i: usize| v.get(i).copied().unwrap_or(0.0) as f32;
        let vec3 = || Vec3::new(at(0), at(1), at(2)).max(Vec3::ZERO);
        let fraction = || at(0).clamp(0.0, 1.0);
        match property {
            MaterialProperty::Base | MaterialProperty::Diffuse => {
                if self.has_base_property(property) {
                    (self.base_color.factor, self.alpha.factor) = (vec3(), at(3).clamp(0.0, 1.0));
                }
            }
            MaterialProperty::AlphaCutoff => {
                if let AlphaMode::Mask(cutoff) = &mut self.alpha_mode {
                    *cutoff = at(0).max(0.0);
                }
            }
            MaterialProperty::Emission => self.emission.factor = vec3(),
            MaterialProperty::EmissionStrength => self.emission_strength = at(0).max(0.0),
            MaterialProperty::OcclusionStrength => self.occlusion.factor = fraction(),
            MaterialProperty::Transmission => self.transmission.factor = fraction(),
            MaterialProperty::Clearcoat => self.clearcoat.factor.factor = fraction(),
            MaterialProperty::ClearcoatRoughness => self.clearcoat.roughness.factor = fraction(),
            MaterialProperty::Thickness => {
                if let Some(volume) = &mut self.volume {
                    // A body stays one.
                    volume.thickness = at(0).max(f32::MIN_POSITIVE);
                }
            }
            MaterialProperty::AttenuationColor => {
                if let Some(volume) = &mut self.volume {
                    volume.attenuation_color = vec3().min(Vec3::ONE);
                }
            }
            MaterialProperty::AttenuationDistance => {
                if let Some(volume) = &mut self.volume {
                    volume.attenuation_distance = if at(0) > 0.0 { at(0) } else { f32::INFINITY };
                }
            }
            MaterialProperty::NormalScale => {
                if let Some(map) = &mut self.normal {
                    map.scale = at(0);
                }
            }
            MaterialProperty::AnisotropyStrength => {
                if let Some(anisotropy) = &mut self.anisotropy {
                    anisotropy.strength = fraction();
                }
            }
            MaterialProperty::AnisotropyRotation => {
                if let Some(anisotropy) = &mut self.anisotropy {
                    anisotropy.rotation = at(0);
                }
            }
            MaterialProperty::SheenColor => self.sheen.color.factor = vec3().min(Vec3::ONE),
            MaterialProperty::SheenRoughness => self.sheen.roughness.factor = fraction(),
            MaterialProperty::Dispersion => self.dispersion = at(0).max(0.0),
            MaterialProperty::DiffuseTransmission => self.diffuse_transmission.factor.factor = fraction(),
            MaterialProperty::DiffuseTransmissionColor => {
                self.diffuse_transmission.color.factor = vec3().min(Vec3::ONE);
            }
            MaterialProperty::Iridescence => self.iridescence.factor.factor = fraction(),
            MaterialProperty::IridescenceIor => self.iridescence.ior = at(0).max(1.0),
            MaterialProperty::IridescenceMinThickness => self.iridescence.min_thickness = at(0).max(0.0),
            MaterialProperty::IridescenceMaxThickness => self.iridescence.max_thickness = at(0).max(0.0),
            MaterialProperty::ClearcoatNormalScale => {
                if let Some(map) = &mut self.clearcoat.normal {
                    map.scale = at(0);
                }
            }
            MaterialProperty::Offset(slot) => {
                self.change_textures(slot, |t| t.transform.set_offset(Vec2::new(at(0), at(1))))
            }
            MaterialProperty::Rotation(slot) => {
                self.change_textures(slot, |t| t.transform.set_rotation(at(0)))
            }
            MaterialProperty::Scale(slot) => {
                self.change_textures(slot, |t| t.transform.set_scale(Vec2::new(at(0), at(1))))
            }
            _ => self.reflectance.set_property(property, vec3()),
        }
    }

    /// Returns true if this property, `Base` or `Diffuse`, is that of the material's model.
    pub(super) fn has_base_property(&self, property: MaterialProperty) -> bool {
        self.is_specular_glossiness() == (property == MaterialProperty::Diffuse)
    }

    /// Returns true for the specular-glossiness model. Metallic-roughness properties, which such
    /// materials may also have as a fallback, do not apply to it.
    fn is_specular_glossiness(&self) -> bool {
        matches!(self.reflectance, Reflectance::SpecularGlossiness { .. })
    }

    /// Changes the textures of a slot.
    fn change_textures(&mut self, slot: TextureSlot, change: impl Fn(&mut TextureRef)) {
        let base = if self.is_specular_glossiness() { TextureSlot::Diffuse } else { TextureSlot::Base };
        let scalar = |input: &mut ScalarInput| input.texture.iter_mut().for_each(|(t, _)| change(t));
        match (slot, &mut self.reflectance) {
            (slot, _) if slot == base => self.base_color.texture.iter_mut().for_each(&change),
            (TextureSlot::Normal, _) => self.normal.iter_mut().for_each(|n| change(&mut n.texture)),
            (TextureSlot::Occlusion, _) => scalar(&mut self.occlusion),
            (TextureSlot::Emission, _) => self.emission.texture.iter_mut().for_each(&change),
            (TextureSlot::Transmission, _) => scalar(&mut self.transmission),
            (TextureSlot::Clearcoat, _) => scalar(&mut self.clearcoat.factor),
            (TextureSlot::ClearcoatRoughness, _) => scalar(&mut self.clearcoat.roughness),
            (TextureSlot::Anisotropy, _) => {
                self.anisotropy.iter_mut().flat_map(|of| &mut of.texture).for_each(&change);
            }
            (TextureSlot::SheenColor, _) => self.sheen.color.texture.iter_mut().for_each(&change),
            (TextureSlot::SheenRoughness, _) => scalar(&mut self.sheen.roughness),
            (TextureSlot::DiffuseTransmission, _) => scalar(&mut self.diffuse_transmission.factor),
            (TextureSlot::DiffuseTransmissionColor, _) => {
                self.diffuse_transmission.color.texture.iter_mut().for_each(&change);
            }
            (TextureSlot::Iridescence, _) => scalar(&mut self.iridescence.factor),
            (TextureSlot::IridescenceThickness, _) => {
                self.iridescence.thickness_texture.iter_mut().for_each(&change);
            }
            (TextureSlot::ClearcoatNormal, _) => {
                self.clearcoat.normal.iter_mut().for_each(|n| change(&mut n.texture));
            }
            (TextureSlot::MetallicRoughness, Reflectance::MetallicRoughness { metallic, roughness, .. }) => {
                scalar(metallic);
                scalar(roughness);
            }
            (TextureSlot::SpecularGlossiness, Reflectance::SpecularGlossiness { specular, glossiness }) => {
                specular.texture.iter_mut().for_each(&change);
                scalar(glossiness);
            }
            (TextureSlot::Specular, Reflectance::MetallicRoughness { dielectric, .. }) => {
                scalar(&mut dielectric.specular);
            }
            (TextureSlot::SpecularColor, Reflectance::MetallicRoughness { dielectric, .. }) => {
                dielectric.specular_color.texture.iter_mut().for_each(&change);
            }
            _ => {}
        }
    }
}

impl Reflectance {
    /// Sets a property to a vector that is not negative, or to its first component.
    fn set_property(&mut self, property: MaterialProperty, v: Vec3) {
        use MaterialProperty as F;
        let fraction = v.x.min(1.0);
        match self {
            Reflectance::MetallicRoughness { metallic, roughness, dielectric } => match property {
                F::Metallic => metallic.factor = fraction,
                F::Roughness => roughness.factor = fraction,
                F::Ior => dielectric.ior = if v.x == 0.0 { 0.0 } else { v.x.max(1.0) },
                F::Specular => dielectric.specular.factor = fraction,
                F::SpecularColor => dielectric.specular_color.factor = v,
                _ => {}
            },
            Reflectance::SpecularGlossiness { specular, glossiness } => match property {
                F::SpecularF0 => specular.factor = v,
                F::Glossiness => glossiness.factor = fraction,
                _ => {}
            },
            Reflectance::Mtl(_) | Reflectance::Unlit | Reflectance::Unshaded => {}
        }
    }
}

impl Light {
    /// Sets a property, clamped to its range. Ignores properties that the type of light does not have.
    pub(super) fn set_property(&mut self, property: LightProperty, v: &[f64]) {
        let at = |i: usize| v.get(i).copied().unwrap_or(0.0) as f32;
        match (property, &mut self.kind) {
            (LightProperty::Color, _) => self.color = Vec3::new(at(0), at(1), at(2)).max(Vec3::ZERO),
            (LightProperty::Intensity, _) => self.intensity = at(0).max(0.0),
            (LightProperty::Range, _) => self.range = if at(0) > 0.0 { at(0) } else { f32::INFINITY },
            (LightProperty::InnerCone, LightKind::Spot { inner, .. }) => *inner = at(0),
            (LightProperty::OuterCone, LightKind::Spot { outer, .. }) => *outer = at(0),
            (LightProperty::Blend, LightKind::Spot { inner, outer }) => *inner = *outer * (1.0 - at(0)),
            _ => {}
        }
    }
}

impl AreaLight {
    /// Sets a property, clamped to its range. Ignores properties that area lights do not have.
    pub(super) fn set_property(&mut self, property: LightProperty, v: &[f64]) {
        let at = |i: usize| v.get(i).copied().unwrap_or(0.0) as f32;
        match property {
            LightProperty::Color => self.color = Vec3::new(at(0), at(1), at(2)).max(Vec3::ZERO),
            LightProperty::Intensity => self.intensity = at(0).max(0.0),
            _ => {}
        }
    }
}

impl FileEnvironment {
    /// Sets a property to its value at `time`, in seconds. Rotations are spherically interpolated, as those of nodes.
    pub(super) fn set_property(&mut self, property: EnvironmentProperty, keyframes: &Keyframes, time: f64) {
        match property {
            EnvironmentProperty::Intensity => self.intensity = (keyframes.sample(time)[0] as f32).max(0.0),
            EnvironmentProperty::Rotation => self.rotation = keyframes.sample_rotation(time),
        }
    }
}

impl FileCamera {
    /// Sets a property. Ignores values that give no view.
    pub(super) fn set_property(&mut self, property: CameraProperty, v: f64) {
        let positive = v > 0.0 && v.is_finite();
        match (property, &mut self.projection) {
            (CameraProperty::Yfov, FileProjection::Perspective { yfov, .. })
                if positive && v < std::f64::consts::PI =>
            {
                *yfov = v;
            }
            (CameraProperty::Aspect, FileProjection::Perspective { aspect, .. }) if positive => {
                *aspect = Some(v)
            }
            (CameraProperty::Xmag, FileProjection::Orthographic { xmag, .. }) if v != 0.0 => *xmag = v.abs(),
            (CameraProperty::Ymag, FileProjection::Orthographic { ymag, .. }) if v != 0.0 => *ymag = v.abs(),
            (CameraProperty::Znear, _) => self.znear = v.max(0.0),
            (CameraProperty::Zfar, _) => self.zfar = if v > self.znear { v } else { f64::INFINITY },
            _ => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ColorInput;

    #[test]
    fn properties_of_the_other_model_change_nothing() {
        let glossy = Reflectance::SpecularGlossiness {
            specular: ColorInput::new(Vec3::ONE),
            glossiness: ScalarInput::new(1.0),
        };
        let mut material = Material { reflectance: glossy, ..Material::default() };
        let before = format!("{material:?}");
        for property in [MaterialProperty::Base, MaterialProperty::Roughness, MaterialProperty::SpecularColor]
        {
            material.set_property(property, &[0.5; 4]);
        }
        assert_eq!(format!("{material:?}"), before);
        material.set_property(MaterialProperty::SpecularF0, &[0.25; 3]);
        material.set_property(MaterialProperty::Glossiness, &[0.5]);
        let Reflectance::SpecularGlossiness { specular, glossiness } = &material.reflectance else {
            panic!()
        };
        assert_eq!((specular.factor, glossiness.factor), (Vec3::splat(0.25), 0.5));
    }
}
