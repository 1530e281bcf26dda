//! Options that decide the pixels: image, camera, lights and shading.

use std::path::PathBuf;

use clap::Args;
use glam::{DVec2, DVec3};

use super::choices::*;
use super::values;
use super::values::{BackgroundArg, HdriArg};
use blinn_core::geometry::Rgb;
use blinn_render::PixelRect;
use blinn_render::integrator::DEFAULT_BOUNCES;
use blinn_scene::{ClipPlanes, Glob, Intrinsics, LightSet, Orbit, UserLight, ViewRect};
use blinn_session::{AovSelection, Exposure, OcclusionSampling};

#[derive(Debug, Args)]
pub struct RenderOptionArgs {
    #[command(flatten)]
    pub image: ImageArgs,
    #[command(flatten)]
    pub camera: CameraArgs,
    #[command(flatten)]
    pub light: LightArgs,
    #[command(flatten)]
    pub shading: ShadingArgs,
}

#[derive(Debug, Args)]
#[command(next_help_heading = "Image")]
pub struct ImageArgs {
    /// Width and height in pixels [default: 1280x720, or the aspect ratio of the file's camera]
    #[arg(long, alias = "resolution", value_name = "WxH", value_parser = values::size)]
    pub size: Option<(u32, u32)>,
    /// Longer side in pixels, for thumbnails: the image has the aspect ratio of the file's camera, or is square
    #[arg(long, value_name = "N", conflicts_with = "size", value_parser = clap::value_parser!(u32).range(1..=16384))]
    pub max_size: Option<u32>,
    /// Samples per pixel; a single sample is at the pixel's centre
    #[arg(short, long, default_value_t = 4, value_parser = clap::value_parser!(u32).range(1..=65536))]
    pub samples: u32,
    /// Adaptive sampling: use all --samples only where neighbouring pixels differ by more than THRESHOLD (0–1), 4
    /// elsewhere
    ///
    /// With 16 or more samples, 0.08 takes about half the time for the same error.
    #[arg(long, value_name = "THRESHOLD", value_parser = values::fraction)]
    pub adaptive: Option<f32>,
    /// Reconstruction filter
    #[arg(long, value_enum, default_value_t = FilterArg::BlackmanHarris)]
    pub filter: FilterArg,
    /// Background: a colour as displayed, none (transparent), or the environment of --hdri or the file (hdri)
    /// [default: .05,.05,.05]
    #[arg(long, value_name = "COLOR|transparent|hdri", value_parser = values::image_background)]
    pub background: Option<BackgroundArg>,
    /// Blur --background hdri: from 0 (sharp) to 1, like the reflection of a surface of that roughness [default: 0]
    #[arg(long, value_name = "BLUR", value_parser = values::fraction)]
    pub background_blur: Option<f32>,
    /// Same as --background transparent
    #[arg(long, hide = true, conflicts_with = "background")]
    pub no_background: bool,
    /// Exposure in stops (EV), or auto to meter the scene
    ///
    /// [default: 0 for light rigs, for lights from flags and for Blender's files near mid-grey; else auto]
    #[arg(long, value_name = "auto|EV", value_parser = values::exposure)]
    pub exposure: Option<Exposure>,
    /// View transform from linear light to display colours; auto is agx for Blender's glTF files, else standard
    #[arg(long, value_enum, default_value_t = ViewArg::Auto)]
    pub view: ViewArg,
    /// AOVs: depth, normal, vertex-normal, geometric-normal, position, albedo, uv, mask, object-id,
    /// material-id, steps, distance, camera-normal, camera-position, nocs, flow-forward, flow-backward, barycentric,
    /// triangle-id, cryptomatte
    ///
    /// They are channels of an .exr, and previews named OUT.<aov>.png beside other images.
    #[arg(long, value_name = "LIST", value_parser = values::aovs, help_heading = "Output")]
    pub aov: Option<AovSelection>,
    /// Unit of the 16-bit depth beside images, for --aov depth: mm, m or metres per step
    ///
    /// OUT.depth.png then holds depths in place of a preview; 0 means no hit. [default for --views: fits the scene]
    #[arg(long, value_name = "mm|m|SCALE", value_parser = values::depth_unit, help_heading = "Output")]
    pub depth_unit: Option<f64>,
    /// Render only a region: left, top, width and height in pixels
    #[arg(long, value_name = "X,Y,W,H", value_parser = values::crop)]
    pub crop: Option<PixelRect>,
    /// Seed of the sample positions
    #[arg(long, default_value_t = 0)]
    pub seed: u32,
}

