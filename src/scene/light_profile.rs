//! Photometric profiles: the intensity of a luminaire by direction, as goniometers measure it.
//!
//! A light with a profile is aimed along −Z of its node, as in the glTF extension `EXT_lights_ies`. Angles are in
//! degrees, as in IES files.

use glam::DVec3;

/// The angles that a goniometer measures at (IES LM-63). Of all types, (0, 0) is the aim, −Z; vertical angles begin
/// towards +X.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Photometry {
    /// Vertical angles are those to the aim, 0 to 180; horizontal angles turn about it from +X to +Y.
    TypeC,
    /// Vertical angles are longitudes about the Y axis; horizontal angles are latitudes, positive towards −Y.
    TypeB,
    /// Horizontal angles are longitudes about the X axis, positive towards −Y; vertical angles are latitudes.
    TypeA,
}

/// The symmetry of the horizontal angles of a type C profile.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Symmetry {
    /// One plane stands for all.
    Axial,
    /// Each quadrant mirrors the first.
    Quadrants,
    /// Mirrored at the plane of 0 and 180 degrees.
    Halves,
    /// Mirrored at the plane of 90 and 270 degrees, from 90 on.
    TurnedHalves,
    /// None: the angles go round.
    None,
}

/// Intensities by direction, interpolated bilinearly in the angles. Outside the measured angles they are 0.
#[derive(Clone, Debug, PartialEq)]
pub struct LightProfile {
    photometry: Photometry,
    symmetry: Symmetry,
    vertical: Vec<f64>,
    horizontal: Vec<f64>,
    /// One row of vertical angles for each horizontal angle, divided by the peak.
    relative: Vec<f32>,
    peak: f32,
}

impl LightProfile {
    /// Returns the profile of `candela`, a row of intensities over the `vertical` angles for each of the `horizontal`
    /// angles.
    ///
    /// # Errors
    /// The reason why these are no profile: angles that do not ascend or exceed their range, intensities that are negative,
    /// infinite or do not fit.
    pub fn new(
        photometry: Photometry,
        vertical: Vec<f64>,
        horizontal: Vec<f64>,
        candela: &[f32],
    ) -> Result<LightProfile, String> {
        let [vertical_range, horizontal_range] = match photometry {
            Photometry::TypeC => [[0.0, 180.0], [0.0, 360.0]],
            Photometry::TypeB | Photometry::TypeA => [[-90.0, 90.0]; 2],
        };
        check_angles("vertical", &vertical, vertical_range)?;
        check_angles("horizontal", &horizontal, horizontal_range)?;
        if candela.len() as u128 != vertical.len() as u128 * horizontal.len() as u128 {
            let (v, h, has) = (vertical.len(), horizontal.len(), candela.len());
            return Err(format!("{has} intensities do not fit {h} × {v} angles"));
        }
        if let Some(value) = candela.iter().find(|v| !(v.is_finite() && **v >= 0.0)) {
            return Err(format!("the intensity {value} is not a positive number"));
        }
        let symmetry = symmetry(photometry, &horizontal)?;
        let peak = candela.iter().copied().fold(0.0, f32::max);
        let relative = |&v: &f32| if peak > 0.0 { v / peak } else { 0.0 };
        let relative = candela.iter().map(relative).collect();
        Ok(LightProfile { photometry, symmetry, vertical, horizontal, relative, peak })
    }

    /// Returns the largest intensity.
    pub fn peak(&self) -> f32 {
        self.peak
    }

    /// Returns the intensity in the direction `d` from the light, divided by the peak. `d` is in the light's space and has
    /// any length but 0.
    pub fn relative_intensity(&self, d: DVec3) -> f32 {
        let (vertical, horizontal) = self.angles(d);
        let Some((v, v_share)) = bracket(&self.vertical, vertical) else { return 0.0 };
        let Some((h, h_share)) = self.horizontal_bracket(horizontal) else { return 0.0 };
        let row = |h: usize| {
            let row = h * self.vertical.len();
            let at = |v: usize| f64::from(self.relative[row + v.min(self.vertical.len() - 1)]);
            at(v) + (at(v + 1) - at(v)) * v_share
        };
        let next = if h + 1 < self.horizontal.len() { h + 1 } else { 0 };
        let (a, b) = (row(h), row(next));
        (a + (b - a) * h_share) as f32
    }

