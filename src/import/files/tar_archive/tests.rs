use tar::Builder;

use super::*;

/// An archive of files with their contents.
fn archive(files: &[(&str, &[u8])]) -> Vec<u8> {
    let mut builder = Builder::new(Vec::new());
    for (name, bytes) in files {
        let mut header = Header::new_gnu();
        header.set_size(bytes.len() as u64);
        header.set_mode(0o644);
        builder.append_data(&mut header, name, *bytes).unwrap();
    }
    builder.into_inner().unwrap()
}

/// A header that says anything.
fn raw_header(name: &[u8], kind: EntryType, size: u64) -> Vec<u8> {
    let mut header = Header::new_gnu();
    header.as_old_mut().name[..name.len()].copy_from_slice(name);
    header.set_entry_type(kind);
    header.set_size(size);
    header.set_cksum();
    header.as_bytes().to_vec()
}

fn open(bytes: &[u8]) -> io::Result<(tempfile::TempDir, TarArchive)> {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.tar");
    std::fs::write(&path, bytes).unwrap();
    let archive = TarArchive::open(&path)?;
    Ok((dir, archive))
}

fn padded(mut bytes: Vec<u8>) -> Vec<u8> {
    bytes.resize(bytes.len().next_multiple_of(512), 0);
    bytes
}

#[test]
fn members_are_found_by_name_and_listed_in_order() {
    let long = format!("{}z.obj", "deep/".repeat(60));
    let files: &[(&str, &[u8])] = &[
        ("z.glb", b"last"),
        ("a/one.obj", b"1"),
        ("a/two.mtl", &[7; 3000]),
        (&long, b"long"),
        ("a/b/c.png", b""),
    ];
    let (_dir, archive) = open(&archive(files)).unwrap();
    assert_eq!(archive.names().collect::<Vec<_>>(), files.iter().map(|(name, _)| *name).collect::<Vec<_>>());
    for (name, bytes) in files {
        assert_eq!(archive.read(name, 1 << 20).unwrap(), *bytes, "{name}");
    }
    assert_eq!(archive.entries("a"), ["b", "one.obj", "two.mtl"]);
    assert_eq!(archive.entries(""), ["a", "deep", "z.glb"]);
    assert!(archive.has_folder("a/b") && !archive.has_folder("a/c") && !archive.has_file("a"));
    assert_eq!(archive.read("a/two.mtl", 2999).unwrap_err().kind(), io::ErrorKind::FileTooLarge);
    assert_eq!(archive.read("b", 9).unwrap_err().kind(), io::ErrorKind::NotFound);
}

#[test]
fn the_last_of_several_members_counts() {
    let (_dir, archive) = open(&archive(&[("./a.obj", b"old"), ("b.obj", b"b"), ("a.obj", b"new")])).unwrap();
    assert_eq!(archive.names().collect::<Vec<_>>(), ["b.obj", "a.obj"]);
    assert_eq!(archive.read("a.obj", 9).unwrap(), b"new");
}

#[test]
fn pax_headers_give_names_and_sizes() {
    let record = |key: &str, value: &str| {
        let body = format!(" {key}={value}\n");
        let length = body.len() + 2;
        format!("{length}{body}")
    };
    let text = record("path", "é/long name.obj") + &record("size", "3") + "garbage";
    let mut bytes = raw_header(b"pax", EntryType::XHeader, text.len() as u64);
    bytes.extend(text.as_bytes());
    let mut bytes = padded(bytes);
    bytes.extend(raw_header(b"short", EntryType::Regular, 0));
    bytes.extend(b"abc");
    let mut bytes = padded(bytes);
    bytes.extend(archive(&[("next.obj", b"n")]));
    let (_dir, archive) = open(&bytes).unwrap();
    assert_eq!(archive.names().collect::<Vec<_>>(), ["é/long name.obj", "next.obj"]);
    assert_eq!(archive.read("é/long name.obj", 9).unwrap(), b"abc");
}

