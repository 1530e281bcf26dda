//! Frame lists as range expressions of Open Job Description, and equal chunks of them.

use std::collections::HashSet;
use std::fmt;
use std::ops::Range;

/// A list of distinct frame numbers in render order.
///
/// The syntax is Open Job Description's, `1-240:2`, `1-3,7,9-11`, `10-1:-3`, and Blender's `1..10`.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize)]
pub struct FrameList(Vec<i64>);

/// The largest number of frames in a list: eleven hours at 24 frames a second.
pub const MAX_FRAMES: usize = 1_000_000;

impl FrameList {
    /// Parses a list. The first occurrence of a frame counts.
    ///
    /// # Errors
    /// A part is not a range, its step leads away from its end, or there are too many frames.
    pub fn parse(text: &str) -> Result<FrameList, String> {
        let mut frames = Vec::new();
        let mut seen = HashSet::new();
        for part in text.split(',').map(str::trim) {
            let range = FrameRange::parse(part).ok_or_else(|| {
                format!("'{part}' is not a frame or a range of frames, such as 7, 1-10, 1-240:2 or 10-1:-3")
            })?;
            let count = range.count().filter(|n| *n > 0);
            let count =
                count.ok_or_else(|| format!("'{part}' has no frames: its step leads away from its end"))?;
            if count > (MAX_FRAMES - frames.len()) as u64 {
                return Err(format!("more than {MAX_FRAMES} frames"));
            }
            frames.extend(range.frames(count).filter(|f| seen.insert(*f)));
        }
        Ok(FrameList(frames))
    }

    /// The frames 1 to `last`.
    pub fn up_to(last: u32) -> FrameList {
        FrameList((1..=i64::from(last)).collect())
    }

    /// Sorts frames and removes duplicates.
    pub fn ascending(frames: impl IntoIterator<Item = i64>) -> FrameList {
        let mut frames: Vec<i64> = frames.into_iter().collect();
        frames.sort_unstable();
        frames.dedup();
        FrameList(frames)
    }

    /// The frames in render order.
    pub fn frames(&self) -> &[i64] {
        &self.0
    }

    /// Returns true if each frame is followed by the next number.
    pub fn is_contiguous(&self) -> bool {
        self.0.windows(2).all(|pair| pair[0].checked_add(1) == Some(pair[1]))
    }
}

/// Formats the list in the syntax that [`FrameList::parse`] reads: `1-3,7,9-21:3`.
impl fmt::Display for FrameList {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let mut rest = &self.0[..];
        let mut comma = "";
        while let [first, after @ ..] = rest {
            let step = after.first().and_then(|next| next.checked_sub(*first)).unwrap_or(0);
            let same_step = |pair: &&[i64]| pair[1].checked_sub(pair[0]) == Some(step);
            let steps = rest.windows(2).take_while(same_step).count();
            let last = rest[steps];
            // Two frames are not written as a range.
            let length = match (steps, step) {
                (0 | 1, _) => {
                    write!(f, "{comma}{first}")?;
                    1
                }
                (_, 1) => {
                    write!(f, "{comma}{first}-{last}")?;
                    steps + 1
                }
                _ => {
                    write!(f, "{comma}{first}-{last}:{step}")?;
                    steps + 1
                }
            };
            rest = &rest[length..];
            comma = ",";
        }
        Ok(())
    }
}

/// A part of a frame list: `first-last:step`.
struct FrameRange {
    first: i64,
    last: i64,
    step: i64,
}

impl FrameRange {
    fn parse(text: &str) -> Option<FrameRange> {
        let (ends, step) = match text.split_once(':') {
            Some((ends, step)) => (ends, Some(step.trim().parse::<i64>().ok().filter(|s| *s != 0)?)),
            None => (text, None),
        };
        let number = |s: &str| s.trim().parse::<i64>().ok();
        // A minus sign at the start belongs to the number.
        let dash = ends.char_indices().skip(1).find(|&(_, c)| c == '-').map(|(i, _)| i);
        let parts = match (ends.split_once(".."), dash) {
            (Some(parts), _) => Some(parts),
            (None, Some(i)) => Some((&ends[..i], &ends[i + 1..])),
            (None, None) => None,
        };
        match parts {
            Some((first, last)) => {
                Some(FrameRange { first: number(first)?, last: number(last)?, step: step.unwrap_or(1) })
            }
            None if step.is_none() => {
                let frame = number(ends)?;
                Some(FrameRange { first: frame, last: frame, step: 1 })
            }
            None => None,
        }
    }

    /// The number of frames. `None` if the step leads away from the end.
    fn count(&self) -> Option<u64> {
        let away = (self.step > 0) != (self.first <= self.last) && self.first != self.last;
        (!away).then(|| (self.first.abs_diff(self.last) / self.step.unsigned_abs()).saturating_add(1))
    }

    fn frames(&self, count: u64) -> impl Iterator<Item = i64> + use<> {
        let first = self.first;
        let step = self.step;
        // The results lie between the ends, so nothing overflows.
        (0..count).map(move |i| first.wrapping_add((i as i64).wrapping_mul(step)))
    }
}

