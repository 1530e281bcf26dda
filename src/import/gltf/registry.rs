//! The extensions of the Khronos registry and their support.
//! `docs/reference/gltf.md` shows this table; a test keeps both equal.

/// Support of an extension.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Support {
    /// Rendered as specified.
    Supported,
    /// Rendered in part; the text says what is missing.
    Partial(&'static str),
    /// Ignored with a warning; the text says how the image differs. A file may require it.
    Ignored(&'static str),
    /// Holds nothing that is rendered.
    Unrendered,
    /// Ignored with a warning, but a file that requires it is an error; the text says what to do.
    NotRequirable(&'static str),
}

use Support::{Ignored, NotRequirable, Partial, Supported, Unrendered};

const SAVE_AS_PNG: &str = "save the textures as PNG, JPEG, WebP or KTX2 with Basis Universal";
const NO_STREAMING: &str = "save the scene without streamed media";
const CORE_FACTORS: &str = "materials use their metallic-roughness factors";

/// All known extensions.
pub(super) const KNOWN: &[(&str, Support)] = &[
    // Khronos, ratified.
    ("KHR_animation_pointer", Supported),
    ("KHR_draco_mesh_compression", Supported),
    ("KHR_lights_punctual", Supported),
    ("KHR_materials_anisotropy", Supported),
    ("KHR_materials_clearcoat", Supported),
    ("KHR_materials_dispersion", Supported),
    ("KHR_materials_emissive_strength", Supported),
    ("KHR_materials_ior", Supported),
    ("KHR_materials_iridescence", Supported),
    ("KHR_materials_sheen", Supported),
    ("KHR_materials_specular", Supported),
    ("KHR_materials_transmission", Supported),
    ("KHR_materials_unlit", Supported),
    ("KHR_materials_variants", Supported),
    ("KHR_materials_volume", Supported),
    ("KHR_mesh_quantization", Supported),
    ("KHR_meshopt_compression", Supported),
    ("KHR_node_hoverability", Unrendered),
    ("KHR_node_selectability", Unrendered),
    ("KHR_node_visibility", Supported),
    ("KHR_texture_basisu", Supported),
    ("KHR_texture_transform", Supported),
    ("KHR_xmp_json_ld", Unrendered),
    // Khronos, in progress.
    ("KHR_accessor_float64", NotRequirable("save the file with 32-bit floats")),
    ("KHR_audio_emitter", Unrendered),
    ("KHR_gaussian_splatting", Ignored("splats are missing")),
    ("KHR_gaussian_splatting_compression_spz", Ignored("splats are missing")),
    ("KHR_gaussian_splatting_compression_spz_2", Ignored("splats are missing")),
    ("KHR_implicit_shapes", Unrendered),
    ("KHR_interactivity", Unrendered),
    ("KHR_lights_area", Ignored("area lights are missing")),
    ("KHR_materials_diffuse_transmission", Supported),
    ("KHR_materials_diffuse_roughness", Ignored("diffuse reflection is Lambertian")),
    ("KHR_materials_volume_scatter", Ignored("the volume scattering is missing")),
    ("KHR_physics_rigid_bodies", Unrendered),
    ("KHR_texture_procedurals", Ignored("procedural textures are missing")),
    // Several vendors.
    ("EXT_feature_metadata", Unrendered),
    ("EXT_instance_features", Unrendered),
    ("EXT_lights_ies", Supported),
    ("EXT_lights_image_based", Supported),
    ("EXT_mesh_features", Unrendered),
    ("EXT_mesh_gpu_instancing", Supported),
    ("EXT_mesh_manifold", Unrendered),
    ("EXT_mesh_primitive_edge_visibility", Supported),
    ("EXT_mesh_primitive_restart", Supported),
    ("EXT_meshopt_compression", Supported),
    ("EXT_primitive_voxels", NotRequirable("voxels are not supported")),
    ("EXT_structural_metadata", Unrendered),
    ("EXT_texture_astc", NotRequirable(SAVE_AS_PNG)),
    ("EXT_texture_avif", NotRequirable(SAVE_AS_PNG)),
    ("EXT_texture_procedurals_mx_1_39", Ignored("procedural textures are missing")),
    ("EXT_texture_webp", Supported),
    // One vendor.
    ("ADOBE_materials_clearcoat_specular", Ignored("the coat is missing")),
    ("ADOBE_materials_clearcoat_tint", Ignored("the coat is missing")),
    ("ADOBE_materials_thin_transparency", Ignored("the surface is opaque")),
    ("AGI_articulations", Unrendered),
    ("AGI_stk_metadata", Unrendered),
    ("BENTLEY_materials_line_style", Unrendered),
    ("BENTLEY_materials_planar_fill", Ignored("fills are rendered as surfaces")),
    ("BENTLEY_materials_point_style", Unrendered),
    ("CESIUM_primitive_outline", Ignored("outlines are missing")),
    ("FB_geometry_metadata", Unrendered),
    ("FB_ngon_encoding", Unrendered),
    ("GODOT_single_root", Unrendered),
    ("GRIFFEL_bim_data", Unrendered),
    ("MPEG_accessor_timed", NotRequirable(NO_STREAMING)),
    ("MPEG_animation_timing", Ignored("animations use their own time")),
    ("MPEG_audio_spatial", Unrendered),
    ("MPEG_buffer_circular", NotRequirable(NO_STREAMING)),
    ("MPEG_media", Ignored("streamed media are missing")),
    ("MPEG_mesh_linking", Ignored("linked meshes move independently")),
    ("MPEG_scene_dynamic", Ignored("the scene is static")),
    ("MPEG_texture_video", Ignored("the still image is used")),
    ("MPEG_viewport_recommended", Ignored("recommended viewports are not cameras")),
    ("MSFT_lod", Partial("the finest level of detail is always used")),
    ("MSFT_packing_normalRoughnessMetallic", Ignored("the standard textures are used")),
    ("MSFT_packing_occlusionRoughnessMetallic", Ignored("the standard textures are used")),
    ("MSFT_texture_dds", NotRequirable(SAVE_AS_PNG)),
    ("NV_materials_mdl", Ignored(CORE_FACTORS)),
    // Archived.
    ("KHR_materials_pbrSpecularGlossiness", Supported),
    ("KHR_techniques_webgl", Ignored(CORE_FACTORS)),
    ("KHR_xmp", Unrendered),
    // glTF 1.0, found in files with version 2.0.
    ("CESIUM_RTC", Ignored("positions are relative to the centre")),
    ("KHR_binary_glTF", Unrendered),
    ("KHR_materials_common", Ignored(CORE_FACTORS)),
    ("KHR_technique_webgl", Ignored(CORE_FACTORS)),
    (
        "WEB3D_quantized_attributes",
        NotRequirable("save the file with KHR_mesh_quantization or without quantization"),
    ),
    // Common, but not in the registry.
    ("EXT_lights_area", Supported),
    ("EXT_materials_bump", Ignored("bump maps are missing")),
    ("KHR_materials_coat", Ignored("the coat is missing")),
    ("KHR_materials_fuzz", Ignored("the fuzz is missing")),
    ("KHR_materials_openpbr", Ignored(CORE_FACTORS)),
    ("VRM", Ignored("materials use their glTF factors; spring bones and gaze are static")),
    ("VRMC_materials_mtoon", Ignored("toon shading is missing")),
    ("VRMC_node_constraint", Ignored("node constraints have no effect")),
    ("VRMC_springBone", Ignored("spring bones are static")),
    ("VRMC_vrm", Unrendered),
];

/// Support of the named extension; `None` if it is unknown.
pub(super) fn support(name: &str) -> Option<Support> {
    KNOWN.iter().find(|(known, _)| *known == name).map(|&(_, support)| support)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table() -> String {
        let mut out = String::from("| extension | support |\n|---|---|\n");
        for (name, support) in KNOWN {
            let text = match support {
                Supported => "supported".to_string(),
                Partial(missing) => format!("supported in part: {missing}"),
                Ignored(effect) => format!("ignored with a warning: {effect}"),
                Unrendered => "ignored: holds nothing that is rendered".to_string(),
                NotRequirable(advice) => {
                    format!(
                        "an error if required ({advice}); otherwise ignored with a warning, and its fallback is used"
                    )
                }
            };
            out.push_str(&format!("| `{name}` | {text} |\n"));
        }
        out
    }

    /// `GOLDEN=update` writes the table into the page.
    #[test]
    fn the_documentation_has_the_same_table() {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/reference/gltf.md");
        let page = std::fs::read_to_string(path).unwrap();
        let start = "<!-- extensions -->\n";
        let end = "<!-- end of extensions -->";
        let (before, rest) = page.split_once(start).unwrap();
        let (found, after) = rest.split_once(end).unwrap();
        if std::env::var_os("GOLDEN").is_some_and(|v| v == "update") {
            std::fs::write(path, format!("{before}{start}{}{end}{after}", table())).unwrap();
        } else {
            assert_eq!(found, table(), "GOLDEN=update rewrites it");
        }
    }

    #[test]
    fn each_extension_is_listed_once() {
        let mut names: Vec<&str> = KNOWN.iter().map(|(name, _)| *name).collect();
        names.sort_unstable();
        assert!(names.windows(2).all(|w| w[0] != w[1]));
        assert_eq!(names.len(), 97);
    }
}
