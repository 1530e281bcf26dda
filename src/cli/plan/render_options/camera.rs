//! Camera options, combined with those of a `--camera-xml` file.

use crate::args::{CameraArgs, FitArg, ProjectionArg};
use crate::usage::UsageError;
use blinn_import::load_camera_xml;
use blinn_scene::{OrbitAngles, Projection, SensorFit, View};

/// Resolves the view. Flags take precedence over the XML file.
pub(super) fn view(args: &CameraArgs) -> Result<View, UsageError> {
    let xml = match &args.camera_xml {
        Some(path) => load_camera_xml(path).map_err(|e| UsageError(format!("--camera-xml: {e}")))?,
        None => View::default(),
    };
    let projection = match args.projection {
        _ if args.camera_orthographic => Some(Projection::Orthographic),
        Some(ProjectionArg::Orthographic) => Some(Projection::Orthographic),
        Some(ProjectionArg::Perspective) => Some(Projection::Perspective),
        None => xml.projection,
    };
    if args.intrinsics.is_some() && projection == Some(Projection::Orthographic) {
        return Err(UsageError(
            "--intrinsics describes a perspective camera; remove the orthographic projection".into(),
        ));
    }
    // --yfov and the like replace the file's view rectangle, --look-at its direction.
    let keeps_rectangle = args.yfov.is_none() && args.view_rect.is_none() && args.intrinsics.is_none();
    let xml_view_dir = if args.look_at.is_none() { xml.view_dir } else { None };
    Ok(View {
        camera: args.camera.clone(),
        view_point: args.view_point.or(xml.view_point),
        view_dir: args.view_dir.or(xml_view_dir),
        look_at: args.look_at,
        view_up: args.view_up.or(xml.view_up),
        proj_distance: args.proj_distance.or(xml.proj_distance),
        view_width: args.view_width.or(xml.view_width.filter(|_| keeps_rectangle)),
        view_height: args.view_height.or(xml.view_height.filter(|_| keeps_rectangle)),
        yfov: args.yfov,
        view_rect: args.view_rect,
        intrinsics: args.intrinsics,
        shift: args.shift.unwrap_or_default(),
        projection,
        clip: args.clip,
        fit: match args.fit {
            FitArg::Auto => SensorFit::Auto,
            FitArg::Horizontal => SensorFit::Horizontal,
            FitArg::Vertical => SensorFit::Vertical,
        },
        orbit: args.orbit,
        orbit_by: OrbitAngles { azimuth: args.camera_azimuth_angle, elevation: args.camera_elevation_angle },
        zoom: args.zoom,
        complete: None,
    })
}
