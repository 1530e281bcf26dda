//! Scales the lengths of a scene that its nodes do not scale.

use blinn_scene::{
    CameraProperty, ChannelTarget, FileProjection, LightKind, LightProperty, MaterialProperty, Scene,
};

/// Multiplies clip planes, extents of orthographic cameras, ranges and radii of lights, volumes, and their keyframes.
/// Meshes, places and area lights are scaled by the root node. Intensities stay, in candela and lux.
pub fn scale_lengths(scene: &mut Scene, factor: f64) {
    if factor == 1.0 {
        return;
    }
    let scale = |length: &mut f32| *length = (f64::from(*length) * factor) as f32;
    for camera in &mut scene.cameras {
        camera.znear *= factor;
        camera.zfar *= factor;
        if let FileProjection::Orthographic { xmag, ymag } = &mut camera.projection {
            *xmag *= factor;
            *ymag *= factor;
        }
    }
    for light in &mut scene.lights {
        scale(&mut light.range);
        // The radius of a sun is an angle.
        if light.kind != LightKind::Directional {
            scale(&mut light.radius);
        }
    }
    for volume in scene.materials.iter_mut().filter_map(|material| material.volume.as_mut()) {
        scale(&mut volume.thickness);
        scale(&mut volume.attenuation_distance);
    }
    let channels = scene.animations.iter_mut().flat_map(|animation| &mut animation.channels);
    for channel in channels.filter(|channel| is_length(channel.target)) {
        channel.keyframes.values.iter_mut().for_each(scale);
    }
}

/// Returns true for animated lengths that belong to no node.
fn is_length(target: ChannelTarget) -> bool {
    use CameraProperty::{Xmag, Ymag, Zfar, Znear};
    matches!(
        target,
        ChannelTarget::Light(_, LightProperty::Range)
            | ChannelTarget::Material(_, MaterialProperty::AttenuationDistance)
            | ChannelTarget::Camera(_, Xmag | Ymag | Znear | Zfar)
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn animated_lengths_are_scaled() {
        assert!(is_length(ChannelTarget::Camera(0, CameraProperty::Znear)));
        assert!(is_length(ChannelTarget::Light(0, LightProperty::Range)));
        assert!(!is_length(ChannelTarget::Translation(0)), "the root node scales it");
        assert!(!is_length(ChannelTarget::Light(0, LightProperty::Intensity)));
    }
}
