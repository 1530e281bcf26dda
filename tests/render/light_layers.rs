//! Layers of light: they add up to the picture, and each holds the light that its name says.

use std::sync::Arc;

use blinn::accel::{Accel, AccelSettings, SimdLevel};
use blinn::geometry::{Rgb, Rgba};
use blinn::integrator::{AmbientOcclusion, Emitters, Frame, LightLayer, LightLayers, Phong};
use blinn::render::{Denoise, PixelRect, RenderSettings, render, render_light_layers};
use blinn::scene::{
    AlphaMode, AreaLightShape, ColorInput, Environment, Lighting, Material, MtlReflectance, PosedAreaLight,
    PosedLight, Projection, Reflectance, Reflection, ScalarInput, Scene, View,
};
use glam::{DAffine3, DVec3};

use crate::common::scenes::{self, add};

const SIDE: u32 = 48;

fn physical(color: Rgb, metallic: f32, roughness: f32) -> Material {
    Material {
        base_color: ColorInput::new(color),
        reflectance: Reflectance::metallic_roughness(metallic, roughness),
        reflection: Reflection::Fresnel,
        double_sided: true,
        ..Material::default()
    }
}

fn matte(albedo: f32, emission: f32) -> Material {
    Material {
        base_color: ColorInput::new(Rgb::splat(albedo)),
        emission: ColorInput::new(Rgb::splat(emission)),
        reflectance: Reflectance::Mtl(MtlReflectance::default()),
        double_sided: true,
        ..Material::default()
    }
}

fn at(x: f64, y: f64, z: f64, scale: f64) -> [DAffine3; 1] {
    [DAffine3::from_translation(DVec3::new(x, y, z)) * DAffine3::from_scale(DVec3::splat(scale))]
}

/// A floor with a ball of metal, one of glass, one that glows, and a pane in front of them.
fn still_life() -> Scene {
    let mut scene = Scene::default();
    add(&mut scene, scenes::grid(1, 1), physical(Rgb::new(0.6, 0.5, 0.4), 0.0, 0.3), &at(0.0, 0.0, 0.0, 4.0));
    add(
        &mut scene,
        scenes::ball(24, 12),
        physical(Rgb::new(0.9, 0.6, 0.2), 1.0, 0.5),
        &at(-0.9, 0.5, 0.0, 0.5),
    );
    let glass = Material { transmission: ScalarInput::new(1.0), ..physical(Rgb::ONE, 0.0, 0.0) };
    add(&mut scene, scenes::ball(24, 12), glass, &at(0.9, 0.5, 0.0, 0.5));
    let ball = scene.instances[2].mesh as usize;
    scene.meshes[ball].is_body = true;
    add(&mut scene, scenes::ball(12, 6), matte(0.5, 3.0), &at(0.0, 0.3, 0.4, 0.2));
    let mut pane = matte(0.8, 0.0);
    (pane.alpha_mode, pane.alpha) = (AlphaMode::Blend, ScalarInput::new(0.4));
    add(&mut scene, scenes::ball(12, 6), pane, &at(0.1, 0.9, 0.8, 0.3));
    scene
}

/// How a scene is lit and rendered.
struct Shot {
    lights: Vec<PosedLight>,
    has_area_light: bool,
    has_emitters: bool,
    indirect: u8,
    ambient: Rgb,
    environment: Option<Environment>,
    background: Option<Environment>,
    ao: Option<AmbientOcclusion>,
    denoise: Denoise,
    samples: u32,
    simd: SimdLevel,
    tile: u32,
    crop: Option<PixelRect>,
}

impl Default for Shot {
    fn default() -> Shot {
        Shot {
            lights: vec![PosedLight::sun(DVec3::new(0.3, -1.0, -0.4), Rgb::ONE)],
            has_area_light: false,
            has_emitters: false,
            indirect: 0,
            ambient: Rgb::ZERO,
            environment: None,
            background: None,
            ao: None,
            denoise: Denoise::Auto,
            samples: 4,
            simd: AccelSettings::default().simd,
            tile: 32,
            crop: None,
        }
    }
}

