//! What a material's textures have at points of one triangle, looked up together.

use std::ops::Range;

use glam::Vec4;

use super::columns::{Group, LANES, TOGETHER};
use super::facet::Facet;
use super::on_mesh::place;
use crate::accel::{Accel, Columnwise};
use crate::scene::{Image, Places, PosedScene, Reading, Texture, TextureRef};

/// What was found, by the place of points in their [`Group`].
#[derive(Debug, Default)]
pub(super) struct Fetched<'a> {
    /// Whose textures these are.
    material: Option<u32>,
    /// The material's uses of textures, and in which column is what they find.
    uses: Vec<(&'a TextureRef, Reading, usize)>,
    columns: Vec<[Vec4; LANES]>,
}

impl<'a> Fetched<'a> {
    /// Looks up everything at points of `facet`, which are `at` some places of `group`.
    pub fn fetch(
        &mut self,
        accel: &Accel,
        posed: &'a PosedScene,
        facet: &Facet,
        (group, at): (&Group, Range<usize>),
    ) {
        if self.material != Some(facet.material) {
            self.begin(posed, facet.material);
        }
        for (nth, out) in self.columns.iter_mut().enumerate() {
            let Some(&(t, reading, _)) = self.uses.iter().find(|(.., column)| *column == nth) else {
                continue;
            };
            let (texture, images) = (&posed.scene.textures[t.texture as usize], &posed.scene.images[..]);
            accel.columnwise(Fetch { facet, group, at: at.clone(), texture, images, t, reading, out });
        }
    }

    /// Finds out which textures a material has. Uses that are alike share a column.
    fn begin(&mut self, posed: &'a PosedScene, material: u32) {
        self.material = Some(material);
        self.uses.clear();
        let mut columns = 0;
        for (t, reading) in posed.materials[material as usize].lookups() {
            let alike = |&&(other, read, _): &&(&TextureRef, Reading, usize)| *other == *t && read == reading;
            let column = self.uses.iter().find(alike).map_or(columns, |(.., column)| *column);
            columns = columns.max(column + 1);
            self.uses.push((t, reading, column));
        }
        self.columns.resize(columns, [Vec4::ZERO; LANES]);
    }

    /// What this use of a texture has found at point `i`, if it was asked.
    #[inline(always)]
    pub fn get(&self, t: &TextureRef, reading: Reading, i: usize) -> Option<Vec4> {
        let asked =
            |(use_, read, _): &&(&TextureRef, Reading, usize)| std::ptr::eq(*use_, t) && *read == reading;
        self.uses.iter().find(asked).map(|(.., column)| self.columns[*column][i])
    }
}

/// One column of them.
struct Fetch<'a, 's> {
    facet: &'a Facet<'s>,
    group: &'a Group,
    at: Range<usize>,
    texture: &'a Texture,
    images: &'a [Image],
    t: &'a TextureRef,
    reading: Reading,
    out: &'a mut [Vec4; LANES],
}

impl Columnwise for Fetch<'_, '_> {
    #[inline(always)]
    fn run(self) {
        let Fetch { facet, group, at, texture, images, t, reading, out } = self;
        let uvs = facet.uvs(t.uv_set);
        for first in at.clone().step_by(TOGETHER) {
            let mut places = Places::<TOGETHER>::ORIGIN;
            for i in 0..TOGETHER {
                let (b, spread) = group.place(first % LANES + i);
                let (uv, over) = place(uvs, b, spread, &t.transform);
                places.set(i, uv, over);
            }
            let end = at.end.min(first + TOGETHER);
            texture.filtered_together(images, &places, reading, &mut out[first..end]);
        }
    }
}
