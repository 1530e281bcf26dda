//! Cryptomatte 1.2 ID mattes: names hashed to float ids, a manifest of names, and ranked channels of
//! (id, coverage) pairs.
//!
//! Friedman and Jones, "Fully Automatic ID Mattes with Support for Motion Blur and Transparency", SIGGRAPH 2015;
//! specification: github.com/Psyop/Cryptomatte.

use std::collections::{HashMap, HashSet};
use std::fmt::Write;

use blinn_render::integrator::MatteKind;
use blinn_render::{MATTE_RANKS, Matte};

/// The value of a channel at each pixel, by index.
pub(super) type PixelFn<'p> = Box<dyn Fn(usize) -> f32 + Sync + 'p>;

/// The matte of one kind, with the names and ids that a file stores.
pub(super) struct Cryptomatte<'m> {
    /// Prefix of its channels.
    name: &'static str,
    matte: &'m Matte,
    /// Distinct names; index 0 is id 1 of [`Matte`].
    names: Vec<String>,
    /// The id of each name, as the bits of a float.
    ids: Vec<u32>,
}

impl<'m> Cryptomatte<'m> {
    pub fn new(matte: &'m Matte) -> Cryptomatte<'m> {
        let name = match matte.kind {
            MatteKind::Object => "crypto_object",
            MatteKind::Material => "crypto_material",
        };
        let names = unique_names(&matte.names, matte.kind.name());
        let ids = names.iter().map(|n| id_bits(n)).collect();
        Cryptomatte { name, matte, names, ids }
    }

    /// The id of each name, as the bits of a float.
    pub fn into_ids(self) -> Vec<u32> {
        self.ids
    }

    /// Keys and values of the EXR attributes.
    pub fn metadata(&self) -> Vec<(String, String)> {
        let key = format!("{:08x}", id_bits(self.name));
        let entry = |field: &str, value: String| (format!("cryptomatte/{}/{field}", &key[..7]), value);
        vec![
            entry("name", self.name.into()),
            entry("hash", "MurmurHash3_32".into()),
            entry("conversion", "uint32_to_float32".into()),
            entry("manifest", self.manifest()),
        ]
    }

    /// JSON object from name to id in hexadecimal.
    fn manifest(&self) -> String {
        let mut text = String::from("{");
        for (i, (name, id)) in self.names.iter().zip(&self.ids).enumerate() {
            let comma = if i == 0 { "" } else { "," };
            // Writing to a string cannot fail.
            let _ = write!(text, "{comma}{}:\"{id:08x}\"", serde_json::Value::from(name.as_str()));
        }
        text.push('}');
        text
    }

    /// The channels `name00.R`, `name00.G`, …: each layer of four holds id and coverage of two ranks.
    pub fn channels(&self) -> impl Iterator<Item = (String, PixelFn<'_>)> {
        (0..MATTE_RANKS).flat_map(move |rank| {
            let [id, coverage] = if rank % 2 == 0 { ["R", "G"] } else { ["B", "A"] };
            let name = |letter: &str| format!("{}{:02}.{letter}", self.name, rank / 2);
            let ranked = move |i| self.matte.pixel(i).get(rank).copied().unwrap_or_default();
            let ids: PixelFn = Box::new(move |i| self.float_id(ranked(i).0));
            let coverages: PixelFn = Box::new(move |i| ranked(i).1);
            [(name(id), ids), (name(coverage), coverages)]
        })
    }

    /// The float id of the matte's id `i`, which counts from 1. 0 stands for no object.
    fn float_id(&self, i: u32) -> f32 {
        let bits = (i as usize).checked_sub(1).and_then(|i| self.ids.get(i));
        f32::from_bits(bits.copied().unwrap_or(0))
    }
}

/// The id of a name, as the bits of a float. Denormals, infinities and NaN do not survive every program, so a
/// bit of the exponent is flipped there (specification, "Hash to float conversion").
pub(super) fn id_bits(name: &str) -> u32 {
    let hash = murmur3(name.as_bytes());
    if matches!((hash >> 23) & 255, 0 | 255) { hash ^ (1 << 23) } else { hash }
}

/// MurmurHash3 for 32 bits on x86 with seed 0 (Austin Appleby, public domain).
fn murmur3(bytes: &[u8]) -> u32 {
    let scramble = |k: u32| k.wrapping_mul(0xcc9e_2d51).rotate_left(15).wrapping_mul(0x1b87_3593);
    let mut h = 0u32;
    let (blocks, tail) = bytes.as_chunks::<4>();
    for block in blocks {
        h ^= scramble(u32::from_le_bytes(*block));
        h = h.rotate_left(13).wrapping_mul(5).wrapping_add(0xe654_6b64);
    }
    let mut last = [0; 4];
    last[..tail.len()].copy_from_slice(tail);
    h ^= scramble(u32::from_le_bytes(last));
    h ^= bytes.len() as u32;
    h = (h ^ (h >> 16)).wrapping_mul(0x85eb_ca6b);
    h = (h ^ (h >> 13)).wrapping_mul(0xc2b2_ae35);
    h ^ (h >> 16)
}

/// Makes names distinct: an empty name becomes `object-7`, and the second use of a name gets `.001`, which is
/// the suffix that Blender adds when it reads such a file.
fn unique_names(names: &[String], kind: &str) -> Vec<String> {
    // The used names, each with the last number that was appended to it.
    let mut used: HashMap<String, u32> = names.iter().map(|n| (n.clone(), 0)).collect();
    let mut assigned = HashSet::new();
    let mut unique = Vec::with_capacity(names.len());
    for (i, name) in names.iter().enumerate() {
        // The first object with a name of the file keeps it.
        let (name, keeps) = if name.is_empty() {
            let name = format!("{kind}-{}", i + 1);
            let keeps = !used.contains_key(&name);
            (name, keeps)
        } else {
            (name.clone(), assigned.insert(name))
        };
        if keeps {
            used.entry(name.clone()).or_insert(0);
            unique.push(name);
            continue;
        }
        let mut k = used.get(&name).copied().unwrap_or(0);
        let numbered = loop {
            k += 1;
            let candidate = format!("{name}.{k:03}");
            if !used.contains_key(&candidate) {
                break candidate;
            }
        };
        used.insert(name, k);
        used.insert(numbered.clone(), 0);
        unique.push(numbered);
    }
    unique
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn murmur3_matches_published_values() {
        for (text, hash) in [
            ("", 0),
            ("a", 0x3c25_69b2),
            ("ab", 0x9bbf_d75f),
            ("abc", 0xb3dd_93fa),
            ("test", 0xba6b_d213),
            ("Hello, world!", 0xc036_3e43),
            ("The quick brown fox jumps over the lazy dog", 0x2e4f_f723),
        ] {
            assert_eq!(murmur3(text.as_bytes()), hash, "{text}");
        }
    }

    /// The values of the specification's own tests.
    #[test]
    #[expect(clippy::excessive_precision, reason = "copied from the specification")]
    fn ids_match_the_specification() {
        for (name, id) in [
            ("hello", 6.070_562_710_240_000_561_6e-17),
            ("cube", -4.084_619_125_19e+15),
            ("sphere", 2.790_186_043_83e+15),
            ("plane", 3.665_576_175_93e-11),
            ("равнина", -1.319_263_121_239_999_946_8e-25),
            ("mädchen", 6.236_129_821_159_999_579_7e+25f32),
        ] {
            assert_eq!(id_bits(name), f32::to_bits(id), "{name}");
        }
        assert!((0..200_000u32).all(|i| f32::from_bits(id_bits(&i.to_string())).is_normal()));
    }

    #[test]
    fn names_become_distinct() {
        let names = ["Cube", "Cube", "", "Cube.001", "object-3", "Cube", ""].map(String::from);
        assert_eq!(
            unique_names(&names, "object"),
            ["Cube", "Cube.002", "object-3.001", "Cube.001", "object-3", "Cube.003", "object-7"]
        );
        let many = unique_names(&vec![String::from("x"); 5000], "object");
        assert_eq!(many.iter().collect::<std::collections::HashSet<_>>().len(), 5000);
        assert_eq!((many[0].as_str(), many[4999].as_str()), ("x", "x.4999"));
    }
}
