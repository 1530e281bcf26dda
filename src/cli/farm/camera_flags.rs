//! A resolved camera as flags, so that no task needs the bounds over the clip.

use glam::DVec2;

use blinn_scene::{Camera, ClipPlanes, Projection, ThinLens};

/// Flags that the resolved camera replaces, besides [`CAMERA_FLAGS`](crate::args::CAMERA_FLAGS).
pub const FRAMING_FLAGS: [&str; 3] = ["elevation", "clip", "fit"];

/// The flags that give exactly this camera. `None` if there are none: for an empty view, for an off-centre view
/// rectangle, for a file's camera that mirrors or shears, and for an aperture that is turned or stretched.
pub fn camera_flags(camera: &Camera) -> Option<Vec<String>> {
    let Camera {
        view_point,
        basis,
        view_width,
        view_height,
        view_centre,
        proj_distance,
        projection,
        clip,
        lens,
    } = *camera;
    if !basis.is_orthonormal() || view_centre != DVec2::ZERO {
        return None;
    }
    let vector = |v: glam::DVec3| v.is_finite().then(|| format!("{},{},{}", v.x, v.y, v.z));
    let length = |d: f64| (d > 0.0 && d.is_finite()).then(|| d.to_string());
    let mut flags = vec![
        format!("--view-point={}", vector(view_point)?),
        format!("--view-dir={}", vector(-basis.w)?),
        format!("--view-up={}", vector(basis.v)?),
        format!("--proj-distance={}", length(proj_distance)?),
        format!("--view-width={}", length(view_width)?),
        format!("--view-height={}", length(view_height)?),
        match projection {
            Projection::Perspective => "--projection=perspective".into(),
            Projection::Orthographic => "--projection=orthographic".into(),
        },
        if clip == ClipPlanes::OFF {
            "--clip=off".into()
        } else {
            format!("--clip={},{}", clip.near, clip.far)
        },
    ];
    if let Some(lens) = lens {
        let ThinLens { aperture_radius, focus_distance, blades, rotation, ratio } = lens;
        // No flag turns or stretches an aperture.
        if rotation != 0.0 || ratio != 1.0 {
            return None;
        }
        flags.push(format!("--aperture-radius={aperture_radius}"));
        flags.push(format!("--focus={focus_distance}"));
        flags.push(format!("--aperture-blades={}", if blades < 3 { 0 } else { blades }));
    }
    Some(flags)
}
