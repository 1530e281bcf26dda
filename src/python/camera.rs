//! Cameras with any position, orientation and view rectangle.

use glam::{DVec2, DVec3};
use numpy::{AllowTypeChange, PyArray1, PyArray2, PyArrayLike2, PyArrayMethods};
use pyo3::prelude::*;

use super::errors::value_error;
use super::size::{optional_size, picture_size};
use blinn_core::geometry::Basis;
use blinn_scene::{Camera, CameraAxes, ClipPlanes, Intrinsics, Projection, SimilarityTransform, ViewRect};

/// Anything that NumPy converts to a matrix of numbers.
type Matrix<'py> = PyArrayLike2<'py, f64, AllowTypeChange>;

/// The view rectangle at distance 1 for perspective, in metres for orthographic cameras.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Extent {
    /// Centred, of this height. The width follows the size of the picture.
    Height(f64),
    /// Possibly off-centre.
    Bounds(ViewRect),
}

/// A camera: position, orientation, projection and view rectangle.
#[pyclass(name = "Camera", module = "blinn", frozen, from_py_object)]
#[derive(Clone, Debug, PartialEq)]
pub struct PyCamera {
    view_point: DVec3,
    basis: Basis,
    projection: Projection,
    rect: Extent,
    clip: ClipPlanes,
    size: Option<(u32, u32)>,
}

/// A pickled camera.
type CameraState = (CameraNumbers, Option<(u32, u32)>);

/// The numbers of a pickled camera.
#[derive(FromPyObject, IntoPyObject)]
struct CameraNumbers {
    /// View point, u, v and w.
    #[pyo3(item)]
    axes: [[f64; 3]; 4],
    #[pyo3(item)]
    is_orthographic: bool,
    /// Height, or left, right, bottom and top.
    #[pyo3(item)]
    rect: Vec<f64>,
    /// Near and far.
    #[pyo3(item)]
    clip: (f64, f64),
}

impl PyCamera {
    /// The camera for a picture of `width` by `height` pixels.
    pub fn resolve(&self, (width, height): (u32, u32)) -> Camera {
        let aspect = f64::from(width) / f64::from(height);
        let rect = match self.rect {
            Extent::Height(h) => {
                let (right, top) = (0.5 * h * aspect, 0.5 * h);
                ViewRect { left: -right, right, bottom: -top, top }
            }
            Extent::Bounds(rect) => rect,
        };
        let camera = rect.camera(self.view_point, self.basis);
        Camera { projection: self.projection, clip: self.clip, ..camera }
    }

    /// The size of the pictures that the camera was made for.
    pub fn picture_size(&self) -> Option<(u32, u32)> {
        self.size
    }

    /// A camera of a scene's file, as it is in the scene's current pose.
    pub fn from_camera(camera: &Camera, size: (u32, u32)) -> PyCamera {
        let (half, d) = (0.5 * DVec2::new(camera.view_width, camera.view_height), camera.proj_distance);
        let scale = if camera.projection == Projection::Perspective { 1.0 / d } else { 1.0 };
        let (low, high) = ((camera.view_centre - half) * scale, (camera.view_centre + half) * scale);
        PyCamera {
            view_point: camera.view_point,
            basis: camera.basis,
            projection: camera.projection,
            rect: Extent::Bounds(ViewRect { left: low.x, right: high.x, bottom: low.y, top: high.y }),
            clip: camera.clip,
            size: Some(size),
        }
    }
}

