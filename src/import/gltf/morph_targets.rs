//! Morph targets of a primitive: displacements of its vertex attributes.

use ::gltf::json::Index;
use glam::{Vec2, Vec4};

use super::accessor::Accessor;
use super::attributes::Attributes;
use super::color;
use super::target_attributes::TargetAttributes;
use crate::error::{LoadError, Warnings};
use blinn_scene::{Mesh, MorphTarget};

/// Reads the morph targets of a primitive, by the indices of its mesh and its own, and their default weights into `mesh`.
/// Displacements of attributes that the mesh lacks are left out.
pub(super) fn read(
    attributes: &Attributes<'_, '_>,
    [mesh_index, primitive]: [usize; 2],
    mesh: &mut Mesh,
    warnings: &mut Warnings,
) -> Result<(), LoadError> {
    let doc = attributes.doc;
    let json = &doc.root().meshes[mesh_index];
    let names = json.extras.as_ref().map_or_else(Vec::new, |e| target_names(e.get()));
    for (i, typed) in attributes.json.targets.iter().flatten().enumerate() {
        let target = TargetReader { attributes, location: format!("{}.targets[{i}]", attributes.location) };
        let mut vec3 = |index: Option<Index<_>>, name: &str, wanted: bool| {
            let index = index.filter(|_| wanted).map(|index| index.value());
            target.read(index, name, &[3], warnings, |accessor| accessor.floats(attributes.elements))
        };
        let mut morph = MorphTarget {
            name: names.get(i).cloned().unwrap_or_default(),
            positions: vec3(typed.positions, "POSITION", true)?,
            normals: vec3(typed.normals, "NORMAL", !mesh.normals.is_empty())?,
            tangents: vec3(typed.tangents, "TANGENT", !mesh.tangents.is_empty())?,
            ..MorphTarget::default()
        };
        if let Some(further) = doc.json.target_attributes.get(&[mesh_index, primitive, i]) {
            morph.uvs = target.uvs(further, mesh, warnings)?;
            morph.colors = target.colors(further, mesh, warnings)?;
        }
        mesh.morph_targets.push(morph);
    }
    mesh.morph_weights = json.weights.clone().unwrap_or_default();
    mesh.morph_weights.resize(mesh.morph_targets.len(), 0.0);
    Ok(())
}

/// Reads the displacements of one morph target.
struct TargetReader<'a> {
    attributes: &'a Attributes<'a, 'a>,
    location: String,
}

impl TargetReader<'_> {
    /// Reads an attribute by its accessor; empty, with a warning, if it does not match the mesh.
    fn read<T>(
        &self,
        index: Option<usize>,
        name: &str,
        components: &[usize],
        warnings: &mut Warnings,
        values: impl FnOnce(&Accessor<'_>) -> Vec<T>,
    ) -> Result<Vec<T>, LoadError> {
        let Some(index) = index else { return Ok(Vec::new()) };
        let accessor = Accessor::open(self.attributes.doc, index, warnings)?;
        let location = format!("{}.{name}", self.location);
        let matches = self.attributes.matches(&accessor, &location, components, warnings);
        Ok(if matches { values(&accessor) } else { Vec::new() })
    }

    /// Reads the displacements of texture coordinates by set; empty if there are none.
    fn uvs(
        &self,
        target: &TargetAttributes,
        mesh: &Mesh,
        warnings: &mut Warnings,
    ) -> Result<Vec<Vec<Vec2>>, LoadError> {
        let mut sets: Vec<Vec<Vec2>> = Vec::new();
        for (&set, &index) in &target.uvs {
            let name = format!("TEXCOORD_{set}");
            if mesh.uv_set(set).is_none() {
                self.warn_missing(&name, warnings);
                continue;
            }
            let elements = self.attributes.elements;
            self.charge::<Vec2>()?;
            let mut uvs: Vec<Vec2> =
                self.read(Some(index), &name, &[2], warnings, |accessor| accessor.floats(elements))?;
            let is_finite = |v: &Vec2| v.is_finite();
            self.replace_nonfinite(&mut uvs, is_finite, &name, warnings);
            if !uvs.is_empty() {
                sets.resize_with(set as usize + 1, Vec::new);
                sets[set as usize] = uvs;
            }
        }
        Ok(sets)
    }

    fn colors(
        &self,
        target: &TargetAttributes,
        mesh: &Mesh,
        warnings: &mut Warnings,
    ) -> Result<Vec<Vec4>, LoadError> {
        let Some(index) = target.colors else { return Ok(Vec::new()) };
        if mesh.colors.is_empty() {
            self.warn_missing("COLOR_0", warnings);
            return Ok(Vec::new());
        }
        self.charge::<Vec4>()?;
        let mut unmarked = false;
        let elements = self.attributes.elements;
        let mut colors = self.read(Some(index), "COLOR_0", color::COMPONENTS, warnings, |accessor| {
            let (colors, is_unmarked) = color::displacements(accessor, elements);
            unmarked = is_unmarked;
            colors
        })?;
        if unmarked {
            warnings.add(format_args!("{}.COLOR_0", self.location), color::UNMARKED);
        }
        self.replace_nonfinite(&mut colors, |v: &Vec4| v.is_finite(), "COLOR_0", warnings);
        Ok(colors)
    }

    fn warn_missing(&self, name: &str, warnings: &mut Warnings) {
        let location = format_args!("{}.{name}", self.location);
        warnings.add(location, format_args!("ignored displacements of {name}, which the mesh lacks"));
    }

    /// Replaces displacements that are not finite by 0.
    fn replace_nonfinite<T: Default>(
        &self,
        values: &mut [T],
        is_finite: impl Fn(&T) -> bool,
        name: &str,
        warnings: &mut Warnings,
    ) {
        let mut replaced = 0usize;
        for value in values.iter_mut().filter(|value| !is_finite(value)) {
            *value = T::default();
            replaced += 1;
        }
        if replaced > 0 {
            let location = format_args!("{}.{name}", self.location);
            warnings.add(location, format_args!("{replaced} displacements are not finite; used 0"));
        }
    }

    /// Charges one value of an attribute for each vertex. Many attributes may share an accessor.
    fn charge<T>(&self) -> Result<(), LoadError> {
        let bytes = (self.attributes.elements.len() as u64).saturating_mul(size_of::<T>() as u64);
        self.attributes.doc.budget.charge(bytes)
    }
}

/// Names of morph targets, which exporters store in `extras.targetNames` of the mesh.
fn target_names(extras: &str) -> Vec<String> {
    let names = serde_json::from_str::<serde_json::Value>(extras).ok();
    let names = names.as_ref().and_then(|v| v.get("targetNames")).and_then(|v| v.as_array());
    names.into_iter().flatten().map(|n| n.as_str().unwrap_or_default().to_string()).collect()
}
