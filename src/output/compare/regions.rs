//! Boxes around connected groups of pixels.

use blinn_render::PixelRect;

/// Side of the blocks whose neighbours are connected, in pixels.
const BLOCK: usize = 8;
/// Largest number of boxes that are listed.
const LISTED: usize = 20;

/// Boxes around groups of pixels.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Regions {
    /// The boxes of the largest groups, the largest first.
    pub boxes: Vec<PixelRect>,
    /// Number of the other groups.
    pub more: usize,
}

#[derive(Clone, Copy)]
struct Group {
    pixels: u64,
    min: [usize; 2],
    max: [usize; 2],
}

/// Returns the boxes of the pixels that `is_in` accepts. Pixels are in one group if blocks of 8 × 8 pixels with
/// accepted pixels connect them, by sides or corners.
pub fn regions((width, height): (u32, u32), is_in: impl Fn(usize) -> bool) -> Regions {
    let (width, height) = (width as usize, height as usize);
    let (columns, rows) = (width.div_ceil(BLOCK), height.div_ceil(BLOCK));
    let mut blocks: Vec<Option<Group>> = vec![None; columns * rows];
    for y in 0..height {
        for x in (0..width).filter(|x| is_in(y * width + x)) {
            let block = &mut blocks[y / BLOCK * columns + x / BLOCK];
            *block = Some(join(*block, Group { pixels: 1, min: [x, y], max: [x, y] }));
        }
    }
    let mut groups = Vec::new();
    let mut pending = Vec::new();
    for start in 0..blocks.len() {
        let Some(mut group) = blocks[start].take() else { continue };
        pending.push(start);
        while let Some(at) = pending.pop() {
            let (x, y) = (at % columns, at / columns);
            for row in y.saturating_sub(1)..(y + 2).min(rows) {
                for column in x.saturating_sub(1)..(x + 2).min(columns) {
                    let neighbour = row * columns + column;
                    if let Some(other) = blocks[neighbour].take() {
                        group = join(Some(group), other);
                        pending.push(neighbour);
                    }
                }
            }
        }
        groups.push(group);
    }
    groups.sort_by_key(|group| std::cmp::Reverse(group.pixels));
    let rect = |group: &Group| {
        let side = |axis: usize| (group.max[axis] - group.min[axis] + 1) as u32;
        PixelRect { x: group.min[0] as u32, y: group.min[1] as u32, width: side(0), height: side(1) }
    };
    let boxes: Vec<PixelRect> = groups.iter().take(LISTED).map(rect).collect();
    Regions { more: groups.len() - boxes.len(), boxes }
}

fn join(group: Option<Group>, other: Group) -> Group {
    let Some(group) = group else { return other };
    let pick = |choose: fn(usize, usize) -> usize, a: [usize; 2], b: [usize; 2]| {
        [choose(a[0], b[0]), choose(a[1], b[1])]
    };
    Group {
        pixels: group.pixels + other.pixels,
        min: pick(usize::min, group.min, other.min),
        max: pick(usize::max, group.max, other.max),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(width: u32, height: u32, pixels: &[(u32, u32)]) -> Regions {
        regions((width, height), |i| {
            let i = i as u32;
            pixels.contains(&(i % width, i / width))
        })
    }

    #[test]
    fn near_pixels_share_a_box_and_far_ones_do_not() {
        let rect = |x, y, width, height| PixelRect { x, y, width, height };
        assert_eq!(of(50, 30, &[]), Regions::default());
        assert_eq!(of(50, 30, &[(49, 29)]).boxes, [rect(49, 29, 1, 1)]);
        let found = of(50, 30, &[(0, 0), (9, 9), (17, 3), (40, 29)]);
        assert_eq!(found.boxes, [rect(0, 0, 18, 10), rect(40, 29, 1, 1)]);
    }

    #[test]
    fn the_largest_are_listed() {
        let many: Vec<(u32, u32)> = (0..40).map(|i| (i * 24, 0)).chain([(481, 0), (482, 0)]).collect();
        let found = of(1000, 1, &many);
        assert_eq!((found.boxes.len(), found.more), (20, 20));
        assert_eq!(found.boxes[0], PixelRect { x: 480, y: 0, width: 3, height: 1 });
    }
}
