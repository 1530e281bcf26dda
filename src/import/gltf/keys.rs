//! Repairs keyframes: those in order, complete and finite are kept.

/// Numbers of each keyframe's values.
#[derive(Clone, Copy, Debug)]
pub(super) struct KeyShape {
    /// Values per keyframe: 1, or an in-tangent, a value and an out-tangent.
    pub elements: usize,
    /// Numbers per value.
    pub width: usize,
}

impl KeyShape {
    fn numbers(self) -> usize {
        self.elements.saturating_mul(self.width)
    }
}

/// Removes surplus values, keyframes without values and keyframes that are not finite, and sorts the others by
/// time. Returns a message for each kind of defect.
pub(super) fn repair(times: &mut Vec<f32>, values: &mut Vec<f32>, shape: KeyShape) -> Vec<String> {
    let mut messages = Vec::new();
    let per_key = shape.numbers().max(1);
    let (keys, complete) = (times.len(), values.len() / per_key);
    if values.len() > keys.saturating_mul(per_key) {
        let count = (values.len() / shape.width.max(1)) as u64;
        messages.push(format!("{count} values for {keys} keyframes; ignored the last values"));
    } else if complete < keys {
        messages.push(format!("values for {complete} of {keys} keyframes; ignored the last keyframes"));
    }
    times.truncate(complete);
    values.truncate(times.len().saturating_mul(per_key));
    let is_finite = |(time, key): (&f32, &[f32])| time.is_finite() && key.iter().all(|v| v.is_finite());
    let invalid = times.iter().zip(values.chunks_exact(per_key)).filter(|&key| !is_finite(key)).count();
    if invalid > 0 {
        messages.push(format!("ignored {invalid} of {keys} keyframes, which are not finite"));
    }
    let is_sorted = times.is_sorted();
    if invalid == 0 && is_sorted {
        return messages;
    }
    let mut order: Vec<usize> = (0..times.len())
        .filter(|&i| is_finite((&times[i], &values[i * per_key..(i + 1) * per_key])))
        .collect();
    if !order.is_sorted_by_key(|&i| times[i]) {
        messages.push("keyframe times do not ascend; sorted the keyframes".into());
        order.sort_by(|&a, &b| times[a].total_cmp(&times[b]));
    }
    *values = order.iter().flat_map(|&i| &values[i * per_key..(i + 1) * per_key]).copied().collect();
    *times = order.iter().map(|&i| times[i]).collect();
    messages
}

#[cfg(test)]
mod tests {
    use super::*;

    const NAN: f32 = f32::NAN;

    /// Keyframes of two numbers each.
    fn repaired(times: &[f32], values: &[f32]) -> (Vec<f32>, Vec<f32>, Vec<String>) {
        let (mut times, mut values) = (times.to_vec(), values.to_vec());
        let messages = repair(&mut times, &mut values, KeyShape { elements: 1, width: 2 });
        (times, values, messages)
    }

    #[test]
    fn good_keyframes_are_kept() {
        let good = (vec![0.0, 1.0, 1.0], vec![0.0, 1.0, 2.0, 3.0, 4.0, 5.0], vec![]);
        assert_eq!(repaired(&good.0, &good.1), good);
        for (times, values, kept, expected, message) in [
            (
                &[2.0, 0.0, 1.0][..],
                &[4.0, 5.0, 0.0, 1.0, 2.0, 3.0][..],
                &[0.0, 1.0, 2.0][..],
                &[0.0, 1.0, 2.0, 3.0, 4.0, 5.0][..],
                "keyframe times do not ascend; sorted the keyframes",
            ),
            (
                &[0.0, NAN, 1.0, 2.0],
                &[0.0, 1.0, 2.0, 3.0, NAN, 5.0, 6.0, 7.0],
                &[0.0, 2.0],
                &[0.0, 1.0, 6.0, 7.0],
                "ignored 2 of 4 keyframes, which are not finite",
            ),
            (
                &[0.0, 1.0],
                &[0.0, 1.0, 2.0, 3.0, 4.0],
                &[0.0, 1.0],
                &[0.0, 1.0, 2.0, 3.0],
                "2 values for 2 keyframes; ignored the last values",
            ),
            (
                &[0.0, 1.0, 2.0],
                &[0.0, 1.0, 2.0, 3.0, 4.0],
                &[0.0, 1.0],
                &[0.0, 1.0, 2.0, 3.0],
                "values for 2 of 3 keyframes; ignored the last keyframes",
            ),
            (&[f32::INFINITY], &[0.0, 1.0], &[], &[], "ignored 1 of 1 keyframes, which are not finite"),
        ] {
            let expected = (kept.to_vec(), expected.to_vec(), vec![message.to_string()]);
            assert_eq!(repaired(times, values), expected);
        }
    }

    #[test]
    fn several_defects_are_repaired_together() {
        let (times, values, messages) = repaired(&[3.0, NAN, 1.0, 2.0], &[6.0, 7.0, 0.0, 0.0, 2.0, 3.0]);
        assert_eq!((times, values), (vec![1.0, 3.0], vec![2.0, 3.0, 6.0, 7.0]));
        assert_eq!(messages.len(), 3, "{messages:?}");
    }
}
