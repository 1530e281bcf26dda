//! The picture of a scene on a contact sheet.

use std::fmt;
use std::sync::Arc;

use anyhow::Result;

use super::cell::SheetCell;
use super::cell_pictures::{CellPictures, planned_frame};
use super::pages::Pages;
use super::scene_sheets::{RenderScene, SheetScene};
use super::views::SheetContent;
use crate::plan::{NumberedScene, PathConflicts, RenderPlan, Writer};
use crate::run::load_scene::load_scene;
use blinn_scene::{PoseSettings, pose};
use blinn_session::{Permit, check_memory};

/// The scenes of a contact sheet. The memory of one is freed when it is rendered: only the pixels are kept for the page.
pub struct ContactCells<'a> {
    pub content: &'a SheetContent,
    pub pages: &'a Pages,
}

/// A scene that was rendered.
pub struct CellPicture {
    pub cell: SheetCell,
    /// 8-bit sRGB with straight alpha, row-major, row 0 on top.
    pub pixels: Vec<[u8; 4]>,
    /// In stops.
    pub exposure: f64,
}

/// The page would overwrite a file of a scene on it, so that it must not be written.
#[derive(Debug)]
pub struct PageIsInput(String);

impl fmt::Display for PageIsInput {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for PageIsInput {}

impl RenderScene for ContactCells<'_> {
    type Output = CellPicture;

    fn view_count(&self) -> usize {
        1
    }

    fn render(&self, scene: &SheetScene, permit: &Arc<Permit>) -> Result<CellPicture> {
        let ContactCells { content, pages } = self;
        let SheetScene { plan, scene: NumberedScene { number, path }, log, cancel } = scene;
        let planned = planned_frame(plan)?;
        let place = pages.place(*number);
        let scene = load_scene(plan, path, log, permit, cancel)?;
        let paths = PathConflicts::with_scene(path, scene.source.file_names());
        paths.check_not_input(&pages.file(place.page), Writer::Scene(path)).map_err(PageIsInput)?;
        permit.resize(check_memory(&plan.session, &scene, 1)?)?;
        let animation = plan.session.options.animation(&scene)?;
        let posed = pose(&scene, &PoseSettings { time: planned.time, animation, centre: None })?;
        let cell = content.first_view(&posed, &pages.grid, place.index, planned.time)?;
        let mut plan = RenderPlan::clone(plan);
        plan.session.options.view.complete = Some(cell.view.camera);
        let pictures = CellPictures { plan, scene: &scene, log, cancel };
        let mut pixels = Vec::new();
        let exposure =
            pictures.render(std::slice::from_ref(&cell), posed, &planned, |_, picture| pixels = picture)?;
        Ok(CellPicture { cell, pixels, exposure })
    }
}
