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
        format!("<h2>{title}</h2>\n<div class=\"wide\"><table>{head}{rows}</table></div>\n")
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

    /// A table environment in LaTeX. It needs the package booktabs, and an engine that reads UTF-8.
    pub fn to_latex(&self) -> String {
        let row = |cells: &[String]| {
            let cells: Vec<String> = cells.iter().map(|cell| escape_latex(cell)).collect();
            format!("{} \\\\\n", cells.join(" & "))
        };
        let columns = format!("l{}", "r".repeat(self.head.len().saturating_sub(1)));
        let rows: String = self.rows.iter().map(|cells| row(cells)).collect();
        let (title, head) = (escape_latex(&self.title), row(&self.head));
        format!(
            "\\begin{{table}}\n\\caption{{{title}}}\n\\begin{{tabular}}{{{columns}}}\n\\toprule\n{head}\\midrule\n\
             {rows}\\bottomrule\n\\end{{tabular}}\n\\end{{table}}\n"
        )
    }
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

/// Escapes the special characters of LaTeX.
fn escape_latex(text: &str) -> String {
    let mut out = String::new();
    for c in text.chars() {
        match c {
            '&' | '%' | '$' | '#' | '_' | '{' | '}' => out.extend(['\\', c]),
            '\\' => out.push_str("\\textbackslash{}"),
            '~' => out.push_str("\\textasciitilde{}"),
            '^' => out.push_str("\\textasciicircum{}"),
            '<' => out.push_str("\\textless{}"),
            '>' => out.push_str("\\textgreater{}"),
            '–' => out.push_str("--"),
            'µ' => out.push_str("\\textmu{}"),
            '×' => out.push_str("$\\times$"),
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
        let latex = table.to_latex();
        assert!(latex.contains("\\caption{a\\_b \\& \\textless{}c\\textgreater{}}"), "{latex}");
        assert!(
            latex.contains(
                "1|2  & 50 \\% \\textbackslash{} \\textmu{}s -- \\textasciicircum{}\\textasciitilde{} \\\\\n"
            ),
            "{latex}"
        );
        assert!(latex.contains("\\begin{tabular}{lr}"));
        assert!(table.to_html().contains("<h2>a_b &amp; &lt;c&gt;</h2>"));
    }
}
