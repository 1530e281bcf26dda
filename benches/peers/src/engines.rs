//! Traces sets of rays with blinn and with all variants of Embree.

use std::ffi::c_int;
use std::hint::black_box;
use std::mem::zeroed;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

use blinn::accel::{Accel, HitBatch};

use crate::embree::{EmbreeScene, FAR, NEAR, Packet, QueryArguments, Ray, RayHit};
use crate::rays::{Batch, Opaque, RaySet};

/// The result of each ray: t of the closest hit, +∞ for a miss. Occluded segments have 0.
pub type HitDistances = Vec<Vec<f32>>;

/// Seconds of `work` on all of `count` batches on `threads` threads. `flush` sets flush-to-zero and
/// denormals-are-zero, as Embree's manual recommends; blinn does not change the mode.
pub fn time(threads: usize, count: usize, flush: bool, work: impl Fn(usize) + Sync) -> f64 {
    let next = AtomicUsize::new(0);
    let run = || {
        if flush {
            flush_denormals();
        }
        loop {
            // Several batches at a time, since a batch may have only a few rays.
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

/// Seconds of blinn.
pub fn time_blinn(accel: &Accel, set: &RaySet, threads: usize) -> f64 {
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

/// The results of blinn.
pub fn blinn_distances(accel: &Accel, set: &RaySet) -> HitDistances {
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

/// A variant of Embree's queries.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct EmbreeVariant {
    /// Rays per packet: 1, 8 or 16.
    pub width: usize,
    /// Sets the flag for coherent rays.
    pub coherent: bool,
    /// Traces shadow rays from the light to the surface.
    pub from_light: bool,
}

impl EmbreeVariant {
    pub fn name(self) -> String {
        let coherent = if self.coherent { " coherent" } else { "" };
        let from = if self.from_light { " from light" } else { "" };
        format!("{}{coherent}{from}", self.width)
    }

    /// All variants for a set. The first is the single ray without flags.
    pub fn all(set: &RaySet) -> Vec<EmbreeVariant> {
        let ends: &[bool] = if set.light().is_some() { &[false, true] } else { &[false] };
        let mut ways = Vec::new();
        for &from_light in ends {
            ways.push(EmbreeVariant { width: 1, coherent: false, from_light });
            for width in [8, 16] {
                ways.extend([false, true].map(|coherent| EmbreeVariant { width, coherent, from_light }));
            }
        }
        ways
    }
}

/// A set in SoA layout for Embree, in the order of its packets.
pub struct EmbreeRays<'s> {
    set: &'s RaySet,
    any: bool,
    /// Origin, direction and far of each batch, padded to a multiple of 16.
    batches: Vec<[Vec<f32>; 7]>,
    near: f32,
}

impl<'s> EmbreeRays<'s> {
    pub fn new(set: &'s RaySet, from_light: bool) -> EmbreeRays<'s> {
        let batches = set.batches.iter().zip(&set.packet_order).map(|(batch, order)| {
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
        EmbreeRays { set, any, batches: batches.collect(), near: if from_light { 0.0 } else { set.margin } }
    }

    /// Seconds to trace all rays.
    pub fn time(&self, built: &EmbreeScene, variant: EmbreeVariant, threads: usize) -> f64 {
        time(threads, self.batches.len(), true, |i| {
            self.trace(i, built, variant, |_, t| {
                black_box(t);
            })
        })
    }

    /// The results of Embree in the order of blinn's batches.
    pub fn found(&self, built: &EmbreeScene, variant: EmbreeVariant) -> HitDistances {
        let one = |i: usize| {
            let mut found = vec![f32::INFINITY; self.set.batches[i].len()];
            self.trace(i, built, variant, |place, t| found[self.set.packet_order[i][place] as usize] = t);
            found
        };
        (0..self.batches.len()).map(one).collect()
    }

    fn trace(&self, batch: usize, built: &EmbreeScene, variant: EmbreeVariant, out: impl FnMut(usize, f32)) {
        let arguments = QueryArguments::new(variant.coherent);
        match variant.width {
            8 => self.packets::<8>(batch, built, &arguments, out),
            16 => self.packets::<16>(batch, built, &arguments, out),
            _ => self.single(batch, built, &arguments, out),
        }
    }

    fn single(
        &self,
        batch: usize,
        built: &EmbreeScene,
        arguments: &QueryArguments,
        mut out: impl FnMut(usize, f32),
    ) {
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
        built: &EmbreeScene,
        arguments: &QueryArguments,
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
        // SAFETY: all fields are numbers, for which zero is valid.
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
                let query = if self.any { occluded } else { intersect };
                query(valid.0.as_ptr(), built.handle, &mut packet, arguments);
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

/// The fraction of rays where only one engine hits, or t differs by more than a relative 1e-4.
pub fn mismatch_rate(a: &HitDistances, b: &HitDistances) -> f64 {
    let differs = |(&a, &b): (&f32, &f32)| {
        // Infinity is a miss, for which a relative difference is undefined.
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
        assert_eq!(mismatch_rate(&ours, &ours), 0.0);
        assert_eq!(mismatch_rate(&ours, &theirs), 4.0 / 8.0);
    }
}
