//! What differs between two frames.

/// A rectangle of pixels; row 0 on top.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Rect {
    pub x: u32,
    pub y: u32,
    pub width: u32,
    pub height: u32,
}

impl Rect {
    /// All of a picture.
    pub fn whole(width: u32, height: u32) -> Rect {
        Rect { x: 0, y: 0, width, height }
    }

    /// The pixels of a picture that is `width` wide which lie in here.
    pub fn cut<T: Copy>(self, pixels: &[T], width: u32) -> Vec<T> {
        let (x, columns) = (self.x as usize, self.width as usize);
        let rows = pixels.chunks_exact(width as usize).skip(self.y as usize).take(self.height as usize);
        rows.flat_map(|row| row[x..x + columns].iter().copied()).collect()
    }
}

/// The smallest rectangle outside which `after` equals `before`; none where they are equal.
pub(crate) fn changed(before: &[[u8; 4]], after: &[[u8; 4]], width: u32) -> Option<Rect> {
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
    (top != usize::MAX).then(|| Rect {
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
    fn only_what_changed_is_inside() {
        let (width, height) = (7, 5);
        let before = vec![[1, 2, 3, 255]; width * height];
        assert_eq!(changed(&before, &before, 7), None);
        for (a, b) in [(0, 0), (8, 19), (34, 34), (6, 28), (13, 8)] {
            let mut after = before.clone();
            after[a][3] = 0;
            after[b][0] = 9;
            let rect = changed(&before, &after, 7).unwrap();
            let (xs, ys) = ([a % 7, b % 7], [a / 7, b / 7]);
            assert_eq!((rect.x, rect.y), (xs[0].min(xs[1]) as u32, ys[0].min(ys[1]) as u32));
            assert_eq!(rect.width as usize, xs[0].abs_diff(xs[1]) + 1);
            assert_eq!(rect.height as usize, ys[0].abs_diff(ys[1]) + 1);
            let cut = rect.cut(&after, 7);
            assert_eq!(cut.iter().filter(|p| **p != before[0]).count(), if a == b { 1 } else { 2 });
        }
    }
}
