//! Scene files on the command line, in `@FILE` lists, and in folders.

use std::fs::File;
use std::io::{self, BufRead, BufReader, Cursor, Read};
use std::path::{Path, PathBuf};

use crate::files::with_slashes;
use crate::scene_file::{is_stdin, scene_path};
use crate::usage::UsageError;
use blinn_import::{has_tar_extension, scenes_in_tar};
use blinn_session::{
    ForeignModels, PathList, PathListBuilder, decode_path, has_scene_extension, visit_scenes,
};

/// Bytes at the start of a list that its encoding and its separators are detected from.
const HEAD_BYTES: u64 = 1 << 16;

/// The scenes of a command line.
#[derive(Debug)]
pub struct SceneList {
    paths: PathList,
    /// The folder that names of scenes are relative to.
    root: PathBuf,
    /// True for several arguments, a list or a folder, however many scenes they hold.
    is_batch: bool,
    /// Models in folders of the command line whose formats are not read.
    foreign: Vec<(PathBuf, ForeignModels)>,
}

impl SceneList {
    /// Folders with models that are left out, and a sentence about them.
    pub fn left_out(&self) -> impl Iterator<Item = (&Path, String)> {
        self.foreign.iter().map(|(folder, models)| {
            (
                folder.as_path(),
                format!("left out {models}, whose formats blinn does not read; export them as .glb"),
            )
        })
    }

    /// Number of scenes, at least 1.
    pub fn len(&self) -> usize {
        self.paths.len()
    }

    /// True if the command line names several files, a list or a folder, however many scenes these hold.
    pub fn is_batch(&self) -> bool {
        self.is_batch
    }

    /// The scenes in order. An error of a long list's temporary file ends the iteration.
    pub fn iter(&self) -> impl Iterator<Item = Result<PathBuf, UsageError>> {
        self.paths.iter().map(|path| {
            path.map_err(|e| UsageError(format!("the temporary file of the scene list cannot be read: {e}")))
        })
    }

    /// The scenes of a list that is known to be short.
    ///
    /// # Errors
    /// As [`SceneList::iter`].
    pub fn to_vec(&self) -> Result<Vec<PathBuf>, UsageError> {
        self.iter().collect()
    }

    /// The first scene.
    ///
    /// # Errors
    /// As [`SceneList::iter`].
    pub fn first(&self) -> Result<PathBuf, UsageError> {
        self.iter().next().unwrap_or_else(|| Ok(PathBuf::new()))
    }

    /// The name of a scene: its path below the folder of all scenes, with slashes. It depends neither on where that folder is, nor
    /// on the order of the scenes.
    pub fn name(&self, scene: &Path) -> String {
        let scene = without_dot(scene);
        with_slashes(scene.strip_prefix(&self.root).unwrap_or(scene))
    }

    /// The only scene; `None` if there are several.
    pub fn single(&self) -> Option<PathBuf> {
        (self.len() == 1).then(|| self.iter().next())?.and_then(Result::ok)
    }
}

/// Expands scene arguments. `-` stands for a scene on standard input, a folder or a tar file for the scene files in it,
/// `@FILE` for the paths in FILE, one per line, and `@-` for those on standard input; empty lines and lines that begin
/// with `#` are skipped, and a line that ends in a slash is a folder, one that ends in `.tar` a tar file. A list is
/// UTF-8, or UTF-16 with a byte order mark. One that contains zero bytes has a path before each of them, as `find -print0` writes it.
pub fn scene_list(args: &[PathBuf]) -> Result<SceneList, UsageError> {
    let mut scenes = Expansion::default();
    for arg in args {
        match arg.to_str().and_then(|text| text.strip_prefix('@')) {
            Some(list) if !arg.exists() => {
                let error = |e: io::Error| UsageError(format!("@{list}: the list cannot be read: {e}"));
                scenes.add_list(list).map_err(error)?;
            }
            _ if has_tar_extension(arg) && arg.is_file() => {
                scenes.add_archive(arg).map_err(|e| UsageError(e.to_string()))?;
            }
            _ if arg.is_dir() => scenes.add_folder(arg).map_err(|e| UsageError(e.to_string()))?,
            _ => scenes.add(scene_path(arg)).map_err(|e| UsageError(e.to_string()))?,
        }
    }
    let is_list = |arg: &&PathBuf| arg.as_os_str() == "@-";
    if scenes.stdin_count + args.iter().filter(is_list).count() > 1 {
        return Err(UsageError("standard input can be read only once; name it once".into()));
    }
    if scenes.paths.count() == 0 {
        return Err(UsageError("the lists contain no scene".into()));
    }
    let is_batch = args.len() > 1 || scenes.is_expanded;
    let paths = scenes.paths.finish();
    let paths = paths.map_err(|e| UsageError(format!("the list of scenes cannot be stored: {e}")))?;
    Ok(SceneList { paths, root: scenes.root.unwrap_or_default(), is_batch, foreign: scenes.foreign })
}

