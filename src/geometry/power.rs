//! Powers of what is below one, as highlights need them: quick, and the same on every machine.

use std::f64::consts::{LN_2, LOG2_E, SQRT_2};

/// (1 − x)^p for x in 0…1 and p ≥ 0, within 1e-9 of its size; 0 where it is below e⁻¹⁰⁴, which is too
/// little for any f32.
///
/// It is told x, and not 1 − x, whose digits are lost just where a large power needs them. Nothing
/// branches here, so that many can be computed at once.
#[inline(always)]
pub fn pow_one_minus(x: f64, p: f64) -> f64 {
    let y = p * ln_below_one(x);
    let power = if y < -LEAST { 0.0 } else { exp(y) };
    // x of 1 is −∞, and with a p of 0 no number: 0⁰ is 1.
    if y.is_nan() { 1.0 } else { power }
}

/// Where an f32 ends.
const LEAST: f64 = 104.0;

/// ln(1 − x) for x in 0…1: −∞ at 1.
#[inline(always)]
fn ln_below_one(x: f64) -> f64 {
    // 1 − x = m·2^e, with m about 1; s = (m − 1)/(m + 1), and ln m = 2 artanh s.
    let bits = (1.0 - x).to_bits();
    let m = f64::from_bits(bits & FRACTION | ONE);
    // A whole number below 2⁵² as the last digits of a sum with it.
    let exponent = f64::from_bits(bits >> 52 | WHOLE.to_bits()) - WHOLE;
    let over = m > SQRT_2;
    let (m, e) = if over { (0.5 * m, exponent - 1022.0) } else { (m, exponent - 1023.0) };
    // Near 0 the digits of x are those of the result.
    let little = x < 1.0 - 0.5 * SQRT_2;
    let (above, below, e) = if little { (-x, 2.0 - x, 0.0) } else { (m - 1.0, m + 1.0, e) };
    let s = above / below;
    let z = s * s;
    let artanh = 1.0
        + z * (1.0 / 3.0
            + z * (1.0 / 5.0 + z * (1.0 / 7.0 + z * (1.0 / 9.0 + z * (1.0 / 11.0 + z * (1.0 / 13.0))))));
    let ln = 2.0 * s * artanh + e * LN_2;
    if x < 1.0 { ln } else { f64::NEG_INFINITY }
}

/// The bits of 1, and those of what comes after the point.
const ONE: u64 = 1023 << 52;
const FRACTION: u64 = (1 << 52) - 1;
/// From here on numbers have no digits after the point.
const WHOLE: f64 = (1u64 << 52) as f64;

/// e^y for y in −104…0; of no value elsewhere.
#[inline(always)]
fn exp(y: f64) -> f64 {
    // y = k·ln 2 + r, r within half of ln 2 of 0; k is a whole number because that is where this
    // sum's digits end, and its last digits are k.
    const ROUNDING: f64 = 1.5 * WHOLE;
    let rounded = y * LOG2_E + ROUNDING;
    let r = y - (rounded - ROUNDING) * LN_2;
    let series = 1.0
        + r * (1.0
            + r * (1.0 / 2.0
                + r * (1.0 / 6.0
                    + r * (1.0 / 24.0
                        + r * (1.0 / 120.0
                            + r * (1.0 / 720.0
                                + r * (1.0 / 5040.0 + r * (1.0 / 40320.0 + r * (1.0 / 362_880.0)))))))));
    series * f64::from_bits(rounded.to_bits().wrapping_add(1023) << 52)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_is_the_power() {
        let mut compared = 0;
        for i in 0..=2000 {
            for x in [f64::from(i) / 2000.0, 0.9f64.powi(i), 1.0 - 0.99f64.powi(i)] {
                for p in [0.0, 0.3, 1.0, 2.0, 17.0, 250.0, 19_998.0, 1e8] {
                    let exact = if x == 1.0 { libm::pow(0.0, p) } else { libm::exp(p * libm::log1p(-x)) };
                    let ours = pow_one_minus(x, p);
                    if exact > 1e-40 {
                        assert!((ours / exact - 1.0).abs() < 1e-9, "{x} {p}: {ours} {exact}");
                        compared += 1;
                    } else {
                        assert!((0.0..1e-39).contains(&ours), "{x} {p}: {ours} {exact}");
                    }
                }
            }
        }
        assert!(compared > 20_000);
    }

    #[test]
    fn its_ends_are_exact() {
        assert_eq!([0.0, 0.5, 1.0].map(|x| pow_one_minus(x, 0.0)), [1.0; 3]);
        assert_eq!([0.0, 1.0].map(|x| pow_one_minus(x, 10.0)), [1.0, 0.0]);
        assert_eq!(pow_one_minus(1.0 - f64::EPSILON, f64::from(f32::MAX)), 0.0);
    }
}
