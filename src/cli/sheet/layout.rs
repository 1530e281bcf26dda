//! Layout of a sheet: four cells of one size and one scale, in third-angle projection. The top view stands above the
//! front view and the right view beside it, so that equal edges are aligned.

use glam::DVec2;

use super::cell::{SheetCell, image_camera};
use blinn_core::geometry::Aabb;
use blinn_scene::{Camera, StandardView};

/// The positions of the views: column and row.
pub const CELLS: [(StandardView, [u32; 2]); 4] = [
    (StandardView::Top, [0, 0]),
    (StandardView::Isometric, [1, 0]),
    (StandardView::Front, [0, 1]),
    (StandardView::Right, [1, 1]),
];

/// Least width and height of a sheet in pixels.
pub const MIN_SIDE: u32 = 128;

/// Margins of a cell, in heights of the labels.
const MARGIN: f64 = 4.0;

/// Four views of a box at one scale.
pub struct SheetLayout {
    pub bounds: Aabb,
    /// Width and height of a cell in pixels.
    pub cell_size: (u32, u32),
    pub pixels_per_metre: f64,
    /// Height of the labels in pixels.
    pub label_height: f64,
    pub cells: Vec<Cell>,
}

/// A view on a sheet.
pub struct Cell {
    pub view: StandardView,
    /// Position of the upper left corner on the sheet in pixels.
    pub origin: [u32; 2],
    pub camera: Camera,
}

impl SheetLayout {
    /// Lays out the views of `bounds` on a sheet of at least [`MIN_SIDE`] pixels a side.
    pub fn new(bounds: Aabb, (width, height): (u32, u32)) -> SheetLayout {
        let cell_size = (width / 2, height / 2);
        let pixels = DVec2::new(f64::from(cell_size.0), f64::from(cell_size.1));
        let label_height = (pixels.min_element() / 40.0).clamp(5.0, 40.0);
        let room = (pixels - 2.0 * MARGIN * label_height).max(DVec2::ONE);
        let scales = StandardView::ALL.map(|view| (room / view.projected_extent(&bounds)).min_element());
        let scale = scales.into_iter().fold(f64::INFINITY, f64::min);
        // A scene without extent.
        let pixels_per_metre = if scale.is_finite() { scale } else { room.min_element() };
        let cell = |(view, [column, row]): (StandardView, [u32; 2])| Cell {
            view,
            origin: [column * cell_size.0, row * cell_size.1],
            camera: view.camera(&bounds, pixels / pixels_per_metre),
        };
        SheetLayout { bounds, cell_size, pixels_per_metre, label_height, cells: CELLS.map(cell).into() }
    }

    /// The middle of a cell on the sheet, in pixels.
    pub fn centre(&self, cell: &Cell) -> DVec2 {
        let [left, top] = cell.origin.map(f64::from);
        DVec2::new(left + 0.5 * f64::from(self.cell_size.0), top + 0.5 * f64::from(self.cell_size.1))
    }

    /// The pictures of the sheet, of a scene at `time`.
    pub fn pictures(&self, time: f64) -> Vec<SheetCell> {
        let picture = |cell: &Cell| SheetCell {
            name: cell.view.name().into(),
            origin: cell.origin,
            view: image_camera(cell.camera, self.cell_size),
            time,
        };
        self.cells.iter().map(picture).collect()
    }

    /// The bounds of a view of the model on the sheet, in pixels: upper left and lower right corner.
    pub fn model_rect(&self, cell: &Cell) -> (DVec2, DVec2) {
        let half = 0.5 * cell.view.projected_extent(&self.bounds) * self.pixels_per_metre;
        let middle = self.centre(cell);
        (middle - half, middle + half)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    fn bounds(min: [f64; 3], max: [f64; 3]) -> Aabb {
        Aabb { min: min.into(), max: max.into() }
    }

    fn corners(b: &Aabb) -> impl Iterator<Item = DVec3> {
        (0..8).map(|i| DVec3::from([0, 1, 2].map(|axis| [b.min, b.max][i >> axis & 1][axis])))
    }

    /// Where the camera's rays meet a point is where the matrix maps it.
    #[test]
    fn matrices_agree_with_eye_rays_and_keep_corners_in_the_margins() {
        let boxes = [
            bounds([-1.0, 0.0, 2.0], [3.0, 0.5, 9.0]),
            bounds([1e6, 0.0, -1e6], [1e6 + 1.0, 30.0, -1e6 + 0.1]),
            bounds([0.0; 3], [1e-6, 0.0, 1e-6]),
            bounds([5.0; 3], [5.0; 3]),
        ];
        for (b, size) in boxes.iter().zip([(1280, 960), (801, 403), (128, 128), (200, 4000)]) {
            let layout = SheetLayout::new(*b, size);
            for (cell, picture) in layout.cells.iter().zip(layout.pictures(0.0)) {
                let matrix = <[[f64; 4]; 2]>::try_from(picture.model_to_pixel()).unwrap();
                let (low, high) = layout.model_rect(cell);
                for p in corners(b) {
                    let pixel = matrix.map(|row| p.extend(1.0).dot(row.into()));
                    let pixel = DVec2::from(pixel);
                    assert!(pixel.cmpge(low - 1e-3).all() && pixel.cmple(high + 1e-3).all(), "{pixel}");
                    let [left, top] = cell.origin.map(f64::from);
                    let (width, height) = (f64::from(layout.cell_size.0), f64::from(layout.cell_size.1));
                    let film = DVec2::new((pixel.x - left) / width, 1.0 - (pixel.y - top) / height);
                    assert!(film.min_element() > 0.0 && film.max_element() < 1.0, "{film}");
                    let ray = cell.camera.eye_ray(film.x, film.y, p);
                    let miss = ray.o.as_dvec3().reject_from_normalized(ray.d.as_dvec3());
                    let pixels = miss.length() * layout.pixels_per_metre;
                    assert!(pixels < 1e-3, "{:?}: {pixels}", cell.view);
                }
            }
        }
    }

    #[test]
    fn equal_edges_are_aligned() {
        let layout = SheetLayout::new(bounds([0.0; 3], [4.0, 2.0, 1.0]), (1000, 800));
        let rect = |view| {
            let cell = layout.cells.iter().find(|cell| cell.view == view).unwrap();
            layout.model_rect(cell)
        };
        let [top, front, right] = [StandardView::Top, StandardView::Front, StandardView::Right].map(rect);
        assert_eq!((top.0.x, top.1.x), (front.0.x, front.1.x));
        assert_eq!((right.0.y, right.1.y), (front.0.y, front.1.y));
    }
}
