//! Options for lists of cameras.

use std::path::PathBuf;

use clap::Args;

use super::choices::UpArg;
use blinn_session::FrameList;

#[derive(Debug, Args)]
#[command(next_help_heading = "Camera")]
pub struct CameraListArgs {
    /// Render an image for each camera of a list: transforms.json (NeRF, nerfstudio, blinn turntable --views), the folder
    /// of a COLMAP model, BOP's scene_camera.json, or JSON lines
    ///
    /// JSON lines have K, camera_to_world or world_to_camera, width, height, convention (opencv or opengl), time and
    /// file. A time poses the scene. --size changes the number of pixels, not the view. {camera} in -o stands for a
    /// camera's name.
    #[arg(long, value_name = "FILE|FOLDER",
          conflicts_with_all = ["camera", "max-size", "view-point", "view-dir", "look-at", "view-up", "proj-distance",
                                "view-width", "view-height", "yfov", "view-rect", "intrinsics", "shift",
                                "aperture-radius", "focus", "aperture-blades",
                                "projection", "camera-orthographic", "orbit", "zoom", "camera-azimuth-angle",
                                "camera-elevation-angle", "camera-xml", "fit", "frame", "frames"])]
    pub cameras: Option<PathBuf>,
    /// Up axis of the world of --cameras; z is for lists from Blender: (x, y, z) becomes (x, z, −y) [default: y]
    #[arg(long, value_enum, requires = "cameras")]
    pub world_up: Option<UpArg>,
    /// Render only these cameras of --cameras, which keep their numbers from 1: 1-36:2, 1-3,7,9-11
    #[arg(long, value_name = "LIST", requires = "cameras", value_parser = FrameList::parse)]
    pub only: Option<FrameList>,
}
