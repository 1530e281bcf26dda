//! `BLINN_SIMD`: the SIMD instructions to use.

use std::ffi::OsString;

use crate::usage::UsageError;
use blinn_accel::SimdLevel;

/// The SIMD level that the value of `BLINN_SIMD` names, else the highest that this processor has.
pub fn simd_level(value: Option<OsString>) -> Result<SimdLevel, UsageError> {
    let Some(value) = value.filter(|value| !value.is_empty()) else { return Ok(SimdLevel::detect()) };
    value.to_string_lossy().parse().map_err(|e| UsageError(format!("BLINN_SIMD: {e}")))
}
