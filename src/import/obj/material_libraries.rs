//! Material libraries: finds and reads the MTL files of an OBJ and looks up materials by name.

use std::collections::HashMap;
use std::ops::Range;

use super::super::Limits;
use super::super::error::Warnings;
use super::mtl::{self, MtlContext, MtlMaterial};
use super::text;
use super::texture_files::find_file;
use crate::files::name_match::{decompose, fold_case};
use crate::files::{escape::printable, scene_folder::SceneFolder};

/// The materials of all MTL files.
#[derive(Default)]
pub(super) struct MaterialLibraries {
    all: Vec<MtlMaterial>,
    /// Indices by name: as written, without quotes in Unicode normal form D, and with case folded. Lookups try them
    /// in this order.
    by_name: [HashMap<String, usize>; 3],
    /// Materials of the MTL with the base name of the OBJ, the fallback for names that all others lack.
    same_name: Option<Box<MaterialLibraries>>,
}

impl MaterialLibraries {
    /// Reads the files of `mtllib` lines. If some of `materials` are missing, it also reads the MTL with the base
    /// name of the OBJ, as Blender does. Warns about what is missing.
    pub fn read(
        lines: &[String],
        materials: &[String],
        folder: &SceneFolder,
        limits: &Limits,
        context: MtlContext,
        warnings: &mut Warnings,
    ) -> MaterialLibraries {
        let mut out = MaterialLibraries::default();
        let missing = out.read_mtllibs(lines, folder, limits, context, warnings);
        let same_name = folder.with_extension("mtl");
        let found =
            out.read_same_name(&same_name, &out.missing(materials), folder, limits, context, warnings);
        let used = format!("used '{}', which has the name of the OBJ", printable(&same_name));
        let instead = format!("{used}, instead");
        let then = if found { instead.as_str() } else { "its materials are matte white" };
        for why in &missing {
            warnings.add("", format!("MTL {why}; {then}"));
        }
        let unknown = out.missing(materials);
        if lines.is_empty() && found {
            warnings.add("", format!("the file names no MTL: {used}"));
        } else if lines.is_empty() && !unknown.is_empty() {
            let count = match unknown.len() {
                1 => "1 material".to_string(),
                n => format!("{n} materials"),
            };
            warnings.add("", format!("the file names {count} and no MTL: used matte white instead"));
        } else if missing.is_empty() && found {
            warnings.add("", format!("{used}, for materials that the MTL lacks"));
        }
        // If an MTL is missing, one warning about it is enough.
        if found || missing.is_empty() && !lines.is_empty() {
            for name in unknown {
                let name = printable(name);
                warnings.add("", format!("material '{name}' is not in the MTL: used matte white instead"));
            }
        }
        out
    }

    /// Reads the files of `mtllib` lines. Returns why others could not be read.
    fn read_mtllibs(
        &mut self,
        lines: &[String],
        folder: &SceneFolder,
        limits: &Limits,
        context: MtlContext,
        warnings: &mut Warnings,
    ) -> Vec<String> {
        let mut all_missing = Vec::new();
        // A file that occurs many times is read once.
        let mut known: HashMap<String, Result<(), String>> = HashMap::new();
        for line in lines {
            let read = |name: &str| {
                if let Some(outcome) = known.get(name) {
                    return outcome.clone().map(|()| None);
                }
                let bytes = find_file(folder, "", name, limits.file_bytes);
                let bytes = bytes.map_err(|e| e.message().to_string());
                known.insert(name.to_string(), bytes.as_ref().map(drop).map_err(String::clone));
                Ok(Some((name.to_string(), bytes?)))
            };
            let read = read_mtllib(line, read);
            let files: Vec<_> = read.found.into_iter().flatten().collect();
            self.add_line(&files, context, warnings);
            all_missing.extend(read.missing);
        }
        all_missing
    }

    /// Reads the MTL `name` and keeps it if it has any of the `missing` materials. Returns true then.
    fn read_same_name(
        &mut self,
        name: &str,
        missing: &[&str],
        folder: &SceneFolder,
        limits: &Limits,
        context: MtlContext,
        warnings: &mut Warnings,
    ) -> bool {
        if missing.is_empty() {
            return false;
        }
        let Ok(bytes) = find_file(folder, "", name, limits.file_bytes) else { return false };
        let mut library = MaterialLibraries::default();
        let mut its_warnings = Warnings::default();
        library.add_line(&[(name.to_string(), bytes)], context, &mut its_warnings);
        if missing.iter().all(|name| library.material(name).is_none()) {
            return false;
        }
        warnings.extend(its_warnings);
        self.same_name = Some(Box::new(library));
        true
    }

