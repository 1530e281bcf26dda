//! Categories of objects, from rules about their names and materials.

use std::collections::BTreeMap;

use anyhow::{Result, bail};

use crate::args::values::CategoryRule;
use blinn_scene::Scene;

/// The categories of a scene's objects. They do not depend on what images show.
pub struct ObjectCategories {
    /// Names of categories: in the order of rules, then of objects.
    pub names: Vec<String>,
    /// Index of the category of each object that has one.
    by_object: BTreeMap<u32, usize>,
}

impl ObjectCategories {
    /// Applies `rules` to all objects that are drawn. The first rule that applies to an object decides. `stem` is the name of
    /// the scene. A pattern need not match something in each of several scenes.
    ///
    /// # Errors
    /// A pattern without a match in a single scene.
    pub fn new(
        scene: &Scene,
        stem: &str,
        rules: &[CategoryRule],
        is_batch: bool,
    ) -> Result<ObjectCategories> {
        let mut categories = ObjectCategories { names: Vec::new(), by_object: BTreeMap::new() };
        for rule in rules {
            match rule {
                CategoryRule::Object => {
                    for instance in &scene.instances {
                        let name = object_name(scene, instance.object);
                        categories.set(instance.object, &name);
                    }
                }
                CategoryRule::Material => {
                    // The material of an object's first mesh.
                    for instance in &scene.instances {
                        let material = scene.meshes[instance.mesh as usize].material as usize;
                        let name = &scene.materials[material].name;
                        let fallback = format!("material {}", material + 1);
                        categories.set(instance.object, if name.is_empty() { &fallback } else { name });
                    }
                }
                CategoryRule::Scene => {
                    for instance in &scene.instances {
                        categories.set(instance.object, stem);
                    }
                }
                CategoryRule::Objects { category, glob } => {
                    categories.index(category);
                    let objects = match scene.matching_objects(glob) {
                        Err(_) if is_batch => Default::default(),
                        objects => objects?,
                    };
                    for object in objects {
                        categories.set(object, category);
                    }
                }
                CategoryRule::Materials { category, glob } => {
                    categories.index(category);
                    if !is_batch && !scene.materials.iter().any(|material| glob.matches_name(&material.name))
                    {
                        bail!("--category {category}: no material matches '{}'", glob.as_str());
                    }
                    for instance in &scene.instances {
                        let mesh = &scene.meshes[instance.mesh as usize];
                        if glob.matches_name(&scene.materials[mesh.material as usize].name) {
                            categories.set(instance.object, category);
                        }
                    }
                }
            }
        }
        Ok(categories)
    }

    /// The index of an object's category.
    pub fn of(&self, object: u32) -> Option<usize> {
        self.by_object.get(&object).copied()
    }

    fn set(&mut self, object: u32, category: &str) {
        if !self.by_object.contains_key(&object) {
            let index = self.index(category);
            self.by_object.insert(object, index);
        }
    }

    /// The index of a category, which is added if it is new.
    fn index(&mut self, category: &str) -> usize {
        self.names.iter().position(|name| name == category).unwrap_or_else(|| {
            self.names.push(category.to_string());
            self.names.len() - 1
        })
    }
}

/// The name of an object, or its number if it has none.
fn object_name(scene: &Scene, object: u32) -> String {
    let name = (object as usize).checked_sub(1).and_then(|i| scene.objects.get(i));
    name.filter(|name| !name.is_empty()).cloned().unwrap_or_else(|| format!("object {object}"))
}
