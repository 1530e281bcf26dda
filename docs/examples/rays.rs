//! Traces rays of its own: the height of a scene over a grid, and the object at each place.
//!
//!     cargo run --release --example rays models/tower/tower.glb

use std::error::Error;

use blinn::accel::{Accel, AccelSettings, Coherence, RayBatch};
use blinn::glam::{DVec3, Vec3};
use blinn::import::{LoadOptions, load};
use blinn::integrator::MaterialHitFilter;
use blinn::scene::{PoseSettings, pose};

/// Places along each side of the grid.
const SIDE: u32 = 5;

fn main() -> Result<(), Box<dyn Error>> {
    let file = std::env::args().nth(1).ok_or("missing argument: scene")?;
    let (scene, _) = load(file.as_ref(), &LoadOptions::default())?;
    let posed = pose(&scene, &PoseSettings::default())?;
    let (accel, _) = Accel::build(&posed, &AccelSettings::default());

    // A batch is traced in packets: rays of one direction, or of one origin, are the fastest.
    let bounds = posed.bounds();
    let mut rays = RayBatch { coherence: Coherence::Direction(Vec3::NEG_Y), ..RayBatch::default() };
    for (row, column) in (0..SIDE).flat_map(|row| (0..SIDE).map(move |column| (row, column))) {
        let share = (DVec3::new(f64::from(column), 0.0, f64::from(row)) + 0.5) / f64::from(SIDE);
        let place = bounds.min + share * (bounds.max - bounds.min);
        let above = place.with_y(bounds.max.y + 1.0);
        // Coordinates of rays are relative to the centre of the scene, which keeps digits far from the origin.
        rays.push((above - posed.centre).as_vec3(), Vec3::NEG_Y);
    }
    let mut hits = Vec::new();
    accel.intersect(&rays, &MaterialHitFilter(&posed), &mut hits);

    for (hit, origin) in hits.iter().zip(&rays.origins) {
        let [x, z] = [origin.x, origin.z].map(f64::from);
        let (x, z) = (x + posed.centre.x, z + posed.centre.z);
        if hit.is_miss() {
            println!("{x:8.2} {z:8.2}  nothing");
            continue;
        }
        // The direction has length 1, so that t is in metres.
        let height = f64::from(origin.y - hit.t) + posed.centre.y;
        let object = scene.instances[hit.id.instance as usize].object;
        let name = (object as usize).checked_sub(1).and_then(|i| scene.objects.get(i));
        println!("{x:8.2} {z:8.2}  height {height:.2} m, {}", name.map_or("no object", String::as_str));
    }
    Ok(())
}
