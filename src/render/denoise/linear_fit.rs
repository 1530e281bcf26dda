//! Weighted least squares of several pixels at once.

use super::params::Params;

/// Fits at once.
pub(super) const LANES: usize = 8;
/// A number of each fit.
pub(super) type Lane = [f32; LANES];

/// Copies the numbers of neighbouring pixels.
#[inline(always)]
pub(super) fn load(plane: &[f32], start: usize) -> Lane {
    let mut lane = [0.0; LANES];
    lane.copy_from_slice(&plane[start..start + LANES]);
    lane
}

/// Normal equations of a fit of three colours by N coefficients: the first is constant.
pub(super) struct NormalEquations<const N: usize> {
    /// Lower triangle of Σ w x xᵀ.
    a: [[Lane; N]; N],
    /// Σ w x cᵀ.
    b: [[Lane; 3]; N],
}

impl<const N: usize> NormalEquations<N> {
    #[inline(always)]
    pub fn new() -> Self {
        NormalEquations { a: [[[0.0; LANES]; N]; N], b: [[[0.0; LANES]; 3]; N] }
    }

    /// Adds `K` observations: weights, features (the first is 1) and colours. Sums are loaded and stored once for all.
    #[inline(always)]
    pub fn add<const K: usize>(&mut self, w: &[Lane; K], x: &[[Lane; N]; K], color: &[[Lane; 3]; K]) {
        for i in 0..N {
            let mut wx = *w;
            if i > 0 {
                for k in 0..K {
                    for l in 0..LANES {
                        wx[k][l] *= x[k][i][l];
                    }
                }
            }
            for j in 0..=i {
                let mut sum = self.a[i][j];
                for k in 0..K {
                    for l in 0..LANES {
                        sum[l] += wx[k][l] * x[k][j][l];
                    }
                }
                self.a[i][j] = sum;
            }
            for c in 0..3 {
                let mut sum = self.b[i][c];
                for k in 0..K {
                    for l in 0..LANES {
                        sum[l] += wx[k][l] * color[k][c][l];
                    }
                }
                self.b[i][c] = sum;
            }
        }
    }

    /// Adds all lanes up into the first, always in the same order.
    #[inline(always)]
    pub fn sum_lanes(&mut self) {
        let sum = |lane: &mut Lane| {
            let four: [f32; 4] = std::array::from_fn(|l| lane[l] + lane[l + 4]);
            lane[0] = (four[0] + four[2]) + (four[1] + four[3]);
        };
        self.a.as_flattened_mut().iter_mut().for_each(sum);
        self.b.as_flattened_mut().iter_mut().for_each(sum);
    }

    /// Solves for the coefficients by Cholesky's decomposition. Lanes without observations have unspecified ones.
    #[inline(always)]
    pub fn solve(&self, params: &Params) -> [[[f64; LANES]; 3]; N] {
        let mut a = [[[0.0f64; LANES]; N]; N];
        for i in 0..N {
            for j in 0..=i {
                for l in 0..LANES {
                    a[i][j][l] = f64::from(self.a[i][j][l]);
                }
            }
        }
        let mut inverse = [[0.0f64; LANES]; N];
        for l in 0..LANES {
            let total = a[0][0][l];
            // Positions are the features 4, 5 and 6.
            let spread = if N > 6 { a[4][4][l] + a[5][5][l] + a[6][6][l] } else { 0.0 };
            for i in 1..N {
                a[i][i][l] += if (4..7).contains(&i) {
                    params.position_ridge * spread + 1e-30 * total
                } else {
                    params.ridge * total
                };
            }
        }
        for i in 0..N {
            for j in 0..=i {
                let mut s = a[i][j];
                for k in 0..j {
                    for l in 0..LANES {
                        s[l] -= a[i][k][l] * a[j][k][l];
                    }
                }
                for l in 0..LANES {
                    if i == j {
                        let floor = 1e-12 * a[i][i][l];
                        let d = if s[l] > floor { s[l] } else { floor };
                        inverse[i][l] = 1.0 / if d > 1e-300 { d } else { 1e-300 }.sqrt();
                    } else {
                        a[i][j][l] = s[l] * inverse[j][l];
                    }
                }
            }
        }
        let mut x = [[[0.0f64; LANES]; 3]; N];
        for c in 0..3 {
            for i in 0..N {
                for l in 0..LANES {
                    x[i][c][l] = f64::from(self.b[i][c][l]);
                }
                for k in 0..i {
                    for l in 0..LANES {
                        x[i][c][l] -= a[i][k][l] * x[k][c][l];
                    }
                }
                for l in 0..LANES {
                    x[i][c][l] *= inverse[i][l];
                }
            }
            for i in (0..N).rev() {
                for k in i + 1..N {
                    for l in 0..LANES {
                        x[i][c][l] -= a[k][i][l] * x[k][c][l];
                    }
                }
                for l in 0..LANES {
                    x[i][c][l] *= inverse[i][l];
                }
            }
        }
        x
    }

    /// Total weight of the observations.
    #[inline(always)]
    pub fn total(&self) -> &Lane {
        &self.a[0][0]
    }
}
