//! Sizes of pictures as Python has them: tuples, lists or arrays of two integers, or one integer.

use pyo3::prelude::*;

use super::errors::value_error;

/// Reads a width and a height, or one number for both.
///
/// # Errors
/// The value is neither an integer from 0 to 2³² − 1 nor a sequence of two.
pub fn picture_size(size: &Bound<'_, PyAny>) -> PyResult<(u32, u32)> {
    let invalid =
        || value_error(format!("size must be two integers, (width, height), or one for both, not {size}"));
    if let Ok(side) = size.extract::<u32>() {
        return Ok((side, side));
    }
    let sides = size.try_iter().map_err(|_| invalid())?;
    let sides: PyResult<Vec<u32>> = sides.map(|side| side?.extract()).collect();
    match sides.map_err(|_| invalid())?[..] {
        [width, height] => Ok((width, height)),
        _ => Err(invalid()),
    }
}

/// [`picture_size`], if there is a size.
pub fn optional_size(size: Option<&Bound<'_, PyAny>>) -> PyResult<Option<(u32, u32)>> {
    size.map(picture_size).transpose()
}
