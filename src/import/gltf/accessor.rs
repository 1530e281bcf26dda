//! Accessors: numbers of every type, strided, sparse, normalised, or all zero.

use ::gltf::json::accessor::{ComponentType, Type};
use ::gltf::json::validation::Checked;

use super::document::Document;
use crate::import::error::{LoadError, Warnings};

/// An accessor whose every element is known to lie within its buffer.
#[derive(Debug)]
pub(super) struct Accessor<'d> {
    /// Number of elements.
    pub count: usize,
    /// Numbers in an element.
    pub width: usize,
    /// What is stored.
    pub component: ComponentType,
    /// True where integers stand for 0…1 or −1…1.
    pub normalized: bool,
    size: usize,
    base: Option<Strided<'d>>,
    sparse: Option<Sparse<'d>>,
}

#[derive(Debug)]
struct Strided<'d> {
    bytes: &'d [u8],
    stride: usize,
}

/// Elements that differ from the base: (index, position among the values), ascending by index.
#[derive(Debug)]
struct Sparse<'d> {
    indices: Vec<(u32, u32)>,
    values: &'d [u8],
}

/// Which elements to read, in which order.
#[derive(Clone, Copy, Debug)]
pub(super) enum Pick<'p> {
    /// The first so many.
    First(usize),
    /// These.
    These(&'p [u32]),
}

impl Pick<'_> {
    /// How many elements it names.
    pub fn len(&self) -> usize {
        match self {
            Pick::First(n) => *n,
            Pick::These(list) => list.len(),
        }
    }
}

/// Bytes of the largest element, MAT4 of floats.
const ZEROS: [u8; 64] = [0; 64];

impl<'d> Accessor<'d> {
    /// Checks accessor `index` against its buffers.
    pub fn open(
        doc: &'d Document<'_>,
        index: usize,
        warnings: &mut Warnings,
    ) -> Result<Accessor<'d>, LoadError> {
        let place = || format!("accessors[{index}]");
        let invalid = |field: &str, rule: String| LoadError::invalid(format!("{}{field}", place()), rule);
        let json = doc.root().accessors.get(index);
        let json = json.ok_or_else(|| invalid("", "there is no such accessor".into()))?;
        let Checked::Valid(component) = json.component_type else {
            return Err(invalid(".componentType", "is none of 5120 to 5123, 5125 and 5126".into()));
        };
        let Checked::Valid(kind) = json.type_ else {
            return Err(invalid(".type", "is none of SCALAR, VEC2 to VEC4 and MAT2 to MAT4".into()));
        };
        let component = component.0;
        let (width, size) = (kind.multiplicity(), element_size(kind, component));
        let count = usize::try_from(json.count.0).ok().filter(|&n| n <= u32::MAX as usize);
        let count = count.ok_or_else(|| invalid(".count", format!("{} is over 2^32", json.count.0)))?;

