//! A scene in a pose: loads, inspects, renders and traces it.

use std::path::PathBuf;
use std::sync::{Arc, OnceLock};

use glam::DVec3;
use numpy::{
    AllowTypeChange, IntoPyArray, PyArray1, PyArray2, PyArrayLike2, PyArrayMethods, PyReadonlyArray1,
};
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict, PyString};

use super::camera::PyCamera;
use super::errors::value_error;
use super::info;
use super::loaded::{LoadedScene, SceneInput};
use super::options::{OptionSet, option_error, plan};
use super::picture::PyPicture;
use super::pictures::PyPictures;
use super::pool;
use super::posed::PosedCell;
use super::rays;
use super::render_job::RenderJob;
use super::size::optional_size;
use blinn_cli::embed::scene_properties;
use blinn_core::geometry::HitId;
use blinn_scene::{AnimationChoice, Scene, View, clip_duration};
use blinn_session::{SessionPlan, camera_name, load_limits, natural_size};

/// A scene, at a time in seconds.
#[pyclass(name = "Scene", module = "blinn", frozen)]
pub struct PyScene {
    loaded: Arc<LoadedScene>,
    time: f64,
    /// The name or index of an animation, `all` or `none`.
    animation: Option<String>,
    /// The pose without and with acceleration structure, made when they are needed.
    pose: OnceLock<Arc<PosedCell>>,
    traceable: OnceLock<Arc<PosedCell>>,
    /// The same with single-sided materials.
    single_sided: OnceLock<Arc<PosedCell>>,
}

/// The use of a pose.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum PoseUse {
    /// Looked at, without acceleration structure.
    Inspect,
    /// Rays are traced in it.
    Trace,
    /// Rays are traced that pass through the back faces of all materials.
    TraceFrontFaces,
}

impl PyScene {
    fn at(loaded: Arc<LoadedScene>, time: f64, animation: Option<String>) -> PyScene {
        let (pose, traceable, single_sided) = (OnceLock::new(), OnceLock::new(), OnceLock::new());
        PyScene { loaded, time, animation, pose, traceable, single_sided }
    }

    fn scene(&self) -> &Scene {
        &self.loaded.scene
    }

    fn choice(&self, plan: &SessionPlan) -> PyResult<AnimationChoice> {
        plan.options.animation(self.scene()).map_err(|e| value_error(e.to_string()))
    }

    fn animation_choice(&self) -> PyResult<AnimationChoice> {
        let options: Vec<(&str, String)> =
            self.animation.iter().map(|name| ("animation", name.clone())).collect();
        self.choice(&plan(OptionSet::Render, None, &options)?)
    }

    /// The pose for a use.
    fn posed(&self, py: Python<'_>, pose_use: PoseUse) -> PyResult<Arc<PosedCell>> {
        let slot = match pose_use {
            PoseUse::Inspect => &self.pose,
            PoseUse::Trace => &self.traceable,
            PoseUse::TraceFrontFaces => &self.single_sided,
        };
        if let Some(cell) = slot.get() {
            return Ok(cell.clone());
        }
        let choice = self.animation_choice()?;
        let pose = if pose_use == PoseUse::Inspect { PosedCell::pose } else { PosedCell::build };
        let scene = match pose_use {
            PoseUse::TraceFrontFaces => self.loaded.single_sided(),
            _ => self.loaded.scene.clone(),
        };
        let time = self.time;
        let cell = pool::run_interruptible(py, move || pose(scene, time, &choice))?;
        Ok(slot.get_or_init(|| Arc::new(cell)).clone())
    }

