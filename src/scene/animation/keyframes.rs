//! Keyframe animation: channels of keyframes, and their interpolation.

use glam::{DQuat, DVec3};

use crate::{CameraProperty, EnvironmentProperty, LightProperty, MaterialProperty};

/// Interpolation between keyframes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Interpolation {
    /// Holds the value of the last keyframe.
    Step,
    /// Linear; spherical (slerp) for rotations.
    Linear,
    /// Cubic Hermite splines. Each keyframe stores in-tangent, value and out-tangent.
    CubicSpline,
}

/// The property that a channel drives.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum ChannelTarget {
    /// Translation of a node (3 components).
    Translation(u32),
    /// Rotation of a node (4 components: x, y, z, w).
    Rotation(u32),
    /// Scale of a node (3 components).
    Scale(u32),
    /// Morph weights of the meshes at a node (one component for each target).
    Weights(u32),
    /// One morph weight of a node, by its index.
    Weight(u32, u32),
    /// Visibility of a node (1 component).
    Visibility(u32),
    /// A property of a material.
    Material(u32, MaterialProperty),
    /// A property of a light.
    Light(u32, LightProperty),
    /// A colour or an intensity of an area light.
    AreaLight(u32, LightProperty),
    /// A property of a camera.
    Camera(u32, CameraProperty),
    /// A property of the file's environment.
    Environment(EnvironmentProperty),
}

/// Keyframes of one value.
#[derive(Clone, Debug)]
pub struct Keyframes {
    /// Times in seconds, ascending, at least one.
    pub times: Vec<f32>,
    /// `width` components for each keyframe; three times as many for splines.
    pub values: Vec<f32>,
    /// Components of the value.
    pub width: usize,
    /// Interpolation between keyframes.
    pub interpolation: Interpolation,
}

/// Drives a property by keyframes.
#[derive(Clone, Debug)]
pub struct Channel {
    /// The driven property.
    pub target: ChannelTarget,
    /// Its values over time.
    pub keyframes: Keyframes,
}

/// An animation of the file.
#[derive(Clone, Debug, Default)]
pub struct Animation {
    /// Name in the file.
    pub name: String,
    /// Channels.
    pub channels: Vec<Channel>,
}

impl Animation {
    /// Returns the time of the last keyframe, in seconds.
    pub fn duration(&self) -> f32 {
        self.channels.iter().filter_map(|c| c.keyframes.times.last()).fold(0.0, |a, &b| a.max(b))
    }
}

impl Keyframes {
    /// Returns the value at `time`, in seconds. It is constant before the first and after the last
    /// keyframe.
    pub fn sample(&self, time: f64) -> Vec<f64> {
        match self.span(time) {
            Span::At(key) => self.value(key),
            Span::Between { key, s, dt } => match self.interpolation {
                Interpolation::Step => self.value(key),
                Interpolation::Linear => {
                    let (a, b) = (self.value(key), self.value(key + 1));
                    a.iter().zip(&b).map(|(a, b)| a + (b - a) * s).collect()
                }
                Interpolation::CubicSpline => self.spline(key, s, dt),
            },
        }
    }

    /// Returns the rotation at `time`, of unit length. Linear interpolation is spherical (slerp).
    pub fn sample_rotation(&self, time: f64) -> DQuat {
        let unit = |v: &[f64]| {
            let q = DQuat::from_xyzw(v[0], v[1], v[2], v[3]);
            if q.length_squared() > 0.0 && q.is_finite() { q.normalize() } else { DQuat::IDENTITY }
        };
        match self.span(time) {
            Span::Between { key, s, .. } if self.interpolation == Interpolation::Linear => {
                slerp(unit(&self.value(key)), unit(&self.value(key + 1)), s)
            }
            _ => unit(&self.sample(time)),
        }
    }

    /// Returns a vector of 3 components at `time`.
    pub fn sample_vec3(&self, time: f64) -> DVec3 {
        let v = self.sample(time);
        DVec3::new(v[0], v[1], v[2])
    }

    /// Returns the keyframe or the pair of keyframes around `time`.
    fn span(&self, time: f64) -> Span {
        // Compares in f32: the keyframe of frame 4 at 30 frames/s may be slightly after 4/30 s.
        let until = if self.interpolation == Interpolation::Step { time + step_slack(time) } else { time };
        let after = self.times.partition_point(|&t| t <= until as f32);
        if after == 0 {
            return Span::At(0);
        }
        if after == self.times.len() {
            return Span::At(after - 1);
        }
        let (t0, t1) = (f64::from(self.times[after - 1]), f64::from(self.times[after]));
        Span::Between { key: after - 1, s: ((time - t0) / (t1 - t0)).max(0.0), dt: t1 - t0 }
    }

    /// Returns the components of a keyframe: for splines, part 0 is the in-tangent, 1 the value, 2 the
    /// out-tangent.
    fn part(&self, key: usize, part: usize) -> impl Iterator<Item = f64> + '_ {
        let parts = if self.interpolation == Interpolation::CubicSpline { 3 } else { 1 };
        let at = (key * parts + part) * self.width;
        self.values[at..at + self.width].iter().map(|&v| f64::from(v))
    }

    /// Returns the value of a keyframe.
    fn value(&self, key: usize) -> Vec<f64> {
        let middle = usize::from(self.interpolation == Interpolation::CubicSpline);
        self.part(key, middle).collect()
    }

    /// Evaluates glTF's cubic Hermite spline at s in 0…1. Tangents are per second; `dt` is the
    /// distance of the keyframes.
    fn spline(&self, key: usize, s: f64, dt: f64) -> Vec<f64> {
        let s2 = s * s;
        let s3 = s * s * s;
        let p0 = self.part(key, 1);
        let m0 = self.part(key, 2);
        let m1 = self.part(key + 1, 0);
        let p1 = self.part(key + 1, 1);
        let tangents = m0.zip(m1);
        p0.zip(p1)
            .zip(tangents)
            .map(|((p0, p1), (m0, m1))| {
                (2.0 * s3 - 3.0 * s2 + 1.0) * p0
                    + (s3 - 2.0 * s2 + s) * dt * m0
                    + (3.0 * s2 - 2.0 * s3) * p1
                    + (s3 - s2) * dt * m1
            })
            .collect()
    }
}

