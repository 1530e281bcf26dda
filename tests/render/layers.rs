//! Layers of materials: white furnaces, and light that only they reflect.

use blinn::geometry::Rgb;
use blinn::scene::{
    Anisotropy, Clearcoat, ColorInput, Iridescence, Material, ScalarInput, Sheen, SheenModel,
};

use crate::reflections::{physical, range};

const ROUGHNESSES: [f32; 4] = [0.1, 0.35, 0.6, 1.0];

fn sheen(color: f32, roughness: f32) -> Sheen {
    let (color, roughness) = (ColorInput::new(Rgb::splat(color)), ScalarInput::new(roughness));
    Sheen { color, roughness, ..Sheen::default() }
}

/// White furnace: what absorbs nothing is as bright as its surroundings.
#[test]
fn white_fabrics_vanish_in_a_white_world() {
    for roughness in ROUGHNESSES {
        for metallic in [0.0, 1.0] {
            let (low, high) =
                range(Material { sheen: sheen(1.0, roughness), ..physical(1.0, metallic, 0.5) });
            assert!(low > 0.99 && high <= 1.0 + 1e-5, "sheen of roughness {roughness}: {low} to {high}");
        }
    }
}

/// The same for the fibres that Blender shows.
#[test]
fn white_microfibres_vanish_in_a_white_world() {
    for roughness in ROUGHNESSES {
        let sheen = Sheen { model: SheenModel::Microfibres, ..sheen(1.0, roughness) };
        let (low, high) = range(Material { sheen, ..physical(1.0, 0.0, 0.5) });
        assert!(low > 0.99 && high <= 1.0 + 1e-5, "sheen of roughness {roughness}: {low} to {high}");
    }
}

/// A coat above a sheen leaves it less light, and reflects the rest.
#[test]
fn coated_white_fabrics_vanish_in_a_white_world() {
    let clearcoat =
        Clearcoat { factor: ScalarInput::new(1.0), roughness: ScalarInput::new(0.2), normal: None };
    let (low, high) = range(Material { clearcoat, sheen: sheen(1.0, 0.5), ..physical(1.0, 0.0, 0.5) });
    assert!(low > 0.98 && high <= 1.0 + 1e-5, "{low} to {high}");
}

/// On black, only the sheen is left: little in the middle, much at the rim.
#[test]
fn a_sheen_is_brightest_at_the_rim() {
    let (low, high) = range(Material { sheen: sheen(1.0, 0.4), ..physical(0.0, 0.0, 1.0) });
    assert!(low < 0.15 && high > 0.5, "{low} to {high}");
    // Blender's fibres are a narrower rim.
    let sheen = Sheen { model: SheenModel::Microfibres, ..sheen(1.0, 0.4) };
    let (low, high) = range(Material { sheen, ..physical(0.0, 0.0, 1.0) });
    assert!(low < 0.1 && high > 0.25, "{low} to {high}");
}

/// A ball without tangents has round highlights; its furnace is the same.
#[test]
fn stretched_metal_without_tangents_vanishes_in_a_white_world() {
    let anisotropy = Some(Anisotropy { strength: 1.0, rotation: 0.5, ..Anisotropy::default() });
    for roughness in ROUGHNESSES {
        let (low, high) = range(Material { anisotropy, ..physical(1.0, 1.0, roughness) });
        assert!(low > 0.99 && high <= 1.0 + 1e-5, "roughness {roughness}: {low} to {high}");
    }
}

fn film(thickness: f32) -> Iridescence {
    Iridescence { factor: ScalarInput::new(1.0), max_thickness: thickness, ..Iridescence::default() }
}

/// A film absorbs nothing, and what it does not reflect a white metal does. Over a white base, the colour that is reflected most
/// is as bright as the surroundings, and no colour is brighter.
#[test]
fn white_surfaces_under_a_film_never_exceed_a_white_world() {
    for (roughness, thickness) in [(0.0, 250.0), (0.1, 400.0), (0.35, 550.0), (0.6, 900.0), (1.0, 400.0)] {
        let (low, high) = range(Material { iridescence: film(thickness), ..physical(1.0, 1.0, roughness) });
        assert!(low > 0.99 && high <= 1.0 + 1e-5, "roughness {roughness}: {low} to {high}");
        let (low, high) = range(Material { iridescence: film(thickness), ..physical(1.0, 0.0, roughness) });
        assert!(low > 0.8 && high > 0.99 && high <= 1.0 + 1e-5, "roughness {roughness}: {low} to {high}");
    }
}
