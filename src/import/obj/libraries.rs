//! The MTLs that an OBJ names, and which of their materials is meant by which name.

use std::collections::HashMap;

use super::super::Limits;
use super::super::error::Warnings;
use super::mtl;
use super::mtl::Mtl;
use super::{text, textures};
use crate::import::files::name_match::{decompose, fold_case};
use crate::import::files::{escape::printable, scene_folder::SceneFolder};

/// All materials of all MTLs.
#[derive(Default)]
pub(super) struct Libraries {
    all: Vec<Mtl>,
    /// Names as written, without quotes and with letters taken apart, and in lower case, in the order in which
    /// they are asked.
    by_name: [HashMap<String, usize>; 3],
    /// What the MTL has that is named as the OBJ: asked for what all others lack.
    namesake: Option<Box<Libraries>>,
}

impl Libraries {
    /// Reads what `mtllib` lines name and, as Blender does, the MTL that is named as the OBJ where that
    /// leaves some of its `materials` out. What is missing costs a warning.
    pub fn read(
        lines: &[String],
        materials: &[String],
        folder: &SceneFolder,
        limits: &Limits,
        warnings: &mut Warnings,
    ) -> Libraries {
        let mut out = Libraries::default();
        let missing = out.read_named(lines, folder, limits, warnings);
        let namesake = folder.with_extension("mtl");
        let found = out.read_namesake(&namesake, &out.lacking(materials), folder, limits, warnings);
        let namesake = format!("'{}', which is named as the OBJ, is read", printable(&namesake));
        let instead = format!("{namesake} instead");
        let then = if found { instead.as_str() } else { "its materials are shown matte white" };
        for why in &missing {
            warnings.add("", format!("MTL {why}; {then}"));
        }
        let lacking = out.lacking(materials);
        if lines.is_empty() && found {
            warnings.add("", format!("the file names no MTL: {namesake}"));
        } else if lines.is_empty() && !lacking.is_empty() {
            let count = lacking.len();
            let what = format!("the file names {count} materials and no MTL: they are shown matte white");
            warnings.add("", what);
        } else if missing.is_empty() && found {
            warnings.add("", format!("{namesake} for materials that the MTL lacks"));
        }
        // Where an MTL is missing, it is no wonder if materials are.
        if found || missing.is_empty() && !lines.is_empty() {
            for name in lacking {
                let name = printable(name);
                warnings.add("", format!("material '{name}' is not in the MTL: shown matte white"));
            }
        }
        out
    }

    /// Reads what `mtllib` lines name. Returns what could not be read, and why.
    fn read_named(
        &mut self,
        lines: &[String],
        folder: &SceneFolder,
        limits: &Limits,
        warnings: &mut Warnings,
    ) -> Vec<String> {
        let mut all_missing = Vec::new();
        // A file that is named a thousand times is read once.
        let mut known: HashMap<String, Result<(), String>> = HashMap::new();
        for line in lines {
            let read = |name: &str| {
                if let Some(outcome) = known.get(name) {
                    return outcome.clone().map(|()| None);
                }
                let bytes = textures::find(folder, "", name, limits.file_bytes);
                let bytes = bytes.map_err(|e| e.message().to_string());
                known.insert(name.to_string(), bytes.as_ref().map(drop).map_err(String::clone));
                Ok(Some((name.to_string(), bytes?)))
            };
            let (found, missing) = named(line, read);
            for (name, bytes) in found.into_iter().flatten() {
                self.parse(&name, &bytes, warnings);
            }
            all_missing.extend(missing);
        }
        all_missing
    }

    /// Reads the MTL of that name if it has any of the materials that are `lacking`: then true.
    fn read_namesake(
        &mut self,
        name: &str,
        lacking: &[&str],
        folder: &SceneFolder,
        limits: &Limits,
        warnings: &mut Warnings,
    ) -> bool {
        if lacking.is_empty() {
            return false;
        }
        let Ok(bytes) = textures::find_named(folder, "", name, limits.file_bytes) else { return false };
        let (mut namesake, mut told) = (Libraries::default(), Warnings::default());
        namesake.parse(name, &bytes, &mut told);
        if lacking.iter().all(|name| namesake.material(name).is_none()) {
            return false;
        }
        warnings.extend(told);
        self.namesake = Some(Box::new(namesake));
        true
    }

