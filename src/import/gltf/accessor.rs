//! Accessors: typed elements in buffer views, with strides, sparse storage, normalized integers and zeros by
//! default.

use ::gltf::json::accessor::{ComponentType, Type};
use ::gltf::json::validation::Checked;

use super::document::Document;
use crate::error::{LoadError, Warnings};

/// An accessor whose elements are proven to lie within its buffer views.
#[derive(Debug)]
pub(super) struct Accessor<'d> {
    /// Number of elements.
    pub count: usize,
    /// Number of components per element.
    pub components: usize,
    pub component_type: ComponentType,
    /// True if integers stand for 0…1 or −1…1.
    pub normalized: bool,
    element_size: usize,
    /// The elements; `None` for an accessor of zeros.
    base: Option<Strided<'d>>,
    sparse: Option<Sparse<'d>>,
}

#[derive(Debug)]
struct Strided<'d> {
    bytes: &'d [u8],
    stride: usize,
}

/// Elements that replace elements of the base.
#[derive(Debug)]
struct Sparse<'d> {
    /// Pairs of an element's index and the position of its value, ascending by index.
    indices: Vec<(u32, u32)>,
    values: &'d [u8],
}

/// The elements to read, in order.
#[derive(Clone, Copy, Debug)]
pub(super) enum Elements<'e> {
    /// The first elements, of this number.
    First(usize),
    /// The elements at these indices.
    At(&'e [u32]),
}

impl Elements<'_> {
    /// Number of elements to read.
    pub fn len(&self) -> usize {
        match self {
            Elements::First(n) => *n,
            Elements::At(indices) => indices.len(),
        }
    }
}

/// Zeros for the largest element, MAT4 of floats.
const ZEROS: [u8; 64] = [0; 64];

impl<'d> Accessor<'d> {
    /// Checks accessor `index` against its buffer views.
    pub fn open(
        doc: &'d Document<'_>,
        index: usize,
        warnings: &mut Warnings,
    ) -> Result<Accessor<'d>, LoadError> {
        let location = || format!("accessors[{index}]");
        let invalid =
            |field: &str, message: String| LoadError::invalid(format!("{}{field}", location()), message);
        let json = doc.root().accessors.get(index);
        let json = json.ok_or_else(|| invalid("", "accessor does not exist".into()))?;
        let Checked::Valid(component_type) = json.component_type else {
            let message = "invalid component type; expected 5120 to 5123, 5125 or 5126";
            return Err(invalid(".componentType", message.into()));
        };
        let Checked::Valid(element_type) = json.type_ else {
            return Err(invalid(
                ".type",
                "invalid type; expected SCALAR, VEC2 to VEC4 or MAT2 to MAT4".into(),
            ));
        };
        let component_type = component_type.0;
        let element_size = element_size(element_type, component_type);
        let count = usize::try_from(json.count.0).ok().filter(|&n| n <= u32::MAX as usize);
        let count = count.ok_or_else(|| invalid(".count", format!("{} exceeds 2^32", json.count.0)))?;
        let components = element_type.multiplicity();

