//! Values numbered in the order of their first use, equal ones alike.

use std::collections::HashMap;

use glam::Vec4;

/// Distinct values of four numbers. Values are equal if their bits are.
#[derive(Default)]
pub(super) struct Interned {
    numbers: HashMap<[u32; 4], u32>,
    pub values: Vec<Vec4>,
}

impl Interned {
    /// Returns the number of a value, and adds the value if it is new.
    pub fn number_of(&mut self, value: Vec4) -> u32 {
        *self.numbers.entry(value.to_array().map(f32::to_bits)).or_insert_with(|| {
            self.values.push(value);
            self.values.len() as u32 - 1
        })
    }
}