    /// Prepares a job. `camera` is a name or an index.
    fn job(
        &self,
        py: Python<'_>,
        picture: PictureArguments,
        camera: Option<&Bound<'_, PyAny>>,
        cameras: Vec<Option<PyCamera>>,
        options: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<RenderJob> {
        let PictureArguments { size, samples, layers } = picture;
        let mut more = vec![("samples", samples.to_string())];
        more.extend(size.map(|(width, height)| ("size", format!("{width}x{height}"))));
        if !layers.is_empty() {
            more.push(("aov", layers.join(",")));
        }
        more.extend(self.animation.iter().map(|name| ("animation", name.clone())));
        if let Some(camera) = camera {
            more.push(("camera", camera.str()?.extract()?));
        }
        let mut plan = plan(OptionSet::Render, options, &more)?;
        let limits = load_limits(None);
        let files = pool::run(py, || Ok(plan.options.read_files(&limits)))?;
        files.map_err(option_error)?;
        let choice = self.choice(&plan)?;
        let animation = plan.options.animation.clone();
        Ok(RenderJob {
            start: self.loaded.clip_start(py, &plan, animation.as_deref(), &choice)?,
            name: self.loaded.name.clone(),
            plan,
            cameras,
            time: self.time,
        })
    }
}

/// Arguments of all pictures of a job.
struct PictureArguments {
    size: Option<(u32, u32)>,
    samples: u32,
    layers: Vec<String>,
}

#[pymethods]
impl PyScene {
    /// Load a file, or bytes of a GLB, glTF or OBJ file. See `blinn.load`.
    #[staticmethod]
    #[pyo3(signature = (source, *, name = None, **options))]
    fn load(
        py: Python<'_>,
        source: &Bound<'_, PyAny>,
        name: Option<PathBuf>,
        options: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<PyScene> {
        let (input, default_name) = if let Ok(bytes) = source.cast::<PyBytes>() {
            (SceneInput::Memory(bytes.as_bytes().to_vec()), PathBuf::from("bytes"))
        } else if source.is_instance_of::<PyString>() || source.hasattr("__fspath__")? {
            let path: PathBuf = source.extract()?;
            (SceneInput::File(path.clone()), path)
        } else {
            let kind = source.get_type().name()?;
            return Err(PyTypeError::new_err(format!("source must be a path or bytes, not {kind}")));
        };
        let name = name.unwrap_or(default_name);
        let plan = plan(OptionSet::Load, options, &[])?;
        let loaded = LoadedScene::load(py, input, name, &plan)?;
        Ok(PyScene::at(Arc::new(loaded), 0.0, None))
    }

    /// Return the same scene at another time in seconds, sharing its data.
    #[pyo3(signature = (time = 0.0, *, animation = None))]
    fn pose(&self, time: f64, animation: Option<&Bound<'_, PyAny>>) -> PyResult<PyScene> {
        if !(time.is_finite() && time >= 0.0) {
            return Err(value_error("time must be finite and not negative"));
        }
        let animation = match animation {
            Some(animation) => Some(animation.str()?.extract()?),
            None => self.animation.clone(),
        };
        let posed = PyScene::at(self.loaded.clone(), time, animation);
        posed.animation_choice()?;
        Ok(posed)
    }

    /// Time in seconds.
    #[getter]
    fn time(&self) -> f64 {
        self.time
    }

    /// Length of the animation in seconds.
    #[getter]
    fn duration(&self) -> PyResult<f64> {
        clip_duration(self.scene(), &self.animation_choice()?).map_err(|e| value_error(e.to_string()))
    }

    /// Warnings of the import.
    #[getter]
    fn warnings(&self) -> Vec<String> {
        self.loaded.warnings.clone()
    }

    /// Number of triangles, those of shared meshes counted once for each instance.
    #[getter]
    fn triangle_count(&self) -> u64 {
        self.scene().instanced_triangle_count()
    }

    /// The lowest and the highest corner of all that is visible, shape (2, 3), in metres.
    #[getter]
    fn bounds<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let bounds = self.posed(py, PoseUse::Inspect)?.borrow_dependent().posed.bounds();
        let corner = |v: DVec3| if bounds.is_empty() { DVec3::NAN } else { v };
        let corners = [corner(bounds.min).to_array(), corner(bounds.max).to_array()];
        PyArray1::from_slice(py, corners.as_flattened()).reshape([2, 3])
    }

    /// The file's cameras at this time, in the order of their indices.
    #[getter]
    fn cameras(&self, py: Python<'_>) -> PyResult<Vec<PyCamera>> {
        let posed = self.posed(py, PoseUse::Inspect)?;
        let scene = self.scene();
        let resolve = |index: usize| {
            let (width, height) = natural_size(scene, Some(index));
            let view = View { camera: Some(camera_name(scene, index)), ..View::default() };
            let (camera, _) = view.resolve(&posed.borrow_dependent().posed, width, height)?;
            Ok(PyCamera::from_camera(&camera, (width, height)))
        };
        pool::run(py, || (0..scene.cameras.len()).map(resolve).collect())
    }

    /// What is in the scene, as `blinn info --json` prints it.
    fn info<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let posed = self.posed(py, PoseUse::Inspect)?;
        let LoadedScene { warnings, glass, .. } = &*self.loaded;
        let value =
            pool::run(py, || Ok(scene_properties(&posed.borrow_dependent().posed, warnings, *glass)))?;
        info::to_python(py, &value)
    }

