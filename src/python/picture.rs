//! A rendered picture with its layers.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use numpy::{IntoPyArray, PyArray1, PyArrayMethods};
use pyo3::exceptions::PyKeyError;
use pyo3::prelude::*;
use pyo3::types::PyBytes;

use super::errors::value_error;
use super::pool;
use blinn_core::worded;
use blinn_output::{BitDepth, ImageFormat, Overwrite, Picture, SaveError, save};
use blinn_render::integrator::{Aov, MatteKind};
use blinn_render::{AovLayer, MATTE_RANKS};
use blinn_session::values;

/// Metres per step of depths in files.
const MILLIMETRE: f64 = 0.001;

/// A rendered picture.
#[pyclass(name = "Picture", module = "blinn", frozen)]
pub struct PyPicture {
    picture: Arc<Picture>,
}

impl PyPicture {
    pub fn new(picture: Picture) -> PyPicture {
        PyPicture { picture: Arc::new(picture) }
    }

    fn size(&self) -> (usize, usize) {
        (self.picture.pixels.width as usize, self.picture.pixels.height as usize)
    }

    /// The picture without its layers.
    fn alone(&self) -> Picture {
        Picture::new(self.picture.pixels.clone(), self.picture.display)
    }

    fn layer(&self, name: &str) -> Option<&AovLayer> {
        self.picture.layers.iter().find(|layer| layer.aov.name() == name)
    }
}

#[pymethods]
impl PyPicture {
    /// Width in pixels.
    #[getter]
    fn width(&self) -> u32 {
        self.picture.pixels.width
    }

    /// Height in pixels.
    #[getter]
    fn height(&self) -> u32 {
        self.picture.pixels.height
    }

    /// Exposure in stops that `rgba` is shown with.
    #[getter]
    fn exposure(&self) -> f64 {
        self.picture.display.ev
    }

    /// The displayed picture as the command writes it to a PNG: straight alpha, sRGB, shape (height, width, 4), uint8.
    #[getter]
    fn rgba<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let (width, height) = self.size();
        let bytes = pool::run(py, || {
            let pixels = self.picture.display.to_rgba8(&self.picture.pixels);
            Ok(pixels.into_flattened())
        })?;
        Ok(bytes.into_pyarray(py).reshape([height, width, 4])?.into_any())
    }

    /// `rgba`, for `numpy.asarray(picture)`.
    #[pyo3(signature = (dtype = None, copy = None))]
    fn __array__<'py>(
        &self,
        py: Python<'py>,
        dtype: Option<&Bound<'py, PyAny>>,
        copy: Option<bool>,
    ) -> PyResult<Bound<'py, PyAny>> {
        if copy == Some(false) {
            return Err(value_error("a picture has no array of its own; use copy=None"));
        }
        let array = self.rgba(py)?;
        match dtype {
            Some(dtype) => array.call_method1("astype", (dtype,)),
            None => Ok(array),
        }
    }

    /// The linear picture as the command writes it to an EXR: Rec. 709 primaries, premultiplied alpha, shape
    /// (height, width, 4), float32. Exposure and view transform are not applied.
    #[getter]
    fn linear<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let (width, height) = self.size();
        let values: Vec<f32> = py.detach(|| {
            let colors = self.picture.pixels.colors.iter();
            colors.flat_map(|&c| self.picture.display.composite_linear(c).to_array()).collect()
        });
        Ok(values.into_pyarray(py).reshape([height, width, 4])?.into_any())
    }

    /// Names of the layers.
    #[getter]
    fn layers(&self) -> Vec<&'static str> {
        self.picture.layers.iter().map(|layer| layer.aov.name()).collect()
    }

    /// A layer at the pixel centres: shape (height, width) for one channel, else (height, width, channels). Ids and
    /// counts are uint32, all others float32.
    fn __getitem__<'py>(&self, py: Python<'py>, name: &str) -> PyResult<Bound<'py, PyAny>> {
        let Some(layer) = self.layer(name) else {
            let known: Vec<_> = Aov::ALL.iter().map(|aov| aov.name()).collect();
            let hint = if known.contains(&name) {
                format!("'{name}' was not rendered; pass layers=[\"{name}\"] to render()")
            } else {
                let rendered = match self.layers()[..] {
                    [] => "the picture has none".to_string(),
                    ref layers => format!("the picture has {}", layers.join(", ")),
                };
                format!("there is no layer '{name}'; {rendered}{}", values::layer_hint(name))
            };
            return Err(PyKeyError::new_err(hint));
        };
        let (width, height) = self.size();
        if layer.aov.is_id() {
            let ids: Vec<u32> = layer.values.iter().map(|&value| layer.aov.id(value)).collect();
            shaped(ids.into_pyarray(py), width, height, layer.aov.channel_count())
        } else {
            shaped(PyArray1::from_slice(py, &layer.values), width, height, layer.aov.channel_count())
        }
    }

    fn __contains__(&self, name: &str) -> bool {
        self.layer(name).is_some()
    }

    /// The objects or materials that each pixel shows, over all samples of the filter: ids from 1, uint32, and the parts of
    /// the pixel that they cover, float32, each of shape (height, width, 6), the largest first and 0 for no more. `kind`
    /// is "object" or "material".
    fn matte<'py>(&self, py: Python<'py>, kind: &str) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyAny>)> {
        if !MatteKind::ALL.iter().any(|known| known.name() == kind) {
            return Err(value_error(format!("kind must be \"object\" or \"material\", not '{kind}'")));
        }
        let Some(matte) = self.picture.mattes.iter().find(|matte| matte.kind.name() == kind) else {
            let text = "mattes were not rendered; pass layers=[\"cryptomatte\"] to render()";
            return Err(PyKeyError::new_err(text));
        };
        let (width, height) = self.size();
        let (ids, coverages): (Vec<u32>, Vec<f32>) = py.detach(|| {
            let ranked = |pixel, rank| matte.pixel(pixel).get(rank).copied().unwrap_or_default();
            let all =
                (0..matte.len()).flat_map(|pixel| (0..MATTE_RANKS).map(move |rank| ranked(pixel, rank)));
            all.unzip()
        });
        Ok((
            shaped(ids.into_pyarray(py), width, height, MATTE_RANKS)?,
            shaped(coverages.into_pyarray(py), width, height, MATTE_RANKS)?,
        ))
    }

    /// Writes the picture to one file. The ending picks the format: .png, .exr, .jpg or .webp. Layers are channels of an
    /// .exr; other formats have the picture alone.
    fn save(&self, py: Python<'_>, path: PathBuf) -> PyResult<()> {
        let format = format_of(&path)?;
        if format.supports_layers() {
            return write(py, &self.picture, &path, format).map(drop);
        }
        write(py, &self.alone(), &path, format).map(drop)
    }

    /// Writes the picture, and beside formats other than .exr each layer as NAME.<layer>.png. Depths are 16-bit integers:
    /// multiples of `depth_unit` ("mm", "m" or metres), 0 where nothing is; other layers are shown as colours. Returns the
    /// written paths.
    #[pyo3(signature = (path, *, depth_unit = None))]
    fn save_all(
        &self,
        py: Python<'_>,
        path: PathBuf,
        depth_unit: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Vec<PathBuf>> {
        let format = format_of(&path)?;
        let unit = match depth_unit {
            Some(unit) => {
                let text: String = unit.str()?.extract()?;
                Some(
                    values::depth_unit(&text)
                        .map_err(|reason| value_error(worded!("`depth-unit`: {}", reason)))?,
                )
            }
            None => self.picture.depth_step,
        };
        let step = unit.unwrap_or(MILLIMETRE);
        check_depths(self.layer(Aov::Depth.name()).filter(|_| !format.supports_layers()), step)?;
        let metric = Picture { depth_step: Some(step), ..Picture::clone(&self.picture) };
        write(py, &metric, &path, format)
    }

    /// The displayed picture as a PNG file, for notebooks.
    fn _repr_png_<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        let bytes = pool::run(py, || Ok(ImageFormat::Png.encode(&self.alone(), BitDepth::Default)?))?;
        Ok(PyBytes::new(py, &bytes))
    }

    fn __repr__(&self) -> String {
        let (width, height) = self.size();
        let layers = match self.layers()[..] {
            [] => String::new(),
            ref names => format!(" with {}", names.join(", ")),
        };
        format!("<blinn.Picture {width}x{height}{layers}>")
    }
}

