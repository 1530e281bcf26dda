//! Median and spread of samples.

/// The median of the finite values. `None` if there are none.
pub fn median(values: impl IntoIterator<Item = f64>) -> Option<f64> {
    let mut sorted: Vec<f64> = values.into_iter().filter(|v| v.is_finite()).collect();
    sorted.sort_by(f64::total_cmp);
    let low = sorted.get(sorted.len().checked_sub(1)? / 2)?;
    let high = sorted.get(sorted.len() / 2)?;
    Some(0.5 * low + 0.5 * high)
}

/// The standard deviation of the logarithms of the positive values: their relative spread. `None` for fewer than two.
pub fn log_std_dev(values: impl IntoIterator<Item = f64>) -> Option<f64> {
    let positive = values.into_iter().filter(|v| v.is_finite() && *v > 0.0);
    let logs: Vec<f64> = positive.map(libm::log).collect();
    if logs.len() < 2 {
        return None;
    }
    let n = logs.len() as f64;
    let mean = logs.iter().sum::<f64>() / n;
    Some((logs.iter().map(|x| (x - mean) * (x - mean)).sum::<f64>() / (n - 1.0)).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_median_ignores_values_that_are_not_finite() {
        assert_eq!(median([3.0, f64::NAN, 1.0, 2.0, f64::INFINITY]), Some(2.0));
        assert_eq!(median([1.0, 4.0]), Some(2.5));
        assert_eq!(median([f64::MAX, f64::MAX]), Some(f64::MAX));
        assert_eq!(median([f64::NAN]), None);
        assert_eq!(median([]), None);
    }

    #[test]
    fn the_spread_is_relative() {
        let small = log_std_dev([0.9, 1.0, 1.1]).unwrap();
        let large = log_std_dev([9e6, 10e6, 11e6]).unwrap();
        assert!((small - large).abs() < 1e-12 && (small - 0.1).abs() < 0.002, "{small} {large}");
        assert_eq!(log_std_dev([5.0; 4]), Some(0.0));
        assert_eq!(log_std_dev([1.0, -1.0, f64::NAN]), None);
    }
}
