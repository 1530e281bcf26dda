//! From a reference in a file to bytes, without leaving the scene's folder.

use std::collections::HashMap;
use std::io;
use std::path::{Component, MAIN_SEPARATOR, Path, PathBuf};
use std::sync::Mutex;

use percent_encoding::percent_decode_str;

use crate::import::error::LoadError;
use crate::import::files::data_uri;
use crate::import::files::name_match;
use crate::import::files::read_file::{no_pointer, read_limited};
use crate::import::files::source_tracker::Found;
use crate::scene::Content;

/// The folder that a scene's references are relative to.
#[derive(Debug)]
pub(crate) struct Folder {
    path: PathBuf,
    /// The scene's own name, without what says its format.
    scene: String,
    allow_outside: bool,
    /// What was in the files that were looked for, by names relative to this folder.
    pub found: Found,
    /// What is in folders that names were looked for in, by what all that are alike have in common. Thousands of
    /// files may be missing, and thousands be there.
    listed: Mutex<HashMap<PathBuf, HashMap<String, Vec<String>>>>,
}

/// Why a reference gives no bytes. The text completes "…: ".
#[derive(Debug)]
pub(crate) enum Unreadable {
    /// It would leave the folder, or is no file name at all.
    Refused(String),
    /// There is no such file, or it cannot be read.
    Missing(String),
    /// There is one, of more bytes than were allowed.
    TooLarge {
        /// All of that.
        text: String,
        /// How many bytes it has.
        bytes: u64,
    },
}

impl Unreadable {
    pub fn text(&self) -> &str {
        match self {
            Unreadable::Refused(text) | Unreadable::Missing(text) | Unreadable::TooLarge { text, .. } => text,
        }
    }

    /// What is too large is no picture without it, but none at all: who set the limit wants to know.
    pub fn over_limit(&self, allowed: u64) -> Option<LoadError> {
        match *self {
            Unreadable::TooLarge { bytes, .. } => {
                Some(LoadError::Limit { name: "file size in bytes", asked: bytes, allowed })
            }
            _ => None,
        }
    }
}

impl Folder {
    /// The folder that holds `scene`.
    pub fn of(scene: &Path, allow_outside: bool) -> Folder {
        let parent = scene.parent().filter(|p| !p.as_os_str().is_empty());
        let path = parent.unwrap_or(Path::new(".")).to_path_buf();
        let scene = scene.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        Folder { path, scene, allow_outside, found: Found::default(), listed: Mutex::default() }
    }

    /// What a file is called that goes with the scene and is named as it is.
    pub fn namesake(&self, extension: &str) -> String {
        format!("{}.{extension}", self.scene)
    }

    /// Reads what a glTF URI names: a data URI, or a file by its percent-encoded relative path.
    pub fn read_uri(&self, uri: &str, limit: u64) -> Result<Vec<u8>, Unreadable> {
        let trimmed = uri.trim();
        if trimmed.get(..5).is_some_and(|s| s.eq_ignore_ascii_case("data:")) {
            return data_uri::decode(trimmed, limit).map_err(Unreadable::Refused);
        }
        let decode = |uri: &str| percent_decode_str(uri).decode_utf8_lossy().into_owned();
        // The decoded name first; a file may also be named with a literal '%20', and '?v=3' be for a server. What is
        // nowhere by its exact name may be there by one that is alike.
        let path = uri.split(['?', '#']).next().unwrap_or(uri);
        let mut names = vec![decode(uri)];
        for name in [uri.into(), decode(path)] {
            if !names.contains(&name) {
                names.push(name);
            }
        }
        let missing = |found: &Result<_, _>| matches!(found, Err(Unreadable::Missing(_)));
        let mut found = self.read_file(&names[0], limit);
        for name in &names[1..] {
            if missing(&found) {
                found = self.read_file(name, limit);
            }
        }
        if missing(&found) {
            let others = names.iter().filter_map(|name| self.alike(name));
            let other = others.map(|name| self.read_file(&name, limit)).find(|other| !missing(other));
            found = other.unwrap_or(found);
        }
        found
    }