/// Returns how far after `time` a step may be that happens at `time`, in seconds.
///
/// Exporters compute the times of frames in f32, as i·(1/30) or as sums of 1/30, and so write some of them a few
/// rounding errors late. The slack is far below the distance of frames: 240 of them take a second at most.
fn step_slack(time: f64) -> f64 {
    const ABSOLUTE: f64 = 5e-5;
    let relative = 4.0 * f64::from(f32::EPSILON);
    ABSOLUTE + relative * time.abs()
}

/// The position of a time among the keyframes.
enum Span {
    At(usize),
    Between { key: usize, s: f64, dt: f64 },
}

/// Spherical linear interpolation along the shorter arc. Uses `libm`, so that all machines agree.
fn slerp(a: DQuat, b: DQuat, s: f64) -> DQuat {
    let dot = a.dot(b);
    let (b, dot) = if dot < 0.0 { (-b, -dot) } else { (b, dot) };
    if dot > 1.0 - 1e-9 {
        return (a * (1.0 - s) + b * s).normalize();
    }
    let angle = libm::acos(dot.min(1.0));
    let (wa, wb) = (libm::sin((1.0 - s) * angle), libm::sin(s * angle));
    (a * wa + b * wb).normalize()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn keys(interpolation: Interpolation, values: &[f32]) -> Keyframes {
        Keyframes { times: vec![1.0, 3.0], values: values.to_vec(), width: 1, interpolation }
    }

    #[test]
    fn values_are_constant_outside_and_interpolated_between() {
        let step = keys(Interpolation::Step, &[2.0, 4.0]);
        let linear = keys(Interpolation::Linear, &[2.0, 4.0]);
        for (t, s, l) in [(0.0, 2.0, 2.0), (1.0, 2.0, 2.0), (2.0, 2.0, 3.0), (3.0, 4.0, 4.0), (9.0, 4.0, 4.0)]
        {
            assert_eq!((step.sample(t)[0], linear.sample(t)[0]), (s, l), "at {t}");
        }
    }

    /// Keyframe times are f32, and differ slightly from the f64 time of their frame.
    #[test]
    fn a_step_happens_at_the_frame_of_its_keyframe() {
        for frame in 1..200 {
            for fps in [24.0, 25.0, 30.0, 60.0] {
                let time = f64::from(frame) / fps;
                let keys =
                    Keyframes { times: vec![0.0, time as f32], ..keys(Interpolation::Step, &[2.0, 4.0]) };
                assert_eq!(keys.sample(time)[0], 4.0, "frame {frame} of {fps}");
                assert_eq!(keys.sample(time - 1e-4)[0], 2.0, "before frame {frame} of {fps}");
            }
        }
    }

    /// Exporters compute times as i·(1/fps), or as sums of 1/fps.
    #[test]
    fn a_step_whose_time_is_rounded_up_happens_at_its_frame() {
        for fps in [24.0f32, 25.0, 30.0, 60.0, 120.0] {
            let count = 240;
            let products: Vec<f32> = (0..count).map(|i| i as f32 * (1.0 / fps)).collect();
            let mut sum = 0.0;
            let sums: Vec<f32> = (0..count)
                .map(|_| {
                    sum += 1.0 / fps;
                    sum - 1.0 / fps
                })
                .collect();
            let values: Vec<f32> = (0..count).map(|i| i as f32).collect();
            for times in [products, sums] {
                let keys = Keyframes { times, values: values.clone(), ..keys(Interpolation::Step, &[]) };
                for i in 0..count {
                    let at = f64::from(i) / f64::from(fps);
                    assert_eq!(keys.sample(at)[0], f64::from(i), "frame {i} of {fps}");
                    assert_eq!(keys.sample(at + 0.9 / f64::from(fps))[0], f64::from(i), "after {i} of {fps}");
                }
            }
        }
    }

    #[test]
    fn splines_interpolate_values_and_tangents() {
        // in-tangent, value, out-tangent of two keyframes 2 s apart: slopes 1/s, then 0.
        let k = keys(Interpolation::CubicSpline, &[0.0, 0.0, 1.0, 0.0, 2.0, 0.0]);
        assert_eq!(k.sample(1.0)[0], 0.0);
        assert_eq!(k.sample(3.0)[0], 2.0);
        // s = 1/2: (1/8)·2·1 + (1/2)·2 = 1.25
        assert!((k.sample(2.0)[0] - 1.25).abs() < 1e-12);
    }

    #[test]
    fn rotations_take_the_shorter_arc() {
        let half = std::f32::consts::FRAC_1_SQRT_2;
        let k = Keyframes {
            times: vec![0.0, 1.0],
            values: vec![0.0, 0.0, 0.0, 1.0, 0.0, 0.0, -half, -half],
            width: 4,
            interpolation: Interpolation::Linear,
        };
        let q = k.sample_rotation(0.5);
        let expected = DQuat::from_rotation_z(std::f64::consts::FRAC_PI_4);
        assert!(q.dot(expected).abs() > 1.0 - 1e-12);
    }
}
