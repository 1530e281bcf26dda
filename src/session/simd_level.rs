//! `BLINN_SIMD`: the SIMD instructions to use.

use crate::error::SessionError;
use blinn_accel::SimdLevel;

/// The SIMD level that the environment variable `BLINN_SIMD` names, else the highest that this processor has.
///
/// # Errors
/// There is no such level, or this processor does not have it.
pub fn simd_level() -> Result<SimdLevel, SessionError> {
    let value = std::env::var_os("BLINN_SIMD").filter(|value| !value.is_empty());
    let Some(value) = value else { return Ok(SimdLevel::detect()) };
    value.to_string_lossy().parse().map_err(|e| SessionError::Option(format!("BLINN_SIMD: {e}")))
}
