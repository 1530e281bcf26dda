//! `BLINN_SIMD`: the SIMD instructions to use.

use std::ffi::OsString;

use crate::accel::SimdLevel;
use crate::cli::usage::UsageError;

/// The SIMD level that the value of `BLINN_SIMD` names, else the highest that this processor has.
pub fn simd_level(value: Option<OsString>) -> Result<SimdLevel, UsageError> {
    let Some(value) = value.filter(|value| !value.is_empty()) else { return Ok(SimdLevel::detect()) };
    match SimdLevel::ALL.into_iter().find(|level| value == level.name()) {
        Some(level) if level.is_supported() => Ok(level),
        Some(level) => {
            Err(UsageError(format!("BLINN_SIMD: this processor does not support {}", level.name())))
        }
        None => {
            let names = SimdLevel::ALL.map(SimdLevel::name).join(", ");
            let value = value.to_string_lossy();
            Err(UsageError(format!("BLINN_SIMD: unknown value '{value}': expected {names}")))
        }
    }
}
