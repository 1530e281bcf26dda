//! Skins: joints and inverse bind matrices.

use ::gltf::json::{Index, Node};
use glam::{DAffine3, DMat4, Mat4};

use super::accessor::{Accessor, Elements};
use super::document::Document;
use crate::error::{LoadError, Warnings};
use blinn_scene::Skin;

/// Reads a skin with its joints as scene nodes. `None`, with a warning, if the scene lacks some of the
/// joints.
pub(super) fn read(
    doc: &Document<'_>,
    index: usize,
    scene_nodes: &[Option<u32>],
    warnings: &mut Warnings,
) -> Result<Option<Skin>, LoadError> {
    let Some(json) = doc.root().skins.get(index) else { return Ok(None) };
    let location = format!("skins[{index}]");
    let node = |joint: &Index<Node>| scene_nodes.get(joint.value()).copied().flatten();
    let joints: Option<Vec<u32>> = json.joints.iter().map(node).collect();
    let Some(joints) = joints.filter(|j| !j.is_empty()) else {
        warnings.add(location, "ignored skin whose joints are not in the scene");
        return Ok(None);
    };
    let mut inverse_bind = Vec::with_capacity(joints.len());
    if let Some(index) = json.inverse_bind_matrices {
        let accessor = Accessor::open(doc, index.value(), warnings)?;
        if accessor.components == 16 {
            let count = accessor.count.min(joints.len());
            let matrices: Vec<[f32; 16]> = accessor.floats(Elements::First(count));
            inverse_bind.extend(matrices.iter().map(|m| affine(Mat4::from_cols_array(m).as_dmat4())));
        }
        if inverse_bind.len() < joints.len() {
            let has = inverse_bind.len();
            let message =
                format!("{has} matrices for {} joints; used the identity for the others", joints.len());
            warnings.add(format_args!("{location}.inverseBindMatrices"), message);
        }
    }
    inverse_bind.resize(joints.len(), DAffine3::IDENTITY);
    Ok(Some(Skin { name: json.name.clone().unwrap_or_default(), joints, inverse_bind }))
}

fn affine(m: DMat4) -> DAffine3 {
    DAffine3::from_cols(m.x_axis.truncate(), m.y_axis.truncate(), m.z_axis.truncate(), m.w_axis.truncate())
}