    /// Returns the mean intensity over all directions, divided by the peak: the luminous flux is 4π times the mean.
    pub fn relative_mean(&self) -> f32 {
        let columns = self.vertical.len();
        let at = |h: usize, v: usize| f64::from(self.relative[h * columns + v]);
        // Weights of latitudes are exact for what is linear between them; longitudes have trapezoids.
        let flux = match self.photometry {
            Photometry::TypeC => {
                let weights = latitude_weights(&self.vertical, |a| -a.cos(), |a| a.sin() - a * a.cos());
                let planes = self.plane_shares();
                let row = |h: usize| (0..columns).map(|v| weights[v] * at(h, v)).sum::<f64>();
                planes.iter().enumerate().map(|(h, share)| share * row(h)).sum::<f64>() * 2.0
            }
            Photometry::TypeB | Photometry::TypeA => {
                let sine = |a: f64| a.sin();
                let moment = |a: f64| a * a.sin() + a.cos();
                let is_a = self.photometry == Photometry::TypeA;
                let [latitudes, longitudes] = match is_a {
                    true => [&self.vertical, &self.horizontal],
                    false => [&self.horizontal, &self.vertical],
                };
                let of_latitude = latitude_weights(latitudes, sine, moment);
                let of_longitude = trapezoid_weights(longitudes);
                let mirrored = |angles: &[f64]| if angles[0] >= 0.0 && angles.len() > 1 { 2.0 } else { 1.0 };
                let value = |h: usize, v: usize| match is_a {
                    true => of_longitude[h] * of_latitude[v] * at(h, v),
                    false => of_latitude[h] * of_longitude[v] * at(h, v),
                };
                let sum: f64 =
                    (0..self.horizontal.len()).map(|h| (0..columns).map(|v| value(h, v)).sum::<f64>()).sum();
                sum * mirrored(latitudes) * mirrored(longitudes) / std::f64::consts::PI
            }
        };
        (flux / 4.0) as f32
    }

    /// The vertical and horizontal angle of a direction.
    fn angles(&self, d: DVec3) -> (f64, f64) {
        let atan2 = |y: f64, x: f64| libm::atan2(y, x).to_degrees();
        // A difference has no negative 0, which would turn the angles at a pole by half a circle.
        let [forward, up, right] = [0.0 - d.z, d.x + 0.0, 0.0 - d.y];
        let length = |a: f64, b: f64| (a * a + b * b).sqrt();
        match self.photometry {
            Photometry::TypeC => (atan2(length(d.x, d.y), forward), atan2(d.y, d.x)),
            Photometry::TypeB => {
                (self.mirrored(&self.vertical, atan2(up, forward)), atan2(right, length(up, forward)))
            }
            Photometry::TypeA => {
                (self.mirrored(&self.vertical, atan2(up, length(right, forward))), atan2(right, forward))
            }
        }
    }

    /// An angle from −180 to 180, mirrored at 0 where none below are measured.
    fn mirrored(&self, angles: &[f64], angle: f64) -> f64 {
        if angles[0] >= 0.0 { angle.abs() } else { angle }
    }

    /// The plane before a horizontal angle, and how far the angle is from it to the next.
    fn horizontal_bracket(&self, angle: f64) -> Option<(usize, f64)> {
        let angles = &self.horizontal;
        if angles.len() == 1 {
            return Some((0, 0.0));
        }
        if self.photometry != Photometry::TypeC {
            return bracket(angles, self.mirrored(angles, angle));
        }
        let positive = if angle < 0.0 { angle + 360.0 } else { angle };
        let folded = match self.symmetry {
            Symmetry::Axial => 0.0,
            Symmetry::Quadrants => {
                let half = if positive > 180.0 { 360.0 - positive } else { positive };
                if half > 90.0 { 180.0 - half } else { half }
            }
            Symmetry::Halves if positive > 180.0 => 360.0 - positive,
            Symmetry::TurnedHalves if positive < 90.0 => 180.0 - positive,
            Symmetry::TurnedHalves if positive > 270.0 => 540.0 - positive,
            _ => positive,
        };
        bracket(angles, folded).or_else(|| {
            let last = angles.len() - 1;
            let gap = angles[0] + 360.0 - angles[last];
            let beyond = if folded < angles[0] { folded + 360.0 } else { folded } - angles[last];
            Some((last, if gap > 0.0 { (beyond / gap).clamp(0.0, 1.0) } else { 0.0 }))
        })
    }

