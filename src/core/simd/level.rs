//! SIMD levels: which instruction sets exist, detection at run time, and dispatch of kernels.

use std::str::FromStr;

#[cfg(target_arch = "x86_64")]
use crate::simd::avx2;
#[cfg(target_arch = "x86_64")]
use crate::simd::avx512;
use crate::simd::instruction_set::SimdKernel;
use crate::simd::portable::Portable;

/// SIMD instructions that rays are traced and points are shaded with.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum SimdLevel {
    /// The baseline of the target: SSE2 on x86-64, NEON on AArch64.
    Portable,
    /// AVX2 and FMA.
    Avx2,
    /// AVX-512 F, VL, DQ and BW.
    Avx512,
}

impl SimdLevel {
    /// All levels, from the narrowest to the widest.
    pub const ALL: [SimdLevel; 3] = [SimdLevel::Portable, SimdLevel::Avx2, SimdLevel::Avx512];

    /// Returns the name that the environment variable `BLINN_SIMD` takes.
    pub fn name(self) -> &'static str {
        match self {
            SimdLevel::Portable => "portable",
            SimdLevel::Avx2 => "avx2",
            SimdLevel::Avx512 => "avx512",
        }
    }

    /// Returns true if this processor supports the level.
    #[inline]
    pub fn is_supported(self) -> bool {
        #[cfg(target_arch = "x86_64")]
        match self {
            SimdLevel::Portable => true,
            SimdLevel::Avx2 => avx2::is_supported(),
            SimdLevel::Avx512 => avx512::is_supported(),
        }
        #[cfg(not(target_arch = "x86_64"))]
        (self == SimdLevel::Portable)
    }

    /// Returns the widest level that this processor supports.
    pub fn detect() -> SimdLevel {
        let supported = SimdLevel::ALL.into_iter().rev().find(|level| level.is_supported());
        supported.unwrap_or(SimdLevel::Portable)
    }

    /// Runs a kernel compiled for this level, or for the portable one if this processor does not support it.
    #[allow(unsafe_code)]
    pub fn run<K: SimdKernel>(self, kernel: K) -> K::Output {
        #[cfg(target_arch = "x86_64")]
        match self {
            // SAFETY: the guard has checked that the processor supports AVX-512.
            SimdLevel::Avx512 if self.is_supported() => return unsafe { avx512::run(kernel) },
            // SAFETY: the guard has checked that the processor supports AVX2.
            SimdLevel::Avx2 if self.is_supported() => return unsafe { avx2::run(kernel) },
            _ => {}
        }
        kernel.run::<Portable>()
    }
}

/// A value of `BLINN_SIMD` that cannot be used.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum SimdLevelError {
    /// No level has this name.
    #[error("unknown value '{0}': expected {names}", names = SimdLevel::ALL.map(SimdLevel::name).join(", "))]
    Unknown(String),
    /// The level needs another processor.
    #[error("this processor does not support {}", .0.name())]
    Unsupported(SimdLevel),
}

/// Parses the name of a level that this processor supports.
impl FromStr for SimdLevel {
    type Err = SimdLevelError;

    fn from_str(name: &str) -> Result<SimdLevel, SimdLevelError> {
        match SimdLevel::ALL.into_iter().find(|level| level.name() == name) {
            Some(level) if level.is_supported() => Ok(level),
            Some(level) => Err(SimdLevelError::Unsupported(level)),
            None => Err(SimdLevelError::Unknown(name.into())),
        }
    }
}

impl Default for SimdLevel {
    fn default() -> Self {
        SimdLevel::detect()
    }
}
