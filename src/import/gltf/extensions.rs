//! Which extensions are shown, and what is said of the others.

use ::gltf::json::Root;

use super::repair::Json;
use crate::import::error::{LoadError, Warnings};

/// What becomes of an extension.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Support {
    /// As its text says.
    Shown,
    /// In part; the text says what is missing.
    Approximated(&'static str),
    /// Read past, as it changes the look of a surface at most; the text says what is missing.
    NotShown(&'static str),
    /// Carries data that no picture shows.
    Data,
    /// A file that requires it is refused; the text says what to do.
    Refused(&'static str),
}

use Support::{Approximated, Data, NotShown, Refused, Shown};

/// Every extension that is known, by name.
pub(super) const KNOWN: &[(&str, Support)] = &[
    ("KHR_lights_punctual", Shown),
    ("KHR_texture_transform", Shown),
    ("KHR_mesh_quantization", Shown),
    ("KHR_node_visibility", Shown),
    ("KHR_materials_unlit", Shown),
    ("KHR_materials_emissive_strength", Shown),
    ("KHR_materials_ior", Shown),
    ("KHR_materials_specular", Shown),
    ("KHR_materials_pbrSpecularGlossiness", Shown),
    ("KHR_draco_mesh_compression", Shown),
    ("KHR_texture_basisu", Shown),
    ("KHR_materials_variants", Shown),
    ("EXT_meshopt_compression", Shown),
    ("KHR_meshopt_compression", Shown),
    ("EXT_texture_webp", Shown),
    ("EXT_mesh_gpu_instancing", Shown),
    ("KHR_materials_transmission", Approximated("light goes straight through, without refraction")),
    ("KHR_materials_volume", Approximated("its attenuation and refraction are not shown")),
    ("KHR_animation_pointer", Approximated("pointers to a node's transform, weights and visibility are")),
    ("KHR_materials_clearcoat", NotShown("the coat is not shown")),
    ("KHR_materials_sheen", NotShown("the sheen is not shown")),
    ("KHR_materials_iridescence", NotShown("the iridescence is not shown")),
    ("KHR_materials_anisotropy", NotShown("highlights are round")),
    ("KHR_materials_dispersion", NotShown("light is not split into colours")),
    ("KHR_materials_diffuse_transmission", NotShown("no light seeps through")),
    ("KHR_materials_volume_scatter", NotShown("no light is scattered inside")),
    ("EXT_lights_image_based", NotShown("the surrounding light is not shown")),
    ("EXT_lights_ies", NotShown("lights shine evenly")),
    ("KHR_technique_webgl", NotShown("materials are metallic-roughness")),
    ("KHR_techniques_webgl", NotShown("materials are metallic-roughness")),
    ("KHR_materials_common", NotShown("materials are metallic-roughness")),
    ("CESIUM_RTC", NotShown("the centre is not added to positions")),
    ("KHR_xmp", Data),
    ("KHR_xmp_json_ld", Data),
    ("KHR_node_selectability", Data),
    ("KHR_node_hoverability", Data),
    ("KHR_interactivity", Data),
    ("EXT_mesh_features", Data),
    ("EXT_structural_metadata", Data),
    ("EXT_instance_features", Data),
    ("EXT_feature_metadata", Data),
    ("GODOT_single_root", Data),
    ("MSFT_texture_dds", Refused("save the textures as PNG or JPEG")),
];

/// What becomes of the extension called `name`; `None` for one that nobody here has heard of.
pub(super) fn support(name: &str) -> Option<Support> {
    KNOWN.iter().find(|(known, _)| *known == name).map(|&(_, support)| support)
}

/// Refuses what the file requires and this reader lacks; warns of what it merely uses.
pub(super) fn judge(json: &Json, warnings: &mut Warnings) -> Result<(), LoadError> {
    let Root { extensions_used, extensions_required, .. } = &json.root;
    let mut missing = Vec::new();
    for name in extensions_required {
        let text = match support(name) {
            None => format!("{name} (not known)"),
            Some(Refused(advice)) => format!("{name} ({advice})"),
            Some(_) => continue,
        };
        if !missing.contains(&text) {
            missing.push(text);
        }
    }
    if !missing.is_empty() {
        let list = missing.join(", ");
        return Err(LoadError::Unsupported(format!("the file requires what is not supported: {list}")));
    }
    for name in extensions_used {
        let quoted = super::super::uri::printable(name);
        match support(name) {
            Some(Shown | Data) => {}
            Some(Approximated(how)) => {
                if name != "KHR_animation_pointer" {
                    warnings.add("", format_args!("{quoted} is shown in part: {how}"));
                }
            }
            Some(NotShown(what)) => warnings.add("", format_args!("{quoted}: {what}")),
            Some(Refused(_)) => warnings.add("", format_args!("{quoted} is not read: fallbacks are used")),
            None => warnings.add("", format_args!("{quoted} is not known, and was ignored")),
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::super::fixture::Fixture;
    use serde_json::json;

    fn with(required: &[&str], used: &[&str]) -> Fixture {
        let mut fixture = Fixture::triangle();
        fixture.json["extensionsRequired"] = json!(required);
        fixture.json["extensionsUsed"] = json!(used);
        fixture
    }

    #[test]
    fn what_is_required_and_missing_is_named() {
        let error = with(&["KHR_texture_transform", "MSFT_texture_dds", "ACME_x"], &[]).error();
        assert!(error.contains("MSFT_texture_dds") && error.contains("ACME_x (not known)"), "{error}");
        assert!(!error.contains("texture_transform"));
    }

    #[test]
    fn what_is_merely_used_is_a_warning() {
        let names = ["MSFT_texture_dds", "ACME_x", "KHR_materials_sheen", "KHR_lights_punctual"];
        let (_, warnings) = with(&["KHR_materials_sheen"], &names).load();
        assert_eq!(warnings.len(), 3, "{warnings:?}");
    }
}