/// The scenes that were found so far.
#[derive(Debug, Default)]
struct Expansion {
    paths: PathListBuilder,
    /// The innermost folder that holds all files, folders and archives that were named.
    root: Option<PathBuf>,
    /// How often standard input is a scene.
    stdin_count: usize,
    /// True after a list or a folder.
    is_expanded: bool,
    foreign: Vec<(PathBuf, ForeignModels)>,
}

impl Expansion {
    fn add(&mut self, scene: &Path) -> io::Result<()> {
        self.stdin_count += usize::from(is_stdin(scene));
        self.widen_root(scene.parent().unwrap_or(Path::new("")));
        self.paths.push(scene)
    }

    /// Makes the root one that holds `folder`, too.
    fn widen_root(&mut self, folder: &Path) {
        let folder = without_dot(folder);
        let root = self.root.take().unwrap_or_else(|| folder.to_path_buf());
        let holding = root.ancestors().find(|above| folder.starts_with(above));
        self.root = Some(holding.unwrap_or(Path::new("")).to_path_buf());
    }

    fn add_folder(&mut self, folder: &Path) -> io::Result<()> {
        self.is_expanded = true;
        self.widen_root(folder);
        let before = self.paths.count();
        let foreign = visit_scenes(folder, &mut |scene| self.paths.push(scene))?;
        if self.paths.count() == before {
            let folder = folder.display();
            let mut text =
                format!("{folder}: a folder without .gltf, .glb, .obj, .stl, .ply or .blend files");
            if !foreign.is_empty() {
                text += &format!("; it has {foreign}: export them as .glb");
            }
            return Err(io::Error::new(io::ErrorKind::NotFound, text));
        }
        if !foreign.is_empty() {
            self.foreign.push((folder.to_path_buf(), foreign));
        }
        Ok(())
    }

    /// Adds the scenes in a tar file.
    fn add_archive(&mut self, file: &Path) -> io::Result<()> {
        self.is_expanded = true;
        self.widen_root(file);
        let with_path = |e: io::Error| io::Error::new(e.kind(), format!("{}: {e}", file.display()));
        let scenes = scenes_in_tar(file, has_scene_extension).map_err(with_path)?;
        if scenes.is_empty() {
            return Err(with_path(io::Error::other(
                "a tar file without .gltf, .glb, .obj, .stl or .ply files",
            )));
        }
        scenes.iter().try_for_each(|scene| self.paths.push(scene))
    }

    /// Adds the paths of a list, which is read piece by piece.
    fn add_list(&mut self, list: &str) -> io::Result<()> {
        self.is_expanded = true;
        let mut input: Box<dyn Read> =
            if list == "-" { Box::new(io::stdin().lock()) } else { Box::new(File::open(list)?) };
        let mut head = Vec::new();
        input.by_ref().take(HEAD_BYTES).read_to_end(&mut head)?;
        match head[..] {
            [0xff, 0xfe, ..] | [0xfe, 0xff, ..] => {
                input.read_to_end(&mut head)?;
                return self.add_lines(Cursor::new(from_utf16(&head)?), b'\n');
            }
            [0xef, 0xbb, 0xbf, ..] => drop(head.drain(..3)),
            _ => {}
        }
        let separator = if head.contains(&0) { 0 } else { b'\n' };
        self.add_lines(BufReader::new(Cursor::new(head).chain(input)), separator)
    }