        let mut count = count;
        let base = if json.buffer_view.is_some() {
            let (base, complete) = Strided::open(doc, json, count, element_size, &location(), warnings)?;
            count = complete;
            Some(base)
        } else {
            doc.charge_zeros(count as u64 * 4 * components as u64)?;
            None
        };
        let sparse = match &json.sparse {
            Some(sparse) => Some(Sparse::open(doc, sparse, count, element_size, &location(), warnings)?),
            None => None,
        };
        let normalized = json.normalized;
        Ok(Accessor { count, components, component_type, normalized, element_size, base, sparse })
    }

    /// An accessor of decompressed data: `count` tightly packed elements.
    pub fn tightly_packed(
        count: usize,
        components: usize,
        component_type: ComponentType,
        normalized: bool,
        bytes: &'d [u8],
    ) -> Accessor<'d> {
        let element_size = components * component_type.size();
        let base = Some(Strided { bytes, stride: element_size });
        Accessor { count, components, component_type, normalized, element_size, base, sparse: None }
    }

    /// Reads elements of `N` components as floats, with normalized integers converted as the specification
    /// says.
    ///
    /// The caller has checked that `N` is the number of components and that the elements exist; anything else
    /// reads as zero.
    pub fn floats<const N: usize, T: From<[f32; N]>>(&self, elements: Elements<'_>) -> Vec<T> {
        self.floats_as(self.normalized, elements)
    }

    /// Reads elements like [`Accessor::floats`], with integers `normalized` or not.
    pub fn floats_as<const N: usize, T: From<[f32; N]>>(
        &self,
        normalized: bool,
        elements: Elements<'_>,
    ) -> Vec<T> {
        use ComponentType::{F32, I8, I16, U8, U16, U32};
        match (self.component_type, normalized) {
            (F32, _) => self.decode(elements, f32::from_le_bytes),
            (U8, false) => self.decode(elements, |[b]: [u8; 1]| f32::from(b)),
            (U8, true) => self.decode(elements, |[b]: [u8; 1]| f32::from(b) / 255.0),
            (I8, false) => self.decode(elements, |b: [u8; 1]| f32::from(i8::from_le_bytes(b))),
            (I8, true) => {
                self.decode(elements, |b: [u8; 1]| (f32::from(i8::from_le_bytes(b)) / 127.0).max(-1.0))
            }
            (U16, false) => self.decode(elements, |b: [u8; 2]| f32::from(u16::from_le_bytes(b))),
            (U16, true) => self.decode(elements, |b: [u8; 2]| f32::from(u16::from_le_bytes(b)) / 65535.0),
            (I16, false) => self.decode(elements, |b: [u8; 2]| f32::from(i16::from_le_bytes(b))),
            (I16, true) => {
                self.decode(elements, |b: [u8; 2]| (f32::from(i16::from_le_bytes(b)) / 32767.0).max(-1.0))
            }
            (U32, false) => self.decode(elements, |b: [u8; 4]| u32::from_le_bytes(b) as f32),
            (U32, true) => self.decode(elements, |b: [u8; 4]| {
                (f64::from(u32::from_le_bytes(b)) / f64::from(u32::MAX)) as f32
            }),
        }
    }

    /// Reads elements of `N` components as unsigned integers. Negative numbers become 0, fractions are
    /// truncated.
    pub fn integers<const N: usize, T: From<[u32; N]>>(&self, elements: Elements<'_>) -> Vec<T> {
        use ComponentType::{F32, I8, I16, U8, U16, U32};
        match self.component_type {
            U8 => self.decode(elements, |[b]: [u8; 1]| u32::from(b)),
            U16 => self.decode(elements, |b: [u8; 2]| u32::from(u16::from_le_bytes(b))),
            U32 => self.decode(elements, u32::from_le_bytes),
            I8 => self.decode(elements, |b: [u8; 1]| i8::from_le_bytes(b).max(0) as u32),
            I16 => self.decode(elements, |b: [u8; 2]| i16::from_le_bytes(b).max(0) as u32),
            F32 => self.decode(elements, |b: [u8; 4]| f32::from_le_bytes(b) as u32),
        }
    }

    /// Reads the components of all elements as floats.
    pub fn flat_floats(&self) -> Vec<f32> {
        fn flatten<const N: usize>(accessor: &Accessor<'_>) -> Vec<f32> {
            accessor.floats::<N, [f32; N]>(Elements::First(accessor.count)).into_flattened()
        }
        match self.components {
            1 => flatten::<1>(self),
            2 => flatten::<2>(self),
            3 => flatten::<3>(self),
            4 => flatten::<4>(self),
            9 => flatten::<9>(self),
            _ => flatten::<16>(self),
        }
    }

    /// The largest index of this component type: the primitive restart value.
    pub fn restart_index(&self) -> u32 {
        match self.component_type {
            ComponentType::U8 | ComponentType::I8 => u32::from(u8::MAX),
            ComponentType::U16 | ComponentType::I16 => u32::from(u16::MAX),
            ComponentType::U32 | ComponentType::F32 => u32::MAX,
        }
    }

    fn decode<const N: usize, const S: usize, X: Copy + Default, T: From<[X; N]>>(
        &self,
        elements: Elements<'_>,
        component: impl Fn([u8; S]) -> X,
    ) -> Vec<T> {
        let decode = |bytes: &[u8]| {
            let mut out = [X::default(); N];
            for (x, bytes) in out.iter_mut().zip(bytes.chunks_exact(S)) {
                *x = component(bytes.try_into().unwrap_or([0; S]));
            }
            T::from(out)
        };
        match elements {
            Elements::First(n) => {
                let mut all: Vec<T> = (0..n).map(|i| decode(self.base_element(i))).collect();
                for &(index, position) in self.sparse.iter().flat_map(|s| &s.indices) {
                    if let (Some(x), Some(sparse)) = (all.get_mut(index as usize), &self.sparse) {
                        *x = decode(sparse.value(position, self.element_size));
                    }
                }
                all
            }
            Elements::At(indices) => indices.iter().map(|&i| decode(self.element(i))).collect(),
        }
    }

    fn base_element(&self, index: usize) -> &[u8] {
        let bytes = self.base.as_ref().and_then(|base| {
            let start = index.checked_mul(base.stride)?;
            base.bytes.get(start..start.checked_add(self.element_size)?)
        });
        bytes.unwrap_or(&ZEROS[..self.element_size])
    }

    fn element(&self, index: u32) -> &[u8] {
        let sparse = self.sparse.as_ref().and_then(|sparse| {
            let entry = sparse.indices.binary_search_by_key(&index, |&(i, _)| i).ok()?;
            Some(sparse.value(sparse.indices[entry].1, self.element_size))
        });
        sparse.unwrap_or_else(|| self.base_element(index as usize))
    }
}

