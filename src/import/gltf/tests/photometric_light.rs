//! EXT_lights_ies.

use glam::{DVec3, Vec3};
use serde_json::{Value, json};

use super::super::fixture::Fixture;
use blinn_scene::{LightKind, LightUnits, PoseSettings, PosedLight, PosedLightKind, Scene, pose};

const NAME: &str = "EXT_lights_ies";

/// 200 cd along the aim, 100 cd at right angles towards +X, 60 cd towards +Y.
const IES: &str = "IESNA:LM-63-2002\nTILT=NONE\n1 1000 2 2 2 1 2 0 0 0\n1 1 60\n0 90\n0 90\n100 50\n100 30\n";

/// A triangle, and a node with this member for the light of `IES`, from a buffer view.
fn lamp(node: Value) -> Fixture {
    let mut fixture = Fixture::triangle();
    let view = fixture.view(IES.as_bytes());
    let light = json!({"name": "Lamp", "bufferView": view, "mimeType": "application/x-ies-lm-63"});
    fixture.json["extensions"] = json!({NAME: {"lights": [light]}});
    fixture.json["extensionsUsed"] = json!([NAME]);
    fixture.json["extensionsRequired"] = json!([NAME]);
    fixture.node(json!({"extensions": {NAME: node}}));
    fixture
}

fn posed(scene: &Scene, time: f64) -> Vec<PosedLight> {
    let settings = PoseSettings { centre: Some(DVec3::ZERO), time, ..PoseSettings::default() };
    pose(scene, &settings).unwrap().lights(LightUnits::Unitless, 1.0)
}

/// Intensity of the only light towards `d`, in the file's unit.
fn intensity(lights: &[PosedLight], d: Vec3) -> Vec3 {
    let [light] = lights else { panic!("{lights:?}") };
    let p = light.position().unwrap() + 2.0 * d.normalize();
    light.intensity * (light.sample(p).attenuation * 4.0 * std::f32::consts::PI)
}

#[test]
fn profiles_are_read_from_buffer_views_data_and_files() {
    let of_view = lamp(json!({"light": 0}));
    let mut of_data = of_view.clone();
    let text = IES.replace('\n', "%0A").replace(' ', "%20");
    of_data.json["extensions"][NAME]["lights"][0] =
        json!({"uri": format!("data:application/x-ies-lm-63,{text}")});
    for fixture in [of_view, of_data] {
        let (scene, warnings) = fixture.load();
        assert!(warnings.is_empty(), "{warnings:?}");
        assert_eq!(scene.lights[0].kind, LightKind::Photometric { profile: 0 });
        let lights = posed(&scene, 0.0);
        for (d, expected) in [(Vec3::NEG_Z, 200.0), (Vec3::X, 100.0), (Vec3::NEG_Y, 60.0), (Vec3::Z, 0.0)] {
            let found = intensity(&lights, d);
            assert!(found.abs_diff_eq(Vec3::splat(expected), 1e-3), "{d}: {found}");
        }
    }
}

#[test]
fn nodes_turn_tint_and_scale_their_profiles() {
    let mut fixture = lamp(json!({"light": 0, "multiplier": 0.5, "color": [1, 0.5, 0]}));
    // −Z of the node points down, its X axis along −Z; scales and a mirror image change no intensity.
    let half = 0.5f64;
    fixture.json["nodes"][1]["rotation"] = json!([-half, half, -half, half]);
    fixture.json["nodes"][1]["scale"] = json!([3, 0.5, 7]);
    fixture.json["nodes"][1]["translation"] = json!([1, 2, 3]);
    let (scene, warnings) = fixture.load();
    assert!(warnings.is_empty(), "{warnings:?}");
    let lights = posed(&scene, 0.0);
    let q = glam::Quat::from_xyzw(-0.5, 0.5, -0.5, 0.5);
    for (d, expected) in [(Vec3::NEG_Z, 100.0), (Vec3::X, 50.0), (Vec3::Y, 30.0)] {
        let found = intensity(&lights, q * d);
        assert!(found.abs_diff_eq(expected * Vec3::new(1.0, 0.5, 0.0), 1e-3), "{d}: {found}");
    }
    let PosedLightKind::Photometric { profile, .. } = &lights[0].kind else { panic!() };
    assert_eq!(profile.peak(), 200.0);
}