    /// Which of these materials have a name and are in no MTL.
    fn lacking<'a>(&self, materials: &'a [String]) -> Vec<&'a str> {
        let names = materials.iter().map(String::as_str);
        names.filter(|name| !name.is_empty() && self.material(name).is_none()).collect()
    }

    /// Adds the materials of an MTL.
    fn parse(&mut self, name: &str, bytes: &[u8], warnings: &mut Warnings) {
        let (text, guessed) = text::decode(bytes);
        let place = printable(name);
        if guessed {
            warnings.add(&place, "lines that are not UTF-8 were read as Windows-1252");
        }
        let unified = name.replace('\\', "/");
        let beside = unified.rsplit_once('/').map_or("", |(folder, _)| folder);
        for material in mtl::parse(&text, &place, beside, warnings) {
            self.add(material, &place, warnings);
        }
    }

    /// Adds a material. One that is given again counts as given last, as in other programs.
    fn add(&mut self, material: Mtl, place: &str, warnings: &mut Warnings) {
        let new = self.all.len();
        let (exact, bare) = (material.name.clone(), material.name.trim_matches('"').to_string());
        if self.by_name[0].contains_key(&exact) {
            warnings.add(place, format!("material '{}' is given again: the later counts", printable(&exact)));
        }
        if let Some(name) = text::without_comment(&bare) {
            self.by_name[2].entry(fold_case(name)).or_insert(new);
        }
        self.by_name[2].insert(fold_case(&bare), new);
        self.by_name[1].insert(decompose(&bare), new);
        self.by_name[0].insert(exact, new);
        self.all.push(material);
    }

    /// The material of that name: exactly, or else as exporters alter names, or else without what
    /// may be a comment.
    pub fn material(&self, name: &str) -> Option<&Mtl> {
        let [exact, bare, lower] = &self.by_name;
        let find = |name: &str| {
            let unquoted = name.trim_matches('"');
            let found = exact.get(name).or_else(|| bare.get(&decompose(unquoted)));
            self.all.get(*found.or_else(|| lower.get(&fold_case(unquoted)))?)
        };
        let namesake = || self.namesake.as_ref()?.material(name);
        text::readings(name).find_map(find).or_else(namesake)
    }
}

/// What a `mtllib` line names, read: the whole line as one name, or else each of its names that end in `.mtl`.
/// And what could not be read.
fn named<T>(line: &str, mut read: impl FnMut(&str) -> Result<T, String>) -> (Vec<T>, Vec<String>) {
    let whole = match read(line.trim_matches('"')) {
        Ok(found) => return (vec![found], Vec::new()),
        Err(why) => why,
    };
    let names = ending(line);
    let (mut found, mut missing) = (Vec::new(), Vec::new());
    for name in &names {
        let (f, m) = match read(name.trim_matches('"')) {
            Ok(one) => (vec![one], Vec::new()),
            Err(why) => worded(name, why, &mut read),
        };
        found.extend(f);
        missing.extend(m);
    }
    // Where nothing is there, the line is told of as it stands.
    if found.is_empty() { (found, vec![whole]) } else { (found, missing) }
}

/// What the words of a name that is not there as a whole name, which may be quoted; or else one name whose
/// spaces have backslashes. And what could not be read.
fn worded<T>(
    name: &str,
    whole: String,
    read: &mut impl FnMut(&str) -> Result<T, String>,
) -> (Vec<T>, Vec<String>) {
    let words = words(name);
    if words.len() > 1 || words.first().is_some_and(|&w| w != name.trim_matches('"')) {
        let (found, missing): (Vec<_>, Vec<_>) = words.iter().map(|w| read(w)).partition(Result::is_ok);
        if !found.is_empty() {
            return (
                found.into_iter().flatten().collect(),
                missing.into_iter().filter_map(Result::err).collect(),
            );
        }
        if let Ok(found) = read(&name.replace("\\ ", " ")) {
            return (vec![found], Vec::new());
        }
    }
    (Vec::new(), vec![whole])
}

/// A line cut behind each `.mtl`, up to a comment: several names on it may have spaces that nothing quotes.
/// A line with quotes is left whole.
fn ending(line: &str) -> Vec<&str> {
    let mut out = Vec::new();
    let mut rest = line.trim();
    let quoted = line.contains('"');
    let ends = |word: &str| !quoted && word.len() > 4 && word.to_ascii_lowercase().ends_with(".mtl");
    while !rest.is_empty() && !rest.starts_with('#') {
        let mut words = rest.split_inclusive(char::is_whitespace);
        let mut length = 0;
        // The first word that ends a name, or all of them.
        let _ = words.find(|word| {
            length += word.len();
            ends(word.trim_end())
        });
        let (name, after) = rest.split_at(length);
        out.push(name.trim_end());
        rest = after.trim_start();
    }
    out
}

