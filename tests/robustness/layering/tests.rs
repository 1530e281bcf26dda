//! The detector of cycles on small made-up crates.

use std::collections::BTreeMap;

use super::source::Modules;
use super::uses::{cycles, uses};

/// The cycles among files, as `a.rs b.rs`.
fn found(files: &[(&str, &str)]) -> Vec<String> {
    let files: BTreeMap<String, String> =
        files.iter().map(|(file, text)| (file.to_string(), text.to_string())).collect();
    let cycles = cycles(&uses(&Modules::read(&files), false));
    cycles.into_iter().map(|cycle| cycle.files.into_iter().collect::<Vec<_>>().join(" ")).collect()
}

const ROOT: (&str, &str) = ("lib.rs", "mod a; mod b; mod c;");
const LEAF: (&str, &str) = ("c.rs", "pub struct C; pub fn c() {}");

#[test]
fn files_in_one_direction_are_no_cycle() {
    let a = ("a.rs", "use crate::b::{self, B}; fn a(_: B) { b::b(); super::c::c() }");
    let b = ("b.rs", "use crate::c::C as See; pub struct B(See); pub fn b() {}");
    assert!(found(&[ROOT, a, b, LEAF]).is_empty());
}

#[test]
fn every_form_of_a_path_closes_a_cycle() {
    let b = ("b.rs", "use crate::a::A; pub struct B(A); pub fn b() {}");
    for uses_b in [
        "use crate::b::B;",
        "use super::{c::C, b::{B as Other}};",
        "use super::b::*; fn a() { b() }",
        "use crate::b; fn a() { b::b() }",
        "fn a() -> crate::b::B { todo!() }",
        "fn a() { super::b::b() }",
        "fn a() { self::inner::a() } mod inner { pub fn a() { super::super::b::b() } }",
        "impl<'a> From<crate::b::B> for A { const Q: char = '\"'; fn from(b: &'a u8) -> char { 'b' } }",
    ] {
        let text = format!("{uses_b} pub struct A;");
        assert_eq!(found(&[ROOT, ("a.rs", &text), b, LEAF]), ["a.rs b.rs"], "{uses_b}");
    }
}

#[test]
fn tests_comments_and_strings_close_none() {
    let b = ("b.rs", "use crate::a::A; pub struct B(A); pub fn b() {}");
    for harmless in [
        "/// [`B`](crate::b::B) /* /* */ use crate::b::B; */\n",
        "/* /* nested */ use crate::b::B; */",
        "const TEXT: &str = \"use crate::b::B; \\\" crate::b::b()\";",
        "const TEXT: &str = r#\"crate::b::b() \" crate::b::b()\"#;",
        "#[cfg(test)] mod tests { use crate::b::B; fn f<A, C>(_: A) { crate::b::b() } }",
        "#[cfg(test)] use crate::b::{B, b};",
        "#[cfg(all(test, unix))] fn f<A, C>(_: A) { crate::b::b() }",
        "struct S { #[cfg(test)] b: crate::b::B, c: u8 }",
        "use crate::b;",
        "use bytes::b::B;",
    ] {
        let text = format!("{harmless} pub struct A;");
        assert!(found(&[ROOT, ("a.rs", &text), b, LEAF]).is_empty(), "{harmless}");
    }
    let tests = ("a.rs", "#[cfg(test)] mod tests; pub struct A;");
    assert!(found(&[ROOT, tests, ("a/tests.rs", "use crate::b::B;"), b, LEAF]).is_empty());
}

#[test]
fn names_are_followed_to_the_file_that_defines_them() {
    let root = ("lib.rs", "pub mod a;");
    // A facade hands names on in both directions.
    let facade = ("a/mod.rs", "mod b; mod c; pub use b::B; pub use c::{C, deep::*}; use crate::a::c::c;");
    let b = ("a/b.rs", "use super::{C, D}; pub struct B(C, D);");
    let c = ("a/c/mod.rs", "pub mod deep; pub struct C; pub fn c() {}");
    let deep = ("a/c/deep.rs", "pub struct D;");
    assert!(found(&[root, facade, b, c, deep]).is_empty());
    // Through the same facade, the other way round as well.
    let back = ("a/c/deep.rs", "use crate::a::B; pub struct D;");
    assert_eq!(found(&[root, facade, b, c, back]), ["a/b.rs a/c/deep.rs"]);
}

#[test]
fn a_parent_that_uses_its_child_and_is_used_by_it_is_a_cycle() {
    let root = ("lib.rs", "pub mod a;");
    let child = ("a/b.rs", "use super::A; pub struct B(A);");
    for parent in [
        "mod b; pub use b::B; pub struct A; fn f(_: B) {}",
        "mod b; pub struct A; fn f() -> b::B { todo!() }",
        "mod b; use b::*; pub struct A; type F = B;",
    ] {
        assert_eq!(found(&[root, ("a/mod.rs", parent), child]), ["a/b.rs a/mod.rs"], "{parent}");
    }
    assert!(found(&[root, ("a/mod.rs", "mod b; pub use b::B; pub struct A;"), child]).is_empty());
}

#[test]
fn a_cycle_of_three_is_one_and_says_what_ties_it() {
    let files = [
        ("lib.rs", "mod a; mod b; mod c; mod d;"),
        ("a.rs", "use crate::b::B; pub struct A;"),
        ("b.rs", "use crate::c::{C, c}; use crate::d::D; pub struct B;"),
        ("c.rs", "use crate::a::A; pub struct C; pub fn c() {}"),
        ("d.rs", "pub struct D;"),
    ];
    assert_eq!(found(&files), ["a.rs b.rs c.rs"]);
    let files: BTreeMap<String, String> =
        files.into_iter().map(|(file, text)| (file.into(), text.into())).collect();
    let ties = &cycles(&uses(&Modules::read(&files), false))[0].ties;
    assert_eq!(*ties, ["a.rs -> b.rs: B", "b.rs -> c.rs: C, c", "c.rs -> a.rs: A"]);
}