#[pymethods]
impl PyCamera {
    /// A camera at `eye` that looks at `target`, with a vertical field of view in degrees.
    ///
    /// `yfov` and `height` exclude each other; `height`, in metres, makes the camera orthographic.
    #[staticmethod]
    #[pyo3(signature = (eye, target, *, up = [0.0, 1.0, 0.0], yfov = None, height = None, near = 0.0, far = f64::INFINITY),
        text_signature = "(eye, target, *, up=(0.0, 1.0, 0.0), yfov=None, height=None, near=0.0, far=1e999)")]
    fn look_at(
        eye: [f64; 3],
        target: [f64; 3],
        up: [f64; 3],
        yfov: Option<f64>,
        height: Option<f64>,
        near: f64,
        far: f64,
    ) -> PyResult<PyCamera> {
        let (eye, target, up) = (finite("eye", eye)?, finite("target", target)?, finite("up", up)?);
        let direction = target - eye;
        if direction.length() == 0.0 {
            return Err(value_error("eye and target are the same point"));
        }
        let basis = Basis::from_view(direction, up)
            .ok_or_else(|| value_error("up is parallel to the view direction; set another up"))?;
        let (projection, rect) = extent(yfov, height)?;
        Ok(PyCamera { view_point: eye, basis, projection, rect, clip: clip(near, far)?, size: None })
    }

    /// A camera from its 4×4 camera-to-world matrix, a rotation and a translation. A uniform scale has no effect.
    ///
    /// `convention` says which way the camera looks: "opengl" (glTF, Blender, NeRF) along −Z with +Y up; "opencv"
    /// (COLMAP, BOP) along +Z with +Y down.
    #[staticmethod]
    #[pyo3(signature = (camera_to_world, *, convention = "opengl", yfov = None, height = None, near = 0.0, far = f64::INFINITY),
        text_signature = "(camera_to_world, *, convention='opengl', yfov=None, height=None, near=0.0, far=1e999)")]
    fn from_matrix(
        camera_to_world: Matrix<'_>,
        convention: &str,
        yfov: Option<f64>,
        height: Option<f64>,
        near: f64,
        far: f64,
    ) -> PyResult<PyCamera> {
        let (view_point, basis) = pose(&camera_to_world, convention)?;
        let (projection, rect) = extent(yfov, height)?;
        Ok(PyCamera { view_point, basis, projection, rect, clip: clip(near, far)?, size: None })
    }

    /// A perspective camera from its 3×3 intrinsic matrix in pixels, for pictures of `size` = (width, height).
    ///
    /// Pixel centres are at half-integers: the centre of the top left pixel is (0.5, 0.5). The principal point may be
    /// off-centre. `camera_to_world` defaults to the identity.
    #[staticmethod]
    #[pyo3(signature = (K, size, camera_to_world = None, *, convention = "opencv", near = 0.0, far = f64::INFINITY),
        text_signature = "(K, size, camera_to_world=None, *, convention='opencv', near=0.0, far=1e999)")]
    #[allow(non_snake_case)]
    fn from_intrinsics(
        K: Matrix<'_>,
        size: &Bound<'_, PyAny>,
        camera_to_world: Option<Matrix<'_>>,
        convention: &str,
        near: f64,
        far: f64,
    ) -> PyResult<PyCamera> {
        let size = picture_size(size)?;
        let k = K.as_array();
        if k.shape() != [3, 3] {
            return Err(value_error(format!("K must be 3×3, not {:?}", k.shape())));
        }
        let numbers = std::array::from_fn(|i| k[[i / 3, i % 3]]);
        let intrinsics =
            Intrinsics::from_matrix(numbers).map_err(|defect| value_error(format!("K {defect}")))?;
        if !intrinsics.is_valid() || size.0 == 0 || size.1 == 0 {
            return Err(value_error("focal lengths and size must be positive and finite"));
        }
        let (view_point, basis) = match &camera_to_world {
            Some(matrix) => pose(matrix, convention)?,
            None => axes(&SimilarityTransform::IDENTITY, convention)?,
        };
        let rect = Extent::Bounds(intrinsics.view_rect(size));
        let projection = Projection::Perspective;
        Ok(PyCamera { view_point, basis, projection, rect, clip: clip(near, far)?, size: Some(size) })
    }

    /// The position, shape (3,), in metres.
    #[getter]
    fn position<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_slice(py, &self.view_point.to_array())
    }

    /// The camera-to-world matrix, shape (4, 4), in the OpenGL convention.
    #[getter]
    fn camera_to_world<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let Basis { u, v, w } = self.basis;
        let e = self.view_point;
        let rows = [[u.x, v.x, w.x, e.x], [u.y, v.y, w.y, e.y], [u.z, v.z, w.z, e.z], [0.0, 0.0, 0.0, 1.0]];
        PyArray1::from_slice(py, rows.as_flattened()).reshape([4, 4])
    }

    /// The size (width, height) of the pictures that the camera was made for, or None.
    #[getter]
    fn size(&self) -> Option<(u32, u32)> {
        self.size
    }

    /// True for an orthographic camera.
    #[getter]
    fn orthographic(&self) -> bool {
        self.projection == Projection::Orthographic
    }

    /// The intrinsic matrix in pixels, shape (3, 3), for pictures of `size`; the camera's own size by default.
    #[pyo3(signature = (size = None))]
    fn intrinsics<'py>(
        &self,
        py: Python<'py>,
        size: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let size = optional_size(size)?;
        if self.projection == Projection::Orthographic {
            return Err(value_error("an orthographic camera has no focal length"));
        }
        let size = size.or(self.size).ok_or_else(|| value_error("the camera has no size; pass size"))?;
        if size.0 == 0 || size.1 == 0 {
            return Err(value_error("the size must be positive"));
        }
        let Intrinsics { fx, fy, cx, cy } = Intrinsics::of(&self.resolve(size), size);
        PyArray1::from_slice(py, &[fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0]).reshape([3, 3])
    }

    fn __repr__(&self) -> String {
        let kind = if self.orthographic() { "orthographic" } else { "perspective" };
        let (e, w) = (self.view_point, -self.basis.w);
        format!(
            "<blinn.Camera {kind} at ({:.4}, {:.4}, {:.4}) towards ({:.4}, {:.4}, {:.4})>",
            e.x, e.y, e.z, w.x, w.y, w.z
        )
    }

    fn __eq__(&self, other: &PyCamera) -> bool {
        self == other
    }

    /// Restore a camera that was pickled.
    #[staticmethod]
    fn _restore(numbers: CameraNumbers, size: Option<(u32, u32)>) -> PyCamera {
        let CameraNumbers { axes, is_orthographic, rect, clip: (near, far) } = numbers;
        let [view_point, u, v, w] = axes.map(DVec3::from_array);
        PyCamera {
            view_point,
            basis: Basis { u, v, w },
            projection: if is_orthographic { Projection::Orthographic } else { Projection::Perspective },
            rect: match rect[..] {
                [left, right, bottom, top] => Extent::Bounds(ViewRect { left, right, bottom, top }),
                _ => Extent::Height(rect.first().copied().unwrap_or(1.0)),
            },
            clip: ClipPlanes { near, far },
            size,
        }
    }

    /// Pickle the camera.
    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<(Bound<'py, PyAny>, CameraState)> {
        let restore = py.get_type::<PyCamera>().getattr("_restore")?;
        let Basis { u, v, w } = self.basis;
        let numbers = CameraNumbers {
            axes: [self.view_point, u, v, w].map(|v| v.to_array()),
            is_orthographic: self.orthographic(),
            rect: match self.rect {
                Extent::Height(height) => vec![height],
                Extent::Bounds(rect) => vec![rect.left, rect.right, rect.bottom, rect.top],
            },
            clip: (self.clip.near, self.clip.far),
        };
        Ok((restore, (numbers, self.size)))
    }
}