/// Words of a line, quoted ones whole, up to a comment.
fn words(line: &str) -> Vec<&str> {
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

    /// Number signs begin comments, and names are looked up without them: not a million times.
    #[test]
    fn a_name_of_number_signs_does_no_harm() {
        let mut libraries = Libraries::default();
        for name in ["a", "a # b"] {
            let material = Mtl { name: name.into(), ..Mtl::default() };
            libraries.add(material, "a.mtl", &mut Warnings::default());
        }
        let found = |name: &str| libraries.material(name).map(|m| m.name.clone());
        assert_eq!(found("a # b # c").as_deref(), Some("a # b"));
        assert_eq!(found("a # c # c").as_deref(), Some("a"));
        assert_eq!(found(&"#".repeat(1 << 20)), None);
    }

    /// Programs on a Mac write some names with their accents apart.
    #[test]
    fn names_are_found_by_letters_put_together_in_another_way() {
        let mut libraries = Libraries::default();
        for name in ["Ka\u{308}se", "ka\u{308}se", "\u{fc}", "u\u{308}"] {
            let material = Mtl { name: name.into(), ..Mtl::default() };
            libraries.add(material, "a.mtl", &mut Warnings::default());
        }
        let found = |name: &str| libraries.material(name).map(|m| m.name.clone());
        for (name, expected) in [("K\u{e4}se", "Ka\u{308}se"), ("\"k\u{e4}se\"", "ka\u{308}se")] {
            assert_eq!(found(name).as_deref(), Some(expected), "{name}");
        }
        assert!(found("K\u{c4}SE").is_some() && found("Kase").is_none());
        // Each of two that look the same is found by its own letters.
        assert!(["\u{fc}", "u\u{308}"].iter().all(|name| found(name).as_deref() == Some(name)));
    }

    #[test]
    fn a_library_named_again_and_again_is_read_once() {
        let dir = tempfile::tempdir().unwrap();
        std::fs::write(dir.path().join("a.mtl"), "newmtl a\n").unwrap();
        let folder = SceneFolder::of(&dir.path().join("a.obj"), false);
        let lines = ["a.mtl a.mtl b.mtl", "a.mtl", "b.mtl a.mtl", "b.mtl b.mtl b.mtl"].map(String::from);
        let mut warnings = Warnings::default();
        let libraries = Libraries::read(&lines, &[], &folder, &Limits::default(), &mut warnings);
        assert_eq!(libraries.all.len(), 1);
        // Neither is a material given again, nor is the missing one told twice.
        let told = warnings.into_vec();
        assert_eq!(told.iter().filter(|w| w.message.contains("'b.mtl'")).count(), 1, "{told:?}");
        assert!(told.iter().all(|w| !w.message.contains("again")), "{told:?}");
    }

    /// Another name, if it is there, goes before.
    #[test]
    fn names_that_are_uris_are_found() {
        let dir = tempfile::tempdir().unwrap();
        let folder = SceneFolder::of(&dir.path().join("a.obj"), false);
        let read = || {
            let mut warnings = Warnings::default();
            let lines = ["my%20own.mtl".to_string()];
            let libraries = Libraries::read(&lines, &[], &folder, &Limits::default(), &mut warnings);
            (libraries.all.iter().map(|m| m.name.clone()).collect::<String>(), warnings.into_vec().len())
        };
        assert_eq!(read(), (String::new(), 1));
        std::fs::write(dir.path().join("my own.mtl"), "newmtl decoded\n").unwrap();
        assert_eq!(read(), ("decoded".into(), 0));
        std::fs::write(dir.path().join("my%20own.mtl"), "newmtl literal\n").unwrap();
        assert_eq!(read(), ("literal".into(), 0));
    }

    /// No name on it costs a look at all of the line.
    #[test]
    fn a_line_of_a_million_names_does_no_harm() {
        assert_eq!(ending(&"a.mtl ".repeat(1 << 20)).len(), 1 << 20);
    }

    #[test]
    fn lines_are_one_name_or_several_or_quoted_or_escaped() {
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
            // Several names on a line whose spaces nothing quotes.
            ("b c.mtl a.mtl", vec!["b c.mtl", "a.mtl"], 0),
            ("a.mtl b c.mtl # note", vec!["a.mtl", "b c.mtl"], 0),
            ("a.mtl b\\ c.mtl", vec!["a.mtl", "b c.mtl"], 0),
            ("a.mtl \"b c.mtl\" e.mtl", vec!["a.mtl", "b c.mtl", "e.mtl"], 0),
            ("x y.mtl b c.mtl", vec!["b c.mtl"], 1),
            ("x y.mtl z.mtl", vec![], 1),
        ] {
            let (f, m) = named(line, read);
            assert_eq!((f, m.len()), (found.into_iter().map(String::from).collect(), missing), "{line}");
        }
    }
}
