//! A page of a contact sheet.

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use anyhow::Result;
use serde_json::{Value, json};

use super::contact_cell::{CellPicture, PageIsInput};
use super::labels::{GridLabels, draw_grid};
use super::pages::Pages;
use blinn_output::Canvas;

/// A page with the pictures of the scenes so far.
pub struct ContactPage {
    /// Width in pixels.
    width: u32,
    canvas: Canvas,
    scenes: Vec<PathBuf>,
    /// Descriptions of the pictures.
    cells: Vec<Value>,
    /// True if the page would overwrite a file of one of its scenes.
    is_input: bool,
}

impl ContactPage {
    /// Creates a page of one colour.
    pub fn new(size: (u32, u32), color: [u8; 4]) -> ContactPage {
        ContactPage {
            width: size.0,
            canvas: Canvas::new(size, color),
            scenes: Vec::new(),
            cells: Vec::new(),
            is_input: false,
        }
    }

    /// Adds the next scene: its picture, or an empty place if it has failed with the line `failure`.
    pub fn add(&mut self, scene: &Path, output: Result<CellPicture>, failure: Option<&str>) {
        let mut description = match output {
            Ok(CellPicture { cell, pixels, exposure }) => {
                self.canvas.copy(&pixels, cell.view.size.0, cell.origin);
                let mut description = cell.describe();
                description["exposure"] = json!(exposure);
                description
            }
            Err(error) => {
                self.is_input |= error.is::<PageIsInput>();
                json!({"error": failure})
            }
        };
        description["scene"] = json!(scene.to_string_lossy());
        self.cells.push(description);
        self.scenes.push(scene.to_path_buf());
    }

    /// True if the page must not be written, as a scene on it has failed because of that.
    pub fn is_input(&self) -> bool {
        self.is_input
    }

    /// Draws the labels of the page of a number, from 0. Returns the pixels and the descriptions of the pictures.
    pub fn finish(mut self, pages: &Pages, number: usize, on_light: bool) -> (Vec<[u8; 4]>, Value) {
        let names = captions(&self.scenes);
        let names: Vec<&str> = names.iter().map(String::as_str).collect();
        let note = pages.note(number);
        let labels = GridLabels { title: pages.title(), note: &note, names: &names, on_light };
        draw_grid(&mut self.canvas, &pages.grid, self.width, &labels);
        (self.canvas.into_pixels(), Value::Array(self.cells))
    }
}

/// The names of files; equal ones have the name of their folder before them.
fn captions(files: &[PathBuf]) -> Vec<String> {
    let file_name = |file: &Path| file.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let mut counts: HashMap<String, usize> = HashMap::new();
    for file in files {
        *counts.entry(file_name(file)).or_default() += 1;
    }
    let caption = |file: &PathBuf| {
        let name = file_name(file);
        let is_shared = counts.get(&name).is_some_and(|count| *count > 1);
        match file.parent().and_then(Path::file_name).filter(|_| is_shared) {
            Some(folder) => format!("{}/{name}", folder.to_string_lossy()),
            None => name,
        }
    };
    files.iter().map(caption).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_names_have_their_folders() {
        let files = ["parts/chair/scene.gltf", "parts/table/scene.gltf", "parts/lamp.glb", "scene.gltf"];
        let expected = ["chair/scene.gltf", "table/scene.gltf", "lamp.glb", "scene.gltf"];
        assert_eq!(captions(&files.map(PathBuf::from)), expected);
    }
}
