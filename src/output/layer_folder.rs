//! Names of the layers that are files beside an image.

use std::path::{Path, PathBuf};

/// The folder of the layers of an image.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum LayerFolder {
    /// That of the image.
    #[default]
    Beside,
    /// The folder `layers` beside that of the image, where tools take every file of the image's folder as an image.
    Layers,
    /// The folder of the image, which is part of a sample such as `0001.rgb.png`: the name of the sample ends at the first
    /// dot.
    Sample,
}

impl LayerFolder {
    /// Returns the file of a layer, such as `0001.depth.png`.
    pub fn file(self, image: &Path, layer: &str) -> PathBuf {
        let extension = format!("{layer}.png");
        let beside = match self {
            LayerFolder::Sample => sample_file(image, &extension),
            LayerFolder::Beside | LayerFolder::Layers => image.with_extension(extension),
        };
        let name = beside.file_name().unwrap_or_default();
        match (self, image.parent()) {
            (LayerFolder::Layers, Some(folder)) => folder.with_file_name("layers").join(name),
            _ => beside,
        }
    }

    /// Returns a layer's path relative to the folder of the image, with `/` between folders.
    pub fn relative(self, file_name: &str) -> String {
        match self {
            LayerFolder::Beside | LayerFolder::Sample => file_name.to_string(),
            LayerFolder::Layers => format!("../layers/{file_name}"),
        }
    }
}

/// Returns the file of a sample that has `extension`, from another one. The name of a sample ends at the first dot.
pub fn sample_file(file: &Path, extension: &str) -> PathBuf {
    let name = file.file_name().unwrap_or_default().to_string_lossy();
    let key = name.split('.').next().unwrap_or_default();
    file.with_file_name(format!("{key}.{extension}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn layers_have_the_name_of_their_image() {
        let image = Path::new("bop/000001/rgb/000007.png");
        assert_eq!(LayerFolder::Beside.file(image, "depth"), Path::new("bop/000001/rgb/000007.depth.png"));
        assert_eq!(LayerFolder::Layers.file(image, "depth"), Path::new("bop/000001/layers/000007.depth.png"));
        assert_eq!(LayerFolder::Layers.relative("000007.depth.png"), "../layers/000007.depth.png");
        let image = Path::new("000001_000007.rgb.png");
        assert_eq!(LayerFolder::Sample.file(image, "depth"), Path::new("000001_000007.depth.png"));
        assert_eq!(LayerFolder::Sample.relative("000001_000007.depth.png"), "000001_000007.depth.png");
    }
}
