//! Options of the camera.

use super::{Choices, Effect, Heading, OptionDef, choose, names, store};
use crate::values;
use blinn_scene::{Projection, SensorFit};

const BASE: OptionDef = OptionDef { heading: Heading::Camera, ..OptionDef::BASE };

const PROJECTIONS: Choices<Option<Projection>, 2> =
    [("perspective", Some(Projection::Perspective)), ("orthographic", Some(Projection::Orthographic))];
const FITS: Choices<SensorFit, 3> =
    [("auto", SensorFit::Auto), ("horizontal", SensorFit::Horizontal), ("vertical", SensorFit::Vertical)];

pub static CAMERA: &[OptionDef] = &[
    OptionDef {
        name: "camera",
        alias: Some("camera-index"),
        value_name: "NAME|INDEX",
        help: "Camera of the file, by name or index",
        effect: Effect::Value(|options, text| store(&mut options.view.camera, Ok(Some(text.into())))),
        ..BASE
    },
    OptionDef {
        name: "view-point",
        alias: Some("camera-position"),
        value_name: "X,Y,Z",
        help: "Eye position e",
        effect: Effect::Value(|options, text| {
            store(&mut options.view.view_point, values::vector(text).map(Some))
        }),
        ..BASE
    },
    OptionDef {
        name: "view-dir",
        alias: Some("camera-direction"),
        value_name: "X,Y,Z",
        help: "View direction −w",
        conflicts: &["look-at"],
        effect: Effect::Value(|options, text| {
            store(&mut options.view.view_dir, values::direction(text).map(Some))
        }),
        ..BASE
    },
    OptionDef {
        name: "look-at",
        alias: Some("camera-focal-point"),
        value_name: "X,Y,Z",
        help: "Point to look at, instead of a view direction",
        effect: Effect::Value(|options, text| {
            store(&mut options.view.look_at, values::vector(text).map(Some))
        }),
        ..BASE
    },
    OptionDef {
        name: "view-up",
        alias: Some("camera-view-up"),
        value_name: "X,Y,Z",
        help: "Up direction",
        effect: Effect::Value(|options, text| {
            store(&mut options.view.view_up, values::direction(text).map(Some))
        }),
        ..BASE
    },
    OptionDef {
        name: "proj-distance",
        value_name: "D",
        help: "Distance d of the view rectangle from the eye",
        effect: Effect::Value(|options, text| {
            store(&mut options.view.proj_distance, values::positive(text).map(Some))
        }),
        ..BASE
    },
    OptionDef {
        name: "view-width",
        value_name: "W",
        help: "Width of the view rectangle",
        effect: Effect::Value(|options, text| {
            store(&mut options.view.view_width, values::positive(text).map(Some))
        }),
        ..BASE
    },
    OptionDef {
        name: "view-height",
        value_name: "H",
        help: "Height of the view rectangle",
        effect: Effect::Value(|options, text| {
            store(&mut options.view.view_height, values::positive(text).map(Some))
        }),
        ..BASE
    },
    OptionDef {
        name: "yfov",
        alias: Some("camera-view-angle"),
        value_name: "DEGREES",
        help: "Vertical field of view, instead of a height",
        conflicts: &["view-height"],
        effect: Effect::Value(|options, text| {
            store(&mut options.view.yfov, values::field_of_view(text).map(Some))
        }),
        ..BASE
    },
    OptionDef {
        name: "view-rect",
        value_name: "L,R,B,T",
        help: "View rectangle at distance d, instead of a width and height; off-centre unless L = −R and B = −T",
        conflicts: &["view-width", "view-height", "yfov"],
        effect: Effect::Value(|options, text| {
            store(&mut options.view.view_rect, values::view_rect(text).map(Some))
        }),
        ..BASE
    },
    OptionDef {
        name: "intrinsics",
        value_name: "FX,FY,CX,CY",
        help: "View rectangle in pixels of `size`, instead of a width and height: focal lengths and principal point\n\n\
               The principal point is measured from the top left corner of the image. Pixel centres are at half-integers: \
               the first is (0.5, 0.5). Add 0.5 to CX and CY from OpenCV's calibration.",
        requires: Some("size"),
        conflicts: &["view-rect", "view-width", "view-height", "yfov", "proj-distance"],
        effect: Effect::Value(|options, text| {
            store(&mut options.view.intrinsics, values::intrinsics(text).map(Some))
        }),
        ..BASE
    },
    OptionDef {
        name: "shift",
        value_name: "X,Y",
        help: "Move the view rectangle to the right and up, in units of its larger side: Blender's lens shift",
        conflicts: &["view-rect", "intrinsics"],
        effect: Effect::Value(|options, text| store(&mut options.view.shift, values::shift(text).map(Some))),
        ..BASE
    },
    OptionDef {
        name: "aperture-radius",
        value_name: "R",
        help: "Radius of the lens's aperture in metres, for a depth of field; 0: all is sharp \
               [default: that of the file's camera, else 0]\n\n\
               Of a photographic lens it is the focal length divided by twice the f-number: 0.009 for 50 mm at f/2.8. \
               Layers are sharp, except Cryptomatte.",
        effect: Effect::Value(|options, text| {
            store(&mut options.view.aperture_radius, values::aperture_radius(text).map(Some))
        }),
        ..BASE
    },
    OptionDef {
        name: "focus",
        value_name: "D|X,Y,Z",
        help: "What is sharp in a depth of field: a distance along the view direction in metres, or a point [default: as for \
               the file's camera, else the point of `look-at` or the centre of the scene]",
        effect: Effect::Value(|options, text| store(&mut options.view.focus, values::focus(text).map(Some))),
        ..BASE
    },
    OptionDef {
        name: "aperture-blades",
        value_name: "N",
        help: "Number of corners of the aperture, 3 or more, which out-of-focus highlights show; 0: a disc",
        effect: Effect::Value(|options, text| {
            store(&mut options.view.aperture_blades, values::aperture_blades(text).map(Some))
        }),
        ..BASE
    },
    OptionDef {
        name: "projection",
        value_name: "PROJECTION",
        choices: &names(&PROJECTIONS),
        help: "Projection [default: perspective, or that of the file's camera]",
        effect: Effect::Value(|options, text| choose(&mut options.view.projection, text, &PROJECTIONS)),
        ..BASE
    },
    OptionDef {
        name: "camera-orthographic",
        help: "Same as `projection orthographic`",
        is_hidden: true,
        conflicts: &["projection"],
        effect: Effect::Flag(|options| options.view.projection = Some(Projection::Orthographic)),
        ..BASE
    },
    OptionDef {
        name: "orbit",
        value_name: "AZIMUTH,ELEVATION[,DISTANCE]",
        help: "Place the camera on a sphere around the scene's centre or `look-at`\n\n\
               AZIMUTH is in degrees from the front (+Z) to the right, ELEVATION in degrees above the horizon, DISTANCE \
               in metres [default DISTANCE: frames the scene]. front, right, back, left, top, bottom and isometric stand for \
               angles.",
        conflicts: &["view-point", "view-dir", "camera-xml"],
        effect: Effect::Value(|options, text| store(&mut options.view.orbit, values::orbit(text).map(Some))),
        ..BASE
    },
    OptionDef {
        name: "zoom",
        alias: Some("camera-zoom-factor"),
        value_name: "F",
        help: "Magnify the image by F: divides the size of the view rectangle",
        effect: Effect::Value(|options, text| {
            store(&mut options.view.zoom, values::positive(text).map(Some))
        }),
        ..BASE
    },
    OptionDef {
        name: "camera-azimuth-angle",
        value_name: "CAMERA_AZIMUTH_ANGLE",
        default: Some("0"),
        help: "Rotate the camera to the right around the point it looks at, in degrees",
        is_hidden: true,
        effect: Effect::Value(|options, text| store(&mut options.view.orbit_by.azimuth, values::angle(text))),
        ..BASE
    },
    OptionDef {
        name: "camera-elevation-angle",
        value_name: "CAMERA_ELEVATION_ANGLE",
        default: Some("0"),
        help: "Rotate the camera upwards around the point it looks at, in degrees",
        is_hidden: true,
        effect: Effect::Value(|options, text| {
            store(&mut options.view.orbit_by.elevation, values::angle(text))
        }),
        ..BASE
    },
    OptionDef {
        name: "camera-xml",
        value_name: "FILE",
        help: "Read the camera from the lecture's <camera> XML block",
        conflicts: &["camera"],
        effect: Effect::Path(|options, path| options.camera_file = Some(path.to_path_buf())),
        ..BASE
    },
    OptionDef {
        name: "clip",
        value_name: "NEAR,FAR|off",
        help: "Near and far plane [default: those of the file's camera; off with `orbit`]",
        effect: Effect::Value(|options, text| store(&mut options.view.clip, values::clip(text).map(Some))),
        ..BASE
    },
    OptionDef {
        name: "fit",
        value_name: "FIT",
        choices: &names(&FITS),
        default: Some("vertical"),
        help: "Field of view that the file's camera keeps if the image has another aspect ratio",
        effect: Effect::Value(|options, text| choose(&mut options.view.fit, text, &FITS)),
        ..BASE
    },
];
