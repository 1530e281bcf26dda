//! Bootstrap confidence intervals of the ratio of two medians.

use super::scenes::noise::Random;
use super::stats::median;

/// Number of resamples.
const RESAMPLES: usize = 1000;
/// Resamples below and above the interval: 2.5 % each.
const TAIL: usize = RESAMPLES / 40;
/// The resamples are the same in every run.
const SEED: u64 = 47;

/// A 95 % confidence interval.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interval {
    /// The lower limit.
    pub low: f64,
    /// The upper limit.
    pub high: f64,
}

impl Interval {
    /// Returns true if `value` is inside or on a limit.
    pub fn contains(&self, value: f64) -> bool {
        self.low <= value && value <= self.high
    }
}

/// The confidence interval of the median of `new` divided by the median of `old`, for positive values: the percentile
/// bootstrap (Efron and Tibshirani, “An Introduction to the Bootstrap”, 1993, chapter 13). `None` for fewer than two
/// values in either.
pub fn ratio_interval(old: &[f64], new: &[f64]) -> Option<Interval> {
    if old.len() < 2 || new.len() < 2 {
        return None;
    }
    let mut random = Random::new(SEED);
    let mut resampled_median = |values: &[f64]| {
        let draw = |_| values[(random.bits() % values.len() as u64) as usize];
        median((0..values.len()).map(draw))
    };
    let ratio = |_| Some(resampled_median(new)? / resampled_median(old)?);
    let mut ratios: Vec<f64> = (0..RESAMPLES).filter_map(ratio).filter(|ratio| ratio.is_finite()).collect();
    ratios.sort_by(f64::total_cmp);
    // Resamples that are not finite count to both ends.
    let low = *ratios.get(TAIL)?;
    let high = *ratios.get(ratios.len().checked_sub(TAIL + 1)?)?;
    (low <= high).then_some(Interval { low, high })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn intervals_are_reproducible_and_follow_the_scatter() {
        let narrow = [0.99, 1.0, 1.01, 1.0, 0.995];
        let wide = [0.5, 1.0, 2.0, 1.1, 0.9];
        let double: Vec<f64> = narrow.iter().map(|v| 2.0 * v).collect();
        let of = |a: &[f64], b: &[f64]| ratio_interval(a, b).unwrap();
        assert_eq!(of(&narrow, &double), of(&narrow, &double));
        let [close, far] = [of(&narrow, &double), of(&narrow, &wide)];
        assert!(close.contains(2.0) && close.low > 1.95 && close.high < 2.05, "{close:?}");
        assert!(far.contains(1.0) && far.low < 0.95 && far.high > 1.1, "{far:?}");
        assert_eq!(of(&[1.0; 3], &[3.0; 4]), Interval { low: 3.0, high: 3.0 });
        assert_eq!(ratio_interval(&[1.0], &narrow), None);
        assert_eq!(ratio_interval(&narrow, &[]), None);
    }

    /// About 95 % of the intervals between runs of the same distribution contain 1; at least 85 % do with seven rounds each.
    #[test]
    fn intervals_cover_the_true_ratio() {
        let mut random = Random::new(1);
        let mut rounds = || -> Vec<f64> {
            (0..7).map(|_| 1.0 + 0.1 * (random.unit() + random.unit() + random.unit()) as f64).collect()
        };
        let covered =
            (0..200).filter(|_| ratio_interval(&rounds(), &rounds()).unwrap().contains(1.0)).count();
        assert!((170..=200).contains(&covered), "{covered} of 200");
    }
}
