use super::*;

const STEPS: usize = 37;

fn every_five_degrees(first: f64, last: f64) -> Vec<f64> {
    let count = ((last - first) / 5.0) as usize;
    (0..=count).map(|i| first + 5.0 * i as f64).collect()
}

/// A profile of the function `f` of direction, measured at these angles.
fn measured(photometry: Photometry, v: Vec<f64>, h: Vec<f64>, f: impl Fn(DVec3) -> f64) -> LightProfile {
    let direction = |v: f64, h: f64| {
        let ((sv, cv), (sh, ch)) = (v.to_radians().sin_cos(), h.to_radians().sin_cos());
        match photometry {
            Photometry::TypeC => DVec3::new(sv * ch, sv * sh, -cv),
            Photometry::TypeB => DVec3::new(ch * sv, -sh, -ch * cv),
            Photometry::TypeA => DVec3::new(sv, -cv * sh, -cv * ch),
        }
    };
    let candela: Vec<f32> = h
        .iter()
        .flat_map(|&h| v.iter().map(move |&v| (v, h)))
        .map(|(v, h)| f(direction(v, h)) as f32)
        .collect();
    LightProfile::new(photometry, v, h, &candela).unwrap()
}

/// Directions all over the sphere.
fn directions() -> impl Iterator<Item = DVec3> {
    (0..2000).map(|i| {
        let z = (f64::from(i) + 0.5) / 1000.0 - 1.0;
        let (sin, cos) = (f64::from(i) * 2.399_963).sin_cos();
        DVec3::new(cos, sin, 0.0) * (1.0 - z * z).sqrt() + DVec3::Z * z
    })
}

/// A beam towards −Z that is turned a little towards +X and −Y. The square is smooth where the beam ends.
fn beam(d: DVec3) -> f64 {
    let d = d.normalize();
    20.0 * (-d.z + 0.2 * d.x - 0.1 * d.y).max(0.0).powi(2)
}

#[test]
fn profiles_of_every_type_give_the_function_that_was_measured() {
    let half = every_five_degrees(-90.0, 90.0);
    let profiles = [
        measured(Photometry::TypeC, every_five_degrees(0.0, 180.0), every_five_degrees(0.0, 360.0), beam),
        measured(Photometry::TypeC, every_five_degrees(0.0, 180.0), every_five_degrees(0.0, 355.0), beam),
        measured(Photometry::TypeB, half.clone(), half.clone(), beam),
        measured(Photometry::TypeA, half.clone(), half, beam),
    ];
    for profile in &profiles {
        assert_eq!(profile.vertical.len(), STEPS);
        let is_half = profile.photometry != Photometry::TypeC;
        let mut lit = 0;
        for d in directions().filter(|d| !is_half || d.z < 0.0) {
            let value = f64::from(profile.relative_intensity(d) * profile.peak());
            assert!((value - beam(d)).abs() < 0.15, "{:?} {d}: {value} {}", profile.photometry, beam(d));
            lit += usize::from(value > 1.0);
        }
        assert!(lit > 500, "{lit}");
        let behind = profile.relative_intensity(DVec3::Z);
        assert_eq!(behind, 0.0, "{:?}", profile.photometry);
    }
}

#[test]
fn symmetric_profiles_mirror_their_planes() {
    let quadrant = |d: DVec3| 10.0 + 5.0 * d.x.abs() + 2.0 * d.y.abs();
    let half = |d: DVec3| 10.0 + 5.0 * d.x + 2.0 * d.y.abs();
    let turned = |d: DVec3| 10.0 + 5.0 * d.x.abs() - 2.0 * d.y;
    let v = || every_five_degrees(0.0, 180.0);
    let check = |profile: &LightProfile, f: &dyn Fn(DVec3) -> f64| {
        for d in directions() {
            let value = f64::from(profile.relative_intensity(d) * profile.peak());
            assert!((value - f(d)).abs() < 0.05, "{:?} {d}: {value} {}", profile.symmetry, f(d));
        }
    };
    let c = Photometry::TypeC;
    check(&measured(c, v(), every_five_degrees(0.0, 90.0), quadrant), &quadrant);
    check(&measured(c, v(), every_five_degrees(0.0, 180.0), half), &half);
    check(&measured(c, v(), every_five_degrees(90.0, 270.0), turned), &turned);
    let axial = |d: DVec3| 3.0 - d.z;
    check(&measured(c, v(), vec![0.0], axial), &axial);
    // Types A and B mirror at 0.
    let front = |d: DVec3| 10.0 + 5.0 * d.x.abs() + 2.0 * d.y.abs();
    let quarter = || every_five_degrees(0.0, 90.0);
    for photometry in [Photometry::TypeA, Photometry::TypeB] {
        let profile = measured(photometry, quarter(), quarter(), front);
        for d in directions().filter(|d| d.z < 0.0) {
            let value = f64::from(profile.relative_intensity(d) * profile.peak());
            assert!((value - front(d)).abs() < 0.05, "{photometry:?} {d}: {value} {}", front(d));
        }
    }
}

