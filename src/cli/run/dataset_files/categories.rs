//! Categories of objects, from rules about their names and materials.

use std::collections::BTreeMap;
use std::sync::Arc;

use anyhow::{Result, bail};

use crate::args::values::CategoryRule;
use crate::plan::{RenderPlan, SceneNames, SharedCategories};
use blinn_core::worded;
use blinn_output::datasets::CocoCategory;
use blinn_scene::Scene;

/// The categories of a scene's objects. They do not depend on what images show.
pub struct ObjectCategories {
    /// All categories: in the order of rules, then of objects.
    pub all: Vec<CocoCategory>,
    /// Index of the category of each object that has one.
    by_object: BTreeMap<u32, usize>,
    /// Ids that scenes share.
    shared: Arc<SharedCategories>,
}

impl ObjectCategories {
    /// Applies the rules of a plan to all objects of a scene that are drawn. The first rule that applies to an object decides. A
    /// pattern need not match something in each of several scenes.
    ///
    /// # Errors
    /// A pattern without a match in a single scene.
    pub fn new(plan: &RenderPlan, scene: &Scene, names: &SceneNames) -> Result<ObjectCategories> {
        let is_batch = plan.scenes.is_batch();
        let shared = plan.formats.shared_categories.clone();
        let mut categories = ObjectCategories { all: Vec::new(), by_object: BTreeMap::new(), shared };
        let every_object = |categories: &mut ObjectCategories, name: &str| {
            scene.instances.iter().for_each(|instance| categories.set(instance.object, name));
        };
        for rule in &plan.formats.categories {
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
                CategoryRule::Scene => every_object(&mut categories, &names.stem),
                CategoryRule::Folder => every_object(&mut categories, &names.folder),
                CategoryRule::Scenes { category, glob } => {
                    categories.index(category);
                    if glob.matches_name(&names.stem) || glob.matches_path(&names.path) {
                        every_object(&mut categories, category);
                    } else if !is_batch {
                        bail!(worded!(
                            "`category` {}: the scene's name does not match '{}'",
                            category,
                            glob.as_str()
                        ));
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
                        bail!(worded!("`category` {}: no material matches '{}'", category, glob.as_str()));
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
        self.all.iter().position(|known| known.name == category).unwrap_or_else(|| {
            let is_own = |known: &&CocoCategory| known.id > self.shared.count();
            let next = || self.shared.count() + self.all.iter().filter(is_own).count() + 1;
            let id = self.shared.id(category).unwrap_or_else(next);
            self.all.push(CocoCategory { id, name: category.to_string() });
            self.all.len() - 1
        })
    }
}

/// The name of an object, or its number if it has none.
fn object_name(scene: &Scene, object: u32) -> String {
    let name = (object as usize).checked_sub(1).and_then(|i| scene.objects.get(i));
    name.filter(|name| !name.is_empty()).cloned().unwrap_or_else(|| format!("object {object}"))
}