/// The I-th of N contiguous chunks, whose sizes differ by at most one.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
pub struct Chunk {
    /// From 1.
    index: u32,
    chunk_count: u32,
}

impl Chunk {
    /// Parses `I/N`.
    ///
    /// # Errors
    /// The text is not of this form, or I is not between 1 and N.
    pub fn parse(text: &str) -> Result<Chunk, String> {
        let parse = || {
            let (index, chunk_count) = text.split_once('/')?;
            let index = index.trim().parse().ok()?;
            let chunk_count = chunk_count.trim().parse().ok()?;
            (1 <= index && index <= chunk_count).then_some(Chunk { index, chunk_count })
        };
        parse().ok_or_else(|| "expected I/N with I from 1 to N, such as 2/8".to_string())
    }

    /// The indices of this chunk among `count` items. Empty if there are fewer items than chunks.
    pub fn range(self, count: usize) -> Range<usize> {
        let start = |i: u32| (count as u128 * u128::from(i) / u128::from(self.chunk_count)) as usize;
        start(self.index - 1)..start(self.index)
    }
}

/// As it is written on the command line.
impl fmt::Display for Chunk {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "{}/{}", self.index, self.chunk_count)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn open_job_description_ranges_are_parsed() {
        for (text, frames) in [
            ("7", vec![7]),
            ("1-4", vec![1, 2, 3, 4]),
            ("1..4", vec![1, 2, 3, 4]),
            ("1-8:3", vec![1, 4, 7]),
            ("1..8:3", vec![1, 4, 7]),
            ("10-1:-3", vec![10, 7, 4, 1]),
            ("1-3, 7,9-11", vec![1, 2, 3, 7, 9, 10, 11]),
            ("-2-1", vec![-2, -1, 0, 1]),
            ("-4--2", vec![-4, -3, -2]),
            ("-4..-2", vec![-4, -3, -2]),
            ("5-5:-1", vec![5]),
            ("3,1-4,3", vec![3, 1, 2, 4]),
            ("9223372036854775806-9223372036854775807", vec![i64::MAX - 1, i64::MAX]),
        ] {
            assert_eq!(FrameList::parse(text).unwrap().frames(), frames, "{text}");
        }
    }

    #[test]
    fn invalid_and_too_long_lists_are_errors() {
        for wrong in
            ["", "a", "1-", "-", "1,,2", "1-3:", "1-3:0", "7:2", "1.5", "1...3", "1-2-3", "3-1", "1-3:-1"]
        {
            assert!(FrameList::parse(wrong).is_err(), "{wrong}");
        }
        assert!(FrameList::parse("1-1000000").is_ok());
        for many in ["1-1000001", "1-600000,700001-1200001", "-9223372036854775808-9223372036854775807"] {
            assert!(FrameList::parse(many).unwrap_err().contains("more than"), "{many}");
        }
    }

    #[test]
    fn display_and_parse_are_inverse() {
        for (frames, text) in [
            (&[7][..], "7"),
            (&[7, 8], "7,8"),
            (&[1, 2, 3, 4], "1-4"),
            (&[1, 3, 5, 7, 8, 9, 20], "1-7:2,8,9,20"),
            (&[-4, -3, -2, 0], "-4--2,0"),
            (&[10, 7, 4, 1], "10-1:-3"),
            (
                &[i64::MIN, 0, i64::MAX - 1, i64::MAX],
                "-9223372036854775808,0,9223372036854775806,9223372036854775807",
            ),
        ] {
            let list = FrameList(frames.to_vec());
            assert_eq!(list.to_string(), text);
            assert_eq!(FrameList::parse(text), Ok(list));
        }
        let ascending = FrameList::ascending([9, 1, 2, 9, 3]);
        assert_eq!(ascending.frames(), [1, 2, 3, 9]);
        assert!(!ascending.is_contiguous() && FrameList::up_to(3).is_contiguous());
    }

    #[test]
    fn chunks_cover_the_list_in_equal_parts() {
        for (count, chunk_count) in [(36, 5), (3, 7), (0, 2), (240, 240), (1_000_000, 4_000_000_000)] {
            let chunk = |index| Chunk { index, chunk_count }.range(count);
            if chunk_count <= 240 {
                let sizes: Vec<_> = (1..=chunk_count).map(|i| chunk(i).len()).collect();
                assert_eq!(sizes.iter().sum::<usize>(), count);
                assert!(sizes.iter().max().unwrap() - sizes.iter().min().unwrap() <= 1);
                assert!((1..chunk_count).all(|i| chunk(i).end == chunk(i + 1).start));
            }
            assert_eq!((chunk(1).start, chunk(chunk_count).end), (0, count));
        }
        assert_eq!(Chunk::parse("2/8"), Ok(Chunk { index: 2, chunk_count: 8 }));
        for wrong in ["0/3", "4/3", "1", "1/0", "a/b", "-1/2", ""] {
            assert!(Chunk::parse(wrong).is_err(), "{wrong}");
        }
    }
}