impl Shot {
    fn take(&self, scene: &Scene) -> (Vec<Rgba>, Vec<LightLayers>) {
        let posed = scenes::posed(scene);
        let settings = AccelSettings { simd: self.simd, ..AccelSettings::default() };
        let accel = Accel::build(&posed, &settings).0;
        let view = View {
            view_point: Some(DVec3::new(0.0, 1.2, 4.0)),
            view_dir: Some(DVec3::new(0.0, -0.2, -1.0)),
            projection: Some(Projection::Perspective),
            ..View::default()
        };
        let (camera, _) = view.resolve(&posed, SIDE, SIDE).unwrap();
        let lit = Lighting { sets: Some(Vec::new()), ..Lighting::default() }.resolve(&posed, &camera);
        let centre = DVec3::new(0.5, 3.0, 0.5) - posed.centre;
        let light =
            PosedAreaLight::facing(AreaLightShape::Rect, [1.0; 2], centre, DVec3::NEG_Y, Rgb::splat(8.0));
        let frame = Frame {
            lights: self.lights.clone(),
            area_lights: light.filter(|_| self.has_area_light).into_iter().collect(),
            emitters: self.has_emitters.then(|| Arc::new(Emitters::new(&posed).expect("it glows"))),
            indirect: self.indirect,
            ambient: self.ambient,
            sky: self.environment.as_ref().map(Environment::ambient_irradiance),
            environment: self.environment.clone(),
            background: self.background.clone(),
            ambient_occlusion: self.ao,
            ..Frame::new(&posed, &accel, camera, &lit)
        };
        let settings = RenderSettings {
            width: SIDE,
            height: SIDE,
            samples: self.samples,
            denoise: self.denoise,
            crop: self.crop,
            tile: self.tile,
            ..RenderSettings::default()
        };
        let picture = render(&frame, &Phong::default(), &settings, &()).unwrap().colors;
        (picture, render_light_layers(&frame, &Phong::default(), &settings, &()).unwrap())
    }

    /// The layers that hold light, after checking that they add up to the picture.
    fn lit_layers(&self, scene: &Scene, name: &str) -> Vec<LightLayer> {
        let (picture, layers) = self.take(scene);
        assert_eq!(picture.len(), layers.len(), "{name}");
        for (i, (color, layers)) in picture.iter().zip(&layers).enumerate() {
            let color = color.truncate();
            let difference = (color - layers.sum()).abs().max_element();
            assert!(
                difference <= 2e-5 * (1.0 + color.max_element()),
                "{name}: pixel {i} is off by {difference}"
            );
        }
        let is_lit = |layer: &LightLayer| layers.iter().any(|light| light[*layer].max_element() > 1e-3);
        LightLayer::ALL.into_iter().filter(is_lit).collect()
    }
}

fn soft_point() -> PosedLight {
    PosedLight { radius: 0.4, ..PosedLight::point(glam::Vec3::new(-1.0, 2.5, 1.5), Rgb::splat(4.0)) }
}

#[test]
fn layers_add_up_to_the_picture() {
    use LightLayer::{DiffuseDirect, DiffuseIndirect, Environment as Background};
    let scene = still_life();
    let all = LightLayer::ALL.to_vec();
    let without = |layers: &[LightLayer]| -> Vec<LightLayer> {
        all.iter().copied().filter(|layer| !layers.contains(layer)).collect()
    };
    let sky = || Some(Environment::uniform(Rgb::new(0.3, 0.4, 0.5)));
    let plain = Shot { denoise: Denoise::Off, ..Shot::default() };
    assert_eq!(plain.lit_layers(&scene, "a sun"), without(&[DiffuseIndirect, Background]));
    let smoothed = Shot { environment: sky(), background: sky(), ..Shot::default() };
    assert_eq!(smoothed.lit_layers(&scene, "smoothed reflections"), all);
    let area = Shot { has_area_light: true, lights: Vec::new(), ..Shot::default() };
    assert_eq!(area.lit_layers(&scene, "an area light"), without(&[DiffuseIndirect, Background]));
    let paths = Shot {
        has_area_light: true,
        has_emitters: true,
        indirect: 2,
        environment: sky(),
        background: sky(),
        ..Shot::default()
    };
    assert_eq!(paths.lit_layers(&scene, "paths"), all);
    let unfiltered = Shot { denoise: Denoise::Off, ..paths };
    assert_eq!(unfiltered.lit_layers(&scene, "paths without filter"), all);
    let soft = Shot { lights: vec![soft_point()], denoise: Denoise::On, ..Shot::default() };
    assert_eq!(soft.lit_layers(&scene, "a soft shadow"), without(&[DiffuseIndirect, Background]));
    let ao = AmbientOcclusion { samples: 4, distance: f64::INFINITY };
    let hidden = Shot { ambient: Rgb::splat(0.3), ao: Some(ao), lights: Vec::new(), ..Shot::default() };
    assert_eq!(hidden.lit_layers(&scene, "ambient occlusion"), without(&[DiffuseDirect, Background]));
}