    fn add_lines(&mut self, mut input: impl BufRead, separator: u8) -> io::Result<()> {
        let mut line = Vec::new();
        while input.read_until(separator, &mut line)? > 0 {
            if line.last() == Some(&separator) {
                line.pop();
            }
            let text = if separator == 0 { &line[..] } else { line.trim_ascii() };
            if !(text.is_empty() || separator != 0 && text.starts_with(b"#")) {
                let path = decode_path(text);
                if text.ends_with(b"/") {
                    self.add_folder(&path)?;
                } else if has_tar_extension(&path) {
                    self.add_archive(&path)?;
                } else {
                    self.add(&path)?;
                }
            }
            line.clear();
        }
        Ok(())
    }
}

/// A path without `./` at its start.
fn without_dot(path: &Path) -> &Path {
    path.strip_prefix(".").unwrap_or(path)
}

/// Converts UTF-16 with a byte order mark to UTF-8.
fn from_utf16(bytes: &[u8]) -> io::Result<Vec<u8>> {
    let unit = if bytes[0] == 0xff { u16::from_le_bytes } else { u16::from_be_bytes };
    let (pairs, rest) = bytes[2..].as_chunks::<2>();
    let text = String::from_utf16(&pairs.iter().map(|pair| unit(*pair)).collect::<Vec<_>>()).ok();
    let text = text.filter(|_| rest.is_empty()).ok_or_else(|| io::Error::other("invalid UTF-16"))?;
    Ok(text.into_bytes())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(bytes: &[u8]) -> Vec<PathBuf> {
        let dir = tempfile::tempdir().unwrap();
        let file = dir.path().join("list");
        std::fs::write(&file, bytes).unwrap();
        expand(&[format!("@{}", file.display()).into()]).unwrap()
    }

    fn expand(args: &[PathBuf]) -> Result<Vec<PathBuf>, UsageError> {
        scene_list(args)?.to_vec()
    }

    #[test]
    fn a_list_has_one_path_per_line() {
        let found = parse(b"a.glb\r\n\n # no\n  b c.obj \n#d\nlast.gltf");
        assert_eq!(found, ["a.glb", "b c.obj", "last.gltf"].map(PathBuf::from));
    }

    #[test]
    fn zero_bytes_separate_paths_of_any_characters() {
        let found = parse(b"#a.glb\0 b.obj \0two\nlines.glb\0");
        assert_eq!(found, ["#a.glb", " b.obj ", "two\nlines.glb"].map(PathBuf::from));
    }

    #[test]
    fn byte_order_marks_and_utf16_are_supported() {
        let dir = tempfile::tempdir().unwrap();
        let file = dir.path().join("list");
        let named = |bytes: &[u8]| {
            std::fs::write(&file, bytes).unwrap();
            expand(&[format!("@{}", file.display()).into()])
        };
        let text = "a.glb\r\nstühle 🪑.glb\n";
        let utf16 = |to: fn(u16) -> [u8; 2]| -> Vec<u8> {
            "\u{feff}".encode_utf16().chain(text.encode_utf16()).flat_map(to).collect()
        };
        for bytes in
            [format!("\u{feff}{text}").into_bytes(), utf16(u16::to_le_bytes), utf16(u16::to_be_bytes)]
        {
            assert_eq!(named(&bytes).unwrap(), ["a.glb", "stühle 🪑.glb"].map(PathBuf::from));
        }
        for broken in [&b"\xff\xfea"[..], b"\xff\xfe\x00\xd8a\x00", b"\xfe\xff\xd8\x00"] {
            assert!(named(broken).unwrap_err().0.contains("invalid UTF-16"));
        }
        assert!(named(b"\xff\xfe").unwrap_err().0.contains("contain no scene"));
    }

    #[test]
    fn standard_input_is_one_scene() {
        let list = |args: &[&str]| expand(&args.iter().map(PathBuf::from).collect::<Vec<_>>());
        assert_eq!(list(&["a.glb", "-"]).unwrap(), ["a.glb", "/dev/stdin"].map(PathBuf::from));
        for args in [&["-", "-"][..], &["-", "/dev/stdin"]] {
            assert!(list(args).unwrap_err().0.contains("only once"), "{args:?}");
        }
    }

    #[test]
    fn lists_are_expanded_in_place() {
        let dir = tempfile::tempdir().unwrap();
        let file = dir.path().join("list");
        std::fs::write(&file, "b.glb\nc.glb\n").unwrap();
        let at = format!("@{}", file.display());
        let args = ["a.glb", &at, "d.glb"].map(PathBuf::from);
        assert_eq!(expand(&args).unwrap(), ["a.glb", "b.glb", "c.glb", "d.glb"].map(PathBuf::from));
        std::fs::write(&file, "\n").unwrap();
        assert!(expand(&args[1..2]).unwrap_err().0.contains("contain no scene"));
        assert!(expand(&["@missing".into()]).unwrap_err().0.contains("@missing"));
    }

    #[test]
    fn folders_and_lines_with_a_slash_are_searched() {
        let dir = tempfile::tempdir().unwrap();
        let at = |name: &str| dir.path().join(name);
        std::fs::create_dir_all(at("models/b")).unwrap();
        for name in ["models/b/2.glb", "models/b/1.obj", "models/a.gltf", "models/b/1.mtl"] {
            std::fs::write(at(name), "").unwrap();
        }
        let expected = ["models/a.gltf", "models/b/1.obj", "models/b/2.glb"].map(at);
        let list = scene_list(&[at("models")]).unwrap();
        assert!(list.is_batch() && list.single().is_none());
        assert_eq!(list.to_vec().unwrap(), expected);
        std::fs::write(at("list"), format!("{}/\n", at("models").display())).unwrap();
        assert_eq!(expand(&[format!("@{}", at("list").display()).into()]).unwrap(), expected);
        std::fs::create_dir(at("empty")).unwrap();
        let error = expand(&[at("empty")]).unwrap_err().0;
        assert!(error.contains("a folder without .gltf, .glb, .obj, .stl, .ply or .blend files"), "{error}");
    }

    #[test]
    fn several_arguments_and_lists_are_batches() {
        let is_batch = |args: &[PathBuf]| scene_list(args).unwrap().is_batch();
        assert!(!is_batch(&["a.glb".into()]) && is_batch(&["a.glb".into(), "b.glb".into()]));
        let dir = tempfile::tempdir().unwrap();
        let file = dir.path().join("list");
        std::fs::write(&file, "a.glb\n").unwrap();
        assert!(is_batch(&[format!("@{}", file.display()).into()]));
    }

    /// The same scenes have the same names in another order, elsewhere, and however they are named.
    #[test]
    fn names_are_relative_to_the_folder_of_all_scenes() {
        let names = |args: &[&str]| {
            let list = scene_list(&args.iter().map(PathBuf::from).collect::<Vec<_>>()).unwrap();
            list.iter().map(|path| list.name(&path.unwrap())).collect::<Vec<_>>()
        };
        assert_eq!(names(&["in/a/m.glb", "in/b/m.glb"]), ["a/m.glb", "b/m.glb"]);
        assert_eq!(names(&["/data/in/b/m.glb", "/data/in/a/m.glb"]), ["b/m.glb", "a/m.glb"]);
        assert_eq!(names(&["./in/a/m.glb", "in/ab/m.glb"]), ["a/m.glb", "ab/m.glb"]);
        assert_eq!(names(&["a.glb", "in/b.glb"]), ["a.glb", "in/b.glb"]);
        assert_eq!(names(&["in/a.glb"]), ["a.glb"]);
        let dir = tempfile::tempdir().unwrap();
        std::fs::create_dir_all(dir.path().join("models/only")).unwrap();
        std::fs::write(dir.path().join("models/only/m.glb"), "").unwrap();
        // A folder keeps the names of its scenes when others are added.
        assert_eq!(names(&[dir.path().join("models").to_str().unwrap()]), ["only/m.glb"]);
    }

    /// A long list is split wherever the blocks that it is read in end.
    #[test]
    fn a_long_list_is_read_piece_by_piece() {
        let names: Vec<String> = (0..20_000).map(|i| format!("objects/{i:06}.glb")).collect();
        for separator in ["\n", "\0"] {
            let found = parse(names.join(separator).as_bytes());
            assert!(found.iter().zip(&names).all(|(found, name)| found == Path::new(name)));
            assert_eq!(found.len(), names.len());
        }
    }
}
