//! The kinds of elements that objects consist of.

/// Kind of the elements of an object.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ElementKind {
    /// Triangles only.
    Triangles,
    /// Points only.
    Points,
    /// Line segments only.
    Lines,
    /// Several of them.
    Mixed,
}

impl ElementKind {
    /// Returns the name of one element.
    pub fn noun(self) -> &'static str {
        match self {
            ElementKind::Triangles => "triangle",
            ElementKind::Points => "point",
            ElementKind::Lines => "line",
            ElementKind::Mixed => "element",
        }
    }

    /// Returns the kind of two kinds together.
    pub(super) fn join(self, other: ElementKind) -> ElementKind {
        if self == other { self } else { ElementKind::Mixed }
    }
}
