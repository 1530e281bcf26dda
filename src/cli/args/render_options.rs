//! Words about how a picture looks: image, camera, lights, shading.

use std::path::PathBuf;

use clap::Args;
use glam::DVec3;

use crate::cli::args::choices::*;
use crate::cli::args::values;
use crate::cli::args::values::{Ao, Exposure, Layers};
use crate::display::Background;
use crate::geometry::Rgb;
use crate::render::PixelRect;
use crate::scene::{ClipPlanes, Glob, LightSet, Orbit, UserLight};

#[derive(Debug, Args)]
#[command(next_help_heading = "Image")]
pub struct ImageArgs {
    /// Width and height in pixels [default: 1280x720, or the shape of the file's camera]
    #[arg(long, alias = "resolution", value_name = "WxH", value_parser = values::size)]
    pub size: Option<(u32, u32)>,
    /// Samples for each pixel; 1 is the pixel's centre
    #[arg(short, long, default_value_t = 4, value_parser = clap::value_parser!(u32).range(1..=65536))]
    pub samples: u32,
    /// Four samples where neighbouring pixels differ by no more than so much of white, all --samples
    /// where they do: with 16 and more, .08 takes about half the time for the same error
    #[arg(long, value_name = "THRESHOLD", value_parser = values::share)]
    pub adaptive: Option<f32>,
    /// Reconstruction filter
    #[arg(long, value_enum, default_value_t = FilterArg::BlackmanHarris)]
    pub filter: FilterArg,
    /// What is behind everything, as the screen shows it [default: .05,.05,.05]
    #[arg(long, value_name = "COLOR|transparent", value_parser = values::background)]
    pub background: Option<Background>,
    /// Same as --background transparent
    #[arg(long, hide = true, conflicts_with = "background")]
    pub no_background: bool,
    /// Stops, or auto: by the scene's light [default: 0 with rigs and given lights, and for
    /// Blender's files near mid-grey; else auto]
    #[arg(long, value_name = "auto|EV", value_parser = values::exposure, allow_hyphen_values = true)]
    pub exposure: Option<Exposure>,
    /// From linear light to the screen; auto is agx for Blender's glTF files, else standard
    #[arg(long, value_enum, default_value_t = ViewArg::Auto)]
    pub view: ViewArg,
    /// Layers: depth, normal, vertex-normal, geometric-normal, position, albedo, uv, mask,
    /// object-id, material-id, steps, cryptomatte
    #[arg(long, value_name = "LIST", value_parser = values::layers, help_heading = "Output")]
    pub aov: Option<Layers>,
    /// Adds a picture of what each pixel's eye ray costs: steps through the trees; the layer of that
    /// name in an EXR
    #[arg(long, value_enum, value_name = "steps", help_heading = "Output")]
    pub heatmap: Option<HeatmapArg>,
    /// Renders a part: left, top, width, height in pixels
    #[arg(long, value_name = "X,Y,W,H", value_parser = values::crop)]
    pub crop: Option<PixelRect>,
    /// Varies the samples' places
    #[arg(long, default_value_t = 0)]
    pub seed: u32,
}

#[derive(Debug, Args)]
#[command(next_help_heading = "Camera")]
pub struct CameraArgs {
    /// Camera of the file, by name or index
    #[arg(long, alias = "camera-index", value_name = "NAME|INDEX")]
    pub camera: Option<String>,
    /// The eye e
    #[arg(long, alias = "camera-position", value_name = "X,Y,Z", value_parser = values::vector, allow_hyphen_values = true)]
    pub view_point: Option<DVec3>,
    /// The view direction −w
    #[arg(long, alias = "camera-direction", value_name = "X,Y,Z", value_parser = values::direction,
          allow_hyphen_values = true, conflicts_with = "look_at")]
    pub view_dir: Option<DVec3>,
    /// Instead of a direction: a point to look at
    #[arg(long, alias = "camera-focal-point", value_name = "X,Y,Z", value_parser = values::vector, allow_hyphen_values = true)]
    pub look_at: Option<DVec3>,
    /// Up in the picture
    #[arg(long, alias = "camera-view-up", value_name = "X,Y,Z", value_parser = values::direction, allow_hyphen_values = true)]
    pub view_up: Option<DVec3>,
    /// Distance d of the view rectangle
    #[arg(long, value_name = "D", value_parser = values::positive)]
    pub proj_distance: Option<f64>,
    /// Width of the view rectangle
    #[arg(long, value_name = "W", value_parser = values::positive)]
    pub view_width: Option<f64>,
    /// Height of the view rectangle
    #[arg(long, value_name = "H", value_parser = values::positive)]
    pub view_height: Option<f64>,
    /// Instead of a height: vertical field of view
    #[arg(long, alias = "camera-view-angle", value_name = "DEGREES", value_parser = values::field_of_view,
          conflicts_with = "view_height")]
    pub yfov: Option<f64>,
    /// How the rectangle is looked through [default: perspective, or the file camera's]
    #[arg(long, value_enum)]
    pub projection: Option<ProjectionArg>,
    /// Same as --projection orthographic
    #[arg(long, hide = true, conflicts_with = "projection")]
    pub camera_orthographic: bool,
    /// Instead of a view point and direction: a place around the scene's middle, or around
    /// --look-at. Degrees from the front (+Z) to the right, degrees above the horizon, and metres
    /// away [default: as far as it takes to see everything]
    #[arg(long, value_name = "AZIMUTH,ELEVATION[,DISTANCE]", value_parser = values::orbit,
          allow_hyphen_values = true, conflicts_with_all = ["view_point", "view_dir", "camera_xml"])]
    pub orbit: Option<Orbit>,
    /// Makes everything F times as large, by a smaller view rectangle
    #[arg(long, alias = "camera-zoom-factor", value_name = "F", value_parser = values::positive)]
    pub zoom: Option<f64>,
    /// Takes the camera around what it looks at, to the right
    #[arg(long, hide = true, default_value_t = 0.0, value_parser = values::angle, allow_hyphen_values = true)]
    pub camera_azimuth_angle: f64,
    /// And upwards
    #[arg(long, hide = true, default_value_t = 0.0, value_parser = values::angle, allow_hyphen_values = true)]
    pub camera_elevation_angle: f64,
    /// The lecture's <camera> block
    #[arg(long, value_name = "FILE", conflicts_with = "camera")]
    pub camera_xml: Option<PathBuf>,
    /// Near and far plane [default: the file camera's, off with --orbit]
    #[arg(long, value_name = "NEAR,FAR|off", value_parser = values::clip)]
    pub clip: Option<ClipPlanes>,
    /// What a file's camera keeps where the picture has another shape
    #[arg(long, value_enum, default_value_t = FitArg::Vertical)]
    pub fit: FitArg,
}

