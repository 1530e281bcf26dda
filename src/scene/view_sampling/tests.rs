use super::*;

fn direction(orbit: &Orbit) -> DVec3 {
    let (y, r) = (libm::sin(orbit.elevation), libm::cos(orbit.elevation));
    DVec3::new(r * libm::sin(orbit.azimuth), y, r * libm::cos(orbit.azimuth))
}

fn views(sampling: &ViewSampling, n: u32) -> Vec<SampledView> {
    let positions = if sampling.layout == ViewLayout::Icosphere { icosphere(n) } else { Vec::new() };
    (0..n).map(|i| sampling.view(i, n, &positions)).collect()
}

fn directions(sampling: &ViewSampling, n: u32) -> Vec<DVec3> {
    views(sampling, n).iter().map(|view| direction(&view.orbit)).collect()
}

const LAYOUTS: [ViewLayout; 6] = [
    ViewLayout::Sphere,
    ViewLayout::Hemisphere,
    ViewLayout::Ring,
    ViewLayout::Icosphere,
    ViewLayout::Random,
    ViewLayout::Stereo { baseline: None },
];

#[test]
fn the_default_is_the_fibonacci_sphere() {
    for n in [1, 7, 100] {
        for (i, view) in (0..).zip(views(&ViewSampling::default(), n)) {
            assert_eq!(view, SampledView::at(Orbit::fibonacci_sphere(i, n)));
        }
    }
}

/// The mean of x, y, z and of their squares over a sphere are 0 and 1/3; over the upper half the mean height is 1/2.
#[test]
fn positions_are_uniform_on_the_sphere_and_the_hemisphere() {
    let n = 2562;
    for (layout, height, tolerance) in [
        (ViewLayout::Sphere, 0.0, 0.003),
        (ViewLayout::Hemisphere, 0.5, 0.003),
        (ViewLayout::Icosphere, 0.0, 0.003),
        // Three standard errors: σ / √n with σ = 1/√3.
        (ViewLayout::Random, 0.0, 3.0 * 0.577 / 50.6),
    ] {
        let all = directions(&ViewSampling { layout, ..ViewSampling::default() }, n);
        let mean = all.iter().sum::<DVec3>() / f64::from(n);
        let squares = all.iter().map(|v| *v * *v).sum::<DVec3>() / f64::from(n);
        assert!((mean - DVec3::new(0.0, height, 0.0)).abs().max_element() < tolerance, "{layout:?}: {mean}");
        assert!((squares - 1.0 / 3.0).abs().max_element() < tolerance, "{layout:?}: {squares}");
        assert!(all.iter().all(|v| (v.length() - 1.0).abs() < 1e-12));
    }
    // Kolmogorov–Smirnov: heights of random views are uniform in −1…1; 1.95/√n is exceeded once in 1000.
    let mut heights: Vec<f64> =
        directions(&ViewSampling { layout: ViewLayout::Random, ..ViewSampling::default() }, n)
            .iter()
            .map(|v| v.y)
            .collect();
    heights.sort_by(f64::total_cmp);
    let gap = |(i, y): (usize, &f64)| (0.5 * (y + 1.0) - (i as f64 + 0.5) / f64::from(n)).abs();
    let largest = heights.iter().enumerate().map(gap).fold(0.0, f64::max);
    assert!(largest < 1.95 / f64::from(n).sqrt(), "{largest}");
}

