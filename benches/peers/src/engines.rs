//! What traces a set of rays: blinn, and Embree in every way that it offers.

use std::ffi::c_int;
use std::hint::black_box;
use std::mem::zeroed;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

use blinn::accel::{Accel, HitBatch};

use crate::embree::{Arguments, Built, FAR, NEAR, Packet, Ray, RayHit};
use crate::rays::{Batch, Opaque, Set};

/// What was found for every ray: t of the closest hit, +∞ for none; for any hit 0 where something
/// is in the way.
pub type Found = Vec<Vec<f32>>;

/// Seconds that `work` takes for all of `count` batches on `threads` threads. With `flush` the
/// threads take numbers near zero as zero, as Embree's manual asks for; blinn leaves the machine
/// as it is.
fn time(threads: usize, count: usize, flush: bool, work: impl Fn(usize) + Sync) -> f64 {
    let next = AtomicUsize::new(0);
    let run = || {
        if flush {
            flush_denormals();
        }
        loop {
            // Some batches at a time: one may be as small as a handful of rays.
            let first = next.fetch_add(4, Ordering::Relaxed);
            if first >= count {
                return;
            }
            (first..(first + 4).min(count)).for_each(&work);
        }
    };
    let start = Instant::now();
    std::thread::scope(|scope| {
        for _ in 0..threads {
            scope.spawn(run);
        }
    });
    start.elapsed().as_secs_f64()
}

/// Sets FTZ and DAZ for this thread, which ends soon after.
fn flush_denormals() {
    let mut word: u32 = 0;
    // SAFETY: reads and writes the control register from and to a word of the stack.
    unsafe {
        std::arch::asm!("stmxcsr [{}]", in(reg) &raw mut word, options(nostack));
        word |= 0x8040;
        std::arch::asm!("ldmxcsr [{}]", in(reg) &raw const word, options(nostack));
    }
}

/// blinn, batch by batch.
pub fn ours(accel: &Accel, set: &Set, threads: usize) -> f64 {
    time(threads, set.batches.len(), false, |i| match &set.batches[i] {
        Batch::Closest(rays) => {
            let mut hits = HitBatch::new();
            accel.intersect(rays, &Opaque, &mut hits);
            black_box(&hits);
        }
        Batch::Any(segments) => {
            let mut blocked = Vec::new();
            accel.occluded(segments, &Opaque, &mut blocked);
            black_box(&blocked);
        }
    })
}

/// What blinn finds.
pub fn ours_found(accel: &Accel, set: &Set) -> Found {
    let one = |batch: &Batch| match batch {
        Batch::Closest(rays) => {
            let mut hits = HitBatch::new();
            accel.intersect(rays, &Opaque, &mut hits);
            hits.iter().map(|h| h.t).collect()
        }
        Batch::Any(segments) => {
            let mut blocked = Vec::new();
            accel.occluded(segments, &Opaque, &mut blocked);
            blocked.iter().map(|&b| if b { 0.0 } else { f32::INFINITY }).collect()
        }
    };
    set.batches.iter().map(one).collect()
}

/// A way to ask Embree.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Way {
    /// Rays at a time: 1, 8, 16.
    pub width: usize,
    /// Its flag for coherent rays.
    pub coherent: bool,
    /// Shadow rays run from the light to the surface.
    pub from_light: bool,
}

impl Way {
    pub fn name(self) -> String {
        let coherent = if self.coherent { " coherent" } else { "" };
        let from = if self.from_light { " from light" } else { "" };
        format!("{}{coherent}{from}", self.width)
    }

    /// All for a set; the first is the plain single ray.
    pub fn all(set: &Set) -> Vec<Way> {
        let ends: &[bool] = if set.light().is_some() { &[false, true] } else { &[false] };
        let mut ways = Vec::new();
        for &from_light in ends {
            ways.push(Way { width: 1, coherent: false, from_light });
            for width in [8, 16] {
                ways.extend([false, true].map(|coherent| Way { width, coherent, from_light }));
            }
        }
        ways
    }
}

/// A set as Embree takes it: rows of numbers by batch, in squares of pixels.
pub struct Flat<'s> {
    set: &'s Set,
    any: bool,
    /// Origin, direction, far; for each batch padded to a multiple of 16.
    batches: Vec<[Vec<f32>; 7]>,
    near: f32,
}