    /// The share of the circle that each plane of a type C profile stands for.
    fn plane_shares(&self) -> Vec<f64> {
        let mut shares = trapezoid_weights(&self.horizontal);
        if self.horizontal.len() == 1 {
            return vec![1.0];
        }
        let last = shares.len() - 1;
        if self.symmetry == Symmetry::None {
            let gap = (self.horizontal[0] + 360.0 - self.horizontal[last]).to_radians();
            shares[0] += 0.5 * gap;
            shares[last] += 0.5 * gap;
        }
        let sum: f64 = shares.iter().sum();
        shares.into_iter().map(|share| share / sum).collect()
    }
}

fn check_angles(name: &str, angles: &[f64], [low, high]: [f64; 2]) -> Result<(), String> {
    let is_outside = |a: &&f64| !(**a >= low && **a <= high);
    if angles.is_empty() {
        return Err(format!("there are no {name} angles"));
    }
    if let Some(angle) = angles.iter().find(is_outside) {
        return Err(format!("the {name} angle {angle} is not from {low} to {high} degrees"));
    }
    match angles.windows(2).find(|pair| pair[0] >= pair[1]) {
        Some(pair) => {
            Err(format!("the {name} angles do not ascend: {} degrees is followed by {}", pair[0], pair[1]))
        }
        None => Ok(()),
    }
}

fn symmetry(photometry: Photometry, horizontal: &[f64]) -> Result<Symmetry, String> {
    if photometry != Photometry::TypeC {
        return Ok(Symmetry::None);
    }
    match (horizontal, horizontal[0], horizontal[horizontal.len() - 1]) {
        ([_], ..) => Ok(Symmetry::Axial),
        (_, 0.0, 90.0) => Ok(Symmetry::Quadrants),
        (_, 0.0, 180.0) => Ok(Symmetry::Halves),
        (_, 90.0, 270.0) => Ok(Symmetry::TurnedHalves),
        // Some programs leave out 360 degrees, which repeats 0.
        (_, first, last) if last - first > 180.0 => Ok(Symmetry::None),
        (_, first, last) => Err(format!(
            "the horizontal angles go from {first} to {last} degrees; they must go from 0 to 0, 90, 180 or 360, or from 90 to 270"
        )),
    }
}

/// The angle before `angle`, and how far `angle` is from it to the next; `None` outside of all angles.
fn bracket(angles: &[f64], angle: f64) -> Option<(usize, f64)> {
    let last = angles.len() - 1;
    if !(angle >= angles[0] && angle <= angles[last]) {
        return None;
    }
    let next = angles.partition_point(|&a| a <= angle).clamp(1, last.max(1));
    let before = next - 1;
    let Some(&end) = angles.get(next) else { return Some((0, 0.0)) };
    Some((before, (angle - angles[before]) / (end - angles[before])))
}

/// Integrals over the angles, in radians, of hat functions times the derivative w of `integral`; `moment` is the
/// integral of a·w(a).
fn latitude_weights(degrees: &[f64], integral: impl Fn(f64) -> f64, moment: impl Fn(f64) -> f64) -> Vec<f64> {
    let mut weights = vec![0.0; degrees.len()];
    for (i, pair) in degrees.windows(2).enumerate() {
        let [a, b] = [pair[0].to_radians(), pair[1].to_radians()];
        let whole = integral(b) - integral(a);
        let towards_b = (moment(b) - moment(a) - a * whole) / (b - a);
        weights[i] += whole - towards_b;
        weights[i + 1] += towards_b;
    }
    weights
}

/// Widths of the trapezoids about each angle, in radians.
fn trapezoid_weights(degrees: &[f64]) -> Vec<f64> {
    let mut weights = vec![0.0; degrees.len()];
    for (i, pair) in degrees.windows(2).enumerate() {
        let half = 0.5 * (pair[1] - pair[0]).to_radians();
        weights[i] += half;
        weights[i + 1] += half;
    }
    weights
}

#[cfg(test)]
mod tests;
