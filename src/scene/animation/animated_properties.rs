//! The numbers of materials, lights and cameras that an animation can drive.
//!
//! Source: KHR_animation_pointer and glTF's object model.

use glam::{Vec2, Vec3};

use crate::scene::{
    AlphaMode, FileCamera, FileProjection, Light, LightKind, Material, Reflectance, ScalarInput, TextureRef,
};

/// A number, or a few, of a material.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum MaterialProperty {
    /// Base colour and alpha (4 numbers).
    Base,
    /// The same of a material of specular and glossiness.
    Diffuse,
    /// Its specular colour (3 numbers).
    SpecularF0,
    /// Its glossiness factor.
    Glossiness,
    /// The metallic factor.
    Metallic,
    /// The roughness factor.
    Roughness,
    /// The alpha below which a MASK material is not there.
    AlphaCutoff,
    /// Emitted colour (3 numbers).
    Emission,
    /// Its strength.
    EmissionStrength,
    /// Scale of the normal map.
    NormalScale,
    /// Strength of the occlusion map.
    OcclusionStrength,
    /// Index of refraction.
    Ior,
    /// Weight of the specular reflection.
    Specular,
    /// Its colour (3 numbers).
    SpecularColor,
    /// Transmission.
    Transmission,
    /// Offset of a slot's texture coordinates (2 numbers).
    Offset(TextureSlot),
    /// Their rotation in radians.
    Rotation(TextureSlot),
    /// Their scale (2 numbers).
    Scale(TextureSlot),
}

/// A place of a material where a texture can be.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum TextureSlot {
    /// Base colour and alpha.
    Base,
    /// The same of a material of specular and glossiness.
    Diffuse,
    /// Its specular colour and glossiness.
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
    /// Its colour.
    SpecularColor,
    /// Transmission.
    Transmission,
}

/// A number, or a few, of a light.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum LightProperty {
    /// Linear colour (3 numbers).
    Color,
    /// Strength in the file's unit.
    Intensity,
    /// Distance at which it ends.
    Range,
    /// Half angle of a spot's full strength, in radians.
    InnerCone,
    /// Half angle of a spot's end, in radians.
    OuterCone,
    /// The share of a spot's half angle over which its strength falls; the inner cone's, in other words.
    Blend,
}

/// A number of a camera.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum CameraProperty {
    /// Full vertical angle in radians.
    Yfov,
    /// Width over height.
    Aspect,
    /// Half the width of an orthographic view.
    Xmag,
    /// Half its height.
    Ymag,
    /// Distance of the near plane.
    Znear,
    /// Distance of the far plane.
    Zfar,
}

impl MaterialProperty {
    /// How many numbers it is.
    pub fn width(self) -> usize {
        match self {
            MaterialProperty::Base | MaterialProperty::Diffuse => 4,
            MaterialProperty::Emission | MaterialProperty::SpecularColor | MaterialProperty::SpecularF0 => 3,
            MaterialProperty::Offset(_) | MaterialProperty::Scale(_) => 2,
            _ => 1,
        }
    }
}

impl LightProperty {
    /// How many numbers it is.
    pub fn width(self) -> usize {
        if self == LightProperty::Color { 3 } else { 1 }
    }
}

impl Material {
    /// Sets a field to as many numbers as it has. What this material does not have stays as it is.
    pub(crate) fn set_property(&mut self, field: MaterialProperty, v: &[f64]) {
        let at = |i: usize| v.get(i).copied().unwrap_or(0.0) as f32;
        let vec3 = || Vec3::new(at(0), at(1), at(2));
        match field {
            MaterialProperty::Base | MaterialProperty::Diffuse => {
                if self.is_glossy() == (field == MaterialProperty::Diffuse) {
                    (self.base_color.factor, self.alpha.factor) = (vec3(), at(3));
                }
            }
            MaterialProperty::AlphaCutoff => {
                if let AlphaMode::Mask(cutoff) = &mut self.alpha_mode {
                    *cutoff = at(0);
                }
            }
            MaterialProperty::Emission => self.emission.factor = vec3(),
            MaterialProperty::EmissionStrength => self.emission_strength = at(0),
            MaterialProperty::OcclusionStrength => self.occlusion.factor = at(0),
            MaterialProperty::Transmission => self.transmission.factor = at(0),
            MaterialProperty::NormalScale => {
                if let Some(map) = &mut self.normal {
                    map.scale = at(0);
                }
            }
            MaterialProperty::Offset(slot) => {
                self.slot(slot, |t| t.transform.set_offset(Vec2::new(at(0), at(1))))
            }
            MaterialProperty::Rotation(slot) => self.slot(slot, |t| t.transform.set_rotation(at(0))),
            MaterialProperty::Scale(slot) => {
                self.slot(slot, |t| t.transform.set_scale(Vec2::new(at(0), at(1))))
            }
            _ => self.reflectance.set_property(field, vec3()),
        }
    }

