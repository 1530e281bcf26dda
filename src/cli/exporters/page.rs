//! docs/reference/exporters.md: the text by hand, then the tables and a section for each exporter.

use super::{Exporter, Format, Quirk};

/// The comment after which the page is written by [`tables_and_sections`].
pub const MARK: &str = "<!-- From here on: written from src/cli/exporters/exporters.toml. -->";

type Column = (&'static str, fn(&Exporter) -> Option<&str>);

const GLTF_COLUMNS: [Column; 11] = [
    ("version", |e| Some(&e.version)),
    ("files", |e| e.files.as_deref()),
    ("unit", |e| e.unit.as_deref()),
    ("up axis", |e| e.up.as_deref()),
    ("colours", |e| e.colors.as_deref()),
    ("default material", |e| e.material.as_deref()),
    ("normals", |e| e.normals.as_deref()),
    ("alpha", |e| e.alpha.as_deref()),
    ("lights", |e| e.lights.as_deref()),
    ("cameras", |e| e.cameras.as_deref()),
    ("surprises", |e| Some(if e.quirks.is_empty() { "-" } else { "yes" })),
];

const OBJ_COLUMNS: [Column; 8] = [
    ("version", |e| Some(&e.version)),
    ("unit", |e| e.unit.as_deref()),
    ("up axis", |e| e.up.as_deref()),
    ("colours", |e| e.colors.as_deref()),
    ("Ka, Ks, Ns, illum", |e| e.material.as_deref()),
    ("normals", |e| e.normals.as_deref()),
    ("opacity", |e| e.alpha.as_deref()),
    ("surprises", |e| Some(if e.quirks.is_empty() { "-" } else { "yes" })),
];

pub fn tables_and_sections(exporters: &[Exporter]) -> String {
    let mut page = String::new();
    for (format, title) in [(Format::Gltf, "glTF"), (Format::Obj, "OBJ and MTL")] {
        let rows: Vec<&Exporter> = exporters.iter().filter(|exporter| exporter.format == format).collect();
        page += &format!("\n## {title}\n\n");
        page += &match format {
            Format::Gltf => table(&rows, &GLTF_COLUMNS),
            Format::Obj => table(&rows, &OBJ_COLUMNS),
        };
        for exporter in rows {
            page += &section(exporter, title);
        }
    }
    page
}

fn table(rows: &[&Exporter], columns: &[Column]) -> String {
    let names = columns.iter().map(|(name, _)| *name).collect::<Vec<_>>().join(" | ");
    let mut table = format!("| exporter | {names} |\n|{}\n", "---|".repeat(columns.len() + 1));
    for exporter in rows {
        let cells = columns.iter().map(|(_, value)| value(exporter).unwrap_or("?"));
        let cells = cells.collect::<Vec<_>>().join(" | ");
        table += &format!("| [{}](#{}) | {cells} |\n", short(&exporter.name), exporter.anchor());
    }
    table
}

/// A name that fits into a column.
fn short(name: &str) -> String {
    let names: Vec<&str> = name.split(", ").collect();
    match names.len() {
        ..=3 => name.replace('*', "\\*"),
        count => format!("{} and {} more", names[..2].join(", "), count - 2),
    }
}

fn section(exporter: &Exporter, title: &str) -> String {
    let name = exporter.name.replace('*', "\\*");
    let mut text = format!("\n<a id=\"{}\"></a>\n\n### {name}: {title}\n\n", exporter.anchor());
    for quirk in &exporter.quirks {
        text += &item(quirk);
    }
    if !exporter.quirks.is_empty() {
        text.push('\n');
    }
    text += &match (&exporter.check, &exporter.unrepeated) {
        (Some(check), _) => format!("Seen with {}:\n\n```bash\n{}\n```\n", exporter.version, check.trim()),
        (None, Some(reason)) => {
            format!("Seen with {}; no command repeats it: {reason}.\n", exporter.version)
        }
        (None, None) => unreachable!("a test checks that each exporter has one of them"),
    };
    text
}

fn item(quirk: &Quirk) -> String {
    let help = quirk.help.iter().map(|help| format!("; what helps: {help}")).collect::<String>();
    format!("- {}. Shown: {}{help}.\n", capitalized(&quirk.fact), quirk.shown)
}

fn capitalized(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map(|first| first.to_uppercase().chain(letters).collect()).unwrap_or_default()
}