/// Means over the sphere: 1 of a constant, ½ of a hemisphere, ¼ of its cosine.
#[test]
fn the_mean_intensity_is_that_of_the_sphere() {
    let cosine = |d: DVec3| (-d.z).max(0.0);
    let near = |profile: &LightProfile, mean: f64, tolerance: f64| {
        let found = f64::from(profile.relative_mean());
        assert!((found - mean).abs() < tolerance, "{:?}: {found} {mean}", profile.photometry);
    };
    let c = Photometry::TypeC;
    for h in [
        vec![0.0],
        every_five_degrees(0.0, 90.0),
        every_five_degrees(0.0, 360.0),
        every_five_degrees(0.0, 355.0),
    ] {
        near(&measured(c, vec![0.0, 180.0], h.clone(), |_| 7.0), 1.0, 1e-6);
        near(&measured(c, vec![0.0, 90.0], h.clone(), |_| 7.0), 0.5, 1e-6);
        near(&measured(c, every_five_degrees(0.0, 180.0), h, cosine), 0.25, 1e-3);
    }
    for photometry in [Photometry::TypeA, Photometry::TypeB] {
        for angles in [every_five_degrees(0.0, 90.0), every_five_degrees(-90.0, 90.0)] {
            near(&measured(photometry, angles.clone(), angles.clone(), |_| 7.0), 0.5, 1e-6);
            near(&measured(photometry, angles.clone(), angles, cosine), 0.25, 1e-3);
        }
    }
    let mean = directions().map(beam).sum::<f64>() / 2000.0;
    let profile = measured(c, every_five_degrees(0.0, 180.0), every_five_degrees(0.0, 360.0), beam);
    near(&profile, mean / f64::from(profile.peak()), 1e-3);
}

#[test]
fn invalid_profiles_are_errors() {
    let error = |v: &[f64], h: &[f64], candela: &[f32]| {
        LightProfile::new(Photometry::TypeC, v.to_vec(), h.to_vec(), candela).unwrap_err()
    };
    assert_eq!(error(&[], &[0.0], &[]), "there are no vertical angles");
    assert!(error(&[0.0, 0.0], &[0.0], &[1.0; 2]).contains("do not ascend: 0 degrees is followed by 0"));
    assert!(error(&[0.0, 200.0], &[0.0], &[1.0; 2]).contains("angle 200 is not from 0 to 180"));
    assert!(error(&[f64::NAN], &[0.0], &[1.0]).contains("angle NaN"));
    assert!(error(&[0.0, 90.0], &[0.0, 60.0], &[1.0; 4]).contains("go from 0 to 60 degrees"));
    assert!(error(&[0.0, 90.0], &[0.0], &[1.0]).contains("1 intensities do not fit 1 × 2 angles"));
    assert!(error(&[0.0, 90.0], &[0.0], &[1.0, -1.0]).contains("intensity -1 "));
}

#[test]
fn profiles_without_light_are_dark() {
    let dark = LightProfile::new(Photometry::TypeC, vec![0.0, 180.0], vec![0.0], &[0.0; 2]).unwrap();
    assert_eq!((dark.peak(), dark.relative_intensity(DVec3::X), dark.relative_mean()), (0.0, 0.0, 0.0));
    // One measured angle is a direction, with no light beside it.
    let single = LightProfile::new(Photometry::TypeC, vec![0.0], vec![0.0], &[5.0]).unwrap();
    assert_eq!(single.relative_intensity(DVec3::NEG_Z), 1.0);
    assert_eq!(single.relative_intensity(DVec3::X), 0.0);
}