/// The format that the ending of a path picks.
fn format_of(path: &Path) -> PyResult<ImageFormat> {
    ImageFormat::from_path(path).ok_or_else(|| {
        let (path, endings) = (path.display(), ImageFormat::EXTENSIONS);
        value_error(format!("{path}: unknown ending; use one of {endings}"))
    })
}

/// Writes a picture with its layers. Returns the written paths.
fn write(py: Python<'_>, picture: &Picture, path: &Path, format: ImageFormat) -> PyResult<Vec<PathBuf>> {
    let write = || Ok(save(picture, path, format, BitDepth::Default, Overwrite::Yes));
    pool::run(py, write)?.map_err(|error| {
        let SaveError { cause, .. } = &error;
        std::io::Error::new(cause.kind(), error.to_string()).into()
    })
}

/// Returns an error for depths that 16-bit integers do not hold.
fn check_depths(layer: Option<&AovLayer>, step: f64) -> PyResult<()> {
    let depths = layer.into_iter().flat_map(|layer| &layer.values).copied();
    let farthest = f64::from(depths.filter(|depth| depth.is_finite()).fold(0.0, f32::max));
    let largest = step * f64::from(u16::MAX);
    if farthest <= largest + 0.5 * step {
        return Ok(());
    }
    Err(value_error(worded!(
        "the depth {} m is above {} m, the largest of 16 bits; pass a larger `depth-unit`, or save an .exr",
        farthest,
        largest
    )))
}

/// An array of pixels with its shape.
fn shaped<'py, T: numpy::Element>(
    values: Bound<'py, PyArray1<T>>,
    width: usize,
    height: usize,
    channels: usize,
) -> PyResult<Bound<'py, PyAny>> {
    Ok(match channels {
        1 => values.reshape([height, width])?.into_any(),
        _ => values.reshape([height, width, channels])?.into_any(),
    })
}
