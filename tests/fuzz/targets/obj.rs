//! An OBJ of random statements, with mostly valid numbers.

use std::fmt::Write;
use std::path::Path;

use arbitrary::{Result, Unstructured};

const NUMBERS: [&str; 14] =
    ["0", "1", "-1", ".5", "-0.0", "1e3", "1e-30", "3e38", "1e39", "nan", "-inf", "1.#IND", "7.", "+2"];
const WORDS: [&str; 10] = ["a", "b", "A", "a b", "", "\"a\"", "é", "..", "a # c", "off"];
const MTL: [&str; 22] = [
    "Kd", "Ka", "Ks", "Ke", "Ns", "d", "Tr", "illum", "Ni", "Tf", "Pr", "Pm", "map_Kd", "map_d", "bump",
    "norm", "map_Ks", "map_Pr", "newmtl", "refl", "disp", "Ps",
];

pub fn target(bytes: &[u8], folder: &Path) -> bool {
    let Ok((obj, mtl)) = texts(&mut Unstructured::new(bytes)) else { return false };
    std::fs::write(folder.join("a.mtl"), mtl).unwrap();
    let path = folder.join("a.obj");
    std::fs::write(&path, obj).unwrap();
    super::load_and_render(&path)
}

/// An OBJ and its MTL.
fn texts(u: &mut Unstructured) -> Result<(String, String)> {
    let mut text = String::new();
    if u.ratio(9u8, 10u8)? {
        text += "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nvt 0 0\nvt 1 0\nvn 0 0 1\n";
    }
    for _ in 0..u.int_in_range(0..=60)? {
        statement(u, &mut text)?;
    }
    let mut mtl = String::new();
    for _ in 0..u.int_in_range(0..=12)? {
        let keyword = u.choose(&MTL)?;
        let _ = write!(mtl, "{keyword} ");
        rest(u, &mut mtl)?;
    }
    Ok((text, mtl))
}

fn statement(u: &mut Unstructured, text: &mut String) -> Result<()> {
    match u.int_in_range(0..=13)? {
        0..=3 => {
            text.push_str("v ");
            numbers(u, 3, text)?;
        }
        4 => {
            text.push_str("vt ");
            numbers(u, 2, text)?;
        }
        5 => {
            text.push_str("vn ");
            numbers(u, 3, text)?;
        }
        6..=8 => face(u, text)?,
        9 => {
            let keyword = u.choose(&["o ", "g ", "s ", "usemtl ", "mtllib a.mtl #"])?;
            text.push_str(keyword);
            rest(u, text)?;
        }
        10 => {
            let keyword =
                u.choose(&["l 1 2 3", "p 1", "#", "\\", "vp 1 2", "call a.obj", "\t", "#MRGB ffff0000"])?;
            text.push_str(keyword);
        }
        11 => text.push_str("mtllib a.mtl"),
        12 => {
            text.push_str("usemtl ");
            text.push_str(u.choose(&WORDS)?);
        }
        _ => rest(u, text)?,
    }
    text.push_str(u.choose(&["\n", "\n", "\n", "\r\n", "\r", " \\\n", ""])?);
    Ok(())
}

fn numbers(u: &mut Unstructured, usual: usize, text: &mut String) -> Result<()> {
    let count = if u.ratio(99u8, 100u8)? { usual } else { u.int_in_range(0..=7)? };
    for _ in 0..count {
        if u.ratio(3u8, 4u8)? {
            let _ = write!(text, "{} ", f32::from(u.arbitrary::<i8>()?) / 8.0);
        } else {
            let odd = if u.ratio(1u8, 100u8)? { "0x1" } else { u.choose(&NUMBERS)? };
            let _ = write!(text, "{odd} ");
        }
    }
    Ok(())
}

fn face(u: &mut Unstructured, text: &mut String) -> Result<()> {
    text.push_str("f ");
    let slashes = u.choose(&["", "/v", "//v", "/v/v", "/", "//", "/v/"])?;
    let corners = if u.ratio(7u8, 8u8)? { u.int_in_range(3..=6)? } else { u.int_in_range(0..=20)? };
    for _ in 0..corners {
        // Small indices from either end; rarely others.
        let mut index = || -> Result<String> {
            Ok(match u.int_in_range(0..=999)? {
                0 => "0".into(),
                1 => "99999999999".into(),
                2 => "-2147483648".into(),
                n @ 3..=500 => (n % 4 + 1).to_string(),
                n => format!("-{}", n % 4 + 1),
            })
        };
        let _ = write!(text, "{}", index()?);
        for c in slashes.chars() {
            match c {
                'v' => text.push_str(&index()?),
                c => text.push(c),
            }
        }
        text.push(' ');
    }
    Ok(())
}

fn rest(u: &mut Unstructured, text: &mut String) -> Result<()> {
    match u.int_in_range(0..=2)? {
        0 => numbers(u, 3, text)?,
        1 => text.push_str(u.choose(&WORDS)?),
        _ => text.push_str(u.choose(&[
            "a.png",
            "-s 1 2 3 a.png",
            "-bm 1 a",
            "-clamp on",
            "-o",
            "spectral a",
        ])?),
    }
    text.push('\n');
    Ok(())
}
