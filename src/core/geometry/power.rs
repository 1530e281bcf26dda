//! Powers `(1 − x)^p` for specular lobes: branch-free, and bit-identical on every machine.

use std::f64::consts::{LN_2, LOG2_E, SQRT_2};

use super::polynomial::polynomial;

/// Returns `(1 − x)^p` for x in 0…1 and p ≥ 0, with a relative error below 1e-9. Returns 0 below
/// e⁻⁶⁴, 1.6·10⁻²⁸, which no light makes visible: products with it are normal f32, and subnormal ones are slow.
///
/// The argument is x rather than 1 − x, because 1 − x loses the digits that a large power needs.
/// There are no branches, so that compilers can vectorise loops over many values.
#[inline(always)]
pub fn pow_one_minus(x: f64, p: f64) -> f64 {
    let y = p * ln_one_minus(x);
    let power = if y < MIN_EXPONENT { 0.0 } else { exp(y) };
    // x = 1 makes the logarithm −∞ and, with p = 0, the product NaN: 0⁰ is 1.
    if y.is_nan() { 1.0 } else { power }
}

/// Powers below e⁻⁶⁴ are 0.
const MIN_EXPONENT: f64 = -64.0;

/// Returns ln(1 − x) for x in 0…1; −∞ at 1.
#[inline(always)]
fn ln_one_minus(x: f64) -> f64 {
    // 1 − x = m·2^e with m in √½…√2; s = (m − 1)/(m + 1), and ln m = 2 artanh s.
    let bits = (1.0 - x).to_bits();
    let m = f64::from_bits(bits & MANTISSA_BITS | ONE_BITS);
    // An integer below 2⁵² converts to f64 as the low mantissa bits of 2⁵² plus it.
    let exponent = f64::from_bits(bits >> 52 | TWO_POW_52.to_bits()) - TWO_POW_52;
    let over = m > SQRT_2;
    let (m, e) = if over { (0.5 * m, exponent - 1022.0) } else { (m, exponent - 1023.0) };
    // Near 0, the digits of x are the digits of the result.
    let near_zero = x < 1.0 - 0.5 * SQRT_2;
    let (above, below, e) = if near_zero { (-x, 2.0 - x, 0.0) } else { (m - 1.0, m + 1.0, e) };
    let s = above / below;
    let z = s * s;
    let artanh = polynomial(z, [1.0, 1.0 / 3.0, 1.0 / 5.0, 1.0 / 7.0, 1.0 / 9.0, 1.0 / 11.0, 1.0 / 13.0]);
    let ln = 2.0 * s * artanh + e * LN_2;
    if x < 1.0 { ln } else { f64::NEG_INFINITY }
}

/// The bits of 1.0, and the mask of the mantissa.
const ONE_BITS: u64 = 1023 << 52;
const MANTISSA_BITS: u64 = (1 << 52) - 1;
/// From 2⁵² on, every f64 is an integer.
const TWO_POW_52: f64 = (1u64 << 52) as f64;

/// Returns e^y for y in −64…0; unspecified elsewhere.
#[inline(always)]
fn exp(y: f64) -> f64 {
    // y = k·ln 2 + r with |r| ≤ ln 2 / 2. Adding ROUNDING rounds to an integer, because the sum has
    // no fractional bits; its low mantissa bits are k.
    const ROUNDING: f64 = 1.5 * TWO_POW_52;
    let rounded = y * LOG2_E + ROUNDING;
    let r = y - (rounded - ROUNDING) * LN_2;
    let series = polynomial(
        r,
        [
            1.0,
            1.0,
            1.0 / 2.0,
            1.0 / 6.0,
            1.0 / 24.0,
            1.0 / 120.0,
            1.0 / 720.0,
            1.0 / 5040.0,
            1.0 / 40320.0,
            1.0 / 362_880.0,
        ],
    );
    series * f64::from_bits(rounded.to_bits().wrapping_add(1023) << 52)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_agrees_with_libm() {
        let mut compared = 0;
        for i in 0..=2000 {
            for x in [f64::from(i) / 2000.0, 0.9f64.powi(i), 1.0 - 0.99f64.powi(i)] {
                for p in [0.0, 0.3, 1.0, 2.0, 17.0, 250.0, 19_998.0, 1e8] {
                    let exact = if x == 1.0 { libm::pow(0.0, p) } else { libm::exp(p * libm::log1p(-x)) };
                    let ours = pow_one_minus(x, p);
                    if exact > 1.7e-28 {
                        assert!((ours / exact - 1.0).abs() < 1e-9, "{x} {p}: {ours} {exact}");
                        compared += 1;
                    } else {
                        // 0 or accurate: no power is subnormal, not even as f32.
                        assert!(ours == 0.0 && exact < 1.7e-28 || ours > 1.6e-28, "{x} {p}: {ours} {exact}");
                    }
                }
            }
        }
        assert!(compared > 20_000);
    }

    #[test]
    fn the_ends_of_the_range_are_exact() {
        assert_eq!([0.0, 0.5, 1.0].map(|x| pow_one_minus(x, 0.0)), [1.0; 3]);
        assert_eq!([0.0, 1.0].map(|x| pow_one_minus(x, 10.0)), [1.0, 0.0]);
        assert_eq!(pow_one_minus(1.0 - f64::EPSILON, f64::from(f32::MAX)), 0.0);
    }
}
