//! Names of layers, and those that other programs have for them.

use crate::options::CRYPTOMATTE;
use blinn_core::closest_name::did_you_mean;
use blinn_render::integrator::Aov;

/// Names of passes of Blender, Arnold, V-Ray and datasets in lower case, and the layers here.
const OTHER_NAMES: [(&[&str], Aov); 16] = [
    (&["z", "zdepth", "z-depth", "mist"], Aov::Depth),
    (&["n", "shading-normal"], Aov::Normal),
    (&["ng", "face-normal"], Aov::GeometricNormal),
    (&["p", "world-position", "xyz"], Aov::Position),
    (&["diffcol", "diffuse-color", "denoising-albedo", "base-color", "basecolor"], Aov::Albedo),
    (&["st", "texcoord"], Aov::Uv),
    (&["alpha", "silhouette"], Aov::Mask),
    (&["indexob", "object-index", "segmentation", "instance-id", "id"], Aov::ObjectId),
    (&["indexma", "material-index"], Aov::MaterialId),
    (&["vector", "motion", "motion-vector", "flow", "optical-flow"], Aov::FlowForward),
    (&["diffdir"], Aov::DiffuseDirect),
    (&["diffind"], Aov::DiffuseIndirect),
    (&["glossdir", "glossy-direct", "specdir"], Aov::SpecularDirect),
    (&["glossind", "glossy-indirect", "specind"], Aov::SpecularIndirect),
    (&["emit"], Aov::Emission),
    (&["env"], Aov::Environment),
];

/// Names of Cryptomatte's passes in lower case.
const MATTES: [&str; 4] = ["crypto", "cryptoobject", "cryptomaterial", "cryptoasset"];

/// The names of all layers.
pub fn layer_names() -> impl Iterator<Item = &'static str> {
    Aov::ALL.iter().map(|aov| aov.name()).chain([CRYPTOMATTE])
}

/// Returns `; did you mean 'depth'?` for a layer that does not exist, in any case, or nothing if no name is close.
pub fn layer_hint(name: &str) -> String {
    let folded = name.to_lowercase().replace(['_', ' '], "-");
    let other = OTHER_NAMES.iter().find(|(names, _)| names.contains(&folded.as_str()));
    match other {
        Some((_, aov)) => format!("; did you mean '{}'?", aov.name()),
        None if MATTES.contains(&folded.as_str()) => format!("; did you mean '{CRYPTOMATTE}'?"),
        None => did_you_mean(name, layer_names()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_other_programs_are_no_layers() {
        let others = OTHER_NAMES.iter().flat_map(|(names, _)| names.iter()).chain(&MATTES);
        for other in others {
            assert!(layer_names().all(|name| name != *other), "{other}");
            assert_eq!(*other, other.to_lowercase().replace('_', "-"));
        }
    }

    #[test]
    fn hints_ignore_case() {
        for (name, layer) in [
            ("Normal", "normal"),
            ("Z", "depth"),
            ("Object_Index", "object-id"),
            ("CryptoObject", "cryptomatte"),
            ("CRYPTOMATTE", "cryptomatte"),
            ("DiffCol", "albedo"),
            ("normals", "normal"),
        ] {
            assert_eq!(layer_hint(name), format!("; did you mean '{layer}'?"));
        }
        assert_eq!(layer_hint("colour"), "");
    }
}
