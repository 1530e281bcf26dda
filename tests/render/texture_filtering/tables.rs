//! The tables of docs/explanation/antialiasing.md.

use super::*;
use blinn::render::PixelRect;

#[test]
#[ignore = "prints the tables of docs/explanation/antialiasing.md"]
fn tables() {
    let counts = [1, 4, 16, 64];
    println!("| floor | | 1 sample | 4 samples | 16 samples | 64 samples |\n|---|---|---|---|---|---|");
    for (name, image, tile) in
        [("checker", checker(), 1.0), ("noise", noise(), 2.0), ("stripes", stripes(), 1.0)]
    {
        let turntable = |integrator: &dyn Integrator, n| -> Vec<Vec<Rgba>> {
            let render = |i: i32| {
                let mesh = floor(30.0 + 0.5 * f64::from(i), tile);
                let scene = scene(vec![mesh], vec![unlit()], vec![image.clone()]);
                picture(&scene, &floor_view(), None, samples(n), integrator)
            };
            (0..4).map(render).collect()
        };
        let expected = turntable(&Points, 1024);
        for (method, integrator) in [("points", &Points as &dyn Integrator), ("filtered", &Phong::default())]
        {
            let cells = counts.map(|n| {
                let actual = turntable(integrator, n);
                format!("{:.4} ({:.4})", error(&actual[0], &expected[0]), shimmer(&actual, &expected))
            });
            println!("| {name} | {method} | {} |", cells.join(" | "));
        }
    }
    println!("\n| ball | | 1 sample | 4 samples | 16 samples | 64 samples |\n|---|---|---|---|---|---|");
    let balls =
        [(0.1, 20.0, false), (0.2, 40.0, false), (0.3, 60.0, false), (0.1, 20.0, true), (0.3, 20.0, true)];
    for (roughness, distance, bumpy) in balls {
        let (ball, view) = (ball(roughness, bumpy), towards_ball(distance));
        // The ball and a margin.
        let side = (400.0 / distance) as u32 + 6;
        let crop = PixelRect { x: (SIZE.0 - side) / 2, y: (SIZE.1 - side) / 2, width: side, height: side };
        let render = |n, integrator: &dyn Integrator| {
            let settings = RenderSettings { crop: Some(crop), ..samples(n) };
            picture(&ball, &view, Some(sun()), settings, integrator)
        };
        let expected = render(16_384, &Points);
        for (method, integrator) in [("points", &Points as &dyn Integrator), ("filtered", &Phong::default())]
        {
            let cells = counts.map(|n| {
                let actual = render(n, integrator);
                format!("{:.4} ({:.2})", error(&actual, &expected), mean(&actual) / mean(&expected))
            });
            let kind = if bumpy { "bumpy" } else { "smooth" };
            println!("| {kind}, roughness {roughness}, {distance} m | {method} | {} |", cells.join(" | "));
        }
    }
}
