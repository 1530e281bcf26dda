//! From a view as asked for to the lecture's camera: the file's, the flags', or the whole scene
//! framed.

use glam::DVec3;

use super::{
    Camera, ClipPlanes, FileProjection, Orbit, OrbitAngles, PosedScene, Projection, Scene, View, ViewError,
};
use crate::geometry::{Basis, Sphere};

/// Where the framed view looks from: right of the front, above.
pub const DEFAULT_VIEW_DIR: DVec3 = DVec3::new(-1.0, -0.7, -1.4);
/// The framed view's vertical field of view, 40°.
pub const DEFAULT_YFOV: f64 = 40.0 * std::f64::consts::PI / 180.0;
/// Room left around the bounding sphere.
const MARGIN: f64 = 1.1;

/// Distance from which a sphere of `radius` just fits a view that is `half_width` by `half_height`
/// at distance 1, with a margin.
pub fn frame_sphere(radius: f64, half_width: f64, half_height: f64) -> f64 {
    let tangent = half_width.min(half_height);
    // sin of the half angle: the sphere touches the narrower pair of the frustum's planes.
    MARGIN * radius * (1.0 + tangent * tangent).sqrt() / tangent
}

/// What resolving a view gives beside the camera.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ViewNotes {
    /// Where the view comes from, in words.
    pub description: String,
    /// Things that the user should know.
    pub warnings: Vec<String>,
}

impl View {
    /// The camera for a picture of `n_x` by `n_y` pixels of `posed`.
    ///
    /// A named camera, or the file's first where no view point comes together with a direction,
    /// is the start, and what is asked for replaces parts of it. Without any, a sphere around the scene
    /// is framed, about the point to look at if there is one; a view point alone looks at the scene's middle.
    ///
    /// # Errors
    /// An unknown camera, an up direction parallel to the view, or numbers that make no picture.
    pub fn resolve(&self, posed: &PosedScene, n_x: u32, n_y: u32) -> Result<(Camera, ViewNotes), ViewError> {
        let picture = f64::from(n_x) / f64::from(n_y);
        self.check()?;
        let start = self.start(posed, picture)?;
        let mut notes =
            ViewNotes { description: self.describe(posed.scene, start.of_file), ..ViewNotes::default() };
        let projection = self.projection.unwrap_or(start.projection);

        let basis = self.basis(&start, self.view_point)?;
        let distance = self.orbit.and_then(|o| o.distance);
        let view_point = self.view_point.or_else(|| distance.map(|far| start.middle() + basis.w * far));
        let d = self.proj_distance.unwrap_or(start.proj_distance);
        // A distance alone zooms, as in the lecture's two views; an angle holds at any distance.
        let height = match (self.view_height, self.yfov) {
            (Some(h), _) => Some(h),
            (None, Some(yfov)) => Some(2.0 * d * libm::tan(0.5 * yfov)),
            (None, None) => None,
        };
        let (view_width, view_height) = match (self.view_width, height) {
            (Some(w), Some(h)) => {
                if (w / h / picture - 1.0).abs() > 1e-3 {
                    notes.warnings.push(format!(
                        "pixels are not square: a view of {w} by {h} on {n_x} by {n_y} pixels"
                    ));
                }
                (w, h)
            }
            (Some(w), None) => (w, w / picture),
            (None, Some(h)) => (h * picture, h),
            (None, None) => {
                let h = start.view_height_by(projection);
                (h * picture, h)
            }
        };
        let clip = self.clip.unwrap_or(start.clip);
        let mut camera = Camera {
            view_point: view_point.or(start.view_point).unwrap_or_default(),
            basis,
            view_width,
            view_height,
            proj_distance: d,
            projection,
            clip,
        };
        if view_point.is_none() && start.view_point.is_none() {
            camera.stand_back(start.sphere());
        } else if distance.is_some() && projection == Projection::Orthographic {
            camera.widen(start.sphere().radius);
        }
        if self.orbit_by != OrbitAngles::default() {
            let pivot = self.look_at.unwrap_or_else(|| camera.in_view(start.middle()));
            camera.orbit(pivot, self.view_up.unwrap_or(DVec3::Y), self.orbit_by);
        }
        if let Some(zoom) = self.zoom {
            camera.view_width /= zoom;
            camera.view_height /= zoom;
        }
        Ok((camera, notes))
    }

    fn check(&self) -> Result<(), ViewError> {
        let positive = |what, value: Option<f64>| match value {
            Some(v) if !(v > 0.0 && v.is_finite()) => {
                Err(ViewError::OutOfRange { what, rule: "greater than zero", value: v })
            }
            _ => Ok(()),
        };
        positive("--proj-distance", self.proj_distance)?;
        positive("--view-width", self.view_width)?;
        positive("--view-height", self.view_height)?;
        positive("--zoom", self.zoom)?;
        positive("the distance of --orbit", self.orbit.and_then(|o| o.distance))?;
        if let Some(yfov) = self.yfov
            && !(yfov > 0.0 && yfov < std::f64::consts::PI)
        {
            let value = yfov.to_degrees();
            return Err(ViewError::OutOfRange { what: "--yfov", rule: "between 0 and 180 degrees", value });
        }
        Ok(())
    }

