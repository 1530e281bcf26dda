//! Resolves a view to the lecture's camera: the file's camera or the framed scene, modified by the view.

use glam::{DVec2, DVec3};

use super::base_view::BaseView;
use super::{
    Camera, FileCamera, Focus, OrbitAngles, PosedScene, Projection, Scene, ThinLens, View, ViewError,
    ViewRect,
};
use blinn_core::geometry::Basis;
use blinn_core::worded;

/// Information beside the camera of a resolved view.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ViewNotes {
    /// Where the view comes from, for the log.
    pub description: String,
    /// Warnings for the user.
    pub warnings: Vec<String>,
    /// Choices that users may want to make themselves.
    pub hints: Vec<String>,
}

/// The extent of the view rectangle, and its centre along u and v.
struct ViewExtent {
    width: f64,
    height: f64,
    centre: DVec2,
}

impl From<ViewRect> for ViewExtent {
    fn from(rect: ViewRect) -> ViewExtent {
        ViewExtent { width: rect.width(), height: rect.height(), centre: rect.centre() }
    }
}

/// Camera names in a hint.
const MAX_NAMES: usize = 4;

/// Returns a hint that the first of several cameras was used, unless the file marks one. Their order may differ between two exports of a scene:
/// Blender sorts nodes by name from version 5.2 on.
fn choice_of_camera(scene: &Scene) -> Option<String> {
    let count = scene.cameras.len();
    if count < 2 || scene.settings.camera.is_some() {
        return None;
    }
    let name =
        |(i, camera): (usize, &FileCamera)| format!("{i} '{}'", scene.nodes[camera.node as usize].name);
    let mut names: Vec<String> = scene.cameras.iter().enumerate().take(MAX_NAMES).map(name).collect();
    if count > MAX_NAMES {
        names.push("…".into());
    }
    Some(worded!(
        "the file has {} cameras: {}; used the first; select one with `camera`",
        count,
        names.join(", ")
    ))
}

impl View {
    /// Returns the camera for a picture of `n_x` by `n_y` pixels of `posed`.
    ///
    /// A complete camera is returned as it is. Otherwise the view modifies the named camera of the file, or else the
    /// file's first, unless it has both a view point and a direction. Without a camera, it frames a sphere around
    /// the scene, centred at the point to look at if there is one. A view point alone looks at the centre of the
    /// scene.
    ///
    /// # Errors
    /// An unknown camera, an up direction parallel to the view, or values out of range.
    pub fn resolve(&self, posed: &PosedScene, n_x: u32, n_y: u32) -> Result<(Camera, ViewNotes), ViewError> {
        if let Some(mut camera) = self.complete {
            camera.lens = self.lens(&camera, camera.lens, || posed.bounding_sphere().centre)?;
            let description = "a complete camera".to_string();
            let warnings = self.options_without_lens(&camera).into_iter().collect();
            return Ok((camera, ViewNotes { description, warnings, ..ViewNotes::default() }));
        }
        let picture = f64::from(n_x) / f64::from(n_y) * self.pixel_aspect(posed.scene);
        self.check_ranges()?;
        let base = self.base(posed, picture)?;
        let mut notes =
            ViewNotes { description: self.describe(posed.scene, base.camera), ..ViewNotes::default() };
        if self.camera.is_none() && base.camera.is_some() {
            notes.hints.extend(choice_of_camera(posed.scene));
        }
        let projection = self.projection.unwrap_or(base.projection);
        let basis = self.basis(&base, self.view_point)?;
        let orbit_distance = self.orbit.and_then(|o| o.distance);
        let view_point =
            self.view_point.or_else(|| orbit_distance.map(|distance| base.centre() + basis.w * distance));
        let proj_distance = self.proj_distance.unwrap_or(base.proj_distance);
        let size = match self.intrinsics {
            Some(_) if projection == Projection::Orthographic => {
                let camera = self.describe(posed.scene, base.camera);
                return Err(ViewError::OrthographicIntrinsics(camera));
            }
            Some(intrinsics) => intrinsics.view_rect((n_x, n_y)).scaled(proj_distance).into(),
            None => self.view_extent(&base, picture, projection, proj_distance),
        };
        // Intrinsics are exact about the shape of pixels.
        if self.intrinsics.is_none() && (size.width / size.height / picture - 1.0).abs() > 1e-3 {
            notes.warnings.push(format!(
                "pixels are not square: the view is {} by {}, the picture {n_x} by {n_y} pixels",
                size.width, size.height
            ));
        }
        let mut camera = Camera {
            view_point: view_point.or(base.view_point).unwrap_or_default(),
            basis,
            view_width: size.width,
            view_height: size.height,
            view_centre: size.centre,
            proj_distance,
            projection,
            clip: self.clip.unwrap_or(base.clip),
            lens: None,
        };
        if view_point.is_none() && base.view_point.is_none() {
            camera.frame_sphere(base.sphere());
        } else if orbit_distance.is_some() && projection == Projection::Orthographic {
            camera.widen(base.sphere().radius);
        }
        self.orbit_and_zoom(&mut camera, &base);
        camera.lens = self.lens(&camera, base.lens, || base.centre())?;
        notes.warnings.extend(self.options_without_lens(&camera));
        Ok((camera, notes))
    }