#[test]
fn each_layer_holds_its_light_alone() {
    let floor = |material: Material| {
        let mut scene = Scene::default();
        add(&mut scene, scenes::grid(1, 1), material, &at(0.0, 0.0, 0.0, 4.0));
        scene
    };
    let dark = || Shot { lights: Vec::new(), ..Shot::default() };
    let sky = || Some(Environment::uniform(Rgb::splat(0.5)));
    let lit = |shot: Shot, material: Material| shot.lit_layers(&floor(material), "a floor");
    assert_eq!(lit(Shot::default(), matte(0.5, 0.0)), [LightLayer::DiffuseDirect]);
    assert_eq!(lit(Shot { has_area_light: true, ..dark() }, matte(0.5, 0.0)), [LightLayer::DiffuseDirect]);
    assert_eq!(lit(Shot { ambient: Rgb::ONE, ..dark() }, matte(0.5, 0.0)), [LightLayer::DiffuseIndirect]);
    assert_eq!(lit(dark(), matte(0.5, 2.0)), [LightLayer::Emission]);
    let mirror = || physical(Rgb::ONE, 1.0, 0.0);
    assert_eq!(lit(Shot { environment: sky(), ..dark() }, mirror()), [LightLayer::SpecularIndirect]);
    assert_eq!(lit(Shot { background: sky(), ..dark() }, matte(0.5, 0.0)), [LightLayer::Environment]);
    let rough = physical(Rgb::ONE, 1.0, 0.7);
    assert_eq!(lit(Shot::default(), rough), [LightLayer::SpecularDirect]);
    // The image of a lamp in a mirror is direct.
    let mut lamp = floor(mirror());
    add(&mut lamp, scenes::ball(12, 6), matte(0.0, 5.0), &at(0.0, 0.5, 0.0, 0.2));
    let layers = Shot { has_emitters: true, ..dark() }.lit_layers(&lamp, "a lamp");
    assert_eq!(layers, [LightLayer::SpecularDirect, LightLayer::Emission]);
}

#[test]
fn light_that_both_shadow_rays_and_bounces_find_is_direct() {
    // A lamp close above the floor, and nothing else: all light of the floor comes from it directly.
    let mut scene = Scene::default();
    add(&mut scene, scenes::grid(1, 1), matte(0.5, 0.0), &at(0.0, 0.0, 0.0, 4.0));
    add(&mut scene, scenes::ball(12, 6), matte(0.0, 5.0), &at(0.0, 0.3, 0.0, 0.2));
    let shot = Shot {
        lights: Vec::new(),
        has_emitters: true,
        indirect: 1,
        denoise: Denoise::Off,
        samples: 16,
        ..Shot::default()
    };
    assert_eq!(shot.lit_layers(&scene, "a lamp"), [LightLayer::DiffuseDirect, LightLayer::Emission]);
}

#[test]
fn layers_do_not_depend_on_tiles_simd_levels_or_crops() {
    let scene = still_life();
    let shot = || Shot { has_area_light: true, indirect: 1, ..Shot::default() };
    let (_, expected) = shot().take(&scene);
    let bits = |layers: &[LightLayers]| -> Vec<u32> {
        let values =
            |light: &LightLayers| LightLayer::ALL.map(|layer| light[layer].to_array().map(f32::to_bits));
        layers.iter().flat_map(values).flatten().collect()
    };
    assert!(bits(&Shot { tile: 7, ..shot() }.take(&scene).1) == bits(&expected), "tiles");
    for simd in scenes::simd_levels() {
        assert!(bits(&Shot { simd, ..shot() }.take(&scene).1) == bits(&expected), "{simd:?}");
    }
    let crop = PixelRect { x: 11, y: 5, width: 20, height: 30 };
    let part: Vec<LightLayers> = (crop.y..crop.y + crop.height)
        .flat_map(|y| (crop.x..crop.x + crop.width).map(move |x| (y * SIDE + x) as usize))
        .map(|i| expected[i])
        .collect();
    assert!(bits(&Shot { crop: Some(crop), ..shot() }.take(&scene).1) == bits(&part), "a crop");
}