    /// A material that the metallic-roughness fields beside it in the file say nothing about.
    fn is_glossy(&self) -> bool {
        matches!(self.reflectance, Reflectance::SpecularGlossiness { .. })
    }

    /// Changes the textures of a slot.
    fn slot(&mut self, slot: TextureSlot, change: impl Fn(&mut TextureRef)) {
        let base = if self.is_glossy() { TextureSlot::Diffuse } else { TextureSlot::Base };
        let scalar = |input: &mut ScalarInput| input.texture.iter_mut().for_each(|(t, _)| change(t));
        match (slot, &mut self.reflectance) {
            (slot, _) if slot == base => self.base_color.texture.iter_mut().for_each(&change),
            (TextureSlot::Normal, _) => self.normal.iter_mut().for_each(|n| change(&mut n.texture)),
            (TextureSlot::Occlusion, _) => scalar(&mut self.occlusion),
            (TextureSlot::Emission, _) => self.emission.texture.iter_mut().for_each(&change),
            (TextureSlot::Transmission, _) => scalar(&mut self.transmission),
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
    /// Sets a field of three numbers, or to the first of them.
    fn set_property(&mut self, field: MaterialProperty, v: Vec3) {
        use MaterialProperty as F;
        match self {
            Reflectance::MetallicRoughness { metallic, roughness, dielectric } => match field {
                F::Metallic => metallic.factor = v.x,
                F::Roughness => roughness.factor = v.x,
                F::Ior => dielectric.ior = v.x,
                F::Specular => dielectric.specular.factor = v.x,
                F::SpecularColor => dielectric.specular_color.factor = v,
                _ => {}
            },
            Reflectance::SpecularGlossiness { specular, glossiness } => match field {
                F::SpecularF0 => specular.factor = v,
                F::Glossiness => glossiness.factor = v.x,
                _ => {}
            },
            Reflectance::Mtl(_) | Reflectance::Unlit => {}
        }
    }
}

impl Light {
    /// Sets a field to as many numbers as it has.
    pub(crate) fn set_property(&mut self, field: LightProperty, v: &[f64]) {
        let at = |i: usize| v.get(i).copied().unwrap_or(0.0) as f32;
        match (field, &mut self.kind) {
            (LightProperty::Color, _) => self.color = Vec3::new(at(0), at(1), at(2)),
            (LightProperty::Intensity, _) => self.intensity = at(0),
            (LightProperty::Range, _) => self.range = if at(0) > 0.0 { at(0) } else { f32::INFINITY },
            (LightProperty::InnerCone, LightKind::Spot { inner, .. }) => *inner = at(0),
            (LightProperty::OuterCone, LightKind::Spot { outer, .. }) => *outer = at(0),
            (LightProperty::Blend, LightKind::Spot { inner, outer }) => *inner = *outer * (1.0 - at(0)),
            _ => {}
        }
    }
}

impl FileCamera {
    /// Sets a field, where the number makes a view.
    pub(crate) fn set_property(&mut self, field: CameraProperty, v: f64) {
        let positive = v > 0.0 && v.is_finite();
        match (field, &mut self.projection) {
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
    use crate::scene::ColorInput;

    #[test]
    fn fields_of_the_other_workflow_change_nothing() {
        let glossy = Reflectance::SpecularGlossiness {
            specular: ColorInput::new(Vec3::ONE),
            glossiness: ScalarInput::new(1.0),
        };
        let mut material = Material { reflectance: glossy, ..Material::default() };
        let before = format!("{material:?}");
        for field in [MaterialProperty::Base, MaterialProperty::Roughness, MaterialProperty::SpecularColor] {
            material.set_property(field, &[0.5; 4]);
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