        let base = match json.buffer_view {
            Some(view) => {
                let view_index = view.value();
                let view = doc.view(view_index)?;
                let stride = match view.stride {
                    Some(s) if s >= size => s,
                    None | Some(0) => size,
                    Some(s) => {
                        let what =
                            format!("{s} is less than an element of {size} bytes; taken as tightly packed");
                        warnings.add(format_args!("bufferViews[{view_index}].byteStride"), what);
                        size
                    }
                };
                let offset = json.byte_offset.map_or(0, |o| o.0);
                let bytes = usize::try_from(offset).ok().and_then(|o| view.bytes.get(o..));
                let needed =
                    count.checked_sub(1).map_or(Some(0), |n| n.checked_mul(stride)?.checked_add(size));
                let bytes = bytes.filter(|b| needed.is_some_and(|n| n <= b.len())).ok_or_else(|| {
                    let has = view.bytes.len();
                    let what = format!(
                        "{count} elements of {size} bytes, {stride} apart, from byte {offset} do not lie in \
                         bufferViews[{view_index}], which has {has} bytes"
                    );
                    invalid("", what)
                })?;
                Some(Strided { bytes, stride })
            }
            None => {
                doc.charge_zeros(count as u64 * 4 * width as u64)?;
                None
            }
        };
        let sparse = match &json.sparse {
            Some(sparse) => Some(Sparse::open(doc, sparse, count, size, &place(), warnings)?),
            None => None,
        };
        Ok(Accessor { count, width, component, normalized: json.normalized, size, base, sparse })
    }

    /// Numbers that were decompressed: `count` elements, tightly packed.
    pub fn packed(
        count: usize,
        width: usize,
        component: ComponentType,
        normalized: bool,
        bytes: &'d [u8],
    ) -> Accessor<'d> {
        let size = width * component.size();
        let base = Some(Strided { bytes, stride: size });
        Accessor { count, width, component, normalized, size, base, sparse: None }
    }

    /// Elements of `N` numbers as floats.
    ///
    /// The caller has checked that `N` is the width and that the picked elements exist; anything
    /// else reads as zero.
    pub fn floats<const N: usize, T: From<[f32; N]>>(&self, pick: Pick<'_>) -> Vec<T> {
        use ComponentType::{F32, I8, I16, U8, U16, U32};
        match (self.component, self.normalized) {
            (F32, _) => self.decode(pick, f32::from_le_bytes),
            (U8, false) => self.decode(pick, |[b]: [u8; 1]| f32::from(b)),
            (U8, true) => self.decode(pick, |[b]: [u8; 1]| f32::from(b) / 255.0),
            (I8, false) => self.decode(pick, |b: [u8; 1]| f32::from(i8::from_le_bytes(b))),
            (I8, true) => self.decode(pick, |b: [u8; 1]| (f32::from(i8::from_le_bytes(b)) / 127.0).max(-1.0)),
            (U16, false) => self.decode(pick, |b: [u8; 2]| f32::from(u16::from_le_bytes(b))),
            (U16, true) => self.decode(pick, |b: [u8; 2]| f32::from(u16::from_le_bytes(b)) / 65535.0),
            (I16, false) => self.decode(pick, |b: [u8; 2]| f32::from(i16::from_le_bytes(b))),
            (I16, true) => {
                self.decode(pick, |b: [u8; 2]| (f32::from(i16::from_le_bytes(b)) / 32767.0).max(-1.0))
            }
            (U32, false) => self.decode(pick, |b: [u8; 4]| u32::from_le_bytes(b) as f32),
            (U32, true) => self
                .decode(pick, |b: [u8; 4]| (f64::from(u32::from_le_bytes(b)) / f64::from(u32::MAX)) as f32),
        }
    }

    /// Elements of `N` unsigned integers; negative numbers and fractions are cut to fit.
    pub fn integers<const N: usize, T: From<[u32; N]>>(&self, pick: Pick<'_>) -> Vec<T> {
        use ComponentType::{F32, I8, I16, U8, U16, U32};
        match self.component {
            U8 => self.decode(pick, |[b]: [u8; 1]| u32::from(b)),
            U16 => self.decode(pick, |b: [u8; 2]| u32::from(u16::from_le_bytes(b))),
            U32 => self.decode(pick, u32::from_le_bytes),
            I8 => self.decode(pick, |b: [u8; 1]| i8::from_le_bytes(b).max(0) as u32),
            I16 => self.decode(pick, |b: [u8; 2]| i16::from_le_bytes(b).max(0) as u32),
            F32 => self.decode(pick, |b: [u8; 4]| f32::from_le_bytes(b) as u32),
        }
    }

    /// Every number of every element in turn, as floats.
    pub fn flat_floats(&self) -> Vec<f32> {
        fn spread<const N: usize>(a: &Accessor<'_>) -> Vec<f32> {
            a.floats::<N, [f32; N]>(Pick::First(a.count)).into_flattened()
        }
        match self.width {
            1 => spread::<1>(self),
            2 => spread::<2>(self),
            3 => spread::<3>(self),
            4 => spread::<4>(self),
            9 => spread::<9>(self),
            _ => spread::<16>(self),
        }
    }

    /// The largest value that indices of this type can have, which restarts a strip.
    pub fn largest(&self) -> u32 {
        match self.component {
            ComponentType::U8 | ComponentType::I8 => u32::from(u8::MAX),
            ComponentType::U16 | ComponentType::I16 => u32::from(u16::MAX),
            ComponentType::U32 | ComponentType::F32 => u32::MAX,
        }
    }

    fn decode<const N: usize, const S: usize, X: Copy + Default, T: From<[X; N]>>(
        &self,
        pick: Pick<'_>,
        number: impl Fn([u8; S]) -> X,
    ) -> Vec<T> {
        let element = |bytes: &[u8]| {
            let mut out = [X::default(); N];
            for (x, bytes) in out.iter_mut().zip(bytes.chunks_exact(S)) {
                *x = number(bytes.try_into().unwrap_or([0; S]));
            }
            T::from(out)
        };
        match pick {
            Pick::First(n) => {
                let mut all: Vec<T> = (0..n).map(|i| element(self.base_element(i))).collect();
                for &(index, at) in self.sparse.iter().flat_map(|s| &s.indices) {
                    if let (Some(x), Some(sparse)) = (all.get_mut(index as usize), &self.sparse) {
                        *x = element(sparse.value(at, self.size));
                    }
                }
                all
            }
            Pick::These(list) => list.iter().map(|&i| element(self.element(i))).collect(),
        }
    }

    fn base_element(&self, index: usize) -> &[u8] {
        let bytes = self.base.as_ref().and_then(|base| {
            let at = index.checked_mul(base.stride)?;
            base.bytes.get(at..at.checked_add(self.size)?)
        });
        bytes.unwrap_or(&ZEROS[..self.size])
    }

    fn element(&self, index: u32) -> &[u8] {
        let sparse = self.sparse.as_ref().and_then(|sparse| {
            let found = sparse.indices.binary_search_by_key(&index, |&(i, _)| i).ok()?;
            Some(sparse.value(sparse.indices[found].1, self.size))
        });
        sparse.unwrap_or_else(|| self.base_element(index as usize))
    }
}