#[derive(Debug, Args)]
#[command(next_help_heading = "Lights")]
pub struct LightArgs {
    /// file, headlight, three-point: a list, or none [default: file, else three-point]
    #[arg(long, value_name = "LIST", value_parser = values::lights)]
    pub lights: Option<std::vec::Vec<LightSet>>,
    /// Adds a point light of the lecture's I
    #[arg(long, value_name = "X,Y,Z,I[,COLOR]", value_parser = values::point_light, allow_hyphen_values = true)]
    pub point_light: Vec<UserLight>,
    /// Adds a sun: the way its light travels, and E
    #[arg(long, value_name = "DX,DY,DZ,E[,COLOR]", value_parser = values::sun, allow_hyphen_values = true)]
    pub sun: Vec<UserLight>,
    /// What the file's numbers mean
    #[arg(long, value_enum, default_value_t = UnitsArg::Auto)]
    pub light_units: UnitsArg,
    /// Multiplies the file's lights [default: 1]
    #[arg(long, value_name = "F", value_parser = values::positive)]
    pub light_scale: Option<f64>,
    /// The lecture's I_a
    #[arg(long, value_name = "COLOR", value_parser = values::color)]
    pub ambient: Option<Rgb>,
    /// Makes shadows soft: point and spot lights are discs of radius R metres to what they shine
    /// on, suns such discs 1 m away (R .0047 is the real sun's); 0 is sharp [default: 0]
    #[arg(long, value_name = "R", value_parser = values::radius, allow_hyphen_values = true)]
    pub light_radius: Option<f64>,
    /// Ambient occlusion: the ambient term by how much of it arrives, found out by SAMPLES rays for
    /// each pixel up to DISTANCE metres, or inf [default distance: a quarter of the scene's
    /// diagonal]. Without --ambient, I_a is then at least a fifth of the light of all lights
    #[arg(long, value_name = "SAMPLES[,DISTANCE]", value_parser = values::ao)]
    pub ao: Option<Ao>,
    /// Puts a ground under the scene's lowest point: a grey plane, or one of which only the shadows
    /// are seen, on a transparent background too
    #[arg(long, value_enum)]
    pub ground: Option<GroundArg>,
    /// Takes the ambient light from a .hdr or .exr picture of all that is around, twice as wide as
    /// high; unless lights are given or the file's, it is the only light. The background stays
    #[arg(long, value_name = "FILE", conflicts_with = "ambient")]
    pub hdri: Option<PathBuf>,
    /// Lets every light reach everything
    #[arg(long)]
    pub no_shadows: bool,
}

#[derive(Debug, Args)]
#[command(next_help_heading = "Shading")]
pub struct ShadingArgs {
    /// How far through the lecture: colour, Lambert, Lambert with shadows, all
    #[arg(long, value_enum, default_value_t = IntegratorArg::Phong)]
    pub integrator: IntegratorArg,
    /// k_d for every material
    #[arg(long, value_name = "COLOR", value_parser = values::color)]
    pub kd: Option<Rgb>,
    /// k_s for every material
    #[arg(long, value_name = "COLOR", value_parser = values::color)]
    pub ks: Option<Rgb>,
    /// p for every material
    #[arg(long, value_name = "P", value_parser = values::positive)]
    pub shininess: Option<f64>,
    /// Shows these objects alone, with all that is below them: a pattern of names, or of paths
    /// from the root such as car/wheels/* (repeatable)
    #[arg(long, value_name = "GLOB", value_parser = values::glob)]
    pub only_objects: Vec<Glob>,
    /// Leaves out objects and lights that a pattern finds (repeatable)
    #[arg(long, value_name = "GLOB", value_parser = values::glob)]
    pub hide: Vec<Glob>,
    /// Whether single-sided materials are seen from behind
    #[arg(long, value_enum, default_value_t = CullArg::Auto)]
    pub cull: CullArg,
}
