//! The base of all packages of the blinn renderer: geometry with its error bounds, SIMD kernels with run-time
//! dispatch, and the cancellation of long work.
#![deny(unsafe_code)]
#![warn(missing_docs)]

pub mod cancellation;
pub mod geometry;
pub mod simd;