#[test]
fn ranges_hold_for_every_layout() {
    let range = (0.2f64, 0.7);
    for layout in LAYOUTS {
        let elevation = (layout != ViewLayout::Icosphere).then_some(range);
        let sampling = ViewSampling {
            layout,
            elevation,
            distance: Some(DistanceRange::Framed(1.5, 2.0)),
            roll: 0.3,
            look_at_jitter: 0.25,
            random_lights: true,
            random_environment: true,
            seed: 3,
        };
        let all = views(&sampling, 642);
        let spread = |value: &dyn Fn(&SampledView) -> f64, low: f64, high: f64| {
            let values: Vec<f64> = all.iter().map(value).collect();
            let (least, most) = values.iter().fold((f64::MAX, f64::MIN), |(a, b), &x| (a.min(x), b.max(x)));
            let margin = 0.02 * (high - low);
            assert!(least >= low && most <= high, "{layout:?}: {least} … {most}, not {low} … {high}");
            assert!(least < low + margin && most > high - margin, "{layout:?}: {least} … {most}");
        };
        if elevation.is_some() {
            spread(&|view| view.orbit.elevation, range.0 - 1e-12, range.1 + 1e-12);
        }
        let distance = |view: &SampledView| match view.distance {
            Some(SampledDistance::Framed(factor)) => factor,
            other => panic!("{other:?}"),
        };
        spread(&distance, 1.5, 2.0);
        spread(&|view| view.roll, -0.3, 0.3);
        spread(&|view| view.light.sources, 0.0, 360.0);
        spread(&|view| view.light.environment, 0.0, 360.0);
        let offsets: Vec<f64> = all.iter().map(|view| view.look_at_offset.length()).collect();
        assert!(offsets.iter().all(|&length| length <= 0.25 + 1e-12));
        // An eighth of a ball lies within half its radius.
        let inner = offsets.iter().filter(|&&length| length < 0.125).count();
        assert!((40..130).contains(&inner), "{inner}");
    }
}

/// Exactly those settings are random whose views another seed changes.
#[test]
fn random_settings_depend_on_the_seed() {
    let plain = ViewSampling::default();
    let layouts = [
        ViewLayout::Sphere,
        ViewLayout::Hemisphere,
        ViewLayout::Ring,
        ViewLayout::Icosphere,
        ViewLayout::Random,
        ViewLayout::Stereo { baseline: None },
    ];
    let mut all: Vec<ViewSampling> = layouts.map(|layout| ViewSampling { layout, ..plain }).to_vec();
    all.extend([
        ViewSampling { layout: ViewLayout::Ring, elevation: Some((0.1, 0.1)), ..plain },
        ViewSampling { layout: ViewLayout::Ring, elevation: Some((0.1, 0.5)), ..plain },
        ViewSampling { elevation: Some((0.1, 0.5)), ..plain },
        ViewSampling { distance: Some(DistanceRange::Metres(2.0, 2.0)), ..plain },
        ViewSampling { distance: Some(DistanceRange::Metres(2.0, 3.0)), ..plain },
        ViewSampling { distance: Some(DistanceRange::Framed(1.0, 2.0)), ..plain },
        ViewSampling { roll: 0.1, ..plain },
        ViewSampling { look_at_jitter: 0.1, ..plain },
        ViewSampling { random_lights: true, ..plain },
        ViewSampling { random_environment: true, ..plain },
    ]);
    let mut random = 0;
    for sampling in all {
        let views = |seed| {
            let sampling = ViewSampling { seed, ..sampling };
            (0..12).map(|i| sampling.view(i, 12, &icosphere(12))).collect::<Vec<_>>()
        };
        assert_eq!(sampling.is_random(), views(1) != views(2), "{sampling:?}");
        random += usize::from(sampling.is_random());
    }
    assert_eq!(random, 8);
}

/// A random view does not depend on the number of views, and no view on another one.
#[test]
fn random_views_are_independent_of_their_number() {
    let sampling = ViewSampling {
        layout: ViewLayout::Random,
        roll: 1.0,
        look_at_jitter: 1.0,
        ..ViewSampling::default()
    };
    let all = views(&sampling, 100);
    assert_eq!(all[..10], views(&sampling, 10));
    let other = views(&ViewSampling { seed: 1, ..sampling }, 100);
    assert!(all.iter().zip(&other).all(|(a, b)| a.orbit != b.orbit && a.roll != b.roll));
    // Rolls and offsets of the other layouts likewise.
    let on_ring = |n| views(&ViewSampling { layout: ViewLayout::Ring, ..sampling }, n);
    assert!(
        on_ring(5)
            .iter()
            .zip(on_ring(9))
            .all(|(a, b)| a.roll == b.roll && a.look_at_offset == b.look_at_offset)
    );
    let rolls: std::collections::BTreeSet<u64> = all.iter().map(|view| view.roll.to_bits()).collect();
    assert_eq!(rolls.len(), 100);
}