impl<'d> Strided<'d> {
    /// Checks that `count` elements lie in the accessor's buffer view. Returns their number, which is less only in
    /// a truncated file.
    fn open(
        doc: &'d Document<'_>,
        json: &::gltf::json::Accessor,
        count: usize,
        element_size: usize,
        accessor: &str,
        warnings: &mut Warnings,
    ) -> Result<(Strided<'d>, usize), LoadError> {
        let index = json.buffer_view.map_or(0, |view| view.value());
        let view = doc.buffer_view(index)?;
        let stride = match view.stride {
            Some(s) if s >= element_size => s,
            None | Some(0) => element_size,
            Some(s) => {
                let message = format!(
                    "{s} is less than the element size of {element_size} bytes; used tightly packed elements"
                );
                warnings.add(format_args!("bufferViews[{index}].byteStride"), message);
                element_size
            }
        };
        let offset = json.byte_offset.map_or(0, |o| o.0);
        let bytes = usize::try_from(offset).ok().and_then(|o| view.bytes.get(o..));
        if doc.is_truncated() {
            let bytes = bytes.unwrap_or_default();
            let complete = bytes.len().checked_sub(element_size).map_or(0, |rest| rest / stride + 1);
            if complete < count {
                let message = format!("has {complete} of {count} elements; ignored what needs the others");
                warnings.add(accessor, message);
            }
            return Ok((Strided { bytes, stride }, complete.min(count)));
        }
        let needed =
            count.checked_sub(1).map_or(Some(0), |n| n.checked_mul(stride)?.checked_add(element_size));
        let bytes = bytes.filter(|b| needed.is_some_and(|n| n <= b.len()));
        bytes.map(|bytes| (Strided { bytes, stride }, count)).ok_or_else(|| {
            let has = view.bytes.len();
            let message = format!(
                "{count} elements of {element_size} bytes at stride {stride} from byte {offset} exceed \
                 bufferViews[{index}], which has {has} bytes"
            );
            LoadError::invalid(accessor, message)
        })
    }
}

impl<'d> Sparse<'d> {
    fn open(
        doc: &'d Document<'_>,
        json: &::gltf::json::accessor::sparse::Sparse,
        count: usize,
        element_size: usize,
        accessor: &str,
        warnings: &mut Warnings,
    ) -> Result<Sparse<'d>, LoadError> {
        let location = |field: &str| format!("{accessor}.sparse{field}");
        let Checked::Valid(component_type) = json.indices.component_type else {
            let message = "invalid component type; expected 5121, 5123 or 5125";
            return Err(LoadError::invalid(location(".indices.componentType"), message));
        };
        let index_size = component_type.0.size();
        let slice = |view: usize, offset: u64, size: usize, field: &str| {
            let bytes = doc.buffer_view(view)?.bytes;
            let tail = usize::try_from(offset).ok().and_then(|o| bytes.get(o..));
            let length = usize::try_from(json.count.0).ok().and_then(|n| n.checked_mul(size));
            length.and_then(|n| tail.and_then(|t| t.get(..n))).ok_or_else(|| {
                let message = format!("{} elements exceed bufferViews[{view}]", json.count.0);
                LoadError::invalid(location(field), message)
            })
        };
        let indices =
            slice(json.indices.buffer_view.value(), json.indices.byte_offset.0, index_size, ".indices")?;
        let values =
            slice(json.values.buffer_view.value(), json.values.byte_offset.0, element_size, ".values")?;
        let number = |b: &[u8]| b.iter().rev().fold(0u32, |n, &b| n << 8 | u32::from(b));
        let mut indices: Vec<(u32, u32)> = indices.chunks_exact(index_size).map(number).zip(0..).collect();
        if let Some((at, (index, _))) = indices.iter().enumerate().find(|(_, (i, _))| *i as usize >= count) {
            let message = format!("element {at} is {index}, but the accessor has {count} elements");
            return Err(LoadError::invalid(location(".indices"), message));
        }
        if !indices.is_sorted_by(|a, b| a.0 < b.0) {
            warnings.add(location(".indices"), "indices do not ascend; used the last value of each index");
            indices.sort_by_key(|&(index, position)| (index, std::cmp::Reverse(position)));
            indices.dedup_by_key(|&mut (index, _)| index);
        }
        Ok(Sparse { indices, values })
    }

    fn value(&self, position: u32, element_size: usize) -> &[u8] {
        let start = (position as usize).saturating_mul(element_size);
        self.values.get(start..start.saturating_add(element_size)).unwrap_or(&ZEROS[..element_size])
    }
}

/// Bytes of an element. Columns of matrices are aligned to four bytes.
fn element_size(element_type: Type, component_type: ComponentType) -> usize {
    let size = component_type.size();
    match element_type {
        Type::Mat2 => 2 * (2 * size).next_multiple_of(4),
        Type::Mat3 => 3 * (3 * size).next_multiple_of(4),
        other => other.multiplicity() * size,
    }
}
