//! Layout of named views: pictures of one size in rows, each with a caption below it, under the title of the sheet.

use glam::DVec2;

/// Least width and height of a picture in pixels.
const MIN_AREA: u32 = 48;
/// Least width and height at which a picture and the name of a file below it are easily read: in pixels, and in heights of the labels.
const READABLE_AREA: u32 = 96;
const READABLE_LABELS: f64 = 8.0;
/// Heights of the title and of a caption, and the space between pictures, in heights of the labels.
const HEADER: f64 = 3.0;
const CAPTION: f64 = 2.5;
const GAP: f64 = 0.5;
/// The aspect ratio that pictures should have.
const ASPECT: f64 = 4.0 / 3.0;

/// Rows of pictures.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Grid {
    /// Width and height of the space for a picture.
    pub area: (u32, u32),
    /// Height of the labels in pixels.
    pub label_height: f64,
    /// Height of the space for the title.
    pub header: u32,
    columns: usize,
    /// Distances of pictures from column to column and from row to row.
    step: (u32, u32),
}

/// Spaces between pictures, in pixels.
struct Spacing {
    label_height: f64,
    header: u32,
    caption: u32,
    gap: u32,
}

impl Spacing {
    fn of(size: (u32, u32)) -> Spacing {
        let label_height = (f64::from(size.0.min(size.1)) / 80.0).clamp(5.0, 40.0);
        let pixels = |labels: f64| (labels * label_height).round() as u32;
        Spacing { label_height, header: pixels(HEADER), caption: pixels(CAPTION), gap: pixels(GAP) }
    }
}

impl Grid {
    /// Lays out `count` pictures as large as possible on a sheet. `None` if there is no room.
    pub fn new(count: usize, size: (u32, u32)) -> Option<Grid> {
        Grid::with_least_area(count, size, MIN_AREA)
    }

    /// Lays out `count` pictures on a sheet, or as many as are easily read. Returns their number, too. `None` if there is no room.
    pub fn readable(count: usize, size: (u32, u32)) -> Option<(Grid, usize)> {
        let Spacing { label_height, header, caption, gap } = Spacing::of(size);
        let least = READABLE_AREA.max((READABLE_LABELS * label_height).ceil() as u32);
        let columns = size.0 / (least + gap);
        let rows = size.1.saturating_sub(header) / (least + caption);
        let count = count.min(columns as usize * rows as usize);
        Some((Grid::with_least_area(count, size, least)?, count))
    }

    /// Lays out `count` pictures whose width and height are at least `least` pixels.
    fn with_least_area(count: usize, size: (u32, u32), least: u32) -> Option<Grid> {
        let Spacing { label_height, header, caption, gap } = Spacing::of(size);
        let with_columns = |columns: usize| {
            let rows = u32::try_from(count.div_ceil(columns)).ok()?;
            let step = (size.0 / u32::try_from(columns).ok()?, size.1.saturating_sub(header) / rows);
            let area = (step.0.saturating_sub(gap), step.1.saturating_sub(caption));
            (area.0.min(area.1) >= least).then_some(Grid { area, label_height, header, columns, step })
        };
        let height = |grid: &Grid| (f64::from(grid.area.0) / ASPECT).min(f64::from(grid.area.1));
        // The first of equal ones.
        let larger = |best: Option<Grid>, grid: Grid| match best {
            Some(best) if height(&best) >= height(&grid) => Some(best),
            _ => Some(grid),
        };
        // More columns than that have no room.
        let columns = (size.0 / least) as usize;
        (1..=count.min(columns)).filter_map(with_columns).fold(None, larger)
    }

    /// Position and size of the `index`-th picture, counted from 0, as large as its aspect ratio allows.
    pub fn fit(&self, index: usize, aspect: f64) -> ([u32; 2], (u32, u32)) {
        let aspect = if aspect.is_finite() && aspect > 0.0 { aspect } else { ASPECT };
        let area = DVec2::new(f64::from(self.area.0), f64::from(self.area.1));
        let width = area.x.min(area.y * aspect);
        let side = |length: f64, limit: u32| (length.round() as u32).clamp(1, limit);
        let size = (side(width, self.area.0), side(width / aspect, self.area.1));
        let [left, top] = self.corner(index);
        ([left + (self.area.0 - size.0) / 2, top + (self.area.1 - size.1) / 2], size)
    }