#[test]
fn an_icosphere_has_distinct_vertices_from_the_top_down() {
    for n in [12, 42, 162, 642] {
        let all = icosphere(n);
        assert_eq!(all.len(), n as usize);
        assert!(all.windows(2).all(|pair| pair[0].y >= pair[1].y - 1e-9));
        let spacing = (8.0 * PI / 3f64.sqrt() / f64::from(n)).sqrt();
        for (i, a) in all.iter().enumerate() {
            let others = all.iter().enumerate().filter(|(j, _)| *j != i).map(|(_, b)| a.distance(*b));
            assert!(others.fold(2.0, f64::min) > 0.75 * spacing, "{n}: {i}");
        }
    }
    let check = |layout: ViewLayout, n, ranged| layout.check(n, ranged);
    assert!(check(ViewLayout::Icosphere, 13, false).unwrap_err().contains("has 12, 42, 162, 642"));
    assert!(check(ViewLayout::Icosphere, 42, true).unwrap_err().contains("fixed elevations"));
    assert!(check(ViewLayout::Stereo { baseline: None }, 3, false).unwrap_err().contains("3 is odd"));
    assert!(LAYOUTS.iter().all(|layout| check(*layout, 12, false).is_ok()));
}

#[test]
fn cameras_are_placed_as_sampled() {
    use crate::{ClipPlanes, Projection};
    let centre = DVec3::new(1.0, 2.0, -3.0);
    let orbit = Orbit { azimuth: 0.7, elevation: 0.4, distance: None };
    let basis = orbit.basis();
    let framed = Camera {
        view_point: centre + basis.w * 10.0,
        basis,
        view_width: 1.0,
        view_height: 1.0,
        view_centre: Default::default(),
        proj_distance: 1.0,
        projection: Projection::Perspective,
        clip: ClipPlanes::OFF,
        lens: None,
    };
    let placed = |change: &dyn Fn(&mut SampledView)| {
        let mut view = SampledView::at(orbit);
        change(&mut view);
        let mut camera = framed;
        view.place(&mut camera, centre, 2.0);
        assert!(camera.basis.is_orthonormal());
        camera
    };
    assert_eq!(placed(&|_| {}), framed);
    let near = placed(&|view| view.distance = Some(SampledDistance::Metres(4.0)));
    assert!((near.view_point.distance(centre) - 4.0).abs() < 1e-12);
    let far = placed(&|view| view.distance = Some(SampledDistance::Framed(1.5)));
    assert!((far.view_point.distance(centre) - 15.0).abs() < 1e-12);
    let offset = DVec3::new(0.3, -0.2, 0.1);
    let aside = placed(&|view| view.look_at_offset = offset);
    let looks_at = (centre + offset * 2.0 - aside.view_point).normalize();
    assert!((looks_at + aside.basis.w).length() < 1e-12 && aside.view_point == framed.view_point);
    let rolled = placed(&|view| view.roll = 0.3);
    assert!((rolled.basis.u.dot(framed.basis.u) - libm::cos(0.3)).abs() < 1e-12);
    assert!(rolled.basis.u.dot(framed.basis.v) > 0.0 && rolled.basis.w == framed.basis.w);
    let eye = |side: f64, baseline| placed(&|view| view.stereo = Some(StereoEye { side, baseline }));
    for (baseline, metres) in [(None, 10.0 / 30.0), (Some(0.06), 0.06)] {
        let (left, right) = (eye(-1.0, baseline), eye(1.0, baseline));
        assert!((right.view_point - left.view_point - framed.basis.u * metres).length() < 1e-12);
        assert_eq!((left.basis, right.basis), (framed.basis, framed.basis));
    }
}