    /// Render a picture. See the package.
    #[pyo3(signature = (camera = None, size = None, samples = 4, layers = Vec::new(), progress = None, **options))]
    #[allow(clippy::too_many_arguments)]
    fn render(
        &self,
        py: Python<'_>,
        camera: Option<&Bound<'_, PyAny>>,
        size: Option<&Bound<'_, PyAny>>,
        samples: u32,
        layers: Vec<String>,
        progress: Option<Py<PyAny>>,
        options: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<PyPicture> {
        let own = camera.and_then(|camera| camera.extract::<PyCamera>().ok());
        let named = if own.is_some() { None } else { camera };
        let size = optional_size(size)?.or(own.as_ref().and_then(PyCamera::picture_size));
        let picture = PictureArguments { size, samples, layers };
        PyPictures::start(self.job(py, picture, named, vec![own], options)?, progress)?.single(py)
    }

    /// Render a picture from each camera. See the package.
    #[pyo3(signature = (cameras, size = None, samples = 4, layers = Vec::new(), progress = None, **options))]
    #[allow(clippy::too_many_arguments)]
    fn render_many(
        &self,
        py: Python<'_>,
        cameras: Vec<PyCamera>,
        size: Option<&Bound<'_, PyAny>>,
        samples: u32,
        layers: Vec<String>,
        progress: Option<Py<PyAny>>,
        options: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<PyPictures> {
        let size = optional_size(size)?;
        let sizes: Vec<_> = cameras.iter().filter_map(PyCamera::picture_size).collect();
        if size.is_none() && sizes.iter().any(|other| *other != sizes[0]) {
            return Err(value_error("the cameras have different sizes; pass size"));
        }
        let picture = PictureArguments { size: size.or(sizes.first().copied()), samples, layers };
        let cameras = cameras.into_iter().map(Some).collect();
        PyPictures::start(self.job(py, picture, None, cameras, options)?, progress)
    }

    /// Find the closest hits of rays. See the package.
    #[pyo3(signature = (origins, directions, *, cull_back_faces = false, point_size = "auto", line_width = "auto"))]
    fn intersect<'py>(
        &self,
        py: Python<'py>,
        origins: PyArrayLike2<'py, f64, AllowTypeChange>,
        directions: PyArrayLike2<'py, f64, AllowTypeChange>,
        cull_back_faces: bool,
        point_size: &str,
        line_width: &str,
    ) -> PyResult<Bound<'py, PyDict>> {
        let (origins, directions) = (origins.as_array(), directions.as_array());
        check_pairs("origins", origins.shape(), "directions", directions.shape())?;
        let pose_use = if cull_back_faces { PoseUse::TraceFrontFaces } else { PoseUse::Trace };
        let posed = self.posed(py, pose_use)?;
        let sizes = rays::sizes(posed.borrow_dependent(), point_size, line_width).map_err(value_error)?;
        let hits = pool::run(py, || {
            rays::intersect(posed.borrow_dependent(), &origins, &directions, cull_back_faces, sizes)
        })?;
        let out = PyDict::new(py);
        out.set_item("t", hits.t.into_pyarray(py))?;
        out.set_item("object", hits.object.into_pyarray(py))?;
        out.set_item("instance", hits.instance.into_pyarray(py))?;
        out.set_item("triangle", hits.triangle.into_pyarray(py))?;
        let count = hits.barycentrics.len();
        let barycentrics = hits.barycentrics.into_flattened().into_pyarray(py);
        out.set_item("barycentrics", barycentrics.reshape([count, 3])?)?;
        let points = hits.points.into_flattened().into_pyarray(py);
        out.set_item("points", points.reshape([count, 3])?)?;
        out.set_item("kind", hits.kind.into_pyarray(py))?;
        Ok(out)
    }

    /// Find whether something blocks the way between points. See the package. `sources` are the instances and triangles
    /// that the ways start on.
    #[pyo3(signature = (from_points, to_points, *, sources = None, point_size = "off", line_width = "off"))]
    fn occluded<'py>(
        &self,
        py: Python<'py>,
        from_points: PyArrayLike2<'py, f64, AllowTypeChange>,
        to_points: PyArrayLike2<'py, f64, AllowTypeChange>,
        sources: Option<(PyReadonlyArray1<'py, i32>, PyReadonlyArray1<'py, i32>)>,
        point_size: &str,
        line_width: &str,
    ) -> PyResult<Bound<'py, PyArray1<bool>>> {
        let (from, to) = (from_points.as_array(), to_points.as_array());
        check_pairs("from_points", from.shape(), "to_points", to.shape())?;
        let posed = self.posed(py, PoseUse::Trace)?;
        let sources: Option<Vec<HitId>> = sources.map(|(instances, triangles)| {
            let (instances, triangles) = (instances.as_array(), triangles.as_array());
            // −1 of a miss is no triangle.
            let id = |(&instance, &triangle): (&i32, &i32)| HitId {
                instance: instance as u32,
                triangle: triangle as u32,
            };
            instances.iter().zip(&triangles).map(id).collect()
        });
        if sources.as_ref().is_some_and(|sources| sources.len() != from.nrows()) {
            return Err(value_error("from_points must be the points of from_hits, one for each hit"));
        }
        let sizes = rays::sizes(posed.borrow_dependent(), point_size, line_width).map_err(value_error)?;
        let occluded = pool::run(py, || {
            rays::occluded(posed.borrow_dependent(), &from, &to, sources.as_deref(), sizes)
        })?;
        Ok(occluded.into_pyarray(py))
    }

    fn __repr__(&self) -> String {
        let (name, triangles) = (self.loaded.name.display(), self.triangle_count());
        format!("<blinn.Scene {name} with {triangles} triangles>")
    }
}

/// Checks that two arrays have the same shape (n, 3).
fn check_pairs(a: &str, a_shape: &[usize], b: &str, b_shape: &[usize]) -> PyResult<()> {
    let is_valid = a_shape[1] == 3 && a_shape == b_shape;
    let text = || format!("{a} and {b} must both have shape (n, 3), not {a_shape:?} and {b_shape:?}");
    if is_valid { Ok(()) } else { Err(value_error(text())) }
}
