//! The annotations of several scenes as one dataset of COCO.

use std::io::{self, Write};

use serde_json::{Map, Value, json};

use super::coco::{CocoCategory, CocoDataset};

/// The annotations of several datasets of [`CocoDataset`], whose categories are united by their names. Categories and images are
/// in memory, masks are not: the texts of all datasets are read twice.
#[derive(Clone, Debug, Default)]
pub struct CocoMerge {
    categories: Vec<String>,
    images: Vec<String>,
    /// Number of annotations that were written.
    annotations: u64,
    /// For each category, true if an annotation has it.
    is_used: Vec<bool>,
}

/// The dataset of a scene.
#[derive(Clone, Copy, Debug)]
pub struct CocoPart<'t> {
    /// The text of its file.
    pub text: &'t str,
    /// The folder of its images, relative to that of the merged file, with slashes.
    pub folder: &'t str,
    /// Added to the ids of its images.
    pub first_image: i64,
}

/// A text that [`CocoDataset`] did not write.
#[derive(Debug, thiserror::Error)]
#[error("it is no annotations.json of blinn: {0}")]
pub struct CocoPartError(String);

impl CocoMerge {
    /// Adds the categories and images of a scene.
    ///
    /// # Errors
    /// The text has another form.
    pub fn add_images(&mut self, part: CocoPart) -> Result<(), CocoPartError> {
        let data = parse(part.text)?;
        for CocoCategory { name, .. } in categories(&data)? {
            if !self.categories.contains(&name) {
                self.categories.push(name);
            }
        }
        for mut image in objects(&data, "images")? {
            let file = image.get("file_name").and_then(Value::as_str);
            let file = file.ok_or_else(|| lacks("file_name"))?;
            let file =
                if part.folder.is_empty() { file.to_string() } else { format!("{}/{file}", part.folder) };
            image.insert("file_name".into(), file.into());
            shift(&mut image, "id", part.first_image)?;
            self.images.push(Value::Object(image).to_string());
        }
        Ok(())
    }

    /// Writes the file up to its annotations.
    ///
    /// # Errors
    /// Those of the writer.
    pub fn begin(&self, out: &mut dyn Write) -> io::Result<()> {
        let numbered = (1..).zip(&self.categories).map(|(id, name)| CocoCategory { id, name: name.clone() });
        let head = CocoDataset::head(&numbered.collect::<Vec<_>>(), &self.images);
        write!(out, "{{\n{head},\n\"annotations\": [")
    }

    /// Writes the annotations of a scene whose images were added.
    ///
    /// # Errors
    /// The text has another form, and errors of the writer.
    pub fn add_annotations(&mut self, part: CocoPart, out: &mut dyn Write) -> io::Result<()> {
        self.is_used.resize(self.categories.len(), false);
        let lines = self.annotation_lines(part).map_err(io::Error::other)?;
        for line in lines {
            let separator = if self.annotations == 0 { "" } else { "," };
            write!(out, "{separator}\n  {line}")?;
            self.annotations += 1;
        }
        Ok(())
    }

    /// Writes the rest of the file.
    ///
    /// # Errors
    /// Those of the writer.
    pub fn finish(&self, out: &mut dyn Write) -> io::Result<()> {
        write!(out, "{}]\n}}\n", if self.annotations == 0 { "" } else { "\n" })
    }

    /// The categories that no annotation has.
    pub fn unused_categories(&self) -> impl Iterator<Item = &str> {
        let is_used = |i: usize| self.is_used.get(i).copied().unwrap_or(false);
        self.categories.iter().enumerate().filter(move |(i, _)| !is_used(*i)).map(|(_, name)| name.as_str())
    }

    fn annotation_lines(&mut self, part: CocoPart) -> Result<Vec<String>, CocoPartError> {
        let data = parse(part.text)?;
        let own = categories(&data)?;
        let mut lines = Vec::new();
        for (number, mut annotation) in (self.annotations + 1..).zip(objects(&data, "annotations")?) {
            let id = annotation.get("category_id").and_then(Value::as_u64);
            let category = own.iter().find(|category| u64::try_from(category.id).ok() == id);
            let position = |of: &CocoCategory| self.categories.iter().position(|name| *name == of.name);
            let merged = category.and_then(position);
            let merged = merged.ok_or_else(|| lacks("category_id"))?;
            self.is_used[merged] = true;
            annotation.insert("category_id".into(), json!(merged + 1));
            annotation.insert("id".into(), number.into());
            shift(&mut annotation, "image_id", part.first_image)?;
            lines.push(Value::Object(annotation).to_string());
        }
        Ok(lines)
    }
}

fn parse(text: &str) -> Result<Value, CocoPartError> {
    serde_json::from_str(text).map_err(|error| CocoPartError(error.to_string()))
}

/// The objects of a list.
fn objects(data: &Value, key: &str) -> Result<Vec<Map<String, Value>>, CocoPartError> {
    let list = data.get(key).and_then(Value::as_array).ok_or_else(|| lacks(key))?;
    list.iter().map(|value| value.as_object().cloned().ok_or_else(|| lacks(key))).collect()
}

