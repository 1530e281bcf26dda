//! What all other packages of the blinn renderer build on: geometry with its error bounds, SIMD kernels with run-time
//! dispatch, and the cancellation of long work.
#![deny(unsafe_code)]
#![warn(missing_docs)]

pub mod cancellation;
pub mod geometry;
pub mod simd;
