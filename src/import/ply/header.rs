//! The header of a PLY file: encoding, elements with their properties, and comments.

use crate::error::LoadError;
use crate::files::escape::printable;

/// Largest number of lines of a header.
const MAX_LINES: usize = 10_000;
/// Largest number of elements, and of properties of all elements.
const MAX_DEFINITIONS: usize = 1000;

/// The encoding of the values after the header.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Encoding {
    Ascii,
    LittleEndian,
    BigEndian,
}

/// The type of a number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Type {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl Type {
    fn by_name(name: &str) -> Option<Type> {
        Some(match name {
            "char" | "int8" => Type::I8,
            "uchar" | "uint8" => Type::U8,
            "short" | "int16" => Type::I16,
            "ushort" | "uint16" => Type::U16,
            "int" | "int32" => Type::I32,
            "uint" | "uint32" => Type::U32,
            "float" | "float32" => Type::F32,
            "double" | "float64" => Type::F64,
            _ => return None,
        })
    }

    /// Returns the number of bytes of a value in binary files.
    pub fn size(self) -> usize {
        match self {
            Type::I8 | Type::U8 => 1,
            Type::I16 | Type::U16 => 2,
            Type::I32 | Type::U32 | Type::F32 => 4,
            Type::F64 => 8,
        }
    }

    /// Returns the value of 1 in colours: floats are fractions, integers go up to their maximum.
    pub fn color_scale(self) -> f64 {
        match self {
            Type::F32 | Type::F64 => 1.0,
            Type::U16 => 65_535.0,
            Type::I8 | Type::U8 | Type::I16 | Type::I32 | Type::U32 => 255.0,
        }
    }
}

/// One value for each row, or a list with its length before it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    Scalar(Type),
    List { length: Type, item: Type },
}

/// A column of an element.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Property {
    pub name: String,
    pub kind: Kind,
}

/// A table: vertices, faces or others.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Element {
    pub name: String,
    pub rows: u64,
    pub properties: Vec<Property>,
}

impl Header {
    /// Returns the first element of a name.
    pub fn element(&self, name: &str) -> Option<&Element> {
        self.elements.iter().find(|element| element.name == name)
    }
}

impl Element {
    /// Returns true if a property has one of `names`.
    pub fn has(&self, names: &[&str]) -> bool {
        self.properties.iter().any(|property| names.contains(&property.name.as_str()))
    }

    /// Returns the smallest number of bytes of a row.
    pub fn min_row_bytes(&self, encoding: Encoding) -> usize {
        let bytes = |property: &Property| match (encoding, property.kind) {
            // A digit and a separator.
            (Encoding::Ascii, _) => 2,
            (_, Kind::Scalar(kind) | Kind::List { length: kind, .. }) => kind.size(),
        };
        self.properties.iter().map(bytes).sum::<usize>().max(1)
    }
}

/// A header.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Header {
    pub encoding: Encoding,
    pub elements: Vec<Element>,
    /// The texts of comments and `obj_info` lines.
    pub comments: Vec<String>,
    /// Number of bytes before the values.
    pub bytes: usize,
}

/// Parses the header at the start of a file.
pub(super) fn parse(file: &[u8]) -> Result<Header, LoadError> {
    let mut encoding = None;
    let (mut elements, mut comments): (Vec<Element>, Vec<String>) = (Vec::new(), Vec::new());
    let (mut at, mut definitions) = (0, 0);
    for number in 1..=MAX_LINES {
        let wrong = |message: String| LoadError::parse(format!("PLY header, line {number}"), message);
        let (line, next) = next_line(file, at).ok_or_else(|| wrong("the header has no end_header".into()))?;
        at = next;
        let text = String::from_utf8_lossy(line);
        let mut words = text.split_ascii_whitespace();
        let keyword = words.next().unwrap_or_default();
        let rest: Vec<&str> = words.collect();
        definitions += usize::from(matches!(keyword, "element" | "property"));
        if definitions > MAX_DEFINITIONS {
            return Err(wrong(format!("more than {MAX_DEFINITIONS} elements and properties")));
        }
        let malformed = || wrong(format!("'{}' is malformed", printable(text.trim())));
        match keyword {
            "ply" if number == 1 => {}
            "format" => encoding = Some(encoding_by_name(&rest).ok_or_else(malformed)?),
            "comment" | "obj_info" => comments.push(rest.join(" ")),
            "element" => {
                let [name, rows] = rest[..] else { return Err(malformed()) };
                let rows = rows.parse().map_err(|_| malformed())?;
                elements.push(Element { name: name.to_string(), rows, properties: Vec::new() });
            }
            "property" => {
                let property = property(&rest).ok_or_else(malformed)?;
                elements.last_mut().ok_or_else(malformed)?.properties.push(property);
            }
            "end_header" => {
                let encoding = encoding.ok_or_else(|| wrong("the header names no format".into()))?;
                return Ok(Header { encoding, elements, comments, bytes: at });
            }
            "" => {}
            _ => return Err(malformed()),
        }
    }
    Err(LoadError::parse("PLY header", format!("more than {MAX_LINES} lines")))
}

