//! The files of the page, inside the program.

use blinn_output::PAGE_STYLE;

/// A file of the page.
pub struct PageFile {
    pub name: &'static str,
    /// Its media type.
    pub kind: &'static str,
    pub text: &'static str,
}

/// Lists files of the folder `page`.
macro_rules! page_files {
    ($($name:literal $kind:ident)*) => {
        &[$(PageFile { name: $name, kind: $kind, text: include_str!(concat!("page/", $name)) }),*]
    };
}

const HTML: &str = "text/html; charset=utf-8";
const CSS: &str = "text/css; charset=utf-8";
const SCRIPT: &str = "text/javascript; charset=utf-8";
const SVG: &str = "image/svg+xml";

/// The style sheet of all pages of the program.
static STYLE: PageFile = PageFile { name: "style.css", kind: CSS, text: PAGE_STYLE };

/// The files of the folder `page`.
static FILES: &[PageFile] = page_files! {
    "index.html" HTML
    "view.css" CSS
    "icon.svg" SVG
    "actions.js" SCRIPT
    "address.js" SCRIPT
    "camera.js" SCRIPT
    "commands.js" SCRIPT
    "connection.js" SCRIPT
    "controls.js" SCRIPT
    "gestures.js" SCRIPT
    "keys.js" SCRIPT
    "main.js" SCRIPT
    "objects.js" SCRIPT
    "picture.js" SCRIPT
    "playback.js" SCRIPT
    "state.js" SCRIPT
    "status.js" SCRIPT
    "vectors.js" SCRIPT
};

/// The file of a name.
pub fn find(name: &str) -> Option<&'static PageFile> {
    FILES.iter().chain([&STYLE]).find(|file| file.name == name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_files_of_the_page_are_served() {
        let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/view/page");
        let mut on_disk: Vec<String> = std::fs::read_dir(folder)
            .unwrap()
            .map(|entry| entry.unwrap().file_name().into_string().unwrap())
            .collect();
        on_disk.sort();
        let mut served: Vec<&str> = FILES.iter().map(|file| file.name).collect();
        served.sort();
        assert_eq!(served, on_disk);
        assert!(find("style.css").is_some());
        assert!(find("../page.rs").is_none() && find("").is_none());
    }
}