/// A program without profiles shows the light of KHR_lights_punctual at the same node.
#[test]
fn a_profile_replaces_the_punctual_light_of_its_node() {
    let mut fixture = lamp(json!({"light": 0}));
    fixture.json["extensions"]["KHR_lights_punctual"] = json!({"lights": [{"type": "point"}]});
    fixture.json["nodes"][1]["extensions"]["KHR_lights_punctual"] = json!({"light": 0});
    let kinds = |fixture: &Fixture| fixture.load().0.lights.iter().map(|l| l.kind.name()).collect::<Vec<_>>();
    assert_eq!(kinds(&fixture), ["photometric"]);
    fixture.json["extensions"][NAME]["lights"][0] = json!({"uri": "missing.ies"});
    assert_eq!(kinds(&fixture), ["point"]);
}

#[test]
fn nodes_share_a_profile() {
    let mut fixture = lamp(json!({"light": 0}));
    fixture.node(json!({"extensions": {NAME: {"light": 0, "multiplier": 2}}}));
    let (scene, _) = fixture.load();
    assert_eq!((scene.lights.len(), scene.light_profiles.len()), (2, 1));
    assert_eq!(scene.lights.iter().map(|l| scene.peak_intensity(l)).collect::<Vec<_>>(), [200.0, 400.0]);
}

#[test]
fn multiplier_and_colour_can_be_animated() {
    let mut fixture = lamp(json!({"light": 0}));
    let times = fixture.floats("SCALAR", 1, &[0.0, 1.0]);
    let multipliers = fixture.floats("SCALAR", 1, &[1.0, 3.0]);
    let colors = fixture.vec3(&[[1.0, 1.0, 1.0], [0.0, 1.0, 0.5]]);
    let channel = |sampler: usize, member: &str| {
        let pointer = format!("/nodes/1/extensions/{NAME}/{member}");
        json!({"sampler": sampler, "target": {"path": "pointer",
            "extensions": {"KHR_animation_pointer": {"pointer": pointer}}}})
    };
    fixture.push(
        "animations",
        json!({"samplers": [{"input": times, "output": multipliers}, {"input": times, "output": colors}],
            "channels": [channel(0, "multiplier"), channel(1, "color")]}),
    );
    let (scene, warnings) = fixture.load();
    assert!(warnings.is_empty(), "{warnings:?}");
    let at = |time| intensity(&posed(&scene, time), Vec3::NEG_Z);
    assert!(at(0.0).abs_diff_eq(Vec3::splat(200.0), 1e-3), "{}", at(0.0));
    assert!(at(1.0).abs_diff_eq(Vec3::new(0.0, 600.0, 300.0), 1e-3), "{}", at(1.0));
}

#[test]
fn what_cannot_be_read_is_a_warning() {
    let check = |edit: &dyn Fn(&mut Fixture), expected: &str, lights: usize| {
        let mut fixture = lamp(json!({"light": 0}));
        edit(&mut fixture);
        let (scene, warnings) = fixture.load();
        assert!(warnings.iter().any(|w| w.starts_with(expected)), "{expected}: {warnings:?}");
        assert_eq!(scene.lights.len(), lights, "{expected}");
    };
    let light = |value: Value| move |f: &mut Fixture| f.json["extensions"][NAME]["lights"][0] = value.clone();
    let node = |value: Value| move |f: &mut Fixture| f.json["nodes"][1]["extensions"][NAME] = value.clone();
    let at = format!("extensions.{NAME}.lights[0]: ");
    check(&light(json!({})), &(at.clone() + "has neither uri nor bufferView; the light is missing"), 0);
    check(&light(json!({"uri": "data:,hello"})), &(at.clone() + "no IES file: it has no line TILT="), 0);
    check(&light(json!({"uri": "missing.ies"})), &at, 0);
    check(&light(json!({"bufferView": "x"})), &(at.clone() + "bufferView is no index"), 0);
    check(&light(json!({"bufferView": 99})), &at, 0);
    let negative = IES.replace("100 30", "100 -30").replace('\n', "%0A").replace(' ', "%20");
    let negative = json!({"uri": format!("data:,{negative}")});
    check(&light(negative), &(at.clone() + "1 intensities below 0 are read as 0"), 1);
    let at = format!("nodes[1].extensions.{NAME}");
    check(&node(json!({"light": 3})), &format!("{at}.light: ignored light 3, which does not exist"), 0);
    check(&node(json!({})), &format!("{at}: ignored light without an index"), 0);
    check(
        &node(json!({"light": 0, "multiplier": -1})),
        &format!("{at}.multiplier: ignored invalid value -1"),
        1,
    );
    check(&node(json!({"light": 0, "color": [1, 2]})), &format!("{at}.color: ignored invalid value"), 1);
    check(&node(json!({"light": 0, "color": [1, 2, 0]})), &format!("{at}.color: values outside"), 1);
    check(
        &|f| f.json["extensions"][NAME] = json!(3),
        &format!("extensions.{NAME}: ignored invalid value 3"),
        0,
    );
}