impl<'d> Sparse<'d> {
    fn open(
        doc: &'d Document<'_>,
        json: &::gltf::json::accessor::sparse::Sparse,
        count: usize,
        size: usize,
        accessor: &str,
        warnings: &mut Warnings,
    ) -> Result<Sparse<'d>, LoadError> {
        let place = |field: &str| format!("{accessor}.sparse{field}");
        let Checked::Valid(component) = json.indices.component_type else {
            return Err(LoadError::invalid(
                place(".indices.componentType"),
                "is none of 5121, 5123 and 5125",
            ));
        };
        let index_size = component.0.size();
        let stretch = |view: usize, offset: u64, size: usize, field: &str| {
            let bytes = doc.view(view)?.bytes;
            let tail = usize::try_from(offset).ok().and_then(|o| bytes.get(o..));
            let length = usize::try_from(json.count.0).ok().and_then(|n| n.checked_mul(size));
            length.and_then(|n| tail.and_then(|t| t.get(..n))).ok_or_else(|| {
                let what = format!("{} elements do not lie in bufferViews[{view}]", json.count.0);
                LoadError::invalid(place(field), what)
            })
        };
        let indices =
            stretch(json.indices.buffer_view.value(), json.indices.byte_offset.0, index_size, ".indices")?;
        let values = stretch(json.values.buffer_view.value(), json.values.byte_offset.0, size, ".values")?;
        let number = |b: &[u8]| b.iter().rev().fold(0u32, |n, &b| n << 8 | u32::from(b));
        let mut indices: Vec<(u32, u32)> = indices.chunks_exact(index_size).map(number).zip(0..).collect();
        if let Some((at, (index, _))) = indices.iter().enumerate().find(|(_, (i, _))| *i as usize >= count) {
            let rule = format!("element {at} is {index}, and the accessor has {count} elements");
            return Err(LoadError::invalid(place(".indices"), rule));
        }
        if !indices.is_sorted_by(|a, b| a.0 < b.0) {
            warnings.add(place(".indices"), "do not ascend; the last value for each index counts");
            indices.sort_by_key(|&(index, at)| (index, std::cmp::Reverse(at)));
            indices.dedup_by_key(|&mut (index, _)| index);
        }
        Ok(Sparse { indices, values })
    }

    fn value(&self, at: u32, size: usize) -> &[u8] {
        let start = (at as usize).saturating_mul(size);
        self.values.get(start..start.saturating_add(size)).unwrap_or(&ZEROS[..size])
    }
}

