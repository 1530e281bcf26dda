//! Differential tests over generated files: the fast parser against the lenient parser, and against tobj alone.

use std::fmt::Write;

use glam::DVec3;

use super::super::{ParsedFile, assemble, build_scene, fast_parser, parse_lenient};
use crate::files::scene_folder::SceneFolder;
use crate::memory::MemoryBudget;
use crate::{Limits, LoadOptions};
use blinn_core::cancellation::CancelToken;
use blinn_scene::Scene;

fn parse_fast(text: &[u8], chunk_bytes: usize, limits: &Limits, origin: Option<DVec3>) -> Option<ParsedFile> {
    assemble(fast_parser::parse(text, chunk_bytes, limits, origin)?, origin)
}

/// A deterministic linear congruential generator.
struct Random(u64);

impl Random {
    fn below(&mut self, n: u64) -> u64 {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (self.0 >> 33) % n
    }

    fn chance(&mut self, of: u64) -> bool {
        self.below(of) == 0
    }

    fn pick<'a>(&mut self, of: &[&'a str]) -> &'a str {
        of[self.below(of.len() as u64) as usize]
    }
}

/// Returns a number in one of the notations that exporters write.
fn number(random: &mut Random) -> String {
    let v = (random.below(4001) as f64 - 2000.0) / 256.0;
    match random.below(8) {
        0 => format!("{v}"),
        1 => format!("{v:e}"),
        2 => format!("{:.12}", v / 3.0),
        3 => format!("{v:.0}"),
        4 => format!("+{:.3}", v.abs()),
        5 => format!("{:.4}", v).replace("0.", "."),
        _ => format!("{v:.6}"),
    }
}

/// Generates an OBJ with every notation that the fast parser accepts.
fn obj(random: &mut Random) -> String {
    let mut text = String::from(random.pick(&["", "\u{feff}", "# Blender 5.0\n", "# x\n\n"]));
    let end = random.pick(&["\n", "\n", "\r\n"]);
    let mut have = [0u64; 3];
    let colored = random.chance(4);
    let plain_forms = random.chance(2);
    for _ in 0..random.below(40) + 8 {
        match random.below(15) {
            0..4 => {
                for _ in 0..random.below(5) + 1 {
                    have[0] += 1;
                    text.push('v');
                    let extra =
                        if colored && random.chance(2) { 3 + random.below(2) } else { random.below(2) };
                    for _ in 0..3 + extra {
                        let _ = write!(text, "{}{}", random.pick(&[" ", " ", "  ", "\t"]), number(random));
                    }
                    text.push_str(random.pick(&["", "", " "]));
                    text.push_str(end);
                }
            }
            4 => {
                have[1] += 1;
                let _ =
                    write!(text, "vt {} {}{}{end}", number(random), number(random), random.pick(&["", " 0"]));
            }
            5 => {
                have[2] += 1;
                let zero = random.chance(6);
                let n: Vec<String> = (0..3).map(|_| if zero { "0".into() } else { number(random) }).collect();
                let _ = write!(text, "vn {}{end}", n.join(" "));
            }
            6..10 if have[0] > 2 => {
                text.push_str(random.pick(&["f", "  f"]));
                let form = random.below(4);
                let arity = if random.chance(3) { random.below(6) + 1 } else { 3 };
                for _ in 0..arity {
                    let form = if plain_forms {
                        3
                    } else if random.chance(9) {
                        random.below(4)
                    } else {
                        form
                    };
                    let mut index = |kind: usize| {
                        if have[kind] == 0 {
                            return String::new();
                        }
                        let i = random.below(have[kind]);
                        if random.chance(4) { format!("-{}", i + 1) } else { format!("{}", i + 1) }
                    };
                    let (v, vt, vn) = (index(0), index(1), index(2));
                    let _ = match (form, vt.as_str(), vn.as_str()) {
                        (0, ..) | (_, "", "") => write!(text, " {v}"),
                        (1, vt, _) if !vt.is_empty() => write!(text, " {v}/{vt}"),
                        (_, _, "") => write!(text, " {v}/{vt}"),
                        (2, ..) | (_, "", _) => write!(text, " {v}//{vn}"),
                        _ => write!(text, " {v}/{vt}/{vn}"),
                    };
                }
                text.push_str(end);
            }
            10 => {
                let _ = write!(text, "s {}{end}", random.pick(&["1", "2", "off", "0", "", "on", "7"]));
            }
            11 => {
                let _ = write!(text, "usemtl {}{end}", random.pick(&["red", "blue #2", "", "é è"]));
            }
            12 => {
                let word = if random.chance(3) { "o" } else { "g" };
                let _ = write!(text, "{word} {}{end}", random.pick(&["a", "b c", "", "ü"]));
            }
            13 if have[0] > 0 => {
                text.push_str(random.pick(&["l", "p", "l", " p"]));
                let has_uvs = have[1] > 0 && random.chance(2);
                for _ in 0..random.below(5) {
                    let sign = random.pick(&["", "", "-"]);
                    let _ = write!(text, " {sign}{}", random.below(have[0]) + 1);
                    if has_uvs {
                        let _ = write!(text, "/{}", random.below(have[1]) + 1);
                    }
                }
                text.push_str(end);
            }
            _ => {
                let line = random.pick(&["# note é", "", "   ", "mtllib gone.mtl", "lod 1", "usemap w"]);
                let _ = write!(text, "{line}{end}");
            }
        }
    }
    text
}