/// Names that lead out, links, folders, devices and sparse files do not exist.
#[test]
fn hostile_members_do_not_exist() {
    let mut bytes = Vec::new();
    for name in [&b"../up.obj"[..], b"/abs.obj", b"a/../../up.obj", b"..", b"bad\xff.obj", b""] {
        bytes.extend(raw_header(name, EntryType::Regular, 0));
    }
    for kind in [EntryType::Symlink, EntryType::Link, EntryType::Directory, EntryType::Char, EntryType::Fifo]
    {
        bytes.extend(raw_header(b"special.obj", kind, 0));
    }
    bytes.extend(raw_header(b"sparse.obj", EntryType::GNUSparse, 0));
    let sparse = "22 GNU.sparse.major=1\n";
    bytes.extend(raw_header(b"pax", EntryType::XHeader, sparse.len() as u64));
    bytes.extend(sparse.as_bytes());
    let mut bytes = padded(bytes);
    bytes.extend(raw_header(b"sparse.obj", EntryType::Regular, 0));
    bytes.extend(raw_header(b"a/./b/../good.obj", EntryType::Regular, 0));
    bytes.extend(archive(&[]));
    let (_dir, archive) = open(&bytes).unwrap();
    assert_eq!(archive.names().collect::<Vec<_>>(), ["a/good.obj"]);
}

#[test]
fn malformed_archives_are_errors() {
    let good = archive(&[("a.obj", &[1; 600])]);
    let mut wrong_sum = good.clone();
    wrong_sum[0] = b'b';
    let text = b"v 0 0 0\n".repeat(100);
    let huge = |size: u64| raw_header(b"a.obj", EntryType::Regular, size);
    let extension = |kind, size: u64| {
        let mut bytes = raw_header(b"x", kind, size);
        bytes.resize(512 + size.min(3 << 20) as usize, b'x');
        bytes
    };
    let mut pax_size = raw_header(b"pax", EntryType::XHeader, 29);
    pax_size.extend(b"29 size=18446744073709551615\n");
    let mut pax_size = padded(pax_size);
    pax_size.extend(raw_header(b"a.obj", EntryType::Regular, 0));
    for (bytes, message) in [
        (&wrong_sum, "checksum"),
        (&good[..300].to_vec(), "inside a header"),
        (&good[..900].to_vec(), "beyond its end"),
        (&text, "malformed"),
        (&huge(1 << 40), "beyond its end"),
        (&huge(u64::MAX >> 1), "beyond its end"),
        (&extension(EntryType::GNULongName, 2 << 20), "too long"),
        (&extension(EntryType::XHeader, 2 << 20), "too long"),
        (&pax_size, "beyond its end"),
    ] {
        let error = open(bytes).err().unwrap_or_else(|| panic!("{message}")).to_string();
        assert!(error.contains(message), "{error}, not {message}");
    }
    // An archive may have no end mark, and an empty one is one.
    assert_eq!(open(&good[..512 + 1024]).unwrap().1.names().count(), 1);
    assert_eq!(open(&[]).unwrap().1.names().count(), 0);
}

#[test]
fn paths_lead_into_archives() {
    let (dir, _) = open(&archive(&[("a/b.obj", b"x")])).unwrap();
    let file = dir.path().join("a.tar");
    let inside = |name: &str| ArchivePath::of(&file.join(name));
    let found = inside("a/b.obj").unwrap().unwrap();
    assert_eq!((found.name.as_str(), found.read(9).unwrap()), ("a/b.obj", b"x".to_vec()));
    assert_eq!(inside("a/../a/./b.obj").unwrap().unwrap().name, "a/b.obj");
    assert!(inside("../b.obj").unwrap().is_err());
    assert!(ArchivePath::of(&file).is_none() && ArchivePath::of(&dir.path().join("x.tar/b.obj")).is_none());
}
