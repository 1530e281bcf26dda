//! The camera that a view starts from: a camera of the file, or the default view that frames the scene.

use blinn_core::closest_name::did_you_mean;
use blinn_core::worded;
use glam::{DVec2, DVec3};

use super::framing::MARGIN;
use super::{
    ClipPlanes, DEFAULT_VIEW_DIR, DEFAULT_YFOV, FileProjection, PosedScene, Projection, ThinLens, View,
    ViewError,
};
use blinn_core::geometry::{Basis, Sphere};

/// The camera that the fields of a [`View`] modify.
pub(super) struct BaseView<'a> {
    /// Index of the file's camera, if it is one.
    pub camera: Option<usize>,
    pub posed: &'a PosedScene<'a>,
    /// True if the framed sphere bounds the whole animation clip, not only this time.
    over_clip: bool,
    /// Centre of the framed sphere, where it is not that of the scene.
    centre: Option<DVec3>,
    /// `None` frames the sphere.
    pub view_point: Option<DVec3>,
    pub view_dir: DVec3,
    pub view_up: DVec3,
    /// Axes of the file's camera, if its node transform mirrors or shears them.
    pub sheared_basis: Option<Basis>,
    view_height: f64,
    /// Shift of the view rectangle, in units of its larger side.
    pub shift: DVec2,
    pub proj_distance: f64,
    pub projection: Projection,
    pub clip: ClipPlanes,
    /// The lens of the file's camera.
    pub lens: Option<ThinLens>,
}

impl View {
    /// Returns the camera that this view modifies, for a picture of aspect ratio `picture`.
    pub(super) fn base<'a>(&self, posed: &'a PosedScene, picture: f64) -> Result<BaseView<'a>, ViewError> {
        let index = self.base_camera(posed)?;
        let orbit = self.orbit.is_some();
        let framed = orbit || (index.is_none() && self.view_point.is_none());
        let centre = self.look_at.filter(|_| framed);
        let Some(index) = index else {
            return Ok(BaseView {
                camera: None,
                posed,
                // The view stays the same while the scene moves.
                over_clip: true,
                centre,
                view_point: None,
                view_dir: DEFAULT_VIEW_DIR,
                view_up: DVec3::Y,
                sheared_basis: None,
                view_height: 2.0 * libm::tan(0.5 * DEFAULT_YFOV),
                shift: DVec2::ZERO,
                proj_distance: 1.0,
                projection: Projection::Perspective,
                clip: ClipPlanes::OFF,
                lens: None,
            });
        };
        let camera = &posed.cameras[index];
        let to_world = posed.node_to_world(camera.node);
        // The file's clipping planes belong to the position of its camera.
        let clip = if orbit { ClipPlanes::OFF } else { ClipPlanes { near: camera.znear, far: camera.zfar } };
        Ok(BaseView {
            camera: Some(index),
            posed,
            over_clip: orbit,
            centre,
            view_point: (!orbit).then_some(to_world.translation),
            view_dir: -to_world.matrix3.z_axis,
            view_up: to_world.matrix3.y_axis,
            sheared_basis: Basis::from_transform(to_world.matrix3).filter(|axes| !axes.is_orthonormal()),
            view_height: camera.view_height(self.fit, picture),
            // An orbit keeps its centre in the middle of the picture.
            shift: if orbit { DVec2::ZERO } else { camera.shift },
            proj_distance: 1.0,
            projection: match camera.projection {
                FileProjection::Perspective { .. } => Projection::Perspective,
                FileProjection::Orthographic { .. } => Projection::Orthographic,
            },
            clip,
            // Its focus belongs to the position of the camera, too.
            lens: camera.lens.filter(|_| !orbit),
        })
    }

    /// Returns the index of the file's camera that the view starts from: the named one, else the first,
    /// unless the view replaces it.
    fn base_camera(&self, posed: &PosedScene) -> Result<Option<usize>, ViewError> {
        let scene = posed.scene;
        let Some(name) = &self.camera else {
            return Ok(scene.default_camera().filter(|_| self.uses_file_camera(scene)));
        };
        if let Some(index) = scene.find_camera(name) {
            return Ok(Some(index));
        }
        let node_name = |node: u32| &scene.nodes[node as usize].name;
        let names: Vec<_> =
            scene.cameras.iter().enumerate().map(|(i, c)| format!("{i} '{}'", node_name(c.node))).collect();
        let list = if names.is_empty() {
            worded!("none; `orbit` shows the scene from any side")
        } else {
            names.join(", ")
        };
        let hint = did_you_mean(name, scene.cameras.iter().map(|camera| node_name(camera.node)));
        Err(ViewError::NoCamera(name.clone(), list + &hint))
    }
}

impl BaseView<'_> {
    /// Returns the sphere to frame and to orbit around. Call it only where needed: it visits the vertices,
    /// for a clip at many times.
    pub fn sphere(&self) -> Sphere {
        let sphere = if self.over_clip { self.posed.clip_sphere() } else { self.posed.bounding_sphere() };
        match self.centre {
            // Large enough for the scene's own sphere, however the camera turns.
            Some(centre) => Sphere { centre, radius: sphere.radius + centre.distance(sphere.centre) },
            None => sphere,
        }
    }

    /// Returns the centre of [`BaseView::sphere`].
    pub fn centre(&self) -> DVec3 {
        self.centre.unwrap_or_else(|| self.sphere().centre)
    }

    /// Returns the direction from a point to the centre; the default direction from the centre itself.
    pub fn dir_to_centre(&self, from: DVec3) -> DVec3 {
        let dir = self.centre() - from;
        dir.try_normalize().map_or(self.view_dir, |_| dir)
    }

    /// Returns the view height for `projection`. If the projection changes, objects at the centre of the
    /// scene keep their size.
    pub fn view_height_for(&self, projection: Projection) -> f64 {
        if projection == self.projection {
            return self.view_height;
        }
        let distance = match self.view_point {
            Some(e) => (self.centre() - e).dot(self.view_dir.normalize_or_zero()),
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
