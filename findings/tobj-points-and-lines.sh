#!/usr/bin/env bash
# tobj reads no points, and reads a line of three vertices as a triangle.
#
# LoadOptions has ignore_points and ignore_lines, both false by default: points and lines are then to be kept. A `p` statement
# still adds nothing, without an error. A line (`l`) with two or four vertices is a face of so many corners in face_arities, by
# which it can be told from triangles. face_arities is empty if all faces of a model have three corners, however: a line of three
# vertices, alone in its object, is the triangle between them.
#
# Reading `p` and `l` from the text oneself helps, with ignore_lines set.
#
# Seen with tobj 4.0.5 on x86-64 under Linux: see the assertions.
# Needs cargo. Fails if the behaviour changes.
set -euo pipefail

dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT
mkdir "$dir/src"
cat >"$dir/Cargo.toml" <<'TOML'
[package]
name = "finding"
version = "0.1.0"
edition = "2021"

[dependencies]
tobj = { version = "=4.0.5", default-features = false }
TOML
cat >"$dir/src/main.rs" <<'RUST'
use tobj::{LoadOptions, Mesh, load_mtl_buf, load_obj_buf};

fn mesh(statement: &str) -> Mesh {
    let text = format!("v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\no object\n{statement}\n");
    let options = LoadOptions { single_index: true, ..LoadOptions::default() };
    let (models, _) = load_obj_buf(&mut text.as_bytes(), &options, |_| load_mtl_buf(&mut &b""[..])).unwrap();
    let mesh = models[0].mesh.clone();
    println!("{statement}: indices {:?}, face_arities {:?}", mesh.indices, mesh.face_arities);
    mesh
}

fn main() {
    assert!(!LoadOptions::default().ignore_points && !LoadOptions::default().ignore_lines);
    assert!(mesh("p 1 2 3").indices.is_empty(), "points are read now");
    assert_eq!(mesh("l 1 2").face_arities, [2]);
    assert_eq!(mesh("l 1 2 3 4").face_arities, [4]);
    let (line, triangle) = (mesh("l 1 2 3"), mesh("f 1 2 3"));
    assert_eq!(line.indices, triangle.indices);
    assert_eq!(line.face_arities, triangle.face_arities, "the line differs from the triangle now");
}
RUST
cargo run --quiet --manifest-path "$dir/Cargo.toml"
