//! Cryptomatte 1.2: names hashed to ids that are floats, a manifest of names, and pairs of id and
//! coverage in ranked channels (Friedman and Jones, "Fully Automatic ID Mattes with Support for
//! Motion Blur and Transparency", SIGGRAPH 2015; and the specification at
//! github.com/Psyop/Cryptomatte).

use std::collections::{HashMap, HashSet};
use std::fmt::Write;

use super::exr::Values;
use crate::integrator::MatteKind;
use crate::render::{MATTE_RANKS, Matte};

/// MurmurHash3 for 32 bits on x86, seed 0 (Austin Appleby, public domain).
pub(super) fn murmur3(bytes: &[u8]) -> u32 {
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

/// A name's id, as the bits of a float: one that is neither denormal nor infinite nor no number,
/// since those would not survive every program on the way.
pub(super) fn id_bits(name: &str) -> u32 {
    let hash = murmur3(name.as_bytes());
    if matches!((hash >> 23) & 255, 0 | 255) { hash ^ (1 << 23) } else { hash }
}

/// A matte as a file has it.
pub(super) struct Layers<'m> {
    /// Its name, which its channels begin with.
    pub name: &'static str,
    matte: &'m Matte,
    /// Names of things from 1 on, each its own.
    names: Vec<String>,
    /// Their ids.
    ids: Vec<u32>,
}

impl<'m> Layers<'m> {
    pub fn new(matte: &'m Matte) -> Layers<'m> {
        let name = match matte.kind {
            MatteKind::Object => "crypto_object",
            MatteKind::Material => "crypto_material",
        };
        let names = unique(&matte.names, matte.kind.name());
        let ids = names.iter().map(|n| id_bits(n)).collect();
        Layers { name, matte, names, ids }
    }

    /// What a file's header says of it.
    pub fn metadata(&self) -> Vec<(String, String)> {
        let key = format!("{:08x}", id_bits(self.name));
        let entry = |what: &str, value: String| (format!("cryptomatte/{}/{what}", &key[..7]), value);
        vec![
            entry("name", self.name.into()),
            entry("hash", "MurmurHash3_32".into()),
            entry("conversion", "uint32_to_float32".into()),
            entry("manifest", self.manifest()),
        ]
    }

    /// JSON of every name and its id.
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

    /// Channels `name00.R`, id and coverage of two ranks in every four, with their values by pixel.
    pub fn channels(&self) -> impl Iterator<Item = (String, Values<'_>)> {
        (0..MATTE_RANKS).flat_map(move |rank| {
            let [id, coverage] = if rank % 2 == 0 { ["R", "G"] } else { ["B", "A"] };
            let name = |letter: &str| format!("{}{:02}.{letter}", self.name, rank / 2);
            let cover = move |i| self.matte.pixel(i).get(rank).copied().unwrap_or_default();
            let ids: Values = Box::new(move |i| self.id(cover(i).0));
            let shares: Values = Box::new(move |i| cover(i).1);
            [(name(id), ids), (name(coverage), shares)]
        })
    }

    /// The id of thing `i`, from 1.
    fn id(&self, i: u32) -> f32 {
        let known = (i as usize).checked_sub(1).and_then(|i| self.ids.get(i));
        f32::from_bits(known.copied().unwrap_or(0))
    }
}

/// The ids of a matte's things, from 1 on.
pub(super) fn ids(matte: &Matte) -> Vec<u32> {
    Layers::new(matte).ids
}

/// Names that are all different: what has none is called `object-7`, and a name's second bearer
/// gets `.001`, as Blender does when it reads such a file.
pub(super) fn unique(names: &[String], kind: &str) -> Vec<String> {
    // Names that somebody bears, with the last number that was added to each.
    let mut taken: HashMap<String, u32> = names.iter().map(|n| (n.clone(), 0)).collect();
    let mut first = HashSet::new();
    let mut out = Vec::with_capacity(names.len());
    for (i, name) in names.iter().enumerate() {
        // Whoever first bears a name in the file keeps it; the others look for what nobody has.
        let (name, keeps) = if name.is_empty() {
            let name = format!("{kind}-{}", i + 1);
            let free = !taken.contains_key(&name);
            (name, free)
        } else {
            (name.clone(), first.insert(name))
        };
        if keeps {
            taken.entry(name.clone()).or_insert(0);
            out.push(name);
            continue;
        }
        let mut k = taken.get(&name).copied().unwrap_or(0);
        let fresh = loop {
            k += 1;
            let candidate = format!("{name}.{k:03}");
            if !taken.contains_key(&candidate) {
                break candidate;
            }
        };
        taken.insert(name, k);
        taken.insert(fresh.clone(), 0);
        out.push(fresh);
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hashes_are_murmur_hash_3() {
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

    /// The values that the specification's own tests publish.
    #[test]
    #[expect(clippy::excessive_precision, reason = "as they were published")]
    fn ids_are_the_published_ones() {
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
    fn every_thing_has_a_name_of_its_own() {
        let names = ["Cube", "Cube", "", "Cube.001", "object-3", "Cube", ""].map(String::from);
        assert_eq!(
            unique(&names, "object"),
            ["Cube", "Cube.002", "object-3.001", "Cube.001", "object-3", "Cube.003", "object-7"]
        );
        let many = unique(&vec![String::from("x"); 5000], "object");
        assert_eq!(many.iter().collect::<std::collections::HashSet<_>>().len(), 5000);
        assert_eq!((many[0].as_str(), many[4999].as_str()), ("x", "x.4999"));
    }
}