/// Bytes of an element; columns of matrices start at multiples of four bytes.
fn element_size(kind: Type, component: ComponentType) -> usize {
    let size = component.size();
    match kind {
        Type::Mat2 => 2 * (2 * size).next_multiple_of(4),
        Type::Mat3 => 3 * (3 * size).next_multiple_of(4),
        other => other.multiplicity() * size,
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::super::fixture::{Fixture, bytes_of};
    use super::*;

    /// Reads accessor 0 of a fixture as flat floats.
    fn read(fixture: &Fixture) -> Result<Vec<f32>, String> {
        fixture.with_document(|doc| {
            Accessor::open(doc, 0, &mut Warnings::default())
                .map(|a| a.flat_floats())
                .map_err(|e| e.to_string())
        })
    }

    #[test]
    fn every_component_type_with_and_without_normalising() {
        type Case = (u32, Vec<u8>, [f32; 2], [f32; 2]);
        let cases: [Case; 6] = [
            (5120, vec![0x80, 127], [-128.0, 127.0], [-1.0, 1.0]),
            (5121, vec![51, 255], [51.0, 255.0], [0.2, 1.0]),
            (5122, bytes_of(&[-32768i16, 32767]), [-32768.0, 32767.0], [-1.0, 1.0]),
            (5123, bytes_of(&[13107u16, 65535]), [13107.0, 65535.0], [0.2, 1.0]),
            (5125, bytes_of(&[0u32, u32::MAX]), [0.0, 4294967295.0], [0.0, 1.0]),
            (5126, bytes_of(&[-0.25f32, 7.0]), [-0.25, 7.0], [-0.25, 7.0]),
        ];
        for (component, bytes, plain, normalised) in cases {
            for (flag, expected) in [(false, plain), (true, normalised)] {
                let mut fixture = Fixture::empty();
                fixture.accessor(component, "VEC2", 1, &bytes);
                fixture.json["accessors"][0]["normalized"] = json!(flag);
                assert_eq!(read(&fixture).unwrap(), expected, "{component} {flag}");
            }
        }
    }

    #[test]
    fn strides_and_offsets() {
        let mut fixture = Fixture::empty();
        fixture.accessor(5126, "VEC2", 2, &bytes_of(&[9.0f32, 1.0, 2.0, 9.0, 3.0, 4.0]));
        fixture.json["bufferViews"][0]["byteStride"] = json!(12);
        fixture.json["accessors"][0]["byteOffset"] = json!(4);
        assert_eq!(read(&fixture).unwrap(), [1.0, 2.0, 3.0, 4.0]);
        // One element more would end past the view.
        fixture.json["accessors"][0]["count"] = json!(3);
        let error = read(&fixture).unwrap_err();
        assert!(error.starts_with("accessors[0]: 3 elements of 8 bytes, 12 apart, from byte 4"), "{error}");
        // A stride that cannot be: tight, with a warning.
        fixture.json["accessors"][0]["count"] = json!(2);
        fixture.json["bufferViews"][0]["byteStride"] = json!(4);
        assert_eq!(read(&fixture).unwrap(), [1.0, 2.0, 9.0, 3.0]);
    }

    #[test]
    fn sparse_with_and_without_a_base() {
        let mut fixture = Fixture::empty();
        fixture.accessor(5126, "SCALAR", 4, &bytes_of(&[1.0f32, 2.0, 3.0, 4.0]));
        let indices = fixture.view(&[1, 3]);
        let values = fixture.view(&bytes_of(&[-1.0f32, -2.0]));
        fixture.json["accessors"][0]["sparse"] = json!({"count": 2,
            "indices": {"bufferView": indices, "componentType": 5121}, "values": {"bufferView": values}});
        assert_eq!(read(&fixture).unwrap(), [1.0, -1.0, 3.0, -2.0]);
        let picked = fixture.with_document(|doc| {
            let accessor = Accessor::open(doc, 0, &mut Warnings::default()).unwrap();
            accessor.floats::<1, [f32; 1]>(Pick::These(&[3, 0]))
        });
        assert_eq!(picked, [[-2.0], [1.0]]);
        fixture.json["accessors"][0].as_object_mut().unwrap().remove("bufferView");
        assert_eq!(read(&fixture).unwrap(), [0.0, -1.0, 0.0, -2.0]);
        fixture.json["accessors"][0]["count"] = json!(3);
        let error = read(&fixture).unwrap_err();
        assert_eq!(error, "accessors[0].sparse.indices: element 1 is 3, and the accessor has 3 elements");
        fixture.json["accessors"][0]["sparse"]["count"] = json!(3);
        assert!(read(&fixture).unwrap_err().contains("3 elements do not lie in"));
    }

    #[test]
    fn huge_claims_are_errors() {
        let mut fixture = Fixture::empty();
        fixture.accessor(5126, "VEC3", 1, &[0; 12]);
        for count in [2u64, 1 << 31, 1 << 40, u64::MAX] {
            fixture.json["accessors"][0]["count"] = json!(count);
            assert!(read(&fixture).is_err(), "{count}");
        }
        fixture.json["accessors"][0]["count"] = json!(1);
        for (key, value) in [("byteOffset", u64::MAX), ("byteLength", u64::MAX), ("byteOffset", 1)] {
            let mut broken = fixture.clone();
            broken.json["bufferViews"][0][key] = json!(value);
            assert!(read(&broken).unwrap_err().starts_with("bufferViews[0]: "), "{key}");
        }
        fixture.json["accessors"][0].as_object_mut().unwrap().remove("bufferView");
        fixture.json["accessors"][0]["count"] = json!(4_000_000_000u64);
        assert!(read(&fixture).unwrap_err().contains("exceeds the limit"));
    }
}
