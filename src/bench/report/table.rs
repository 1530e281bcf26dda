//! Tables as HTML, Markdown, LaTeX and text.

use blinn_output::escape_html;

/// A table with a title. Its first column is aligned to the left.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Table {
    /// The title.
    pub title: String,
    /// The names of the columns.
    pub head: Vec<String>,
    /// The rows, as long as the head.
    pub rows: Vec<Vec<String>>,
}

impl Table {
    /// A heading and a table in HTML.
    pub fn to_html(&self) -> String {
        let row = |tag: &str, cells: &[String]| {
            let cells = cells.iter().map(|cell| format!("<{tag}>{}</{tag}>", escape_html(cell)));
            format!("<tr>{}</tr>\n", cells.collect::<String>())
        };
        let rows: String = self.rows.iter().map(|cells| row("td", cells)).collect();
        let (title, head) = (escape_html(&self.title), row("th", &self.head));
        format!("<h2>{title}</h2>\n<div class=\"scrolls\"><table>{head}{rows}</table></div>\n")
    }

    /// A heading and a table in GitHub's Markdown.
    pub fn to_markdown(&self) -> String {
        let row = |cells: &[String]| {
            let cells: Vec<String> = cells.iter().map(|cell| escape_markdown(cell)).collect();
            format!("| {} |\n", cells.join(" | "))
        };
        let alignment: Vec<&str> =
            (0..self.head.len()).map(|i| if i == 0 { "---" } else { "---:" }).collect();
        let rows: String = self.rows.iter().map(|cells| row(cells)).collect();
        let (title, head) = (escape_markdown(&self.title), row(&self.head));
        format!("## {title}\n\n{head}| {} |\n{rows}", alignment.join(" | "))
    }
}

/// Cells of these texts.
pub(super) fn texts<const N: usize>(cells: [&str; N]) -> Vec<String> {
    cells.map(str::to_string).to_vec()
}

/// Keeps text in its cell: no line breaks, column separators, markup or HTML.
fn escape_markdown(text: &str) -> String {
    let mut out = String::new();
    for c in text.chars() {
        match c {
            '|' | '\\' | '*' | '_' | '`' | '[' | ']' | '#' | '<' | '>' | '&' | '~' => out.extend(['\\', c]),
            c if c.is_control() => out.push(' '),
            c => out.push(c),
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_keep_to_their_cell() {
        let table = Table {
            title: "a_b & <c>".into(),
            head: vec!["x".into(), "y".into()],
            rows: vec![vec!["1|2\n".into(), "50 % \\ µs – ^~".into()]],
        };
        let markdown = table.to_markdown();
        assert_eq!(
            markdown,
            "## a\\_b \\& \\<c\\>\n\n| x | y |\n| --- | ---: |\n| 1\\|2  | 50 % \\\\ µs – ^\\~ |\n"
        );
        assert!(table.to_html().contains("<h2>a_b &amp; &lt;c&gt;</h2>"));
    }
}
