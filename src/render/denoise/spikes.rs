//! Bounds on single bright pixels.

/// Scales pixels of each half that are more than `factor` times as bright as the brightest of the pixels next to it, in
/// either half, and the pixel itself in the other half, to that brightness. Light is lost, never gained. Pixels among black
/// ones stay.
pub(super) fn limit_spikes(halves: &mut [Vec<f32>; 6], weight: &[f32], width: usize, factor: f32) {
    let luminance = [0, 3].map(|h| -> Vec<f32> {
        let light = |i: usize| 0.2126 * halves[h][i] + 0.7152 * halves[h + 1][i] + 0.0722 * halves[h + 2][i];
        (0..weight.len()).map(light).collect()
    });
    let brighter: Vec<f32> = luminance[0].iter().zip(&luminance[1]).map(|(a, b)| a.max(*b)).collect();
    for y in 1..(weight.len() / width).saturating_sub(1) {
        for x in 1..width - 1 {
            let i = y * width + x;
            if weight[i] == 0.0 {
                continue;
            }
            let mut limit = 0.0f32;
            for row in [i - width, i, i + width] {
                for q in row - 1..=row + 1 {
                    if q != i {
                        limit = limit.max(brighter[q]);
                    }
                }
            }
            for h in 0..2 {
                let limit = factor * limit.max(luminance[1 - h][i]);
                if limit > 0.0 && luminance[h][i] > limit {
                    let scale = limit / luminance[h][i];
                    halves[3 * h..3 * h + 3].iter_mut().for_each(|channel| channel[i] *= scale);
                }
            }
        }
    }
}