impl<'s> Flat<'s> {
    pub fn new(set: &'s Set, from_light: bool) -> Flat<'s> {
        let batches = set.batches.iter().zip(&set.squares).map(|(batch, order)| {
            let mut rows: [Vec<f32>; 7] = Default::default();
            for &i in order {
                let (mut o, mut d, mut far) = batch.ray(i as usize);
                if from_light {
                    (o, d, far) = (o + d, -d, far - set.margin);
                }
                for (row, x) in rows.iter_mut().zip([o.x, o.y, o.z, d.x, d.y, d.z, far]) {
                    row.push(x);
                }
            }
            for row in &mut rows {
                row.resize(row.len().next_multiple_of(16), 1.0);
            }
            rows
        });
        let any = matches!(set.batches.first(), Some(Batch::Any(_)));
        Flat { set, any, batches: batches.collect(), near: if from_light { 0.0 } else { set.margin } }
    }

    /// Seconds to trace all.
    pub fn time(&self, built: &Built, way: Way, threads: usize) -> f64 {
        time(threads, self.batches.len(), true, |i| {
            self.trace(i, built, way, |_, t| {
                black_box(t);
            })
        })
    }

    /// What Embree finds, in the order of blinn's batches.
    pub fn found(&self, built: &Built, way: Way) -> Found {
        let one = |i: usize| {
            let mut found = vec![f32::INFINITY; self.set.batches[i].len()];
            self.trace(i, built, way, |place, t| found[self.set.squares[i][place] as usize] = t);
            found
        };
        (0..self.batches.len()).map(one).collect()
    }

    fn trace(&self, batch: usize, built: &Built, way: Way, out: impl FnMut(usize, f32)) {
        let arguments = Arguments::new(way.coherent);
        match way.width {
            8 => self.packets::<8>(batch, built, &arguments, out),
            16 => self.packets::<16>(batch, built, &arguments, out),
            _ => self.single(batch, built, &arguments, out),
        }
    }

    fn single(&self, batch: usize, built: &Built, arguments: &Arguments, mut out: impl FnMut(usize, f32)) {
        let [ox, oy, oz, dx, dy, dz, far] = &self.batches[batch];
        let embree = built.embree();
        for i in 0..self.set.batches[batch].len() {
            let mut ray = Ray {
                o: [ox[i], oy[i], oz[i]],
                near: self.near,
                d: [dx[i], dy[i], dz[i]],
                time: 0.0,
                far: far[i],
                mask: !0,
                id: 0,
                flags: 0,
            };
            // SAFETY: the scene is committed, the structures are Embree's.
            let t = unsafe {
                if self.any {
                    (embree.occluded1)(built.handle, &mut ray, arguments);
                    if ray.far < 0.0 { 0.0 } else { f32::INFINITY }
                } else {
                    let none = u32::MAX;
                    let mut hit = RayHit {
                        ray,
                        normal: [0.0; 3],
                        uv: [0.0; 2],
                        primitive: none,
                        geometry: none,
                        instance: [none; 2],
                        rest: [0; 7],
                    };
                    (embree.intersect1)(built.handle, &mut hit, arguments);
                    if hit.geometry == none { f32::INFINITY } else { hit.ray.far }
                }
            };
            out(i, t);
        }
    }

    fn packets<const N: usize>(
        &self,
        batch: usize,
        built: &Built,
        arguments: &Arguments,
        mut out: impl FnMut(usize, f32),
    ) {
        #[repr(align(64))]
        struct Valid<const N: usize>([c_int; N]);
        let (Some(intersect), Some(occluded)) =
            (built.embree().intersect::<N>(), built.embree().occluded::<N>())
        else {
            return;
        };
        let rows = &self.batches[batch];
        let count = self.set.batches[batch].len();
        // SAFETY: a structure of numbers; zeros are numbers.
        let mut packet: Packet<N> = unsafe { zeroed() };
        packet.mask = [!0; N];
        packet.numbers[NEAR] = [self.near; N];
        for first in (0..count).step_by(N) {
            let live = (count - first).min(N);
            let mut valid = Valid([0; N]);
            valid.0[..live].fill(-1);
            for (to, row) in [0, 1, 2, 4, 5, 6, FAR].into_iter().zip(rows) {
                packet.numbers[to].copy_from_slice(&row[first..first + N]);
            }
            packet.geometry = [u32::MAX; N];
            packet.instance = [[u32::MAX; N]; 2];
            // SAFETY: the scene is committed, the structures are Embree's and aligned.
            unsafe {
                let ask = if self.any { occluded } else { intersect };
                ask(valid.0.as_ptr(), built.handle, &mut packet, arguments);
            }
            for lane in 0..live {
                let far = packet.numbers[FAR][lane];
                let hit = if self.any { far < 0.0 } else { packet.geometry[lane] != u32::MAX };
                let t = if self.any { 0.0 } else { far };
                out(first + lane, if hit { t } else { f32::INFINITY });
            }
        }
    }
}

/// The share of rays where one side hits and the other does not, or t differs by over 1e-4.
pub fn differing(a: &Found, b: &Found) -> f64 {
    let differs = |(&a, &b): (&f32, &f32)| {
        // Infinity is a miss: no multiple of it may excuse a difference.
        let both = a.is_finite() && b.is_finite();
        if both { (a - b).abs() > 1e-4 * a.abs().max(b.abs()) } else { a.to_bits() != b.to_bits() }
    };
    let pairs = || a.iter().flatten().zip(b.iter().flatten());
    pairs().filter(|&p| differs(p)).count() as f64 / pairs().count().max(1) as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn misses_differ_from_hits_and_near_distances_agree() {
        let miss = f32::INFINITY;
        let ours = vec![vec![1.0, miss, 0.0, miss], vec![2.0, 3.0, 1e-3, miss]];
        let theirs = vec![vec![1.00005, miss, miss, 0.0], vec![2.001, 3.0, 1e-3, 4.0]];
        assert_eq!(differing(&ours, &ours), 0.0);
        assert_eq!(differing(&ours, &theirs), 4.0 / 8.0);
    }
}