    /// Reads a file by a relative path as files of any system write it.
    pub fn read_file(&self, name: &str, limit: u64) -> Result<Vec<u8>, Unreadable> {
        let path = match self.resolve(name) {
            Ok(path) => path,
            Err(refused @ Unreadable::Refused(_)) => return Err(refused),
            Err(e) => {
                self.found.file(self.relative(name), Content::Unread);
                return Err(e);
            }
        };
        let read = read_limited(&path, limit);
        let content = read.as_ref().map_or(Content::Unread, |bytes| Content::of(bytes));
        self.found.file(self.relative(name), content);
        match read.and_then(no_pointer) {
            Ok(bytes) => Ok(bytes),
            Err(e) => {
                let text = format!("'{}' cannot be read: {e}", printable(name));
                match std::fs::metadata(&path) {
                    Ok(file) if e.kind() == io::ErrorKind::FileTooLarge => {
                        Err(Unreadable::TooLarge { text, bytes: file.len() })
                    }
                    _ => Err(Unreadable::Missing(text)),
                }
            }
        }
    }

    /// A name of a file that is there and differs from `name` alone in the case of letters and in what
    /// they are put together from, in its folders' names too.
    pub fn alike(&self, name: &str) -> Option<String> {
        let unified = self.relative(name);
        let mut found = String::from(".");
        for part in unified.split('/').filter(|part| !part.is_empty() && *part != ".") {
            // Not put together anew for each part: a name may be a million times the way up.
            if part == ".." {
                found.push_str("/..");
                continue;
            }
            let exact = format!("{found}/{part}");
            if self.resolve(&exact).is_ok_and(|path| path.exists()) {
                found = exact;
                continue;
            }
            let other = self.alike_in(&found, part)?;
            found = format!("{found}/{other}");
        }
        Some(found)
    }

    /// What in this folder is named like `part`.
    fn alike_in(&self, folder: &str, part: &str) -> Option<String> {
        let path = self.resolve(folder).ok()?;
        let mut listed = self.listed.lock().unwrap_or_else(|e| e.into_inner());
        let listed = listed.entry(path).or_insert_with_key(|path| {
            let mut there: HashMap<String, Vec<String>> = HashMap::new();
            let entries = std::fs::read_dir(path).into_iter().flatten().flatten();
            for name in entries.filter_map(|entry| entry.file_name().into_string().ok()) {
                there.entry(name_match::caseless(&name)).or_default().push(name);
            }
            there
        });
        // One in the same case, or the first by name, so that the same folder always gives the same answer.
        let apart = name_match::apart(part);
        let alike = listed.get(&name_match::caseless(part))?.iter();
        alike.min_by_key(|&name| (name_match::apart(name) != apart, name)).cloned()
    }

    /// A name with this system's slashes and as few steps up as there can be; and relative where it is a whole path
    /// that leads through this folder, or one that leaves it and comes back: judged by its words alone, so that
    /// nothing elsewhere is asked whether it is there.
    fn relative(&self, name: &str) -> String {
        let name = name.replace('\\', "/");
        // A whole path, as a URI has it.
        let local = ["file://localhost", "file://"].iter().find_map(|front| name.strip_prefix(front));
        let name = local.filter(|path| path.starts_with('/')).unwrap_or(&name);
        if name.contains("://") {
            return name.to_string();
        }
        let path = without_detours(Path::new(name));
        let inside = if path.is_absolute() || path.starts_with("..") {
            let homes = [std::path::absolute(&self.path), self.path.canonicalize()];
            let inside =
                |home: &PathBuf| without_detours(&home.join(&path)).strip_prefix(home).map(PathBuf::from);
            homes.iter().flatten().find_map(|home| inside(home).ok())
        } else {
            None
        };
        inside.unwrap_or(path).to_string_lossy().replace(MAIN_SEPARATOR, "/")
    }