fn encoding_by_name(words: &[&str]) -> Option<Encoding> {
    match words {
        ["ascii", ..] => Some(Encoding::Ascii),
        ["binary_little_endian", ..] => Some(Encoding::LittleEndian),
        ["binary_big_endian", ..] => Some(Encoding::BigEndian),
        _ => None,
    }
}

fn property(words: &[&str]) -> Option<Property> {
    let (kind, name) = match *words {
        ["list", length, item, name] => {
            (Kind::List { length: Type::by_name(length)?, item: Type::by_name(item)? }, name)
        }
        [kind, name] => (Kind::Scalar(Type::by_name(kind)?), name),
        _ => return None,
    };
    Some(Property { name: name.to_string(), kind })
}

/// Returns the line at `start` and the place after its end: a line feed, a carriage return or both. A carriage return after
/// `end_header` ends the header alone if the first line ended so, as the next byte is data.
fn next_line(file: &[u8], start: usize) -> Option<(&[u8], usize)> {
    let rest = file.get(start..)?;
    let length = rest.iter().position(|byte| matches!(byte, b'\n' | b'\r'))?;
    let uses_pairs =
        file.iter().position(|byte| *byte == b'\r').and_then(|cr| file.get(cr + 1)) == Some(&b'\n');
    let is_pair = uses_pairs && rest[length] == b'\r' && rest.get(length + 1) == Some(&b'\n');
    Some((&rest[..length], start + length + if is_pair { 2 } else { 1 }))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn headers_have_elements_and_comments_with_any_line_end() {
        let text = "ply\nformat ascii 1.0\ncomment made by hand\nelement vertex 3\nproperty float x\nelement face 1\n\
                    property list uchar int vertex_indices\nend_header\n";
        for end in ["\n", "\r\n", "\r"] {
            let file = text.replace('\n', end) + "\n1";
            let header = parse(file.as_bytes()).unwrap();
            assert_eq!((header.encoding, header.bytes), (Encoding::Ascii, file.len() - 2), "{end:?}");
            assert_eq!(header.comments, ["made by hand"]);
            let [vertex, face] = &header.elements[..] else { panic!("{header:?}") };
            assert!(vertex.has(&["x"]) && vertex.rows == 3);
            assert_eq!(face.properties[0].kind, Kind::List { length: Type::U8, item: Type::I32 });
        }
    }

    #[test]
    fn malformed_headers_name_the_line() {
        for (text, message) in [
            ("ply\nformat ascii 1.0\n", "line 3: the header has no end_header"),
            ("ply\nend_header\n", "line 2: the header names no format"),
            ("ply\nformat text 1.0\nend_header\n", "line 2: 'format text 1.0' is malformed"),
            ("ply\nproperty float x\n", "line 2: 'property float x' is malformed"),
            ("ply\nelement vertex -1\n", "line 2: 'element vertex -1' is malformed"),
            ("ply\nelement vertex 1\nproperty half x\n", "line 3: 'property half x' is malformed"),
            ("ply\nhello\n", "line 2: 'hello' is malformed"),
        ] {
            assert_eq!(parse(text.as_bytes()).unwrap_err().to_string(), format!("PLY header, {message}"));
        }
        let many = format!("ply\nformat ascii 1.0\n{}", "element a 1\n".repeat(MAX_DEFINITIONS + 1));
        assert!(parse(many.as_bytes()).unwrap_err().to_string().contains("more than 1000"));
    }
}