#[derive(Debug, Args)]
#[command(next_help_heading = "Camera")]
pub struct CameraArgs {
    /// Camera of the file, by name or index
    #[arg(long, alias = "camera-index", value_name = "NAME|INDEX")]
    pub camera: Option<String>,
    /// Eye position e
    #[arg(long, alias = "camera-position", value_name = "X,Y,Z", value_parser = values::vector)]
    pub view_point: Option<DVec3>,
    /// View direction −w
    #[arg(long, alias = "camera-direction", value_name = "X,Y,Z", value_parser = values::direction,
          conflicts_with = "look_at")]
    pub view_dir: Option<DVec3>,
    /// Point to look at, instead of a view direction
    #[arg(long, alias = "camera-focal-point", value_name = "X,Y,Z", value_parser = values::vector)]
    pub look_at: Option<DVec3>,
    /// Up direction
    #[arg(long, alias = "camera-view-up", value_name = "X,Y,Z", value_parser = values::direction)]
    pub view_up: Option<DVec3>,
    /// Distance d of the view rectangle from the eye
    #[arg(long, value_name = "D", value_parser = values::positive)]
    pub proj_distance: Option<f64>,
    /// Width of the view rectangle
    #[arg(long, value_name = "W", value_parser = values::positive)]
    pub view_width: Option<f64>,
    /// Height of the view rectangle
    #[arg(long, value_name = "H", value_parser = values::positive)]
    pub view_height: Option<f64>,
    /// Vertical field of view, instead of a height
    #[arg(long, alias = "camera-view-angle", value_name = "DEGREES", value_parser = values::field_of_view,
          conflicts_with = "view_height")]
    pub yfov: Option<f64>,
    /// View rectangle at distance d, instead of a width and height; off-centre unless L = −R and B = −T
    #[arg(long, value_name = "L,R,B,T", value_parser = values::view_rect,
          conflicts_with_all = ["view_width", "view_height", "yfov"])]
    pub view_rect: Option<ViewRect>,
    /// View rectangle in pixels of --size, instead of a width and height: focal lengths and principal point
    ///
    /// The principal point is measured from the top left corner of the image. Pixel centres are at half-integers: the
    /// first is (0.5, 0.5). Add 0.5 to CX and CY from OpenCV's calibration.
    #[arg(long, value_name = "FX,FY,CX,CY", value_parser = values::intrinsics, requires = "size",
          conflicts_with_all = ["view_rect", "view_width", "view_height", "yfov", "proj_distance"])]
    pub intrinsics: Option<Intrinsics>,
    /// Move the view rectangle to the right and up, in units of its larger side: Blender's lens shift
    #[arg(long, value_name = "X,Y", value_parser = values::shift, conflicts_with_all = ["view_rect", "intrinsics"])]
    pub shift: Option<DVec2>,
    /// Projection [default: perspective, or that of the file's camera]
    #[arg(long, value_enum)]
    pub projection: Option<ProjectionArg>,
    /// Same as --projection orthographic
    #[arg(long, hide = true, conflicts_with = "projection")]
    pub camera_orthographic: bool,
    /// Place the camera on a sphere around the scene's centre or --look-at
    ///
    /// AZIMUTH is in degrees from the front (+Z) to the right, ELEVATION in degrees above the horizon, DISTANCE in
    /// metres [default DISTANCE: frames the scene].
    #[arg(long, value_name = "AZIMUTH,ELEVATION[,DISTANCE]", value_parser = values::orbit,
          conflicts_with_all = ["view_point", "view_dir", "camera_xml"])]
    pub orbit: Option<Orbit>,
    /// Magnify the image by F: divides the size of the view rectangle
    #[arg(long, alias = "camera-zoom-factor", value_name = "F", value_parser = values::positive)]
    pub zoom: Option<f64>,
    /// Rotate the camera to the right around the point it looks at, in degrees
    #[arg(long, hide = true, default_value_t = 0.0, value_parser = values::angle)]
    pub camera_azimuth_angle: f64,
    /// Rotate the camera upwards around the point it looks at, in degrees
    #[arg(long, hide = true, default_value_t = 0.0, value_parser = values::angle)]
    pub camera_elevation_angle: f64,
    /// Read the camera from the lecture's <camera> XML block
    #[arg(long, value_name = "FILE", conflicts_with = "camera")]
    pub camera_xml: Option<PathBuf>,
    /// Near and far plane [default: those of the file's camera; off with --orbit]
    #[arg(long, value_name = "NEAR,FAR|off", value_parser = values::clip)]
    pub clip: Option<ClipPlanes>,
    /// Field of view that the file's camera keeps if the image has another aspect ratio
    #[arg(long, value_enum, default_value_t = FitArg::Vertical)]
    pub fit: FitArg,
}