    /// Returns the named materials that are in no MTL.
    fn missing<'a>(&self, materials: &'a [String]) -> Vec<&'a str> {
        let names = materials.iter().map(String::as_str);
        names.filter(|name| !name.is_empty() && self.material(name).is_none()).collect()
    }

    /// Adds the materials of the files, with their names, of one `mtllib` line.
    fn add_line(&mut self, files: &[(String, Vec<u8>)], context: MtlContext, warnings: &mut Warnings) {
        let parsed: Vec<_> =
            files.iter().map(|(name, bytes)| parse(name, bytes, context, warnings)).collect();
        let line = self.all.len();
        // The first file of a line is searched first, so it is added last.
        for (place, materials) in parsed.into_iter().rev() {
            let others = line..self.all.len();
            for material in materials {
                self.add(material, &place, &others, warnings);
            }
        }
    }

    /// Adds a material. A repeated name replaces the earlier material, as in other programs. `others` are the materials
    /// of the files that the same line names after this one.
    fn add(&mut self, material: MtlMaterial, place: &str, others: &Range<usize>, warnings: &mut Warnings) {
        let new = self.all.len();
        let exact = material.name.clone();
        let bare = material.name.trim_matches('"').to_string();
        if let Some(replaced) = self.by_name[0].get(&exact) {
            let name = printable(&exact);
            warnings.add(
                place,
                if others.contains(replaced) {
                    format!(
                        "material '{name}' is in a later file of the same mtllib too: used that of the first"
                    )
                } else {
                    format!("material '{name}' occurs again: used the later one")
                },
            );
        }
        if let Some(name) = text::strip_comment(&bare) {
            self.by_name[2].entry(fold_case(name)).or_insert(new);
        }
        self.by_name[2].insert(fold_case(&bare), new);
        self.by_name[1].insert(decompose(&bare), new);
        self.by_name[0].insert(exact, new);
        self.all.push(material);
    }

    /// Returns the material with a name: by the exact name, else as exporters alter names, else without a
    /// trailing comment.
    pub fn material(&self, name: &str) -> Option<&MtlMaterial> {
        let [exact, bare, lower] = &self.by_name;
        let find = |name: &str| {
            let unquoted = name.trim_matches('"');
            let found = exact.get(name).or_else(|| bare.get(&decompose(unquoted)));
            self.all.get(*found.or_else(|| lower.get(&fold_case(unquoted)))?)
        };
        let fallback = || self.same_name.as_ref()?.material(name);
        text::name_candidates(name).find_map(find).or_else(fallback)
    }
}

/// Parses an MTL file. Returns its name for warnings, and its materials.
fn parse(
    name: &str,
    bytes: &[u8],
    context: MtlContext,
    warnings: &mut Warnings,
) -> (String, Vec<MtlMaterial>) {
    let (text, guessed) = text::decode(bytes);
    let place = printable(name);
    if guessed {
        warnings.add(&place, "decoded lines that are not UTF-8 as Windows-1252");
    }
    let unified = name.replace('\\', "/");
    let beside = unified.rsplit_once('/').map_or("", |(folder, _)| folder);
    let materials = mtl::parse(&text, &place, beside, context, warnings);
    (place, materials)
}

/// The files of a `mtllib` line.
struct ReadFiles<T> {
    found: Vec<T>,
    /// Why the others could not be read.
    missing: Vec<String>,
}

impl<T> ReadFiles<T> {
    fn one(file: T) -> ReadFiles<T> {
        ReadFiles { found: vec![file], missing: Vec::new() }
    }
}

/// Reads the files of a `mtllib` line: the whole line as one name, or else each of its names that end in `.mtl`.
fn read_mtllib<T>(line: &str, mut read: impl FnMut(&str) -> Result<T, String>) -> ReadFiles<T> {
    let whole = match read(line.trim_matches('"')) {
        Ok(file) => return ReadFiles::one(file),
        Err(why) => why,
    };
    let mut all = ReadFiles { found: Vec::new(), missing: Vec::new() };
    for name in split_after_mtl(line) {
        let files = match read(name.trim_matches('"')) {
            Ok(file) => ReadFiles::one(file),
            Err(why) => read_words(name, why, &mut read),
        };
        all.found.extend(files.found);
        all.missing.extend(files.missing);
    }
    // If no file exists, the warning names the whole line.
    if all.found.is_empty() {
        all.missing = vec![whole];
    }
    all
}

/// Reads the files that the words of `name` name, which may be quoted; or else one name with escaped spaces.
/// `whole` says why there is no file with the whole name.
fn read_words<T>(
    name: &str,
    whole: String,
    read: &mut impl FnMut(&str) -> Result<T, String>,
) -> ReadFiles<T> {
    let words = split_words(name);
    if words.len() > 1 || words.first().is_some_and(|&w| w != name.trim_matches('"')) {
        let (found, missing): (Vec<_>, Vec<_>) = words.iter().map(|w| read(w)).partition(Result::is_ok);
        if !found.is_empty() {
            return ReadFiles {
                found: found.into_iter().flatten().collect(),
                missing: missing.into_iter().filter_map(Result::err).collect(),
            };
        }
        if let Ok(file) = read(&name.replace("\\ ", " ")) {
            return ReadFiles::one(file);
        }
    }
    ReadFiles { found: Vec::new(), missing: vec![whole] }
}

