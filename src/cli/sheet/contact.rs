//! A contact sheet: one picture of each of several scenes, on pages.

use anyhow::Result;
use serde_json::{Value, json};

use super::backdrop::{background_pixel, is_light};
use super::contact_cell::ContactCells;
use super::contact_page::ContactPage;
use super::pages::Pages;
use super::scene_sheets::render_scenes;
use super::views::SheetContent;
use super::write_sheet::write_sheet;
use crate::files::create_parent_folder;
use crate::plan::RenderPlan;
use crate::run::batch::fail;
use crate::run::progress::Reporter;
use crate::summary::Summary;
use crate::usage::UsageError;
use blinn_output::{ImageFormat, check_writable};

/// A contact sheet.
pub struct ContactSheet<'a> {
    /// The plan of the pictures, of the size that they have at most.
    pub plan: &'a RenderPlan,
    /// The views, of which pictures show the first that a scene has.
    pub content: &'a SheetContent,
    pub pages: &'a Pages,
    /// Width and height of a page in pixels.
    pub size: (u32, u32),
    pub format: ImageFormat,
}

impl ContactSheet<'_> {
    /// Renders all scenes, side by side, and writes each page as soon as its scenes are rendered. Returns the descriptions of the
    /// pages. A scene that fails has an empty place with its name.
    ///
    /// # Errors
    /// The list of scenes cannot be read to its end. The page with that end is not written.
    pub fn render(&self, reporter: &Reporter, summary: &mut Summary) -> Result<Vec<Value>, UsageError> {
        let ContactSheet { plan, content, pages, .. } = *self;
        if let Err(error) = self.check_files() {
            fail(summary, reporter, &error);
            return Ok(Vec::new());
        }
        let mut all = Vec::new();
        let mut page = self.new_page();
        let cells = ContactCells { content, pages };
        render_scenes(plan, &cells, reporter, summary, |scene, output, failure, summary| {
            page.add(&scene.path, output, failure);
            let place = pages.place(scene.number);
            if place.is_last {
                let complete = std::mem::replace(&mut page, self.new_page());
                match self.write(complete, place.page, reporter) {
                    Ok(description) => all.extend(description),
                    Err(error) => fail(summary, reporter, &error),
                }
            }
        })?;
        Ok(all)
    }

    /// Checks that all pages can be written.
    fn check_files(&self) -> Result<()> {
        for file in self.pages.files() {
            create_parent_folder(&file)?;
            check_writable(&file, self.plan.outputs.replace)?;
        }
        Ok(())
    }

    fn new_page(&self) -> ContactPage {
        ContactPage::new(self.size, background_pixel(self.plan.session.options.fixed_background()))
    }

    /// Writes the page of a number, from 0, and returns its description; `None` if it must not be written.
    fn write(&self, page: ContactPage, number: usize, reporter: &Reporter) -> Result<Option<Value>> {
        if page.is_input() {
            return Ok(None);
        }
        let on_light = is_light(self.plan.session.options.fixed_background());
        let (pixels, cells) = page.finish(self.pages, number, on_light);
        let file = self.pages.file(number);
        write_sheet(&file, self.format, self.size, &pixels, self.plan.outputs.replace)?;
        reporter.wrote(None, &file);
        Ok(Some(json!({
            "file": file.to_string_lossy(),
            "width": self.size.0,
            "height": self.size.1,
            "cells": cells,
        })))
    }
}
