//! Which frames: Open Job Description's range expressions, and shares of them.

use std::collections::HashSet;
use std::fmt;
use std::ops::Range;

/// Frame numbers, in the order in which they were asked for, each once.
///
/// `1-240:2`, `1-3,7,9-11`, `10-1:-3` as Open Job Description writes them, and Blender's `1..10`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FrameList(Vec<i64>);

/// Frames in one list, at most: eleven hours at 24 frames a second.
pub const MAX_FRAMES: usize = 1_000_000;

impl FrameList {
    /// Reads a list.
    ///
    /// # Errors
    /// What is wrong with which part of it.
    pub fn parse(text: &str) -> Result<FrameList, String> {
        let mut frames = Vec::new();
        let mut seen = HashSet::new();
        for part in text.split(',').map(str::trim) {
            let range = FrameRange::parse(part).ok_or_else(|| {
                format!("'{part}' is no frame and no range of them, such as 7, 1-10, 1-240:2 or 10-1:-3")
            })?;
            let count = range.count().filter(|n| *n > 0);
            let count =
                count.ok_or_else(|| format!("'{part}' holds no frame: its step leads away from its end"))?;
            if count > (MAX_FRAMES - frames.len()) as u64 {
                return Err(format!("more than {MAX_FRAMES} frames"));
            }
            frames.extend(range.frames(count).filter(|f| seen.insert(*f)));
        }
        Ok(FrameList(frames))
    }

    /// 1 to `last`.
    pub fn up_to(last: u32) -> FrameList {
        FrameList((1..=i64::from(last)).collect())
    }

    /// Those frames, in increasing order.
    pub fn ascending(frames: impl IntoIterator<Item = i64>) -> FrameList {
        let mut frames: Vec<i64> = frames.into_iter().collect();
        frames.sort_unstable();
        frames.dedup();
        FrameList(frames)
    }

    /// The frames.
    pub fn frames(&self) -> &[i64] {
        &self.0
    }

    /// Whether every frame is the next one's neighbour.
    pub fn is_contiguous(&self) -> bool {
        self.0.windows(2).all(|two| two[0].checked_add(1) == Some(two[1]))
    }
}

/// As [`FrameList::parse`] reads it: `1-3,7,9-21:3`.
impl fmt::Display for FrameList {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let mut rest = &self.0[..];
        let mut comma = "";
        while let [first, after @ ..] = rest {
            let step = after.first().and_then(|next| next.checked_sub(*first)).unwrap_or(0);
            let alike = |two: &&[i64]| two[1].checked_sub(two[0]) == Some(step);
            let steps = rest.windows(2).take_while(alike).count();
            let last = rest[steps];
            // Two frames are no range.
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

/// `first-last:step`.
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
        // A minus sign at the very start belongs to the number.
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
                let one = number(ends)?;
                Some(FrameRange { first: one, last: one, step: 1 })
            }
            None => None,
        }
    }

    /// `None` where the step leads away from the end.
    fn count(&self) -> Option<u64> {
        let away = (self.step > 0) != (self.first <= self.last) && self.first != self.last;
        (!away).then(|| (self.first.abs_diff(self.last) / self.step.unsigned_abs()).saturating_add(1))
    }

    fn frames(&self, count: u64) -> impl Iterator<Item = i64> + use<> {
        let (first, step) = (self.first, self.step);
        // Within the ends, so nothing overflows.
        (0..count).map(move |i| first.wrapping_add((i as i64).wrapping_mul(step)))
    }
}

/// The I-th of N shares of a list: contiguous, their sizes differ by at most one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Chunk {
    /// From 1.
    index: u32,
    of: u32,
}

impl Chunk {
    /// Reads `I/N`.
    ///
    /// # Errors
    /// What is expected.
    pub fn parse(text: &str) -> Result<Chunk, String> {
        let read = || {
            let (index, of) = text.split_once('/')?;
            let (index, of) = (index.trim().parse().ok()?, of.trim().parse().ok()?);
            (1 <= index && index <= of).then_some(Chunk { index, of })
        };
        read().ok_or_else(|| "expected I/N with I from 1 to N, such as 2/8".to_string())
    }

    /// This share of `count` things. Empty where there are fewer things than shares.
    pub fn range(self, count: usize) -> Range<usize> {
        let at = |i: u32| (count as u128 * u128::from(i) / u128::from(self.of)) as usize;
        at(self.index - 1)..at(self.index)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lists_are_read_as_open_job_description_writes_them() {
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
    fn what_is_no_list_is_told() {
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
    fn lists_are_written_as_they_are_read() {
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
    fn chunks_are_all_of_it_and_alike() {
        for (count, of) in [(36, 5), (3, 7), (0, 2), (240, 240), (1_000_000, 4_000_000_000)] {
            let chunk = |index| Chunk { index, of }.range(count);
            if of <= 240 {
                let sizes: Vec<_> = (1..=of).map(|i| chunk(i).len()).collect();
                assert_eq!(sizes.iter().sum::<usize>(), count);
                assert!(sizes.iter().max().unwrap() - sizes.iter().min().unwrap() <= 1);
                assert!((1..of).all(|i| chunk(i).end == chunk(i + 1).start));
            }
            assert_eq!((chunk(1).start, chunk(of).end), (0, count));
        }
        assert_eq!(Chunk::parse("2/8"), Ok(Chunk { index: 2, of: 8 }));
        for wrong in ["0/3", "4/3", "1", "1/0", "a/b", "-1/2", ""] {
            assert!(Chunk::parse(wrong).is_err(), "{wrong}");
        }
    }
}