/// Formats everything of a scene that the parsers could disagree on.
fn describe(scene: &Scene, warnings: &[String]) -> String {
    format!(
        "{:?}\n{:?}\n{:?}\n{:?}\n{:?}\n{:?}",
        scene.source, scene.objects, scene.instances, scene.materials, scene.meshes, warnings
    )
}

fn describe_scene(parsed: ParsedFile) -> Result<String, String> {
    let folder = SceneFolder::of(std::path::Path::new("nowhere/x.obj"), false);
    match build_scene(parsed, &folder, &LoadOptions::default(), &MemoryBudget::new(&Limits::default())) {
        Ok((scene, warnings)) => {
            let warnings: Vec<String> = warnings.iter().map(ToString::to_string).collect();
            Ok(describe(&scene, &warnings))
        }
        Err(e) => Err(e.to_string()),
    }
}

#[test]
fn fast_and_lenient_parser_build_the_same_scenes() {
    let mut random = Random(7);
    let limits = Limits::default();
    let mut scenes = 0;
    let mut cases = 0;
    for _ in 0..6000 {
        let text = obj(&mut random);
        let origin = random.chance(4).then_some(DVec3::new(5e5, 4e6, -1e-3));
        let fast = parse_fast(text.as_bytes(), 100, &limits, origin)
            .unwrap_or_else(|| panic!("gave up at:\n{text}"));
        let lenient = parse_lenient(text.as_bytes(), &limits, origin, &CancelToken::default())
            .unwrap_or_else(|e| panic!("{e} in:\n{text}"));
        let fast = describe_scene(fast);
        let lenient = describe_scene(lenient);
        assert!(fast == lenient, "{text}\nfast: {fast:?}\n\nlenient: {lenient:?}");
        scenes += usize::from(fast.is_ok());
        cases += 1;
    }
    assert_eq!(cases, 6000);
    assert!(scenes > 4000, "{scenes}");
}

#[test]
fn the_fast_parser_gives_up_where_the_lenient_parser_differs() {
    let mut random = Random(11);
    let limits = Limits::default();
    let mut accepted = 0;
    let mut cases = 0;
    for _ in 0..20_000 {
        let mut text = obj(&mut random).into_bytes();
        for _ in 0..random.below(3) + 1 {
            let at = random.below(text.len() as u64) as usize;
            text[at] =
                *b"\0 \t\n\r\\#/-+.0e9fvnts\x80\xff\x0b,o".get(random.below(27) as usize).unwrap_or(&b'x');
        }
        cases += 1;
        let origin = random.chance(4).then_some(DVec3::new(-3.5, 1e7, 2e5));
        let Some(fast) = parse_fast(&text[..], 100, &limits, origin) else { continue };
        accepted += 1;
        let shown = String::from_utf8_lossy(&text).into_owned();
        let lenient = parse_lenient(&text, &limits, origin, &CancelToken::default())
            .unwrap_or_else(|e| panic!("{e} in:\n{shown}"));
        let fast = describe_scene(fast);
        let lenient = describe_scene(lenient);
        assert!(fast == lenient, "{shown}\nfast: {fast:?}\n\nlenient: {lenient:?}");
    }
    assert_eq!(cases, 20_000);
    assert!(accepted > 1000, "{accepted}");
}

#[test]
fn the_fast_parser_agrees_with_tobj_on_plain_files() {
    let mut random = Random(3);
    for case in 0..1000 {
        let mut text = String::new();
        let n = random.below(20) + 3;
        for _ in 0..n {
            let [x, y, z, u, v] = std::array::from_fn(|_| number(&mut random));
            let _ = write!(text, "v {x} {y} {z}\nvt {u} {v}\nvn {z} 1 {y}\n");
        }
        for _ in 0..random.below(30) + 1 {
            let [a, b, c] = std::array::from_fn(|_| random.below(n) + 1);
            let _ = writeln!(text, "f {a}/{b}/{c} {b}/{c}/{a} {c}/{a}/{b}");
        }
        let options = tobj::LoadOptions { single_index: false, ..Default::default() };
        let none = |_: &std::path::Path| Ok((Vec::new(), Default::default()));
        let model = tobj::load_obj_buf(&mut text.as_bytes(), &options, none).unwrap().0.remove(0).mesh;
        let geometry = parse_fast(text.as_bytes(), 200, &Limits::default(), None).unwrap().geometry;
        let corners: Vec<_> = geometry.triangles.concat();
        assert_eq!(corners.len(), model.indices.len(), "case {case}");
        for (i, corner) in corners.iter().enumerate() {
            let at = |values: &[f32], i: u32, n: usize| values[n * i as usize..][..n].to_vec();
            let p = geometry.positions[corner.v as usize].to_array().to_vec();
            assert_eq!(p, at(&model.positions, model.indices[i], 3));
            assert_eq!(
                geometry.uvs[corner.vt as usize].to_vec(),
                at(&model.texcoords, model.texcoord_indices[i], 2)
            );
            let normal = geometry.normals[corner.vn as usize].to_array().to_vec();
            assert_eq!(normal, at(&model.normals, model.normal_indices[i], 3));
        }
    }
}

#[test]
fn the_number_of_threads_does_not_change_the_scene() {
    let mut random = Random(5);
    let pool = |threads| rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    let pools = [pool(1), pool(2), pool(5)];
    for _ in 0..100 {
        let text = obj(&mut random);
        let parse = |pool: &rayon::ThreadPool| {
            pool.install(|| {
                describe_scene(parse_fast(text.as_bytes(), 64, &Limits::default(), None).unwrap())
            })
        };
        let [one, two, five] = pools.each_ref().map(parse);
        assert!(one == two && two == five, "{text}");
    }
}
