//! The Python module `blinn._blinn`: load, pose, render and trace scenes with NumPy arrays.
//!
//! `src/python/blinn` holds the Python side: the package that users import, its type stubs and the command. This side
//! converts arguments and results. Options of a render come from the same table as those of the command line, so
//! pictures equal those of the command bit for bit.
//!
//! Arrays are C-contiguous. Images have row 0 on top. The world is right-handed with +Y up, in metres; angles are
//! degrees, as on the command line.
//!
//! All work is done in the thread pool of `pool`, without the GIL. The threads of a render never wait for Python.
// PyO3's macros generate unsafe code.
#![allow(unsafe_code)]

mod array_words;
mod camera;
mod camera_list;
mod command;
mod errors;
mod info;
mod loaded;
mod log;
mod option_types;
mod options;
mod picture;
mod pictures;
mod pool;
mod posed;
mod ray_order;
mod rays;
mod render_job;
mod scene;
mod size;

use pyo3::prelude::*;

use blinn_cli::embed::install_panic_hook;
use blinn_session::set_option_word;

/// Rendering of glTF and OBJ scenes on the CPU.
#[pymodule]
fn _blinn(module: &Bound<'_, PyModule>) -> PyResult<()> {
    install_panic_hook();
    set_option_word(log::keyword);
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    errors::register(module)?;
    module.add_class::<camera::PyCamera>()?;
    module.add_class::<picture::PyPicture>()?;
    module.add_class::<scene::PyScene>()?;
    module.add_class::<pictures::PyPictures>()?;
    module.add_function(wrap_pyfunction!(camera_list::load_cameras, module)?)?;
    module.add_function(wrap_pyfunction!(command::check_dataset_options, module)?)?;
    module.add_function(wrap_pyfunction!(command::main, module)?)?;
    module.add_function(wrap_pyfunction!(option_types::option_types, module)?)?;
    module.add_function(wrap_pyfunction!(options::list_render_options, module)?)?;
    module.add_function(wrap_pyfunction!(pool::set_threads, module)?)?;
    Ok(())
}
