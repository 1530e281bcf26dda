//! Scenes inside tar files, which are read in place.
//!
//! A path like `objects.tar/a/chair.obj` names a member. The headers of an archive are read once; its members stay on the
//! disk. Old tar, ustar, pax and GNU archives are read, without compression. Members that are no files, that are sparse, or
//! whose names lead out of the archive do not exist.

use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};
use std::path::{Component, Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::SystemTime;

use tar::{EntryType, Header};

/// Bytes of a block.
const BLOCK: u64 = 512;
/// Most members of an archive.
const MAX_MEMBERS: usize = 16 << 20;
/// Most bytes of all names.
const MAX_NAME_BYTES: usize = 1 << 30;
/// Most bytes of the name or the extended header of a member.
const MAX_EXTENSION: u64 = 1 << 20;

/// The files in an archive.
#[derive(Debug)]
pub(crate) struct TarArchive {
    path: PathBuf,
    /// Names of all members, one after the other.
    names: Vec<u8>,
    /// Members in the order of their names; of several with one name, the last.
    members: Vec<Member>,
    /// Members in the order of the archive, as indices into `members`.
    order: Vec<u32>,
}

#[derive(Clone, Copy, Debug)]
struct Member {
    name_start: usize,
    name_end: usize,
    offset: u64,
    size: u64,
}

/// A member of an archive, or a path that leads into one.
#[derive(Clone, Debug)]
pub(crate) struct ArchivePath {
    pub archive: Arc<TarArchive>,
    /// The name inside, with slashes; empty for the root.
    pub name: String,
}

/// The archive that was used last, with its size and time of modification.
type CachedArchive = (PathBuf, u64, Option<SystemTime>, Arc<TarArchive>);
static LAST: Mutex<Option<CachedArchive>> = Mutex::new(None);

impl ArchivePath {
    /// Splits a path at the tar file that it leads into. `None` if it leads into none.
    pub fn of(path: &Path) -> Option<io::Result<ArchivePath>> {
        let file =
            path.ancestors().skip(1).find(|ancestor| has_tar_extension(ancestor) && ancestor.is_file())?;
        let inside = path.strip_prefix(file).ok()?;
        let name = normalized(&inside.to_string_lossy().replace('\\', "/"));
        let open =
            || Ok(ArchivePath { archive: TarArchive::open_cached(file)?, name: name.ok_or_else(no_member)? });
        Some(open())
    }

    /// The folder that it is in; `None` for the root.
    pub fn parent(self) -> Option<ArchivePath> {
        let end = if self.name.is_empty() { return None } else { self.name.rfind('/').unwrap_or(0) };
        Some(ArchivePath { name: self.name[..end].to_string(), ..self })
    }

    /// Reads it, if it has at most `limit` bytes.
    pub fn read(&self, limit: u64) -> io::Result<Vec<u8>> {
        self.archive.read(&self.name, limit)
    }
}

/// Returns the paths of the scenes in a tar file, in its order: those of its files that have the extension of a scene.
///
/// # Errors
/// The file cannot be read or is no tar file.
pub fn scenes_in_tar(path: &Path, is_scene: impl Fn(&Path) -> bool) -> io::Result<Vec<PathBuf>> {
    let archive = TarArchive::open_cached(path)?;
    Ok(archive.names().map(Path::new).filter(|name| is_scene(name)).map(|name| path.join(name)).collect())
}

/// Returns what changes when a file is replaced: its size, its time of modification, and its place in the archive that
/// the path leads into. `None` if it does not exist.
pub fn file_version(path: &Path) -> Option<(u64, Option<SystemTime>, u64)> {
    let of_file = |path: &Path| {
        let metadata = std::fs::metadata(path).ok()?;
        Some((metadata.len(), metadata.modified().ok()))
    };
    let Some(inside) = ArchivePath::of(path) else {
        let (bytes, modified) = of_file(path)?;
        return Some((bytes, modified, 0));
    };
    let ArchivePath { archive, name } = inside.ok()?;
    let (offset, bytes) = archive.place(&name)?;
    let (_, modified) = of_file(archive.path())?;
    Some((bytes, modified, offset))
}

/// Returns true for a path that leads into a tar file.
pub fn is_in_archive(path: &Path) -> bool {
    ArchivePath::of(path).is_some()
}

/// Returns true for the names of tar files.
pub fn has_tar_extension(path: &Path) -> bool {
    path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("tar"))
}

fn no_member() -> io::Error {
    io::Error::new(io::ErrorKind::NotFound, "no such file in the archive")
}

fn invalid(what: &str) -> io::Error {
    io::Error::new(io::ErrorKind::InvalidData, format!("the tar file is malformed: {what}"))
}

