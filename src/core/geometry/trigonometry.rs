//! Trigonometric functions: branch-free, and bit-identical on every machine.

use std::f64::consts::TAU;

use super::polynomial::polynomial;

/// Returns the cosine and the sine of `angle` radians, −π/4…π/4, with an error below 3e-16.
///
/// There are no branches, so that compilers can vectorise loops over many angles.
#[inline(always)]
pub(crate) fn cos_sin_of_eighth(angle: f64) -> [f64; 2] {
    // Taylor series: the first omitted terms are below 1e-16.
    let x2 = angle * angle;
    let cos = polynomial(
        -x2,
        [
            1.0,
            1.0 / 2.0,
            1.0 / 24.0,
            1.0 / 720.0,
            1.0 / 40_320.0,
            1.0 / 3_628_800.0,
            1.0 / 479_001_600.0,
            1.0 / 87_178_291_200.0,
            1.0 / 20_922_789_888_000.0,
        ],
    );
    let sin = polynomial(
        -x2,
        [
            1.0,
            1.0 / 6.0,
            1.0 / 120.0,
            1.0 / 5040.0,
            1.0 / 362_880.0,
            1.0 / 39_916_800.0,
            1.0 / 6_227_020_800.0,
            1.0 / 1_307_674_368_000.0,
        ],
    );
    [cos, angle * sin]
}

/// Returns the cosine and the sine of an angle in full turns, 0…1, with an error below 1e-15. Free of branches as well.
#[inline(always)]
pub fn cos_sin_of_turns(turns: f64) -> [f64; 2] {
    // Adding this to an f64 rounds it to an integer.
    const ROUNDING: f64 = 1.5 * (1u64 << 52) as f64;
    let quarters = (4.0 * turns + ROUNDING) - ROUNDING;
    let [cos, sin] = cos_sin_of_eighth(TAU * (turns - 0.25 * quarters));
    let is_odd = (quarters == 1.0) | (quarters == 3.0);
    let side = if (quarters == 2.0) | (quarters == 3.0) { -1.0 } else { 1.0 };
    let (cos, sin) = if is_odd { (-sin, cos) } else { (cos, sin) };
    [side * cos, side * sin]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn turns_agree_with_libm() {
        for i in 0..=4000 {
            let turns = f64::from(i) / 4000.0;
            let [cos, sin] = cos_sin_of_turns(turns);
            let error = (cos - libm::cos(TAU * turns)).abs().max((sin - libm::sin(TAU * turns)).abs());
            assert!(error < 1e-15, "{turns}: {error}");
        }
        let quarters = [0.0, 0.25, 0.5, 0.75].map(cos_sin_of_turns);
        assert_eq!(quarters, [[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]]);
    }

    #[test]
    fn it_agrees_with_libm() {
        for i in -1000..=1000 {
            let angle = f64::from(i) * std::f64::consts::FRAC_PI_4 / 1000.0;
            let [cos, sin] = cos_sin_of_eighth(angle);
            let error = (cos - libm::cos(angle)).abs().max((sin - libm::sin(angle)).abs());
            assert!(error < 3e-16, "{angle}: {error}");
        }
        assert_eq!(cos_sin_of_eighth(0.0), [1.0, 0.0]);
    }
}