    /// Returns a warning of options of a lens that a finished camera does not have.
    fn options_without_lens(&self, camera: &Camera) -> Option<String> {
        if camera.lens.is_some() {
            return None;
        }
        let options = match (self.focus, self.aperture_blades) {
            (Some(_), Some(_)) => worded!("`focus` and `aperture-blades` have"),
            (Some(_), None) => worded!("`focus` has"),
            (None, Some(_)) => worded!("`aperture-blades` has"),
            (None, None) => return None,
        };
        Some(worded!(
            "{} no effect, as everything is sharp; add `aperture-radius` for a depth of field",
            options
        ))
    }

    /// Returns the lens of a finished camera: `own` with what the view replaces. Without a focus, the point to look at is sharp,
    /// else `centre`.
    fn lens(
        &self,
        camera: &Camera,
        own: Option<ThinLens>,
        centre: impl FnOnce() -> DVec3,
    ) -> Result<Option<ThinLens>, ViewError> {
        let Some(aperture_radius) =
            self.aperture_radius.or(own.map(|lens| lens.aperture_radius)).filter(|radius| *radius > 0.0)
        else {
            return Ok(None);
        };
        let depth = |p: DVec3| -camera.to_camera(p).z;
        let focus_distance = match (self.focus, own) {
            (Some(Focus::Distance(distance)), _) => distance,
            (Some(Focus::Point(p)), _) => depth(p),
            (None, Some(own)) => own.focus_distance,
            (None, None) => depth(self.look_at.unwrap_or_else(centre)),
        };
        if !(focus_distance > 0.0 && focus_distance.is_finite()) {
            return Err(ViewError::NothingInFocus(focus_distance));
        }
        let own = own.unwrap_or(ThinLens::round(aperture_radius, focus_distance));
        let blades = self.aperture_blades.unwrap_or(own.blades);
        Ok(Some(ThinLens { aperture_radius, focus_distance, blades, ..own }))
    }

    /// Returns width over height of a pixel: that of the file, where its camera is used.
    fn pixel_aspect(&self, scene: &Scene) -> f64 {
        let aspect = scene.settings.pixel_aspect.filter(|_| self.uses_file_camera(scene));
        aspect.unwrap_or(1.0)
    }

    fn check_ranges(&self) -> Result<(), ViewError> {
        let positive = |what, value: Option<f64>| match value {
            Some(v) if !(v > 0.0 && v.is_finite()) => {
                Err(ViewError::OutOfRange { what, rule: "greater than zero", value: v })
            }
            _ => Ok(()),
        };
        positive("`proj-distance`", self.proj_distance)?;
        positive("`view-width`", self.view_width)?;
        positive("`view-height`", self.view_height)?;
        positive("`zoom`", self.zoom)?;
        if let Some(value) = self.aperture_radius.filter(|radius| !(*radius >= 0.0 && radius.is_finite())) {
            return Err(ViewError::OutOfRange { what: "`aperture-radius`", rule: "0 or more", value });
        }
        if let Some(k) = self.intrinsics {
            positive("the FX of `intrinsics`", Some(k.fx))?;
            positive("the FY of `intrinsics`", Some(k.fy))?;
        }
        if let Some(rect) = self.view_rect.filter(|rect| !rect.is_valid()) {
            return Err(ViewError::EmptyViewRect(rect));
        }
        positive("the distance of `orbit`", self.orbit.and_then(|o| o.distance))?;
        if let Some(yfov) = self.yfov
            && !(yfov > 0.0 && yfov < std::f64::consts::PI)
        {
            let value = yfov.to_degrees();
            return Err(ViewError::OutOfRange { what: "`yfov`", rule: "between 0 and 180 degrees", value });
        }
        Ok(())
    }