    /// The middle of the caption of the `index`-th picture, in pixels.
    pub fn caption(&self, index: usize) -> DVec2 {
        let [left, top] = self.corner(index).map(f64::from);
        let below = 0.5 * f64::from(self.step.1 - self.area.1);
        DVec2::new(left + 0.5 * f64::from(self.area.0), top + f64::from(self.area.1) + below)
    }

    /// The upper left corner of the space for a picture.
    fn corner(&self, index: usize) -> [u32; 2] {
        let (column, row) = ((index % self.columns) as u32, (index / self.columns) as u32);
        let gap = self.step.0 - self.area.0;
        [column * self.step.0 + gap / 2, self.header + row * self.step.1]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// No two pictures overlap, and none leaves the sheet or the room of its caption.
    #[test]
    fn pictures_are_apart_and_on_the_sheet() {
        for (count, size) in
            [(1, (1280, 960)), (2, (300, 900)), (7, (1280, 960)), (36, (1999, 777)), (5, (400, 400))]
        {
            let grid = Grid::new(count, size).unwrap();
            let mut rects = Vec::new();
            for (index, aspect) in (0..count).zip([1.5, 0.2, 9.0, f64::NAN, 0.0, 1e12].into_iter().cycle()) {
                let ([x, y], (width, height)) = grid.fit(index, aspect);
                assert!(width >= 1 && height >= 1 && x + width <= size.0 && y >= grid.header, "{count}");
                let caption = grid.caption(index);
                let label = 0.5 * grid.label_height;
                assert!(caption.y - label > f64::from(y + height) && caption.y + label < f64::from(size.1));
                rects.push((x, y, x + width, caption.y as u32));
            }
            for (i, a) in rects.iter().enumerate() {
                for b in &rects[..i] {
                    assert!(a.0 >= b.2 || b.0 >= a.2 || a.1 >= b.3 || b.1 >= a.3, "{count}: {a:?} {b:?}");
                }
            }
        }
    }

    #[test]
    fn rows_suit_the_shape_of_the_sheet() {
        let columns = |count, size| Grid::new(count, size).map(|grid| grid.columns);
        assert_eq!(columns(4, (1280, 960)), Some(2));
        assert_eq!(columns(3, (1200, 300)), Some(3));
        assert_eq!(columns(3, (300, 1200)), Some(1));
        assert_eq!(columns(1000, (1280, 960)), None);
        assert_eq!(columns(0, (1280, 960)), None);
        assert_eq!(columns(1, (40, 960)), None);
    }

    /// As many pictures as have room are on a page, and every sheet has room for one.
    #[test]
    fn pages_have_readable_pictures() {
        for size in
            [(128, 128), (128, 5000), (5000, 128), (300, 300), (1000, 1000), (1280, 960), (9000, 4000)]
        {
            for count in [1, 5, 1_000_000] {
                let (grid, on_page) = Grid::readable(count, size).unwrap();
                assert!((1..=count).contains(&on_page), "{size:?} {count}: {on_page}");
                let side = f64::from(grid.area.0.min(grid.area.1));
                assert!(side >= 96.0 && side >= 8.0 * grid.label_height, "{size:?} {count}: {side}");
            }
        }
        assert_eq!(Grid::readable(5, (1280, 960)), Grid::new(5, (1280, 960)).map(|grid| (grid, 5)));
        assert_eq!(Grid::readable(1000, (1280, 960)).map(|(_, on_page)| on_page), Some(84));
        assert_eq!(Grid::readable(0, (1280, 960)), None);
    }

    #[test]
    fn pictures_keep_their_aspect_ratio() {
        let grid = Grid::new(4, (1280, 960)).unwrap();
        for aspect in [0.5, 1.0, 16.0 / 9.0] {
            let (_, (width, height)) = grid.fit(0, aspect);
            assert!(
                (f64::from(width) - aspect * f64::from(height)).abs() <= 1.0,
                "{aspect}: {width} {height}"
            );
            assert!(width == grid.area.0 || height == grid.area.1);
        }
    }
}
