//! The program `blinn` as people, scripts and farms meet it: commands, flags, help, exit codes, the files that it
//! writes and what it prints about them. Nearly all tests run the program; `camera` calls the library behind its flags.
//!
//! - `animation_output`: `--frames` and `turntable` into GIF, APNG, MP4 and HTML
//! - `assemble`: `blinn assemble` over frames on disk
//! - `batches`: folders and lists of scenes, `--chunk`, `--ledger` and `--timeout`, after kills too
//! - `bench`: what `blinn bench` counts, writes, reads and compares
//! - `blend_files`: .blend files and the programs that convert them
//! - `bop_archives`: `turntable --dataset bop` into archives
//! - `camera`: `--orbit`, `--zoom`, f3d's camera flags, `--hide`, `--only-objects`
//! - `cameras`: lists of cameras in each format
//! - `contact_sheets`: `blinn sheet` of several scenes in one file
//! - `dataset_formats`: `turntable --dataset`: COLMAP, BOP and COCO
//! - `datasets`: `turntable --views`, its layers and `transforms.json`
//! - `diff`: `blinn diff` of scenes and images
//! - `edges`, `edges_of_files`: edges over pictures, and those that glTF files describe
//! - `empty_images`: images that show nothing, and the reason
//! - `examples`: the programs in docs/examples; they need `cargo build --examples`
//! - `exit_codes`: wrong files and command lines: one line and an exit code
//! - `farm`: scripts for render farms, and their tasks run by a stand-in for the engine
//! - `file_settings`: render settings in `extras.blinn`
//! - `golden_check`: `render --check`, `--bless` and `--max-size`
//! - `help`: help pages, usage errors, completions, man pages, docs/reference/command-line.md
//! - `image_output`: EXR, JPEG, WebP, Cryptomatte and layer previews read back
//! - `info`: `blinn info`, in text and JSON
//! - `layers`: layers of geometry: camera space, object coordinates, flow, triangles
//! - `library`: the same pictures from the library
//! - `light_sources`: glowing surfaces as lights, and remarks on lights that cannot be seen
//! - `lighting`: exposure, light radius, ambient occlusion, ground and environment maps from flags
//! - `points`: points and lines: layers, animation, instances, sizes and bad input
//! - `points_in_pictures`: points and lines with clipping planes, grounds, transparent backgrounds, Cryptomatte
//! - `process_limits`: threads, file sizes and memory that the system does not grant
//! - `render`: flags of `blinn render`, and the pictures that they change
//! - `resume`: `--resume` after changes, crashes and kills
//! - `sequences`: many frames and many files: lists, names, configuration files, reports, progress
//! - `sheet`: `blinn sheet` and its JSON
//! - `shards`: archives of images for WebDataset
//! - `signals`: interrupted renders
//! - `trace_bound`: the speed-up that more cores could give, by traces
//! - `turntable`: a model or a camera once around
//! - `view`: the server of `blinn view`: frames, commands, reloads, and requests that get nothing
//! - `view_rects`: off-centre views from flags
//! - `warnings`: how many are printed; `--version` and `--cull`
//! - `watch`: `render --watch`

#[path = "../common/mod.rs"]
mod common;

mod animation_output;
mod assemble;
mod batches;
mod bench;
mod bench_results;
mod benchmark_scenes;
#[cfg(unix)]
mod blend_files;
mod bop_archives;
mod camera;
mod cameras;
mod contact_sheets;
mod dataset_formats;
mod datasets;
mod diff;
mod diff_folders;
mod edges;
mod edges_of_files;
mod empty_images;
mod examples;
mod exit_codes;
mod farm;
mod file_settings;
mod golden_check;
mod help;
mod image_output;
mod info;
mod layers;
mod ledgers;
mod library;
mod light_sources;
mod lighting;
mod points;
mod points_in_pictures;
mod polygon_files;
mod process_limits;
mod render;
mod resume;
mod scene_datasets;
mod scene_inputs;
mod sequences;
mod shards;
mod sheet;
mod signals;
mod trace_bound;
mod turntable;
mod view;
mod view_rects;
mod warnings;
mod watch;