    /// Describes where the view comes from, for the log.
    fn describe(&self, scene: &Scene, camera: Option<usize>) -> String {
        let base = match camera {
            Some(i) => {
                let name = &scene.nodes[scene.cameras[i].node as usize].name;
                format!("the file's camera {i} '{name}'")
            }
            None if self.view_point.is_some() => "from the given view point".into(),
            None => "the whole scene, framed".into(),
        };
        if self.orbit.is_some() { worded!("{}, from `orbit`", base) } else { base }
    }

    /// Returns the view rectangle without intrinsics. A given width or height alone keeps pixels square.
    ///
    /// A projection distance alone zooms, as in the lecture; an angle holds at any distance.
    fn view_extent(&self, base: &BaseView, picture: f64, projection: Projection, d: f64) -> ViewExtent {
        if let Some(rect) = self.view_rect {
            return rect.into();
        }
        let height = self.view_height.or(self.yfov.map(|yfov| 2.0 * d * libm::tan(0.5 * yfov)));
        let (width, height) = match (self.view_width, height) {
            (Some(width), Some(height)) => (width, height),
            (Some(width), None) => (width, width / picture),
            (None, height) => {
                let height = height.unwrap_or_else(|| base.view_height_for(projection));
                (height * picture, height)
            }
        };
        ViewExtent { width, height, centre: self.shift.unwrap_or(base.shift) * width.max(height) }
    }

    /// Returns the basis of the camera.
    fn basis(&self, base: &BaseView, view_point: Option<DVec3>) -> Result<Basis, ViewError> {
        let parallel =
            |up: DVec3, dir: DVec3| ViewError::ParallelUp { up: up.to_string(), dir: dir.to_string() };
        if let Some(orbit) = self.orbit {
            let own = orbit.basis();
            return match self.view_up {
                Some(up) => Basis::from_view(-own.w, up).ok_or_else(|| parallel(up, -own.w)),
                None => Ok(own),
            };
        }
        let directed = self.view_dir.is_some() || self.look_at.is_some();
        let dir = self.direction(base, view_point, directed)?;
        if let Some(up) = self.view_up {
            return Basis::from_view(dir, up).ok_or_else(|| parallel(up, dir));
        }
        if let Some(basis) = base.sheared_basis.filter(|_| !directed) {
            return Ok(basis);
        }
        // A file's camera with a new direction keeps the world upright rather than its own roll.
        let up = if directed { DVec3::Y } else { base.view_up };
        Basis::from_view_with_fallback_up(dir, up).ok_or_else(|| parallel(up, dir))
    }

    /// Returns the view direction, of any length above 0. `directed` says that the view gives one.
    fn direction(
        &self,
        base: &BaseView,
        view_point: Option<DVec3>,
        directed: bool,
    ) -> Result<DVec3, ViewError> {
        let from = view_point.or(base.view_point);
        let dir = match (self.view_dir, self.look_at, from) {
            (Some(dir), ..) => dir,
            (None, Some(at), Some(from)) => at - from,
            (None, None, Some(from)) if base.camera.is_none() => base.dir_to_centre(from),
            _ => base.view_dir,
        };
        if let (Some(camera), false, false) = (base.camera, directed, dir.length() > 0.0) {
            let scene = base.posed.scene;
            let node = &scene.nodes[scene.cameras[camera].node as usize];
            return Err(ViewError::DegenerateFileCamera(node.name.clone()));
        }
        if !(dir.length() > 0.0 && dir.is_finite()) {
            return Err(ViewError::NoDirection(from.unwrap_or_else(|| base.centre()).to_string()));
        }
        Ok(dir)
    }

    /// Moves the finished camera around what it looks at, and magnifies.
    fn orbit_and_zoom(&self, camera: &mut Camera, base: &BaseView) {
        if self.orbit_by != OrbitAngles::default() {
            let pivot = self.look_at.unwrap_or_else(|| camera.axis_point(base.centre()));
            camera.orbit(pivot, self.view_up.unwrap_or(DVec3::Y), self.orbit_by);
        }
        if let Some(zoom) = self.zoom {
            camera.view_width /= zoom;
            camera.view_height /= zoom;
        }
    }
}
