//! The content of a sheet: a drawing, named views, or the cameras of a list.

use std::collections::HashSet;
use std::sync::Arc;

use anyhow::{Result, bail};
use glam::{DVec2, DVec3};

use super::cell::{SheetCell, image_camera};
use super::grid::Grid;
use crate::args::SheetArgs;
use crate::args::values::{SheetView, SheetViews};
use crate::plan::{check_only, open_cameras};
use crate::usage::UsageError;
use blinn_core::geometry::{Aabb, Basis};
use blinn_scene::{PosedScene, Scene, StandardView, View, orthographic_camera, projected_extent};
use blinn_session::{CameraList, ImageCamera, ReplacedCameraFields, camera_name, load_limits};

/// The part of a picture that the scene may fill along directions.
const FILLED: f64 = 0.92;
/// The aspect ratio of cameras of the file that have none.
const ASPECT: f64 = 4.0 / 3.0;

const NO_CAMERAS: &str = "--views: the file has no cameras; name directions, such as front,30/20";

/// The content of a sheet.
pub enum SheetContent {
    /// Four views with dimensions.
    Drawing,
    /// Named views.
    Views(Vec<SheetView>),
    /// Cameras of a list.
    Cameras {
        list: Arc<CameraList>,
        /// Those that are shown.
        indices: Vec<usize>,
    },
}

/// Named views on a sheet.
pub struct NamedViews {
    pub grid: Grid,
    pub cells: Vec<SheetCell>,
    /// The scale of directions in pixels per metre; `None` if there are none.
    pub pixels_per_metre: Option<f64>,
}

impl SheetContent {
    /// The content of a sheet, from arguments. Opens the list of --cameras.
    ///
    /// # Errors
    /// The list cannot be read, or the sheet has no room for all views.
    pub fn of_args(args: &SheetArgs) -> Result<SheetContent, UsageError> {
        let content = if let Some(path) = &args.cameras {
            // Cameras without a size of their own have the shape of the sheet.
            let replaced = ReplacedCameraFields { size: Some(args.size), ..Default::default() };
            let limits = load_limits(args.preview.process.max_memory);
            let list = open_cameras(path, args.world_up, replaced, &limits)?;
            check_only(args.only.as_ref(), list.len())?;
            let indices = match &args.only {
                Some(only) => only.frames().iter().map(|number| *number as usize - 1).collect(),
                None => (0..list.len()).collect(),
            };
            SheetContent::Cameras { list: Arc::new(list), indices }
        } else if let Some(SheetViews(views)) = &args.views {
            SheetContent::Views(views.clone())
        } else {
            SheetContent::Drawing
        };
        let count = match &content {
            SheetContent::Cameras { indices, .. } => Some(indices.len()),
            SheetContent::Views(views) if !views.contains(&SheetView::FileCameras) => Some(views.len()),
            _ => None,
        };
        match count.filter(|count| Grid::new(*count, args.size).is_none()) {
            Some(count) => Err(UsageError(no_room(count, args.size))),
            None => Ok(content),
        }
    }

    /// The views of a sheet of `size` pixels with their names; `None` for a drawing. The scene is posed at `time`, as it is for
    /// cameras without a time.
    ///
    /// # Errors
    /// The scene has no cameras to show, the sheet has no room for them, or the list of cameras changed.
    pub fn named_views(&self, posed: &PosedScene, size: (u32, u32), time: f64) -> Result<Option<NamedViews>> {
        if matches!(self, SheetContent::Drawing) {
            return Ok(None);
        }
        let named = self.views_of_scene(posed.scene)?;
        let Some(grid) = Grid::new(named.len(), size) else { bail!(no_room(named.len(), size)) };
        let scale = scale(&named, &posed.bounds(), grid.area);
        let mut names = DistinctNames::default();
        let mut cells = Vec::with_capacity(named.len());
        for (index, view) in named.iter().enumerate() {
            let place = Place { grid: &grid, index, pixels_per_metre: scale };
            let cell = self.place(view, place, posed, time)?;
            cells.push(SheetCell { name: names.add(cell.name), ..cell });
        }
        let has_directions = named.iter().any(|view| matches!(view, NamedView::Direction { .. }));
        Ok(Some(NamedViews { grid, cells, pixels_per_metre: has_directions.then_some(scale) }))
    }

