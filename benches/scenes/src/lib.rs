//! The generated benchmark scenes, re-exported from [`blinn_bench::scenes`].
//!
//! ```sh
//! cargo run --release -p blinn-scenes -- scan 1100000 target/scenes/scan-1.1m.glb
//! ```

pub use blinn_bench::scenes::*;
