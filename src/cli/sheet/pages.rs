//! Pages of a contact sheet: the scenes on each, and their files.

use std::path::{Path, PathBuf, is_separator};

use super::grid::Grid;
use crate::args::SheetArgs;
use crate::plural::plural;
use blinn_output::ImageFormat;
use blinn_session::PathTemplate;

/// The pages of a contact sheet, which have one layout.
pub struct Pages {
    pub grid: Grid,
    /// The title of each page: the name of the folder of scenes, or that of the first file.
    title: String,
    /// Number of all scenes.
    scenes: usize,
    /// Number of scenes on each page but the last.
    per_page: usize,
    /// The file of the first page.
    first: PathBuf,
}

/// The place of a scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ScenePlace {
    /// Number of the page, from 0.
    pub page: usize,
    /// Number of the picture on the page, from 0.
    pub index: usize,
    /// True for the last picture of the page.
    pub is_last: bool,
}

impl Pages {
    /// The pages for several scenes if `-o` names one file for all; `None` if each scene has a sheet of its own.
    pub fn of_args(args: &SheetArgs, scenes: usize) -> Option<Pages> {
        let file = args.output.as_deref()?;
        let name = file.to_str()?;
        let is_one_file = PathTemplate::parse(name).is_literal()
            && ImageFormat::from_path(file).is_some()
            && !name.ends_with(is_separator)
            && !file.is_dir();
        if scenes < 2 || args.cameras.is_some() || !is_one_file {
            return None;
        }
        let folder = match &args.scene.scenes[..] {
            [one] if one.is_dir() => one.file_name(),
            _ => None,
        };
        let title = folder.or(file.file_stem()).unwrap_or_default().to_string_lossy().into_owned();
        Pages::new(file, title, scenes, args.size)
    }

    fn new(first: &Path, title: String, scenes: usize, size: (u32, u32)) -> Option<Pages> {
        let (grid, per_page) = Grid::readable(scenes, size)?;
        Some(Pages { grid, title, scenes, per_page, first: first.to_path_buf() })
    }

    /// The files of all pages.
    pub fn files(&self) -> impl Iterator<Item = PathBuf> {
        (0..self.count()).map(|page| self.file(page))
    }

    /// The file of a page, counted from 0: `contact.png`, `contact-2.png` and so on.
    pub fn file(&self, page: usize) -> PathBuf {
        if page == 0 {
            return self.first.clone();
        }
        let part = |part: Option<&std::ffi::OsStr>| part.unwrap_or_default().to_string_lossy().into_owned();
        let (stem, extension) = (part(self.first.file_stem()), part(self.first.extension()));
        self.first.with_file_name(format!("{stem}-{}.{extension}", page + 1))
    }

    /// The place of the scene of a number, from 1.
    pub fn place(&self, number: usize) -> ScenePlace {
        let before = number.saturating_sub(1);
        let index = before % self.per_page;
        let is_last = index + 1 == self.per_page || number == self.scenes;
        ScenePlace { page: before / self.per_page, index, is_last }
    }

    /// The title of all pages.
    pub fn title(&self) -> &str {
        &self.title
    }

    /// The note beside the title of a page, counted from 0.
    pub fn note(&self, page: usize) -> String {
        let scenes = plural(self.scenes as u64, "scene");
        match self.count() {
            1 => scenes,
            count => format!("{scenes}, page {} of {count}", page + 1),
        }
    }

    fn count(&self) -> usize {
        self.scenes.div_ceil(self.per_page)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scenes_fill_one_page_after_the_other() {
        // 84 pictures of a readable size are on a page.
        let pages = Pages::new(Path::new("out/all.png"), "parts".into(), 170, (1280, 960)).unwrap();
        let files: Vec<PathBuf> = pages.files().collect();
        assert_eq!(files, ["out/all.png", "out/all-2.png", "out/all-3.png"].map(PathBuf::from));
        let place = |page, index, is_last| ScenePlace { page, index, is_last };
        for (number, expected) in [
            (1, place(0, 0, false)),
            (84, place(0, 83, true)),
            (85, place(1, 0, false)),
            (169, place(2, 0, false)),
            (170, place(2, 1, true)),
        ] {
            assert_eq!(pages.place(number), expected, "{number}");
        }
        assert_eq!(pages.note(2), "170 scenes, page 3 of 3");
        let one = Pages::new(Path::new("all.webp"), String::new(), 2, (128, 4000)).unwrap();
        assert_eq!(one.files().collect::<Vec<_>>(), [PathBuf::from("all.webp")]);
        assert_eq!(one.note(0), "2 scenes");
    }
}
