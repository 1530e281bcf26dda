//! Polynomials by Horner's rule.

/// Returns the sum of `coefficients[i]`·x^i, from the highest power down.
#[inline(always)]
pub(crate) fn polynomial<const N: usize>(x: f64, coefficients: [f64; N]) -> f64 {
    let mut sum = coefficients[N - 1];
    for i in (0..N - 1).rev() {
        sum = coefficients[i] + x * sum;
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn powers_have_their_coefficients() {
        assert_eq!(polynomial(10.0, [4.0, 3.0, 2.0, 1.0]), 1234.0);
        assert_eq!(polynomial(10.0, [4.0]), 4.0);
    }
}
