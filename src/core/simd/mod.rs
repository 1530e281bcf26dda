//! Explicit SIMD with run-time dispatch: portable, AVX2 or AVX-512.
//!
//! Kernels are written once, generic over [`Simd`], and compiled for each instruction set. [`SimdLevel::run`]
//! selects the compiled kernel. Levels may round differently (some fuse multiply and add), so f32 results only ever
//! prove a fact within an error bound that covers both roundings. Final results are bit-identical on all levels.

#[cfg(target_arch = "x86_64")]
mod avx2;
#[cfg(target_arch = "x86_64")]
mod avx512;
mod instruction_set;
mod lanes;
mod level;
mod pair;
mod portable;
mod prefetch;
#[cfg(test)]
mod tests;
pub mod vec3;
#[cfg(target_arch = "x86_64")]
mod x86_lanes;

pub use instruction_set::{AutovecKernel, OutlinedKernel, Simd, SimdKernel};
pub use lanes::Lanes;
pub use level::{SimdLevel, SimdLevelError};
pub use prefetch::{prefetch, prefetch_all_lines};
