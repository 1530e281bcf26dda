//! Parts that all HTML pages share.

/// The style sheet of all pages, for a `style` element or a file: colours in light and dark mode, text, controls, and
/// the layout of pages that scroll (`class="page"`).
pub const PAGE_STYLE: &str = include_str!("style.css");

#[cfg(test)]
mod tests {
    use super::PAGE_STYLE;

    /// Both colour schemes define the same colours, and the text can end no element.
    #[test]
    fn colors_are_defined_in_both_schemes() {
        let (light, dark) = PAGE_STYLE.split_once("prefers-color-scheme: dark").unwrap();
        let dark = dark.split_once("\n}\n").unwrap().0;
        let names = |text: &str| {
            let parts = text.split(['{', ';', '\n']).map(str::trim);
            let mut names: Vec<String> = parts
                .filter_map(|part| Some(part.strip_prefix("--")?.split_once(':')?.0.to_string()))
                .collect();
            names.sort();
            names
        };
        assert!(names(light).len() > 20);
        assert_eq!(names(light), names(dark));
        assert!(!PAGE_STYLE.contains('<') && !PAGE_STYLE.contains("{{"));
    }
}
