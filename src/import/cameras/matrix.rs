//! Small matrices in JSON: nested rows, or one row after the other.

use std::fmt;

use glam::{DMat3, DVec3};
use serde::de::{Deserialize, Deserializer, Error, SeqAccess, Visitor};

use blinn_scene::{Intrinsics, SimilarityTransform};

/// Up to 16 numbers of a matrix in JSON, with the lengths of its rows.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Matrix {
    numbers: [f64; 16],
    /// Number of numbers.
    len: usize,
    /// Number and length of rows; `None` for a flat list.
    rows: Option<(usize, usize)>,
}

impl Matrix {
    /// The numbers, if there are `rows` by `columns`, nested or flat.
    fn shaped(&self, rows: usize, columns: usize) -> Option<&[f64]> {
        let fits = self.len == rows * columns && self.rows.is_none_or(|shape| shape == (rows, columns));
        fits.then_some(&self.numbers[..self.len])
    }

    /// The 3×3 matrix K of a pinhole camera.
    pub fn to_intrinsics(&self) -> Result<Intrinsics, String> {
        let numbers = self.shaped(3, 3).and_then(|numbers| numbers.try_into().ok());
        Intrinsics::from_matrix(numbers.ok_or("must have 3×3 numbers")?)
    }

    /// A 4×4 or 3×4 matrix of a rotation, perhaps with a uniform scale, and a translation.
    pub fn to_similarity(&self) -> Result<SimilarityTransform, String> {
        let m = self.shaped(4, 4).or_else(|| self.shaped(3, 4));
        SimilarityTransform::from_rows(m.ok_or("must have 4×4 or 3×4 numbers")?)
    }

    /// A 3×3 rotation.
    pub fn to_rotation(&self) -> Result<DMat3, String> {
        let m = self.shaped(3, 3).ok_or("must have 9 numbers")?;
        let column = |j: usize| DVec3::new(m[j], m[3 + j], m[6 + j]);
        Ok(DMat3::from_cols(column(0), column(1), column(2)))
    }

    /// Three numbers.
    pub fn to_vector(&self) -> Result<DVec3, String> {
        let numbers = self.shaped(1, 3).or_else(|| self.shaped(3, 1));
        numbers.map(DVec3::from_slice).ok_or_else(|| "must have 3 numbers".into())
    }
}

/// An element of a matrix: a number of a flat list, or a row.
enum Element {
    Number(f64),
    Row([f64; 4], usize),
}

impl<'de> Deserialize<'de> for Element {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Element, D::Error> {
        struct ElementVisitor;
        impl<'de> Visitor<'de> for ElementVisitor {
            type Value = Element;

            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                f.write_str("a number or a row of numbers")
            }

            fn visit_f64<E>(self, v: f64) -> Result<Element, E> {
                Ok(Element::Number(v))
            }

            fn visit_i64<E>(self, v: i64) -> Result<Element, E> {
                Ok(Element::Number(v as f64))
            }

            fn visit_u64<E>(self, v: u64) -> Result<Element, E> {
                Ok(Element::Number(v as f64))
            }

            fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> Result<Element, A::Error> {
                let mut row = [0.0; 4];
                let mut len = 0;
                while let Some(number) = seq.next_element::<f64>()? {
                    *row.get_mut(len).ok_or_else(|| A::Error::custom("a row has more than 4 numbers"))? =
                        number;
                    len += 1;
                }
                Ok(Element::Row(row, len))
            }
        }
        deserializer.deserialize_any(ElementVisitor)
    }
}

impl<'de> Deserialize<'de> for Matrix {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Matrix, D::Error> {
        struct MatrixVisitor;
        impl<'de> Visitor<'de> for MatrixVisitor {
            type Value = Matrix;

            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                f.write_str("a matrix")
            }

            fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> Result<Matrix, A::Error> {
                let mut matrix = Matrix { numbers: [0.0; 16], len: 0, rows: None };
                let mut index = 0;
                while let Some(element) = seq.next_element::<Element>()? {
                    let (numbers, len) = match element {
                        Element::Number(number) => ([number, 0.0, 0.0, 0.0], 1),
                        Element::Row(row, len) => (row, len),
                    };
                    let row_len = matches!(element, Element::Row(..)).then_some(len);
                    if index > 0 && row_len != matrix.rows.map(|(_, len)| len) {
                        return Err(A::Error::custom("the rows of a matrix must have the same length"));
                    }
                    let places = matrix.numbers.get_mut(matrix.len..matrix.len + len);
                    let too_many = || A::Error::custom("a matrix has more than 16 numbers");
                    places.ok_or_else(too_many)?.copy_from_slice(&numbers[..len]);
                    matrix.len += len;
                    index += 1;
                    // An empty row adds no number, so it could repeat without end.
                    if index > 16 {
                        return Err(too_many());
                    }
                    matrix.rows = row_len.map(|len| (index, len));
                }
                Ok(matrix)
            }
        }
        deserializer.deserialize_any(MatrixVisitor)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn matrix(text: &str) -> Result<Matrix, String> {
        serde_json::from_str(text).map_err(|e| e.to_string())
    }

    #[test]
    fn matrices_are_nested_or_flat() {
        let k = Intrinsics { fx: 500.0, fy: 400.0, cx: 320.5, cy: 240.0 };
        for text in ["[[500, 0, 320.5], [0, 4e2, 240], [0, 0, 1]]", "[500, 0, 320.5, 0, 400, 240, 0, 0, 1]"] {
            assert_eq!(matrix(text).unwrap().to_intrinsics(), Ok(k));
        }
        let pose = matrix("[[1,0,0,5],[0,1,0,6],[0,0,1,7]]").unwrap().to_similarity();
        assert_eq!(pose, SimilarityTransform::new(DMat3::IDENTITY, DVec3::new(5.0, 6.0, 7.0)));
        assert_eq!(matrix("[1,0,0,5,0,1,0,6,0,0,1,7,0,0,0,1]").unwrap().to_similarity(), pose);
        assert_eq!(matrix("[[1],[2],[3]]").unwrap().to_vector(), Ok(DVec3::new(1.0, 2.0, 3.0)));
        let turn = matrix("[0,-1,0, 1,0,0, 0,0,1]").unwrap().to_rotation().unwrap();
        assert_eq!(turn * DVec3::X, DVec3::Y);
    }

    #[test]
    fn other_shapes_are_refused() {
        for text in ["{}", "3", "[1, [2]]", "[[1],[2,3]]", "[[1,2,3,4,5]]", "[null]", "[\"1\"]", "[1e999]"] {
            assert!(matrix(text).is_err(), "{text}");
        }
        assert!(matrix(&format!("[{}]", ["0"; 17].join(","))).is_err());
        assert!(matrix(&format!("[{}]", ["[]"; 17].join(","))).is_err());
        let shape = |text: &str| matrix(text).unwrap();
        assert!(shape("[1,2,3]").to_intrinsics().is_err() && shape("[]").to_vector().is_err());
        assert!(shape("[500,1,0,0,500,0,0,0,1]").to_intrinsics().unwrap_err().contains("skew 1"));
        assert!(shape("[500,0,0,0,500,0,0,0,2]").to_intrinsics().is_err());
        let transposed = shape("[1,0,0,0, 0,1,0,0, 0,0,1,0, 5,6,7,1]").to_similarity().unwrap_err();
        assert!(transposed.contains("transposed"), "{transposed}");
    }
}