/// A name without `.` and empty parts. `None` if it leads out of the archive.
fn normalized(name: &str) -> Option<String> {
    let mut parts = Vec::new();
    for part in Path::new(name).components() {
        match part {
            Component::Normal(part) => parts.push(part.to_str()?),
            Component::CurDir => {}
            Component::ParentDir => drop(parts.pop()?),
            Component::RootDir | Component::Prefix(_) => return None,
        }
    }
    Some(parts.join("/"))
}

impl TarArchive {
    /// Opens an archive, or returns the one that was used last if that is unchanged.
    pub fn open_cached(path: &Path) -> io::Result<Arc<TarArchive>> {
        let metadata = std::fs::metadata(path)?;
        let version = (metadata.len(), metadata.modified().ok());
        let mut last = LAST.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((cached, bytes, modified, archive)) = &*last
            && cached == path
            && (*bytes, *modified) == version
        {
            return Ok(archive.clone());
        }
        let archive = Arc::new(TarArchive::open(path)?);
        *last = Some((path.to_path_buf(), version.0, version.1, archive.clone()));
        Ok(archive)
    }

    /// Reads all headers.
    ///
    /// # Errors
    /// The file cannot be read, is no tar file, is truncated, or exceeds a limit.
    pub fn open(path: &Path) -> io::Result<TarArchive> {
        let mut file = io::BufReader::new(File::open(path)?);
        let length = file.get_ref().metadata()?.len();
        let mut archive = TarArchive {
            path: path.to_path_buf(),
            names: Vec::new(),
            members: Vec::new(),
            order: Vec::new(),
        };
        let mut position = 0;
        let mut extended = Extended::default();
        let mut block = [0; BLOCK as usize];
        while position < length {
            file.read_exact(&mut block).map_err(|_| invalid("it ends inside a header"))?;
            position += BLOCK;
            if block.iter().all(|&b| b == 0) {
                break;
            }
            let header = Header::from_byte_slice(&block);
            check_sum(header, &block)?;
            let stored = header.entry_size().map_err(|_| invalid("a size is no number"))?;
            let kind = header.entry_type();
            let is_extension = matches!(
                kind,
                EntryType::GNULongName
                    | EntryType::GNULongLink
                    | EntryType::XHeader
                    | EntryType::XGlobalHeader
            );
            let size = if is_extension { stored } else { extended.size.unwrap_or(stored) };
            let padded = size.checked_next_multiple_of(BLOCK).and_then(|padded| position.checked_add(padded));
            let end = padded.filter(|_| position.checked_add(size).is_some_and(|end| end <= length));
            let end = end.ok_or_else(|| invalid("a file reaches beyond its end"))?;
            if is_extension {
                if size > MAX_EXTENSION {
                    return Err(invalid("an extended header is too long"));
                }
                let mut bytes = vec![0; size as usize];
                file.read_exact(&mut bytes)?;
                extended.add(kind, &bytes);
                skip(&mut file, end - position - size)?;
            } else {
                let Extended { name, is_sparse, .. } = std::mem::take(&mut extended);
                let name = name.unwrap_or_else(|| header.path_bytes().into_owned());
                let is_file = matches!(kind, EntryType::Regular | EntryType::Continuous) && !is_sparse;
                if is_file && !name.ends_with(b"/") {
                    archive.add(&name, position, size)?;
                }
                skip(&mut file, end - position)?;
            }
            position = end;
        }
        archive.sort();
        Ok(archive)
    }

    fn add(&mut self, name: &[u8], offset: u64, size: u64) -> io::Result<()> {
        // Names that are not UTF-8 cannot be referred to.
        let Some(name) = std::str::from_utf8(name).ok().and_then(normalized).filter(|name| !name.is_empty())
        else {
            return Ok(());
        };
        if self.members.len() >= MAX_MEMBERS || self.names.len() + name.len() > MAX_NAME_BYTES {
            return Err(invalid("it has too many members"));
        }
        let name_start = self.names.len();
        self.names.extend_from_slice(name.as_bytes());
        self.members.push(Member { name_start, name_end: self.names.len(), offset, size });
        Ok(())
    }

    /// Sorts the members, and removes those that a later one replaces.
    fn sort(&mut self) {
        let names = &self.names;
        let name = |member: &Member| &names[member.name_start..member.name_end];
        self.members.sort_by(|a, b| name(a).cmp(name(b)).then(b.offset.cmp(&a.offset)));
        self.members.dedup_by(|later, first| name(later) == name(first));
        let mut order: Vec<u32> = (0..self.members.len() as u32).collect();
        order.sort_by_key(|&i| self.members[i as usize].offset);
        self.order = order;
    }

    fn name(&self, member: &Member) -> &str {
        // Only UTF-8 is stored.
        std::str::from_utf8(&self.names[member.name_start..member.name_end]).unwrap_or_default()
    }

