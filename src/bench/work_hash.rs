//! Hashes of results: equal hashes show that two runs did the same work.

use std::fmt;

use twox_hash::XxHash3_128;

use blinn_core::geometry::{Hit, Rgba};

/// A 128-bit hash (XXH3) of hits, of occlusion or of an image. It depends neither on the number of threads nor on the
/// SIMD level or the processor.
///
/// It is written as 32 hexadecimal digits.
#[derive(Clone, Copy, PartialEq, Eq)]
pub struct WorkHash(u128);

impl WorkHash {
    /// Hashes the closest hits of a batch: the bits of t, the instance and the triangle of each, as little-endian
    /// 32-bit words.
    pub fn of_hits(hits: &[Hit]) -> WorkHash {
        let mut hash = XxHash3_128::new();
        for Hit { t, id } in hits {
            for word in [t.to_bits(), id.instance, id.triangle] {
                hash.write(&word.to_le_bytes());
            }
        }
        WorkHash(hash.finish_128())
    }

    /// Hashes the occlusion of a batch: a byte for each segment, 1 if it is occluded.
    pub fn of_occlusion(occluded: &[bool]) -> WorkHash {
        let bytes: Vec<u8> = occluded.iter().map(|&occluded| u8::from(occluded)).collect();
        WorkHash(XxHash3_128::oneshot(&bytes))
    }

    /// Hashes the pixels of an image: the bits of red, green, blue and alpha as little-endian 32-bit floats,
    /// premultiplied and linear, row by row from the top.
    pub fn of_pixels(pixels: &[Rgba]) -> WorkHash {
        let mut hash = XxHash3_128::new();
        for pixel in pixels {
            for channel in pixel.to_array() {
                hash.write(&channel.to_bits().to_le_bytes());
            }
        }
        WorkHash(hash.finish_128())
    }

    /// Combines the hashes of batches in their order: hashes their 16 little-endian bytes.
    pub fn combine(hashes: impl IntoIterator<Item = WorkHash>) -> WorkHash {
        let mut all = XxHash3_128::new();
        for WorkHash(hash) in hashes {
            all.write(&hash.to_le_bytes());
        }
        WorkHash(all.finish_128())
    }
}

impl fmt::Display for WorkHash {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:032x}", self.0)
    }
}

impl fmt::Debug for WorkHash {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "WorkHash({self})")
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use blinn_core::geometry::HitId;

    /// Every bit of t, the ids and their order count.
    #[test]
    fn any_difference_of_hits_changes_the_hash() {
        let hit = |t: f32, instance, triangle| Hit { t, id: HitId { instance, triangle } };
        let hits = [hit(1.0, 2, 3), hit(4.0, 5, 6)];
        let hash = WorkHash::of_hits(&hits);
        assert_eq!(hash, WorkHash::of_hits(&hits));
        let others = [
            vec![hit(1.0f32.next_up(), 2, 3), hits[1]],
            vec![hit(1.0, 3, 3), hits[1]],
            vec![hit(1.0, 2, 4), hits[1]],
            vec![hits[1], hits[0]],
            vec![hits[0]],
            vec![hits[0], hits[1], Hit::MISS],
        ];
        for other in others {
            assert_ne!(WorkHash::of_hits(&other), hash, "{other:?}");
        }
        let [a, b] = [WorkHash::of_occlusion(&[true, false]), WorkHash::of_occlusion(&[false, true])];
        assert_ne!(WorkHash::combine([a, b]), WorkHash::combine([b, a]));
        assert_eq!(hash.to_string().len(), 32);
    }
}
