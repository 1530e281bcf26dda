//! What a material's textures have at points of one triangle, looked up together.

use std::ops::Range;

use glam::Vec4;

use crate::accel::Accel;
use crate::integrator::surface::points::{Group, LANES, TOGETHER};
use crate::integrator::surface::shading_triangle::Facet;
use crate::integrator::surface::texture_eval::place;
use crate::scene::{Image, PosedScene, SampleCoords, TexelSemantics, Texture, TextureRef};
use crate::simd::AutovecKernel;

/// What was found, by the place of points in their [`Group`].
#[derive(Debug, Default)]
pub(crate) struct Fetched<'a> {
    /// Whose textures these are.
    material: Option<u32>,
    /// The material's uses of textures.
    uses: Vec<Use<'a>>,
    columns: Vec<[Option<Vec4>; LANES]>,
}

/// A material's use of a texture.
#[derive(Clone, Copy, Debug)]
struct Use<'a> {
    t: &'a TextureRef,
    reading: TexelSemantics,
    /// False: of a normal map, whose means over more than a texel are not a texture's.
    all: bool,
    /// In which column is what it finds.
    column: usize,
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
            let Some(of) = self.uses.iter().find(|of| of.column == nth) else { continue };
            let (texture, images) = (&posed.scene.textures[of.t.texture as usize], &posed.scene.images[..]);
            accel.run_autovec(Fetch { facet, group, at: at.clone(), texture, images, of, out });
        }
    }

    /// Finds out which textures a material has. Uses that are alike share a column.
    fn begin(&mut self, posed: &'a PosedScene, material: u32) {
        self.material = Some(material);
        self.uses.clear();
        let material = &posed.materials[material as usize];
        let map = material.normal.as_ref().map(|map| (&map.texture, TexelSemantics::Data, false));
        let mut columns = 0;
        for (t, reading, all) in
            material.textures_with_semantics().map(|(t, reading)| (t, reading, true)).chain(map)
        {
            let alike = |of: &&Use| (of.t, of.reading, of.all) == (t, reading, all);
            let column = self.uses.iter().find(alike).map_or(columns, |of| of.column);
            columns = columns.max(column + 1);
            self.uses.push(Use { t, reading, all, column });
        }
        self.columns.resize(columns, [None; LANES]);
    }

    /// What this use of a texture has found at point `i`, if it was asked.
    #[inline(always)]
    pub fn get(&self, t: &TextureRef, reading: TexelSemantics, i: usize) -> Option<Vec4> {
        let asked = |of: &&Use| std::ptr::eq(of.t, t) && of.reading == reading;
        self.uses.iter().find(asked).and_then(|of| self.columns[of.column][i])
    }
}

/// One column of them.
struct Fetch<'a, 's> {
    facet: &'a Facet<'s>,
    group: &'a Group,
    at: Range<usize>,
    texture: &'a Texture,
    images: &'a [Image],
    of: &'a Use<'a>,
    out: &'a mut [Option<Vec4>; LANES],
}

impl AutovecKernel for Fetch<'_, '_> {
    #[inline(always)]
    fn run(self) {
        let Fetch { facet, group, at, texture, images, of: &Use { t, reading, all, .. }, out } = self;
        let uvs = facet.uvs(t.uv_set);
        for first in at.clone().step_by(TOGETHER) {
            let mut places = SampleCoords::<TOGETHER>::ORIGIN;
            for i in 0..TOGETHER {
                let (b, spread) = group.place(first % LANES + i);
                let (uv, over) = place(uvs, b, spread, &t.transform);
                places.set(i, uv, over);
            }
            let end = at.end.min(first + TOGETHER);
            texture.sample_batch(images, &places, (reading, all), &mut out[first..end]);
        }
    }
}
