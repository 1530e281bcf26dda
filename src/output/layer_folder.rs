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
}

impl LayerFolder {
    /// Returns the file of a layer, such as `0001.depth.png`.
    pub fn file(self, image: &Path, layer: &str) -> PathBuf {
        let beside = image.with_extension(format!("{layer}.png"));
        let name = beside.file_name().unwrap_or_default();
        match (self, image.parent()) {
            (LayerFolder::Layers, Some(folder)) => folder.with_file_name("layers").join(name),
            _ => beside,
        }
    }

    /// Returns a layer's path relative to the folder of the image, with `/` between folders.
    pub fn relative(self, file_name: &str) -> String {
        match self {
            LayerFolder::Beside => file_name.to_string(),
            LayerFolder::Layers => format!("../layers/{file_name}"),
        }
    }
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
    }
}
