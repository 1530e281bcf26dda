//! The base of all packages of the blinn renderer: geometry with its error bounds, SIMD kernels with run-time
//! dispatch, the cancellation of long work, suggestions for misspelt names, and words for options in messages.
#![deny(unsafe_code)]
#![warn(missing_docs)]

pub mod cancellation;
pub mod closest_name;
pub mod geometry;
pub mod option_words;
pub mod simd;