/// Splits a line after each `.mtl`, up to a comment, since names may contain unquoted spaces. A line with quotes is
/// not split.
fn split_after_mtl(line: &str) -> Vec<&str> {
    let mut out = Vec::new();
    let mut rest = line.trim();
    let quoted = line.contains('"');
    let ends_name = |word: &str| !quoted && word.len() > 4 && word.to_ascii_lowercase().ends_with(".mtl");
    while !rest.is_empty() && !rest.starts_with('#') {
        let mut words = rest.split_inclusive(char::is_whitespace);
        let mut length = 0;
        // Add the lengths up to the first word that ends a name, or of all words.
        let _ = words.find(|word| {
            length += word.len();
            ends_name(word.trim_end())
        });
        let (name, after) = rest.split_at(length);
        out.push(name.trim_end());
        rest = after.trim_start();
    }
    out
}

/// Splits a line into words up to a comment; a quoted part is one word.
fn split_words(line: &str) -> Vec<&str> {
    let mut out = Vec::new();
    let mut rest = line.trim_start();
    while !rest.is_empty() && !rest.starts_with('#') {
        let quoted = rest.strip_prefix('"').and_then(|r| r.split_once('"'));
        let (word, after) = quoted.unwrap_or_else(|| text::split_keyword(rest));
        if !word.is_empty() {
            out.push(word);
        }
        rest = after.trim_start();
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The number of comment starts that a lookup tries is limited.
    #[test]
    fn a_name_of_a_million_number_signs_is_looked_up_quickly() {
        let mut libraries = MaterialLibraries::default();
        for name in ["a", "a # b"] {
            let material = MtlMaterial { name: name.into(), ..MtlMaterial::default() };
            libraries.add(material, "a.mtl", &(0..0), &mut Warnings::default());
        }
        let found = |name: &str| libraries.material(name).map(|m| m.name.clone());
        assert_eq!(found("a # b # c").as_deref(), Some("a # b"));
        assert_eq!(found("a # c # c").as_deref(), Some("a"));
        assert_eq!(found(&"#".repeat(1 << 20)), None);
    }

    /// macOS programs write some names in Unicode normal form D.
    #[test]
    fn names_match_in_any_unicode_normal_form() {
        let mut libraries = MaterialLibraries::default();
        for name in ["Ka\u{308}se", "ka\u{308}se", "\u{fc}", "u\u{308}"] {
            let material = MtlMaterial { name: name.into(), ..MtlMaterial::default() };
            libraries.add(material, "a.mtl", &(0..0), &mut Warnings::default());
        }
        let found = |name: &str| libraries.material(name).map(|m| m.name.clone());
        for (name, expected) in [("K\u{e4}se", "Ka\u{308}se"), ("\"k\u{e4}se\"", "ka\u{308}se")] {
            assert_eq!(found(name).as_deref(), Some(expected), "{name}");
        }
        assert!(found("K\u{c4}SE").is_some() && found("Kase").is_none());
        // An exact match takes precedence.
        assert!(["\u{fc}", "u\u{308}"].iter().all(|name| found(name).as_deref() == Some(name)));
    }

    #[test]
    fn a_library_that_occurs_again_is_read_once() {
        let dir = tempfile::tempdir().unwrap();
        std::fs::write(dir.path().join("a.mtl"), "newmtl a\n").unwrap();
        let folder = SceneFolder::of(&dir.path().join("a.obj"), false);
        let lines = ["a.mtl a.mtl b.mtl", "a.mtl", "b.mtl a.mtl", "b.mtl b.mtl b.mtl"].map(String::from);
        let mut warnings = Warnings::default();
        let libraries = MaterialLibraries::read(
            &lines,
            &[],
            &folder,
            &Limits::default(),
            MtlContext::default(),
            &mut warnings,
        );
        assert_eq!(libraries.all.len(), 1);
        // No material is reported as repeated, and the missing file is reported once.
        let warnings = warnings.into_vec();
        assert_eq!(warnings.iter().filter(|w| w.message.contains("'b.mtl'")).count(), 1, "{warnings:?}");
        assert!(warnings.iter().all(|w| !w.message.contains("again")), "{warnings:?}");
    }

    /// The specification: "the first file listed is searched first for the material definition". Later lines and later
    /// definitions of one file replace earlier ones.
    #[test]
    fn the_first_file_of_a_line_is_searched_first() {
        let dir = tempfile::tempdir().unwrap();
        for (file, text) in [
            ("a.mtl", "newmtl m\nNs 1\nnewmtl a\nNs 2\nnewmtl a\nNs 3\n"),
            ("b.mtl", "newmtl M\nNs 4\nnewmtl m\nNs 5\nnewmtl b\nNs 6\n"),
        ] {
            std::fs::write(dir.path().join(file), text).unwrap();
        }
        let folder = SceneFolder::of(&dir.path().join("scene.obj"), false);
        let ns = |lines: &[&str], names: &[&str]| {
            let lines: Vec<String> = lines.iter().map(ToString::to_string).collect();
            let mut warnings = Warnings::default();
            let libraries = MaterialLibraries::read(
                &lines,
                &[],
                &folder,
                &Limits::default(),
                MtlContext::default(),
                &mut warnings,
            );
            let ns = names.iter().map(|name| libraries.material(name).and_then(|m| m.ns).unwrap_or(0.0));
            let repeated = warnings.into_vec().iter().filter(|w| w.message.contains("of the first")).count();
            (ns.collect::<Vec<_>>(), repeated)
        };
        let names = ["m", "a", "b", "M"];
        assert_eq!(ns(&["a.mtl b.mtl"], &names), (vec![1.0, 3.0, 6.0, 4.0], 1));
        assert_eq!(ns(&["b.mtl a.mtl"], &names), (vec![5.0, 3.0, 6.0, 4.0], 1));
        assert_eq!(ns(&["a.mtl", "b.mtl"], &names), (vec![5.0, 3.0, 6.0, 4.0], 0));
        assert_eq!(ns(&["b.mtl", "a.mtl b.mtl"], &["m"]), (vec![1.0], 0));
    }

    /// The name as written takes precedence.
    #[test]
    fn percent_encoded_names_are_found() {
        let dir = tempfile::tempdir().unwrap();
        let folder = SceneFolder::of(&dir.path().join("a.obj"), false);
        let read = || {
            let mut warnings = Warnings::default();
            let lines = ["my%20own.mtl".to_string()];
            let libraries = MaterialLibraries::read(
                &lines,
                &[],
                &folder,
                &Limits::default(),
                MtlContext::default(),
                &mut warnings,
            );
            (libraries.all.iter().map(|m| m.name.clone()).collect::<String>(), warnings.into_vec().len())
        };
        assert_eq!(read(), (String::new(), 1));
        std::fs::write(dir.path().join("my own.mtl"), "newmtl decoded\n").unwrap();
        assert_eq!(read(), ("decoded".into(), 0));
        std::fs::write(dir.path().join("my%20own.mtl"), "newmtl literal\n").unwrap();
        assert_eq!(read(), ("literal".into(), 0));
    }

    /// Splitting takes linear time.
    #[test]
    fn a_line_of_a_million_names_is_split_quickly() {
        assert_eq!(split_after_mtl(&"a.mtl ".repeat(1 << 20)).len(), 1 << 20);
    }

    #[test]
    fn mtllib_lines_may_have_several_quoted_or_escaped_names() {
        let files = ["a.mtl", "b c.mtl", "d", "e.mtl"];
        let read = |name: &str| {
            let known = files.contains(&name).then(|| name.to_string());
            known.ok_or_else(|| format!("no {name}"))
        };
        for (line, found, missing) in [
            ("a.mtl", vec!["a.mtl"], 0),
            ("b c.mtl", vec!["b c.mtl"], 0),
            ("\"b c.mtl\"", vec!["b c.mtl"], 0),
            ("a.mtl e.mtl", vec!["a.mtl", "e.mtl"], 0),
            ("\"b c.mtl\" \"a.mtl\" d", vec!["b c.mtl", "a.mtl", "d"], 0),
            ("b\\ c.mtl", vec!["b c.mtl"], 0),
            ("a.mtl # note", vec!["a.mtl"], 0),
            ("a.mtl x.mtl", vec!["a.mtl"], 1),
            ("x y.mtl", vec![], 1),
            // Several names with unquoted spaces.
            ("b c.mtl a.mtl", vec!["b c.mtl", "a.mtl"], 0),
            ("a.mtl b c.mtl # note", vec!["a.mtl", "b c.mtl"], 0),
            ("a.mtl b\\ c.mtl", vec!["a.mtl", "b c.mtl"], 0),
            ("a.mtl \"b c.mtl\" e.mtl", vec!["a.mtl", "b c.mtl", "e.mtl"], 0),
            ("x y.mtl b c.mtl", vec!["b c.mtl"], 1),
            ("x y.mtl z.mtl", vec![], 1),
        ] {
            let files = read_mtllib(line, read);
            assert_eq!(files.found, found, "{line}");
            assert_eq!(files.missing.len(), missing, "{line}");
        }
    }
}
