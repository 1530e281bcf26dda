//! Every extension that Khronos's registry lists, and what becomes of each here.
//! `docs/reference/gltf.md` shows this table; a test holds the two together.

/// What becomes of an extension.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Support {
    /// As its text says.
    Shown,
    /// In part; the text says what is missing.
    Approximated(&'static str),
    /// Read past, as it changes the look at most; the text says what is missing.
    NotShown(&'static str),
    /// Carries nothing that a picture shows.
    Data,
    /// A file that requires it is refused; the text says what to do.
    Refused(&'static str),
}

use Support::{Approximated, Data, NotShown, Refused, Shown};

const AS_PNG: &str = "save the textures as PNG, JPEG, WebP or KTX2";
const STANDS_STILL: &str = "save the scene without streamed media";
const BY_FACTORS: &str = "materials are shown by their metallic-roughness factors";

/// Every extension that is known, by name.
pub(super) const KNOWN: &[(&str, Support)] = &[
    // Khronos, ratified.
    ("KHR_animation_pointer", Shown),
    ("KHR_draco_mesh_compression", Shown),
    ("KHR_lights_punctual", Shown),
    ("KHR_materials_anisotropy", NotShown("highlights are round")),
    ("KHR_materials_clearcoat", NotShown("the coat is not shown")),
    ("KHR_materials_dispersion", NotShown("light is not split into colours")),
    ("KHR_materials_emissive_strength", Shown),
    ("KHR_materials_ior", Shown),
    ("KHR_materials_iridescence", NotShown("the iridescence is not shown")),
    ("KHR_materials_sheen", NotShown("the sheen is not shown")),
    ("KHR_materials_specular", Shown),
    ("KHR_materials_transmission", Approximated("light goes straight through, without refraction")),
    ("KHR_materials_unlit", Shown),
    ("KHR_materials_variants", Shown),
    ("KHR_materials_volume", Approximated("its attenuation and refraction are not shown")),
    ("KHR_mesh_quantization", Shown),
    ("KHR_meshopt_compression", Shown),
    ("KHR_node_hoverability", Data),
    ("KHR_node_selectability", Data),
    ("KHR_node_visibility", Shown),
    ("KHR_texture_basisu", Shown),
    ("KHR_texture_transform", Shown),
    ("KHR_xmp_json_ld", Data),
    // Khronos, in progress.
    ("KHR_accessor_float64", Refused("save the file with numbers of 32 bits")),
    ("KHR_audio_emitter", Data),
    ("KHR_gaussian_splatting", NotShown("splats are not shown")),
    ("KHR_gaussian_splatting_compression_spz", NotShown("splats are not shown")),
    ("KHR_gaussian_splatting_compression_spz_2", NotShown("splats are not shown")),
    ("KHR_implicit_shapes", Data),
    ("KHR_interactivity", Data),
    ("KHR_lights_area", NotShown("area lights are not shown")),
    ("KHR_materials_diffuse_transmission", NotShown("no light seeps through")),
    ("KHR_materials_diffuse_roughness", NotShown("diffuse light is Lambert's")),
    ("KHR_materials_volume_scatter", NotShown("no light is scattered inside")),
    ("KHR_physics_rigid_bodies", Data),
    ("KHR_texture_procedurals", NotShown("procedural textures are not shown")),
    // Several vendors.
    ("EXT_feature_metadata", Data),
    ("EXT_instance_features", Data),
    ("EXT_lights_ies", NotShown("lights shine evenly")),
    ("EXT_lights_image_based", NotShown("the surrounding light is not shown")),
    ("EXT_mesh_features", Data),
    ("EXT_mesh_gpu_instancing", Shown),
    ("EXT_mesh_manifold", Data),
    ("EXT_mesh_primitive_edge_visibility", Data),
    ("EXT_mesh_primitive_restart", Shown),
    ("EXT_meshopt_compression", Shown),
    ("EXT_primitive_voxels", Refused("voxels are not read")),
    ("EXT_structural_metadata", Data),
    ("EXT_texture_avif", Refused(AS_PNG)),
    ("EXT_texture_procedurals_mx_1_39", NotShown("procedural textures are not shown")),
    ("EXT_texture_webp", Shown),
    // One vendor.
    ("ADOBE_materials_clearcoat_specular", NotShown("the coat is not shown")),
    ("ADOBE_materials_clearcoat_tint", NotShown("the coat is not shown")),
    ("ADOBE_materials_thin_transparency", NotShown("the surface is not transparent")),
    ("AGI_articulations", Data),
    ("AGI_stk_metadata", Data),
    ("BENTLEY_materials_line_style", Data),
    ("BENTLEY_materials_planar_fill", NotShown("fills are shown as surfaces")),
    ("BENTLEY_materials_point_style", Data),
    ("CESIUM_primitive_outline", NotShown("the outline is not drawn")),
    ("FB_geometry_metadata", Data),
    ("FB_ngon_encoding", Data),
    ("GODOT_single_root", Data),
    ("GRIFFEL_bim_data", Data),
    ("MPEG_accessor_timed", Refused(STANDS_STILL)),
    ("MPEG_animation_timing", NotShown("animations play by their own time")),
    ("MPEG_audio_spatial", Data),
    ("MPEG_buffer_circular", Refused(STANDS_STILL)),
    ("MPEG_media", NotShown("streamed media are not read")),
    ("MPEG_mesh_linking", NotShown("linked meshes do not move each other")),
    ("MPEG_scene_dynamic", NotShown("the scene stays as it is stored")),
    ("MPEG_texture_video", NotShown("the still image is shown")),
    ("MPEG_viewport_recommended", NotShown("recommended views are not cameras")),
    ("MSFT_lod", Approximated("the finest level is shown always")),
    ("MSFT_packing_normalRoughnessMetallic", NotShown("the standard textures are shown")),
    ("MSFT_packing_occlusionRoughnessMetallic", NotShown("the standard textures are shown")),
    ("MSFT_texture_dds", Refused(AS_PNG)),
    ("NV_materials_mdl", NotShown(BY_FACTORS)),
    // Archived.
    ("KHR_materials_pbrSpecularGlossiness", Shown),
    ("KHR_techniques_webgl", NotShown(BY_FACTORS)),
    ("KHR_xmp", Data),
    // Of glTF 1.0, met in files that call themselves 2.0.
    ("CESIUM_RTC", NotShown("the centre is not added to positions")),
    ("KHR_binary_glTF", Data),
    ("KHR_materials_common", NotShown(BY_FACTORS)),
    ("KHR_technique_webgl", NotShown(BY_FACTORS)),
    ("WEB3D_quantized_attributes", Refused("save the file with KHR_mesh_quantization or none")),
    // Not in the registry, and common.
    ("EXT_lights_area", NotShown("area lights are not shown")),
    ("EXT_materials_bump", NotShown("bumps are not shown")),
    ("KHR_materials_coat", NotShown("the coat is not shown")),
    ("KHR_materials_fuzz", NotShown("the fuzz is not shown")),
    ("KHR_materials_openpbr", NotShown(BY_FACTORS)),
    ("VRM", NotShown("materials are shown by their glTF factors, and nothing springs or looks")),
    ("VRMC_materials_mtoon", NotShown("toon shading is not shown")),
    ("VRMC_node_constraint", NotShown("constraints do not move nodes")),
    ("VRMC_springBone", NotShown("nothing springs")),
    ("VRMC_vrm", Data),
];

/// What becomes of the extension called `name`; `None` for one that nobody here has heard of.
pub(super) fn support(name: &str) -> Option<Support> {
    KNOWN.iter().find(|(known, _)| *known == name).map(|&(_, support)| support)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table() -> String {
        let mut out = String::from("| extension | what becomes of it |\n|---|---|\n");
        for (name, support) in KNOWN {
            let text = match support {
                Shown => "shown".to_string(),
                Approximated(how) => format!("approximated: {how}"),
                NotShown(what) => format!("read, and warned of: {what}"),
                Data => "passed over: it holds nothing that a picture shows".to_string(),
                Refused(advice) => {
                    format!(
                        "refused where the file requires it ({advice}); else warned of, and its fallback shown"
                    )
                }
            };
            out.push_str(&format!("| `{name}` | {text} |\n"));
        }
        out
    }

    /// `GOLDEN=update` writes the table into the page.
    #[test]
    fn the_documentation_has_this_table() {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/docs/reference/gltf.md");
        let page = std::fs::read_to_string(path).unwrap();
        let (start, end) = ("<!-- extensions -->\n", "<!-- end of extensions -->");
        let (before, rest) = page.split_once(start).unwrap();
        let (found, after) = rest.split_once(end).unwrap();
        if std::env::var_os("GOLDEN").is_some_and(|v| v == "update") {
            std::fs::write(path, format!("{before}{start}{}{end}{after}", table())).unwrap();
        } else {
            assert_eq!(found, table(), "GOLDEN=update writes it afresh");
        }
    }

    #[test]
    fn every_extension_is_listed_once() {
        let mut names: Vec<&str> = KNOWN.iter().map(|(name, _)| *name).collect();
        names.sort_unstable();
        assert!(names.windows(2).all(|w| w[0] != w[1]));
        assert_eq!(names.len(), 96);
    }
}