    /// The path of `name`, proved to lie within the folder unless that is not asked for.
    pub fn resolve(&self, name: &str) -> Result<PathBuf, Unreadable> {
        let refuse = |why: &str| Err(Unreadable::Refused(format!("'{}' {why}", printable(name))));
        if name.is_empty() || name.contains('\0') {
            return refuse("is not a file name");
        }
        let relative = self.relative(name);
        let outside = "leads out of the scene's folder and was not read (--allow-outside would)";
        // Without slashes a colon is a letter of a name, but for a drive's, which is a path's prefix where
        // there are drives.
        if relative.contains("://") {
            return refuse("is not a file beside the scene and was not read");
        }
        if self.allow_outside {
            return Ok(self.path.join(relative));
        }
        let mut depth = 0i32;
        for part in Path::new(&relative).components() {
            match part {
                Component::Normal(_) => depth += 1,
                Component::CurDir => {}
                Component::ParentDir => depth -= 1,
                Component::RootDir | Component::Prefix(_) => return refuse(outside),
            }
            if depth < 0 {
                return refuse(outside);
            }
        }
        let path = self.path.join(&relative);
        // A symbolic link may still lead away.
        let missing =
            |e: io::Error| Unreadable::Missing(format!("'{}' cannot be read: {e}", printable(name)));
        let real = path.canonicalize().map_err(missing)?;
        let home = self.path.canonicalize().map_err(missing)?;
        if real.starts_with(&home) { Ok(real) } else { refuse(outside) }
    }
}

/// A path without steps that stay, and without those down that the next one up takes back, as URIs mean it: whether
/// the folder between is there does not matter.
fn without_detours(path: &Path) -> PathBuf {
    let mut straight = PathBuf::new();
    for step in path.components() {
        match (step, straight.components().next_back()) {
            (Component::CurDir, _) => {}
            (Component::ParentDir, Some(Component::Normal(_))) => {
                straight.pop();
            }
            _ => straight.push(step),
        }
    }
    straight
}