    /// Where the view comes from, in words: one of the file's cameras, or what there is without.
    fn describe(&self, scene: &Scene, of_file: Option<usize>) -> String {
        let start = match of_file {
            Some(i) => {
                let name = &scene.nodes[scene.cameras[i].node as usize].name;
                format!("the file's {i} '{name}'")
            }
            None if self.view_point.is_some() => "from where it was asked for".into(),
            None => "the whole scene, framed".into(),
        };
        if self.orbit.is_some() { format!("{start}, from --orbit") } else { start }
    }

    /// The camera before any part of it is replaced.
    fn start<'a>(&self, posed: &'a PosedScene, picture: f64) -> Result<BaseView<'a>, ViewError> {
        let scene = posed.scene;
        let index = match &self.camera {
            Some(name) => Some(scene.find_camera(name).ok_or_else(|| {
                let names: Vec<_> = scene
                    .cameras
                    .iter()
                    .enumerate()
                    .map(|(i, c)| format!("{i} '{}'", scene.nodes[c.node as usize].name))
                    .collect();
                let list = if names.is_empty() { "none".to_string() } else { names.join(", ") };
                ViewError::NoCamera(name.clone(), list)
            })?),
            None if self.replaces_file_camera() || scene.cameras.is_empty() => None,
            None => Some(0),
        };
        let orbit = self.orbit.is_some();
        let framed = orbit || (index.is_none() && self.view_point.is_none());
        let middle = self.look_at.filter(|_| framed);
        let Some(index) = index else {
            return Ok(BaseView {
                of_file: None,
                posed,
                // The view stands still while things move.
                clip_bounds_cache: true,
                middle,
                view_point: None,
                view_dir: DEFAULT_VIEW_DIR,
                view_up: DVec3::Y,
                placed: None,
                view_height: 2.0 * libm::tan(0.5 * DEFAULT_YFOV),
                proj_distance: 1.0,
                projection: Projection::Perspective,
                clip: ClipPlanes::OFF,
            });
        };
        let camera = &posed.cameras[index];
        let to_world = posed.node_to_world(camera.node);
        Ok(BaseView {
            of_file: Some(index),
            posed,
            clip_bounds_cache: orbit,
            middle,
            view_point: (!orbit).then_some(to_world.translation),
            view_dir: -to_world.matrix3.z_axis,
            view_up: to_world.matrix3.y_axis,
            placed: Basis::from_transform(to_world.matrix3).filter(|axes| !axes.is_orthonormal()),
            view_height: camera.view_height(self.fit, picture),
            proj_distance: 1.0,
            projection: match camera.projection {
                FileProjection::Perspective { .. } => Projection::Perspective,
                FileProjection::Orthographic { .. } => Projection::Orthographic,
            },
            // Planes are measured from the camera's own place.
            clip: if orbit { ClipPlanes::OFF } else { ClipPlanes { near: camera.znear, far: camera.zfar } },
        })
    }

    fn basis(&self, start: &BaseView, view_point: Option<DVec3>) -> Result<Basis, ViewError> {
        if let Some(orbit) = self.orbit {
            let own = orbit_basis(orbit);
            return match self.view_up {
                Some(up) => Basis::from_view(-own.w, up)
                    .ok_or_else(|| ViewError::ParallelUp { up: up.to_string(), dir: (-own.w).to_string() }),
                None => Ok(own),
            };
        }
        let from = view_point.or(start.view_point);
        let dir = match (self.view_dir, self.look_at, from) {
            (Some(dir), ..) => dir,
            (None, Some(at), Some(from)) => at - from,
            (None, None, Some(from)) if start.of_file.is_none() => start.to_middle(from),
            _ => start.view_dir,
        };
        let asked = self.view_dir.is_some() || self.look_at.is_some();
        if let (Some(camera), false, false) = (start.of_file, asked, dir.length() > 0.0) {
            let scene = start.posed.scene;
            let node = &scene.nodes[scene.cameras[camera].node as usize];
            return Err(ViewError::Flattened(node.name.clone()));
        }
        if !(dir.length() > 0.0 && dir.is_finite()) {
            return Err(ViewError::NoDirection(from.unwrap_or_else(|| start.middle()).to_string()));
        }
        let parallel = |up: DVec3| ViewError::ParallelUp { up: up.to_string(), dir: dir.to_string() };
        match self.view_up {
            Some(up) => Basis::from_view(dir, up).ok_or_else(|| parallel(up)),
            None => {
                // A file camera turned elsewhere keeps the world upright, not its own roll.
                let turned = self.view_dir.is_some() || self.look_at.is_some();
                if let Some(placed) = start.placed.filter(|_| !turned) {
                    return Ok(placed);
                }
                let up = if turned { DVec3::Y } else { start.view_up };
                Basis::from_view_with_fallback_up(dir, up).ok_or_else(|| parallel(up))
            }
        }
    }
}

