//! Dirty rectangles: the part of a frame that differs from the frame before it.

use blinn_render::PixelRect;

/// The rectangle of a full image.
pub(super) fn full_rect(width: u32, height: u32) -> PixelRect {
    PixelRect { x: 0, y: 0, width, height }
}

/// Copies the pixels inside `rect` from an image that is `width` pixels wide.
pub(super) fn crop<T: Copy>(pixels: &[T], width: u32, rect: PixelRect) -> Vec<T> {
    let x = rect.x as usize;
    let columns = rect.width as usize;
    let rows = pixels.chunks_exact(width as usize).skip(rect.y as usize).take(rect.height as usize);
    rows.flat_map(|row| row[x..x + columns].iter().copied()).collect()
}

/// The smallest rectangle that contains all differing pixels; `None` if the frames are equal.
pub(super) fn dirty_rect(before: &[[u8; 4]], after: &[[u8; 4]], width: u32) -> Option<PixelRect> {
    let width = width as usize;
    let (mut left, mut right, mut top, mut bottom) = (width, 0, usize::MAX, 0);
    let rows = before.chunks_exact(width).zip(after.chunks_exact(width));
    for (y, (old, new)) in rows.enumerate() {
        if old == new {
            continue;
        }
        let differs = |x: &usize| old[*x] != new[*x];
        left = left.min((0..width).find(differs).unwrap_or(width));
        right = right.max((0..width).rfind(differs).unwrap_or(0));
        top = top.min(y);
        bottom = y;
    }
    (top != usize::MAX).then(|| PixelRect {
        x: left as u32,
        y: top as u32,
        width: (right - left + 1) as u32,
        height: (bottom - top + 1) as u32,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_rectangle_bounds_the_differing_pixels() {
        let (width, height) = (7, 5);
        let before = vec![[1, 2, 3, 255]; width * height];
        assert_eq!(dirty_rect(&before, &before, 7), None);
        for (a, b) in [(0, 0), (8, 19), (34, 34), (6, 28), (13, 8)] {
            let mut after = before.clone();
            after[a][3] = 0;
            after[b][0] = 9;
            let rect = dirty_rect(&before, &after, 7).unwrap();
            let xs = [a % 7, b % 7];
            let ys = [a / 7, b / 7];
            assert_eq!((rect.x, rect.y), (xs[0].min(xs[1]) as u32, ys[0].min(ys[1]) as u32));
            assert_eq!(rect.width as usize, xs[0].abs_diff(xs[1]) + 1);
            assert_eq!(rect.height as usize, ys[0].abs_diff(ys[1]) + 1);
            let cropped = crop(&after, 7, rect);
            assert_eq!(cropped.iter().filter(|p| **p != before[0]).count(), if a == b { 1 } else { 2 });
        }
    }
}