/// A name fit for a line of text: control characters shown, long ones cut.
pub(crate) fn printable(name: &str) -> String {
    let mut text: String = name
        .chars()
        .take(120)
        .flat_map(|c| {
            // What turns the direction of writing shows a name as another.
            let turns = matches!(c, '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}');
            let escaped =
                if c.is_control() || turns { c.escape_default().collect::<String>() } else { c.to_string() };
            escaped.chars().collect::<Vec<_>>()
        })
        .collect();
    if name.chars().count() > 120 {
        text.push('…');
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    fn folder() -> (tempfile::TempDir, Folder) {
        let dir = tempfile::tempdir().unwrap();
        std::fs::write(dir.path().join("canary"), b"outside").unwrap();
        let inside = dir.path().join("scene");
        std::fs::create_dir_all(inside.join("tex")).unwrap();
        std::fs::write(inside.join("tex/a b.png"), b"inside").unwrap();
        let folder = Folder::of(&inside.join("scene.gltf"), false);
        (dir, folder)
    }

    #[test]
    fn names_inside_are_read_however_they_are_written() {
        let (_dir, folder) = folder();
        for uri in ["tex/a b.png", "tex/a%20b.png", "tex\\a b.png", "./tex/a b.png", "tex/../tex/a b.png"] {
            assert_eq!(folder.read_uri(uri, 100).unwrap(), b"inside", "{uri}");
        }
        assert_eq!(folder.read_uri(" DATA:;base64,aGk =", 100).unwrap(), b"hi");
    }

    #[test]
    fn a_name_of_a_million_ways_up_does_no_harm() {
        let (_dir, folder) = folder();
        assert_eq!(folder.alike(&format!("{}a.png", "../".repeat(1 << 20))), None);
    }

    /// Exporters write textures' whole paths, which may still be right.
    #[test]
    fn whole_paths_into_the_folder_are_read() {
        let (dir, folder) = folder();
        let whole = |name: &str| dir.path().join("scene").join(name).to_string_lossy().into_owned();
        assert_eq!(folder.read_file(&whole("tex/a b.png"), 100).unwrap(), b"inside");
        #[cfg(unix)]
        {
            std::os::unix::fs::symlink(dir.path().join("scene"), dir.path().join("other")).unwrap();
            let folder = Folder::of(&dir.path().join("other/scene.gltf"), false);
            for way in ["scene/tex/a b.png", "other/tex/a b.png"] {
                let path = dir.path().canonicalize().unwrap().join(way);
                assert_eq!(folder.read_file(&path.to_string_lossy(), 100).unwrap(), b"inside", "{way}");
            }
            std::os::unix::fs::symlink(dir.path().join("canary"), dir.path().join("scene/link")).unwrap();
        }
        for name in ["../canary", "tex/../../canary", "link", ""] {
            assert!(folder.read_file(&whole(name), 100).is_err(), "{name}");
        }
    }

    /// As URIs are resolved: a folder that a name only passes through need not be there.
    #[test]
    fn steps_up_take_steps_down_back() {
        let (dir, folder) = folder();
        let here = std::path::absolute(dir.path().join("scene/tex/a b.png")).unwrap();
        let here = here.to_str().unwrap().replace(' ', "%20");
        for uri in ["none/../tex/a b.png", "../scene/tex/a b.png", "tex/../../scene/./tex//a b.png"] {
            assert_eq!(folder.read_uri(uri, 100).unwrap(), b"inside", "{uri}");
        }
        for uri in [format!("file://{here}"), format!("file://localhost{here}")] {
            assert_eq!(folder.read_uri(&uri, 100).unwrap(), b"inside", "{uri}");
        }
        for uri in ["none/../../canary", "../other/tex/a b.png", "file://tex/a b.png"] {
            assert!(matches!(folder.read_uri(uri, 100), Err(Unreadable::Refused(_))), "{uri}");
        }
    }

    #[test]
    fn what_is_for_a_server_is_no_part_of_a_name_unless_a_file_has_it() {
        let (dir, folder) = folder();
        for uri in ["tex/a%20b.png?v=3", "tex/a b.png?v=3#top", "tex/a%20b.png#top"] {
            assert_eq!(folder.read_uri(uri, 100).unwrap(), b"inside", "{uri}");
        }
        std::fs::write(dir.path().join("scene/tex/a b.png#top"), b"own").unwrap();
        assert_eq!(folder.read_uri("tex/a%20b.png#top", 100).unwrap(), b"own");
        let missing = folder.read_uri("none.png?v=3", 100).unwrap_err();
        assert!(missing.text().starts_with("'none.png' cannot be read: "), "{missing:?}");
    }

    /// Where a file was made, the case of letters may not have counted.
    #[test]
    fn what_is_missing_is_found_in_another_case() {
        let (dir, mut folder) = folder();
        for uri in ["Tex/A%20b.PNG", "TEX\\A B.png", "tex/../Tex/A b.png?v=3", "./tex/a%20B.png"] {
            assert_eq!(folder.read_uri(uri, 100).unwrap(), b"inside", "{uri}");
        }
        // A name that is there by its letter goes first, in whichever way it is written.
        std::fs::write(dir.path().join("scene/%41.png"), b"as written").unwrap();
        std::fs::write(dir.path().join("scene/A.PNG"), b"other case").unwrap();
        folder = Folder::of(&dir.path().join("scene/scene.gltf"), false);
        assert_eq!(folder.read_uri("%41.png", 100).unwrap(), b"as written");
        std::fs::remove_file(dir.path().join("scene/%41.png")).unwrap();
        assert_eq!(folder.read_uri("%41.png", 100).unwrap(), b"other case");
        assert!(matches!(folder.read_uri("a.png", 5), Err(Unreadable::TooLarge { bytes: 10, .. })));
        let missing = folder.read_uri("tex/B.png", 100).unwrap_err();
        assert!(missing.text().starts_with("'tex/B.png' cannot be read: "), "{missing:?}");
        // The same may be read as by an exact name: nothing outside.
        #[cfg(unix)]
        std::os::unix::fs::symlink(dir.path().join("canary"), dir.path().join("scene/link")).unwrap();
        folder = Folder::of(&dir.path().join("scene/scene.gltf"), false);
        for uri in ["../Canary", "Tex/../../Canary", "LINK", "../SCENE/../canary"] {
            assert!(folder.read_uri(uri, 100).is_err(), "{uri}");
        }
    }

    #[test]
    fn a_folder_is_looked_through_once() {
        let (dir, folder) = folder();
        assert!(folder.alike("tex/C.png").is_none());
        std::fs::write(dir.path().join("scene/tex/c.png"), b"too late").unwrap();
        assert!(folder.alike("tex/C.png").is_none());
        assert!(Folder::of(&dir.path().join("scene/scene.gltf"), false).alike("tex/C.png").is_some());
    }

    /// A Mac's disks took letters with accents apart, and archives keep them so.
    #[test]
    fn what_is_missing_is_found_by_letters_put_together_in_another_way() {
        let (dir, _) = folder();
        let there = |name: &str| {
            std::fs::write(dir.path().join("scene/tex").join(name), name).unwrap();
            Folder::of(&dir.path().join("scene/scene.gltf"), false)
        };
        let apart = "u\u{308}.png";
        let mut folder = there(apart);
        for uri in ["tex/%C3%BC.png", "tex/\u{fc}.png", "TEX/\u{dc}.PNG"] {
            assert_eq!(folder.read_uri(uri, 100).unwrap(), apart.as_bytes(), "{uri}");
        }
        // A file in the same case goes before one in another, and the exact name before both.
        folder = there("U\u{308}.png");
        assert_eq!(folder.read_uri("tex/\u{fc}.png", 100).unwrap(), apart.as_bytes());
        folder = there("\u{fc}.png");
        assert_eq!(folder.read_uri("tex/%C3%BC.png", 100).unwrap(), "\u{fc}.png".as_bytes());
        assert!(folder.read_uri("tex/u.png", 100).is_err());
    }

    #[test]
    #[cfg(unix)]
    fn a_colon_is_a_letter_of_a_name() {
        let (dir, folder) = folder();
        std::fs::write(dir.path().join("scene/c:d.png"), b"inside").unwrap();
        for uri in ["c:d.png", "c%3Ad.png", "./c:d.png"] {
            assert_eq!(folder.read_uri(uri, 100).unwrap(), b"inside", "{uri}");
        }
        let missing = folder.read_uri("c:e.png", 100).unwrap_err();
        assert!(missing.text().starts_with("'c:e.png' cannot be read: "), "{missing:?}");
    }

    #[test]
    fn nothing_outside_is_read() {
        let (dir, folder) = folder();
        let absolute = dir.path().join("canary").to_string_lossy().into_owned();
        #[cfg(unix)]
        std::os::unix::fs::symlink(dir.path().join("canary"), dir.path().join("scene/link")).unwrap();
        let file_uri = format!("file://{absolute}");
        for uri in [
            "../canary",
            "%2e%2e/canary",
            "..\\canary",
            "tex/../../canary",
            &absolute,
            &file_uri,
            "http://localhost/canary",
            "C:\\canary",
            "C:canary",
            "\\\\host\\share",
            "link",
            "/proc/self/environ",
            "",
            "canary\0",
            "tex",
        ] {
            assert!(folder.read_uri(uri, 100).is_err(), "{uri}");
        }
        let allowed = Folder { allow_outside: true, ..folder };
        assert_eq!(allowed.read_uri("../canary", 100).unwrap(), b"outside");
    }

    #[test]
    fn names_are_fit_for_a_line() {
        assert_eq!(printable("a\x1b[31m\n\u{202e}b é"), r"a\u{1b}[31m\n\u{202e}b é");
        assert_eq!(printable(&"x".repeat(200)).chars().count(), 121);
    }

    #[test]
    fn sizes_are_limited() {
        let (_dir, folder) = folder();
        assert!(folder.read_uri("tex/a b.png", 6).is_ok());
        assert!(folder.read_uri("tex/a b.png", 5).is_err());
    }
}