fn finite(name: &str, v: [f64; 3]) -> PyResult<DVec3> {
    let v = DVec3::from_array(v);
    if v.is_finite() { Ok(v) } else { Err(value_error(format!("{name} must be finite"))) }
}

/// Projection and view rectangle for a field of view in degrees, or a height in metres.
fn extent(yfov: Option<f64>, height: Option<f64>) -> PyResult<(Projection, Extent)> {
    match (yfov, height) {
        (Some(_), Some(_)) => Err(value_error("yfov is for perspective, height for orthographic cameras")),
        (None, Some(height)) if height > 0.0 && height.is_finite() => {
            Ok((Projection::Orthographic, Extent::Height(height)))
        }
        (None, Some(_)) => Err(value_error("height must be positive and finite")),
        (yfov, None) => {
            let yfov = yfov.unwrap_or(blinn_scene::DEFAULT_YFOV.to_degrees());
            if !(yfov > 0.0 && yfov < 180.0) {
                return Err(value_error("yfov must be between 0 and 180 degrees"));
            }
            let height = 2.0 * libm::tan(0.5 * yfov.to_radians());
            Ok((Projection::Perspective, Extent::Height(height)))
        }
    }
}

fn clip(near: f64, far: f64) -> PyResult<ClipPlanes> {
    if near >= 0.0 && far > near {
        Ok(ClipPlanes { near, far })
    } else {
        Err(value_error("near must be at least 0, and far greater than near"))
    }
}

fn pose(matrix: &Matrix<'_>, convention: &str) -> PyResult<(DVec3, Basis)> {
    let m = matrix.as_array();
    if m.shape() != [4, 4] && m.shape() != [3, 4] {
        return Err(value_error(format!("camera_to_world must be 4×4, not {:?}", m.shape())));
    }
    let rows: Vec<f64> = m.iter().copied().collect();
    let to_world = SimilarityTransform::from_rows(&rows);
    axes(&to_world.map_err(|defect| value_error(format!("camera_to_world {defect}")))?, convention)
}

/// Position and basis of a camera-to-world transform.
fn axes(to_world: &SimilarityTransform, convention: &str) -> PyResult<(DVec3, Basis)> {
    let axes = match convention {
        "opengl" => CameraAxes::OpenGl,
        "opencv" => CameraAxes::OpenCv,
        _ => {
            return Err(value_error(format!(
                "convention must be \"opengl\" or \"opencv\", not {convention:?}"
            )));
        }
    };
    Ok(to_world.camera_pose(axes))
}
