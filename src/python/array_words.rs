//! Warnings about scenes of arrays in the words of their arguments: they are loaded as a GLB, whose JSON nobody sees.

use std::path::Path;

/// Names of the scenes that the package makes of arrays.
const NAMES: [&str; 2] = ["arrays", "trimesh"];

/// Ends of places in the JSON of a GLB, and the arguments that are written there.
const ARGUMENTS: [(&str, &str); 28] = [
    (".primitives[0].attributes.POSITION", "vertices"),
    (".primitives[0].attributes.NORMAL", "normals"),
    (".primitives[0].attributes.TEXCOORD_0", "uvs"),
    (".primitives[0].attributes.COLOR_0", "colors"),
    (".primitives[0].indices", "faces"),
    (".matrix", "transforms"),
    (".translation", "transforms"),
    (".pbrMetallicRoughness.baseColorFactor", "base_color"),
    (".pbrMetallicRoughness.metallicFactor", "metallic"),
    (".pbrMetallicRoughness.roughnessFactor", "roughness"),
    (".emissiveFactor", "emissive"),
    (".alphaMode", "alpha_mode"),
    (".alphaCutoff", "alpha_cutoff"),
    (".KHR_materials_ior.ior", "ior"),
    (".KHR_materials_transmission.transmissionFactor", "transmission"),
    (".KHR_materials_volume.thicknessFactor", "thickness"),
    (".KHR_materials_dispersion.dispersion", "dispersion"),
    (".KHR_materials_clearcoat.clearcoatFactor", "clearcoat"),
    (".KHR_materials_clearcoat.clearcoatRoughnessFactor", "clearcoat_roughness"),
    (".KHR_materials_sheen.sheenColorFactor", "sheen_color"),
    (".KHR_materials_sheen.sheenRoughnessFactor", "sheen_roughness"),
    (".KHR_materials_anisotropy.anisotropyStrength", "anisotropy"),
    (".KHR_materials_anisotropy.anisotropyRotation", "anisotropy_rotation"),
    (".KHR_materials_iridescence.iridescenceFactor", "iridescence"),
    (".KHR_materials_iridescence.iridescenceIor", "iridescence_ior"),
    (".KHR_materials_iridescence.iridescenceThicknessMaximum", "iridescence_thickness"),
    (".KHR_materials_diffuse_transmission.diffuseTransmissionFactor", "diffuse_transmission"),
    (".KHR_materials_diffuse_transmission.diffuseTransmissionColorFactor", "diffuse_transmission_color"),
];

/// Returns true for the name of a scene of arrays.
pub fn names_arrays(name: &Path) -> bool {
    NAMES.iter().any(|arrays| name == Path::new(arrays))
}

/// Replaces the place in the JSON, with which a warning begins, by the argument that is written there.
pub fn with_arguments(warning: &str) -> String {
    let argument = |place: &str| {
        let (owner, name) =
            ARGUMENTS.iter().find_map(|&(end, name)| Some((place.strip_suffix(end)?, name)))?;
        Some(format!("{name} of {}", owner.trim_end_matches(".extensions")))
    };
    match warning.split_once(": ") {
        Some((place, message)) => match argument(place) {
            Some(argument) => format!("{argument}: {message}"),
            None => warning.to_string(),
        },
        None => warning.to_string(),
    }
}