    /// The first view of a scene, that of a drawing isometric, as the `index`-th picture of a grid, which the scene fills. The
    /// scene is posed at `time`.
    ///
    /// # Errors
    /// As [`SheetContent::named_views`].
    pub fn first_view(&self, posed: &PosedScene, grid: &Grid, index: usize, time: f64) -> Result<SheetCell> {
        let mut views = self.views_of_scene(posed.scene)?;
        views.truncate(1);
        let place = Place { grid, index, pixels_per_metre: scale(&views, &posed.bounds(), grid.area) };
        match views.first() {
            Some(view) => self.place(view, place, posed, time),
            None => bail!(NO_CAMERAS),
        }
    }

    /// The views of a scene in their order, at least one.
    fn views_of_scene(&self, scene: &Scene) -> Result<Vec<NamedView>> {
        let views = match self {
            SheetContent::Drawing => {
                let view = StandardView::Isometric;
                vec![NamedView::Direction { name: view.name().into(), basis: view.basis() }]
            }
            SheetContent::Views(views) => named_views_of_scene(views, scene),
            SheetContent::Cameras { indices, .. } => indices.iter().map(|i| NamedView::Listed(*i)).collect(),
        };
        if views.is_empty() {
            bail!(NO_CAMERAS);
        }
        Ok(views)
    }

    /// A view at its place on the sheet.
    fn place(&self, view: &NamedView, place: Place, posed: &PosedScene, time: f64) -> Result<SheetCell> {
        let Place { grid, index, pixels_per_metre } = place;
        let (camera, time) = match view {
            NamedView::Direction { basis, .. } => {
                let (width, height) = (f64::from(grid.area.0), f64::from(grid.area.1));
                let rect = DVec2::new(width, height) / pixels_per_metre;
                let camera = orthographic_camera(*basis, &posed.bounds(), rect);
                (image_camera(camera, grid.area), time)
            }
            NamedView::OfFile(camera) => {
                let aspect = posed.scene.cameras.get(*camera).and_then(|camera| camera.aspect());
                let (_, size) = grid.fit(index, aspect.unwrap_or(ASPECT));
                let name = Some(camera_name(posed.scene, *camera));
                let view = View { camera: name, ..View::default() };
                (image_camera(view.resolve(posed, size.0, size.1)?.0, size), time)
            }
            NamedView::Listed(number) => match self {
                SheetContent::Cameras { list, .. } => {
                    (list.camera(*number)?, list.time(*number).unwrap_or(time))
                }
                SheetContent::Drawing | SheetContent::Views(_) => bail!("there is no list of cameras"),
            },
        };
        let aspect = match view {
            NamedView::Listed(_) => camera.camera.view_width / camera.camera.view_height,
            _ => f64::from(camera.size.0) / f64::from(camera.size.1),
        };
        let (origin, size) = grid.fit(index, aspect);
        let name = view.name(posed.scene, self);
        Ok(SheetCell { name, origin, view: ImageCamera { size, crop: None, ..camera }, time })
    }
}

/// A place on a sheet.
#[derive(Clone, Copy)]
struct Place<'a> {
    grid: &'a Grid,
    /// The number of the picture, from 0.
    index: usize,
    /// The scale of directions.
    pixels_per_metre: f64,
}

/// A view before it has a place.
enum NamedView {
    Direction {
        name: String,
        basis: Basis,
    },
    /// A camera of the file.
    OfFile(usize),
    /// A camera of the list.
    Listed(usize),
}

impl NamedView {
    /// The name of the view; cameras without one have their number, from 1.
    fn name(&self, scene: &Scene, content: &SheetContent) -> String {
        let named = match self {
            NamedView::Direction { name, .. } => Some(name.clone()),
            NamedView::OfFile(camera) => scene.cameras.get(*camera).and_then(|camera| {
                let node = scene.nodes.get(camera.node as usize).map_or("", |node| node.name.as_str());
                [node, camera.name.as_str()].into_iter().find(|name| !name.is_empty()).map(str::to_string)
            }),
            NamedView::Listed(camera) => match content {
                SheetContent::Cameras { list, .. } => {
                    list.listed(*camera).ok().and_then(|camera| camera.name)
                }
                _ => None,
            },
        };
        let number = match self {
            NamedView::Direction { .. } => 0,
            NamedView::OfFile(camera) | NamedView::Listed(camera) => camera + 1,
        };
        named.unwrap_or_else(|| format!("camera {number}"))
    }
}

