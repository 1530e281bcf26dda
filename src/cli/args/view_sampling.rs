//! Options for the views of a dataset.

use clap::Args;

use super::choices::UnitShapeArg;
use super::values;
use blinn_scene::{DistanceRange, ViewLayout};

/// The views of a dataset. All random choices follow from `--seed`, the number of the view and, with `--random-per-scene`, the name
/// of the scene.
#[derive(Debug, Args)]
#[command(next_help_heading = "Turntable")]
pub struct ViewSamplingArgs {
    /// Distribution of the views: sphere, hemisphere, ring, icosphere (12, 42, 162, 642, … views), random, or stereo
    /// (pairs of parallel cameras, BASELINE metres apart) [default: sphere]
    ///
    /// The default BASELINE is a thirtieth of the distance. A ring has an elevation of 22 degrees.
    #[arg(long, value_name = "LAYOUT[=BASELINE]", value_parser = values::view_layout)]
    pub on: Option<ViewLayout>,
    /// Elevations of the views above the horizon, from LO to HI [default: all]
    #[arg(long, value_name = "LO,HI", value_parser = values::elevation_range)]
    pub elevation_range: Option<(f64, f64)>,
    /// Distances of the cameras, at random from LO to HI: metres, or with x multiples of the distance that frames the
    /// scene, such as 1x,1.5x [default: 1x]
    #[arg(long, value_name = "LO,HI", value_parser = values::distance_range)]
    pub distance_range: Option<DistanceRange>,
    /// Roll the cameras about their view directions at random, by up to DEGREES either way
    #[arg(long, value_name = "DEGREES", value_parser = values::roll)]
    pub roll: Option<f64>,
    /// Look at random points in a ball around the centre, whose radius is F times that of the scene's bounding sphere
    #[arg(long, value_name = "F", value_parser = values::positive)]
    pub look_at_jitter: Option<f64>,
    /// Turn the light sources about the vertical, in each view by another random angle
    #[arg(long)]
    pub random_lights: bool,
    /// Turn the environment about the vertical, in each view by another random angle
    #[arg(long)]
    pub random_hdri: bool,
    /// Choose other random cameras and lights for each scene, from --seed and the name of the scene
    ///
    /// The name is the path below the folder that is given, or below the innermost one of all scenes. --chunk, --resume and the
    /// order of the scenes change nothing.
    #[arg(long)]
    pub random_per_scene: bool,
    /// Scale and move the scene into a cube with sides of 1, or a sphere of radius 1, in all that is written
    ///
    /// Positions, depths and transforms.json are in these units, and so are --distance-range and BASELINE. The pictures
    /// stay the same. transforms.json holds the matrix back to the scene's own coordinates.
    #[arg(long, value_enum)]
    pub normalize: Option<UnitShapeArg>,
}