/// What the asked-for parts replace.
struct BaseView<'a> {
    /// Which of the file's cameras it is, if any.
    of_file: Option<usize>,
    posed: &'a PosedScene<'a>,
    /// True: the sphere holds the whole clip, else this moment.
    clip_bounds_cache: bool,
    /// Where the sphere's middle is put: what goes around the point to look at, or stands back from it, does so
    /// from there.
    middle: Option<DVec3>,
    /// `None`: stand back until the sphere fits.
    view_point: Option<DVec3>,
    view_dir: DVec3,
    view_up: DVec3,
    /// The axes of a file's camera where what it is below mirrors or shears them.
    placed: Option<Basis>,
    view_height: f64,
    proj_distance: f64,
    projection: Projection,
    clip: ClipPlanes,
}

impl BaseView<'_> {
    /// What is framed and gone around. Every vertex is looked at for it, at many moments of a clip: only
    /// what cannot do without asks for it.
    fn sphere(&self) -> Sphere {
        let sphere =
            if self.clip_bounds_cache { self.posed.clip_sphere() } else { self.posed.bounding_sphere() };
        match self.middle {
            // Far enough to hold all of the scene's own, and so all of the scene however it is turned.
            Some(centre) => Sphere { centre, radius: sphere.radius + centre.distance(sphere.centre) },
            None => sphere,
        }
    }

    fn middle(&self) -> DVec3 {
        self.middle.unwrap_or_else(|| self.sphere().centre)
    }

    /// The way from a point to the middle of what there is; where it is there already, the usual one.
    fn to_middle(&self, from: DVec3) -> DVec3 {
        let dir = self.middle() - from;
        dir.try_normalize().map_or(self.view_dir, |_| dir)
    }

    /// The height of the same view in `projection`: what stands at the scene's centre keeps its size.
    fn view_height_by(&self, projection: Projection) -> f64 {
        if projection == self.projection {
            return self.view_height;
        }
        let distance = match self.view_point {
            Some(e) => (self.middle() - e).dot(self.view_dir.normalize_or_zero()),
            None => 0.0,
        };
        match (projection, distance > 0.0) {
            (Projection::Orthographic, true) => self.view_height * distance,
            (Projection::Orthographic, false) => 2.0 * MARGIN * self.sphere().radius,
            (Projection::Perspective, true) => self.view_height / distance,
            (Projection::Perspective, false) => 2.0 * libm::tan(0.5 * DEFAULT_YFOV),
        }
    }
}

impl Camera {
    /// Moves back along w until the sphere is in view.
    fn stand_back(&mut self, sphere: Sphere) {
        let distance = match self.projection {
            Projection::Perspective => {
                let half = 0.5 / self.proj_distance;
                frame_sphere(sphere.radius, half * self.view_width, half * self.view_height)
            }
            Projection::Orthographic => {
                self.widen(sphere.radius);
                2.0 * sphere.radius
            }
        };
        self.view_point = sphere.centre + self.basis.w * distance;
    }

    /// Widens the view rectangle until a sphere of `radius` fits.
    fn widen(&mut self, radius: f64) {
        let smaller = self.view_width.min(self.view_height);
        let wanted = 2.0 * MARGIN * radius;
        if smaller < wanted {
            self.view_width *= wanted / smaller;
            self.view_height *= wanted / smaller;
        }
    }

    /// What lies in the view's middle as far away as `middle`; `middle` itself where that is behind.
    fn in_view(&self, middle: DVec3) -> DVec3 {
        let ahead = -self.basis.w;
        let depth = (middle - self.view_point).dot(ahead);
        if depth > 0.0 { self.view_point + ahead * depth } else { middle }
    }

    /// Goes around `pivot` by angles to the right about `up`, and then upwards.
    fn orbit(&mut self, pivot: DVec3, up: DVec3, by: OrbitAngles) {
        let mut turned = [self.view_point - pivot, self.basis.u, self.basis.v, self.basis.w];
        let about = |axis: DVec3, angle: f64, all: &mut [DVec3; 4]| {
            let Some(axis) = axis.try_normalize() else { return };
            let (sin, cos) = (libm::sin(angle), libm::cos(angle));
            // Rodrigues's formula.
            *all = all.map(|v| v * cos + axis.cross(v) * sin + axis * axis.dot(v) * (1.0 - cos));
        };
        about(up, by.azimuth, &mut turned);
        about(-turned[1], by.elevation, &mut turned);
        let [from, u, v, w] = turned;
        self.view_point = pivot + from;
        self.basis = Basis { u, v, w };
    }
}

/// The basis of a camera at that place: also straight above and below, where no up direction
/// would say which way is up in the picture.
fn orbit_basis(orbit: Orbit) -> Basis {
    let (sin_a, cos_a) = (libm::sin(orbit.azimuth), libm::cos(orbit.azimuth));
    let (sin_e, cos_e) = (libm::sin(orbit.elevation), libm::cos(orbit.elevation));
    Basis {
        u: DVec3::new(cos_a, 0.0, -sin_a),
        v: DVec3::new(-sin_e * sin_a, cos_e, -sin_e * cos_a),
        w: DVec3::new(cos_e * sin_a, sin_e, cos_e * cos_a),
    }
}