#[derive(Clone, Debug, Args)]
#[command(next_help_heading = "Lights")]
pub struct LightArgs {
    /// Light sources: file, headlight, three-point (a list), or none [default: file, else three-point]
    #[arg(long, value_name = "LIST", value_parser = values::lights)]
    pub lights: Option<std::vec::Vec<LightSet>>,
    /// Add a point light at X,Y,Z with intensity I (repeatable)
    #[arg(long, value_name = "X,Y,Z,I[,COLOR]", value_parser = values::point_light)]
    pub point_light: Vec<UserLight>,
    /// Add a directional light that travels along DX,DY,DZ with irradiance E (repeatable)
    #[arg(long, value_name = "DX,DY,DZ,E[,COLOR]", value_parser = values::sun)]
    pub sun: Vec<UserLight>,
    /// Unit of the file's light intensities
    #[arg(long, value_enum, default_value_t = UnitsArg::Auto)]
    pub light_units: UnitsArg,
    /// Multiply the intensity of the file's lights by F [default: 1]
    #[arg(long, value_name = "F", value_parser = values::positive)]
    pub light_scale: Option<f64>,
    /// Ambient light I_a
    #[arg(long, value_name = "COLOR", value_parser = values::color)]
    pub ambient: Option<Rgb>,
    /// Soft shadows: radius of the lights in metres, 0 for hard shadows [default: 0]
    ///
    /// Point and spot lights are discs that face the shaded point; suns are discs at a distance of 1 m, with
    /// R = 0.0047 for the real sun.
    #[arg(long, value_name = "R", value_parser = values::radius)]
    pub light_radius: Option<f64>,
    /// Ambient occlusion with SAMPLES rays per pixel, up to DISTANCE metres or inf [default DISTANCE: a quarter of
    /// the scene's diagonal]
    ///
    /// Without --ambient, I_a is at least a fifth of the light of all lights.
    #[arg(long, value_name = "SAMPLES[,DISTANCE]", value_parser = values::ao)]
    pub ao: Option<OcclusionSampling>,
    /// Add a ground below the scene: a grey plane, or a shadow catcher (shadow)
    ///
    /// The ground is at the scene's lowest point. A shadow catcher shows only shadows, also on a transparent
    /// background.
    #[arg(long, value_enum)]
    pub ground: Option<GroundArg>,
    /// Light the scene with an environment map: .hdr or .exr, twice as wide as high; or with soft boxes (studio) or a
    /// clear sky (sky)
    ///
    /// It replaces the ambient light, and is the only light unless the file or flags have lights. --background hdri
    /// shows it. A file of the name studio or sky is ./studio or ./sky.
    #[arg(long, value_name = "FILE|studio|sky", value_parser = values::hdri(), conflicts_with = "ambient")]
    pub hdri: Option<HdriArg>,
    /// Turn the environment about the vertical: counterclockwise seen from above [default: 0]
    #[arg(long, value_name = "DEGREES", value_parser = values::angle)]
    pub hdri_rotate: Option<f64>,
    /// Multiply the light of the environment by X [default: 1]
    #[arg(long, value_name = "X", value_parser = values::strength)]
    pub hdri_strength: Option<f64>,
    /// Disable shadows
    #[arg(long)]
    pub no_shadows: bool,
}

#[derive(Clone, Debug, Args)]
#[command(next_help_heading = "Shading")]
pub struct ShadingArgs {
    /// Terms of the lecture's shading: color (unlit), diffuse (Lambert), shadow (Lambert with shadows), phong (all)
    #[arg(long, value_enum, default_value_t = IntegratorArg::Phong)]
    pub integrator: IntegratorArg,
    /// Diffuse coefficient k_d of all materials
    #[arg(long, value_name = "COLOR", value_parser = values::color)]
    pub kd: Option<Rgb>,
    /// Specular coefficient k_s of all materials
    #[arg(long, value_name = "COLOR", value_parser = values::color)]
    pub ks: Option<Rgb>,
    /// Specular exponent p of all materials
    #[arg(long, value_name = "P", value_parser = values::positive)]
    pub shininess: Option<f64>,
    /// Render only the objects that match GLOB, and their children (repeatable)
    ///
    /// GLOB matches names, or paths from the root such as car/wheels/*.
    #[arg(long, value_name = "GLOB", value_parser = values::glob)]
    pub only_objects: Vec<Glob>,
    /// Hide the objects and lights that match GLOB (repeatable)
    #[arg(long, value_name = "GLOB", value_parser = values::glob)]
    pub hide: Vec<Glob>,
    /// Maximum reflections along a path, and three times as many surfaces of glass; 0 disables reflections and refraction
    #[arg(long, value_name = "N", default_value_t = DEFAULT_BOUNCES, value_parser = clap::value_parser!(u8).range(0..=64))]
    pub bounces: u8,
    /// Back faces that the camera sees through: those of single-sided materials (auto), of all materials (back), or
    /// none (off)
    ///
    /// OBJ materials are double-sided. back removes the backs of doubled faces, and shows rooms from outside.
    #[arg(long, value_enum, default_value_t = CullArg::Auto)]
    pub cull: CullArg,
}