/// The categories of a dataset.
fn categories(data: &Value) -> Result<Vec<CocoCategory>, CocoPartError> {
    let category = |category: Map<String, Value>| {
        let id = category.get("id").and_then(Value::as_u64).and_then(|id| usize::try_from(id).ok());
        let name = category.get("name").and_then(Value::as_str).map(str::to_string);
        Ok(CocoCategory { id: id.ok_or_else(|| lacks("id"))?, name: name.ok_or_else(|| lacks("name"))? })
    };
    objects(data, "categories")?.into_iter().map(category).collect()
}

/// Adds to an id.
fn shift(object: &mut Map<String, Value>, key: &str, by: i64) -> Result<(), CocoPartError> {
    let id = object.get(key).and_then(Value::as_i64).and_then(|id| id.checked_add(by));
    object.insert(key.into(), id.ok_or_else(|| lacks(key))?.into());
    Ok(())
}

fn lacks(key: &str) -> CocoPartError {
    CocoPartError(format!("a valid \"{key}\" is missing"))
}

#[cfg(test)]
mod tests {
    use super::super::coco::{CocoMasks, CocoObject};
    use super::*;
    use blinn_render::PixelMask;

    fn part(first_id: usize, categories: &[&str], objects: &[usize]) -> String {
        let mut mask = PixelMask::default();
        mask.add(1, 1);
        // Ids need not count from 1.
        let category = |(id, name): (usize, &&str)| CocoCategory { id, name: name.to_string() };
        let categories = (first_id..).zip(categories).map(category).collect();
        let mut data = CocoDataset::new((4, 3), categories, CocoMasks::RunLengths);
        for id in 1..=2 {
            let object =
                |&category| CocoObject { object: 1, name: "n", category, visible: &mask, amodal: &mask };
            data.add_image(id, &format!("{id}.png"), objects.iter().map(object));
        }
        data.to_json()
    }

    #[test]
    fn ids_and_categories_are_united() {
        let texts = [part(1, &["cup", "pot"], &[0, 1]), part(1, &[], &[]), part(7, &["lid", "cup"], &[1])];
        let parts = ["a", "", "b"].into_iter().zip(&texts).zip([0, 2, 4]);
        let parts = parts.map(|((folder, text), first_image)| CocoPart { text, folder, first_image });
        let mut merge = CocoMerge::default();
        parts.clone().for_each(|part| merge.add_images(part).unwrap());
        let mut bytes = Vec::new();
        merge.begin(&mut bytes).unwrap();
        parts.for_each(|part| merge.add_annotations(part, &mut bytes).unwrap());
        merge.finish(&mut bytes).unwrap();
        let data: Value = serde_json::from_slice(&bytes).unwrap();
        let column = |list: &str, key: &str| -> Vec<Value> {
            data[list].as_array().unwrap().iter().map(|row| row[key].clone()).collect()
        };
        assert_eq!(column("categories", "name"), ["cup", "pot", "lid"]);
        assert_eq!(merge.unused_categories().collect::<Vec<_>>(), ["lid"]);
        assert_eq!(column("images", "id"), [1, 2, 3, 4, 5, 6]);
        assert_eq!(
            column("images", "file_name"),
            ["a/1.png", "a/2.png", "1.png", "2.png", "b/1.png", "b/2.png"]
        );
        assert_eq!(column("annotations", "id"), [1, 2, 3, 4, 5, 6]);
        assert_eq!(column("annotations", "image_id"), [1, 1, 2, 2, 5, 6]);
        assert_eq!(column("annotations", "category_id"), [1, 2, 1, 2, 1, 1]);
    }

    /// One dataset, merged, is that dataset.
    #[test]
    fn a_merged_dataset_has_the_form_of_one() {
        for text in [part(1, &["cup"], &[0]), part(1, &[], &[])] {
            let part = CocoPart { text: &text, folder: "", first_image: 0 };
            let mut merge = CocoMerge::default();
            merge.add_images(part).unwrap();
            let mut bytes = Vec::new();
            merge.begin(&mut bytes).unwrap();
            merge.add_annotations(part, &mut bytes).unwrap();
            merge.finish(&mut bytes).unwrap();
            assert_eq!(String::from_utf8(bytes).unwrap(), text);
        }
    }

    #[test]
    fn other_files_are_refused() {
        for text in ["", "[]", "{\"categories\": []}", "{\"categories\": [{}], \"images\": []}"] {
            let part = CocoPart { text, folder: "", first_image: 0 };
            assert!(CocoMerge::default().add_images(part).is_err(), "{text}");
        }
        let text = part(1, &["cup"], &[0]).replace("\"id\":1,", "\"id\":9223372036854775807,");
        let part = CocoPart { text: &text, folder: "", first_image: 1 };
        assert!(CocoMerge::default().add_images(part).is_err());
    }
}