    /// The names of all files, in the order of the archive.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.order.iter().map(|&i| self.name(&self.members[i as usize]))
    }

    fn find(&self, name: &str) -> Option<&Member> {
        let found = self.members.binary_search_by(|member| self.name(member).cmp(name)).ok()?;
        self.members.get(found)
    }

    /// Returns true for a file of this name.
    pub fn has_file(&self, name: &str) -> bool {
        self.find(name).is_some()
    }

    /// Returns true if there are files below this name.
    pub fn has_folder(&self, name: &str) -> bool {
        name.is_empty() || self.below(name).next().is_some()
    }

    /// The members below a folder, in the order of their names.
    fn below<'a>(&'a self, folder: &str) -> impl Iterator<Item = &'a str> + use<'a> {
        let prefix = if folder.is_empty() { String::new() } else { format!("{folder}/") };
        let first = self.members.partition_point(|member| self.name(member) < prefix.as_str());
        let names = self.members[first..].iter().map(|member| self.name(member));
        names.map_while(move |name| name.strip_prefix(&prefix))
    }

    /// The names of files and folders in a folder.
    pub fn entries(&self, folder: &str) -> Vec<String> {
        let mut entries: Vec<String> =
            self.below(folder).map(|name| name.split('/').next().unwrap_or(name).to_string()).collect();
        entries.dedup();
        entries
    }

    /// The archive's own path.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The name inside of a path that leads into the archive.
    pub fn name_of(&self, path: &Path) -> Option<String> {
        normalized(&path.strip_prefix(&self.path).ok()?.to_string_lossy())
    }

    /// The offset and size of a file.
    pub fn place(&self, name: &str) -> Option<(u64, u64)> {
        self.find(name).map(|member| (member.offset, member.size))
    }

    /// Reads a file of at most `limit` bytes.
    ///
    /// # Errors
    /// The archive has no such file, it is too large, or cannot be read.
    pub fn read(&self, name: &str, limit: u64) -> io::Result<Vec<u8>> {
        let Member { offset, size, .. } = *self.find(name).ok_or_else(no_member)?;
        if size > limit {
            let text = format!("larger than the limit of {limit} bytes");
            return Err(io::Error::new(io::ErrorKind::FileTooLarge, text));
        }
        let mut file = File::open(&self.path)?;
        file.seek(SeekFrom::Start(offset))?;
        let mut bytes = Vec::with_capacity(size as usize);
        file.take(size).read_to_end(&mut bytes)?;
        let is_complete = bytes.len() as u64 == size;
        if is_complete { Ok(bytes) } else { Err(invalid("it was shortened while it was read")) }
    }
}

/// Values of extended headers for the next member.
#[derive(Debug, Default)]
struct Extended {
    name: Option<Vec<u8>>,
    size: Option<u64>,
    is_sparse: bool,
}

impl Extended {
    fn add(&mut self, kind: EntryType, bytes: &[u8]) {
        match kind {
            EntryType::GNULongName => {
                let end = bytes.iter().position(|&b| b == 0).unwrap_or(bytes.len());
                self.name = Some(bytes[..end].to_vec());
            }
            EntryType::XHeader => {
                for (key, value) in pax_records(bytes) {
                    match key {
                        b"path" => self.name = Some(value.to_vec()),
                        b"size" => {
                            self.size = std::str::from_utf8(value).ok().and_then(|text| text.parse().ok())
                        }
                        _ if key.starts_with(b"GNU.sparse") => self.is_sparse = true,
                        _ => {}
                    }
                }
            }
            _ => {}
        }
    }
}

/// The records of a pax header: `LENGTH KEY=VALUE\n`, where the length is that of the whole record.
fn pax_records(mut bytes: &[u8]) -> impl Iterator<Item = (&[u8], &[u8])> {
    std::iter::from_fn(move || {
        let space = bytes.iter().position(|&b| b == b' ')?;
        let length: usize = std::str::from_utf8(&bytes[..space]).ok()?.parse().ok()?;
        let record = bytes.get(space + 1..length)?;
        bytes = &bytes[length..];
        let equals = record.iter().position(|&b| b == b'=')?;
        let value = record[equals + 1..].strip_suffix(b"\n").unwrap_or(&record[equals + 1..]);
        Some((&record[..equals], value))
    })
}

/// Checks the sum that a header stores, which text and other files do not have.
fn check_sum(header: &Header, block: &[u8]) -> io::Result<()> {
    let stored = header.cksum().map_err(|_| invalid("it has no checksum"))?;
    let sum: u32 =
        block.iter().enumerate().map(|(i, &b)| if (148..156).contains(&i) { 32 } else { u32::from(b) }).sum();
    if stored == sum { Ok(()) } else { Err(invalid("a checksum is wrong")) }
}

fn skip(file: &mut io::BufReader<File>, bytes: u64) -> io::Result<()> {
    file.seek_relative(i64::try_from(bytes).map_err(|_| invalid("a file is too large"))?)
}

#[cfg(test)]
mod tests;