/// The views in their order, with the cameras of a file in the place of their word.
fn named_views_of_scene(views: &[SheetView], scene: &Scene) -> Vec<NamedView> {
    let of_view = |view: &SheetView| -> Vec<NamedView> {
        match *view {
            SheetView::FileCameras => (0..scene.cameras.len()).map(NamedView::OfFile).collect(),
            SheetView::Direction { name, azimuth, elevation } => {
                let name = name.map_or_else(|| direction_name(azimuth, elevation), str::to_string);
                vec![NamedView::Direction { name, basis: basis(azimuth, elevation) }]
            }
        }
    };
    views.iter().flat_map(of_view).collect()
}

/// The camera basis for a position at angles in degrees, upright also straight above and below.
fn basis(azimuth: f64, elevation: f64) -> Basis {
    let (sin, cos) = libm::sincos(azimuth.to_radians());
    let (up, out) = libm::sincos(elevation.to_radians());
    let u = DVec3::new(cos, 0.0, -sin);
    let w = DVec3::new(out * sin, up, out * cos);
    Basis { u, v: w.cross(u), w }
}

/// The name of a direction without one: `30°`, `30°, 20° up`.
fn direction_name(azimuth: f64, elevation: f64) -> String {
    let degrees = |angle: f64| {
        let text = format!("{:.2}", (angle * 100.0).round() / 100.0 + 0.0);
        format!("{}°", text.trim_end_matches('0').trim_end_matches('.'))
    };
    match elevation {
        0.0 => degrees(azimuth),
        up if up > 0.0 => format!("{}, {} up", degrees(azimuth), degrees(up)),
        down => format!("{}, {} down", degrees(azimuth), degrees(-down)),
    }
}

/// The scale at which all directions fit into a picture, in pixels per metre.
fn scale(views: &[NamedView], bounds: &Aabb, area: (u32, u32)) -> f64 {
    let room = FILLED * DVec2::new(f64::from(area.0), f64::from(area.1));
    let scales = views.iter().filter_map(|view| match view {
        NamedView::Direction { basis, .. } => Some((room / projected_extent(basis, bounds)).min_element()),
        NamedView::OfFile(_) | NamedView::Listed(_) => None,
    });
    let scale = scales.fold(f64::INFINITY, f64::min);
    // A scene without extent.
    if scale.is_finite() { scale } else { room.min_element() }
}

/// Names that differ: equal ones are counted.
#[derive(Default)]
struct DistinctNames(HashSet<String>);

impl DistinctNames {
    fn add(&mut self, name: String) -> String {
        let mut distinct = name.clone();
        let mut count = 1;
        while !self.0.insert(distinct.clone()) {
            count += 1;
            distinct = format!("{name} ({count})");
        }
        distinct
    }
}

fn no_room(count: usize, (width, height): (u32, u32)) -> String {
    let fewer = "choose fewer with --views, or with --only from --cameras";
    format!(
        "--size: a sheet of {width}x{height} pixels has no room for {count} views; make it larger, or {fewer}"
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn directions_are_those_of_a_drawing() {
        for (angles, view) in [
            ((0.0, 0.0), StandardView::Front),
            ((90.0, 0.0), StandardView::Right),
            ((0.0, 90.0), StandardView::Top),
            ((45.0, 35.264_389_682_754_654), StandardView::Isometric),
        ] {
            let (a, b) = (basis(angles.0, angles.1), view.basis());
            for (a, b) in [(a.u, b.u), (a.v, b.v), (a.w, b.w)] {
                assert!((a - b).length() < 1e-15, "{view:?}: {a} {b}");
            }
        }
        for angles in [(33.0, 20.0), (-400.0, -90.0), (1e9, 89.9)] {
            let Basis { u, v, w } = basis(angles.0, angles.1);
            assert!((u.cross(v) - w).length() < 1e-14 && v.y >= -1e-15, "{angles:?}");
        }
    }

    #[test]
    fn angles_are_named_without_needless_digits() {
        assert_eq!(direction_name(30.0, 0.0), "30°");
        assert_eq!(direction_name(22.5, 20.0), "22.5°, 20° up");
        assert_eq!(direction_name(-0.0, -7.125), "0°, 7.13° down");
        assert_eq!(direction_name(360.0 / 7.0, 0.0), "51.43°");
        assert_eq!(direction_name(100.0, 0.0), "100°");
    }

    #[test]
    fn equal_names_are_counted() {
        let mut names = DistinctNames::default();
        let all: Vec<String> = ["a", "b", "a", "a (2)", "a"].map(|name| names.add(name.into())).into();
        assert_eq!(all, ["a", "b", "a (2)", "a (2) (2)", "a (3)"]);
    }
}
