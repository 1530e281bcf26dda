//! The version of Blender that wrote a file.

/// A version of Blender. Its glTF add-on has had the same numbers since 3.3.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct BlenderVersion {
    /// Major version.
    pub major: u32,
    /// Minor version.
    pub minor: u32,
}

impl BlenderVersion {
    /// A version from its numbers.
    pub const fn new(major: u32, minor: u32) -> BlenderVersion {
        BlenderVersion { major, minor }
    }

    /// Reads the version from a generator, such as `Khronos glTF Blender I/O v5.2.41`, or from the first comment of an
    /// OBJ or MTL file, such as `Blender 5.1.2 MTL File: 'a.blend'`. `None` if it has none.
    pub fn from_generator(generator: &str) -> Option<BlenderVersion> {
        let (_, after) = generator.split_once("Blender")?;
        // Later words may be the name of a .blend file.
        after.split_whitespace().take(2).find_map(|word| {
            let mut numbers = word.strip_prefix('v').unwrap_or(word).split('.');
            let mut number = || numbers.next()?.parse().ok();
            Some(BlenderVersion::new(number()?, number()?))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn generators_name_the_version() {
        for (generator, version) in [
            ("Khronos glTF Blender I/O v5.2.41", Some((5, 2))),
            ("Khronos glTF Blender I/O v10.0.1-beta", Some((10, 0))),
            ("Blender 5.2.3 LTS", Some((5, 2))),
            ("Blender 5.1.2 MTL File: 'a.blend'", Some((5, 1))),
            ("Blender v2.79 (sub 0) OBJ File: ''", Some((2, 79))),
            ("Blender MTL File: '5.1 kitchen.blend'", None),
            ("Blender", None),
            ("COLLADA2GLTF 5.1", None),
        ] {
            let expected = version.map(|(major, minor)| BlenderVersion { major, minor });
            assert_eq!(BlenderVersion::from_generator(generator), expected, "{generator}");
        }
    }
}
