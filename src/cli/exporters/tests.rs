use std::collections::HashSet;
use std::fs;
use std::path::{Path, PathBuf};

use super::*;

fn workspace() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

fn source(format: SourceFormat, generator: &str) -> Source {
    Source { format, generator: generator.into(), ..Source::default() }
}

#[test]
fn the_table_is_complete() {
    let table: Table = toml::from_str(TABLE).unwrap();
    assert!(table.exporter.len() >= 60, "{}", table.exporter.len());
    assert_eq!(EXPORTERS.len(), table.exporter.len());
    let anchors: HashSet<String> = table.exporter.iter().map(Exporter::anchor).collect();
    assert_eq!(anchors.len(), table.exporter.len(), "sections need names of their own");
    for exporter in &table.exporter {
        let name = &exporter.name;
        assert!(exporter.check.is_some() != exporter.unrepeated.is_some(), "{name}: check or unrepeated");
        assert!(exporter.generator.iter().all(|mark| mark.len() > 2), "{name}: too short for a search");
        for quirk in &exporter.quirks {
            let texts = [Some(&quirk.fact), Some(&quirk.shown), quirk.help.as_ref()];
            let is_one_line =
                |text: &&String| !text.is_empty() && !text.contains('\n') && !text.ends_with('.');
            assert!(texts.into_iter().flatten().all(|text| is_one_line(&text)), "{name}: {quirk:?}");
        }
    }
}

/// docs/reference/exporters.md is written from the table; `GOLDEN=update` rewrites it.
#[test]
fn the_reference_page_shows_the_table() {
    let path = workspace().join(PAGE);
    let text = fs::read_to_string(&path).unwrap();
    let (by_hand, _) = text.split_once(page::MARK).expect("a mark after which the tables follow");
    let expected = format!("{by_hand}{}\n{}", page::MARK, page::tables_and_sections(&EXPORTERS));
    if std::env::var_os("GOLDEN").is_some_and(|value| value == "update") {
        fs::write(&path, &expected).unwrap();
    }
    let written = fs::read_to_string(&path).unwrap();
    assert!(written == expected, "rewrite it with GOLDEN=update cargo test -p blinn-cli exporters::");
}

/// Collects the texts that the code compares a generator with: literals in calls such as `generator.contains("…")`,
/// and those beside an `MtlWriter`.
fn compared_texts(folder: &Path, found: &mut Vec<String>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            compared_texts(&path, found);
            continue;
        }
        if path.extension().is_none_or(|extension| extension != "rs") || path.ends_with("tests.rs") {
            continue;
        }
        let code = fs::read_to_string(&path).unwrap();
        let code = code.split("#[cfg(test)]").next().unwrap_or_default();
        for line in code.lines().map(str::trim) {
            for method in ["contains", "starts_with", "ends_with", "split_once"] {
                let call = format!("generator.{method}(\"");
                let calls = line.split(&call).skip(1);
                found.extend(calls.filter_map(|rest| Some(rest.split_once('"')?.0.to_owned())));
            }
            if let Some((text, _)) =
                line.strip_prefix("(\"").and_then(|rest| rest.split_once("\", MtlWriter::"))
            {
                found.push(text.to_owned());
            }
        }
    }
}

#[test]
fn every_program_that_the_code_recognises_is_in_the_table() {
    let mut texts = Vec::new();
    for package in ["import", "scene"] {
        compared_texts(&workspace().join("src").join(package), &mut texts);
    }
    for expected in ["Blender", "JSCAD", "Created by Jmol", "mikedh/trimesh"] {
        assert!(texts.iter().any(|text| text == expected), "{expected} is not found in the code: {texts:?}");
    }
    for text in texts {
        let is_known =
            [SourceFormat::Gltf, SourceFormat::Obj].map(|format| candidates(&source(format, &text)));
        let is_spelled_small = text == "blender";
        assert!(is_spelled_small || is_known.iter().any(|found| !found.is_empty()), "no entry for {text}");
    }
}

#[test]
fn exporters_are_found_by_the_longest_text() {
    let names = |format, generator| -> Vec<&str> {
        candidates(&source(format, generator)).into_iter().map(|exporter| exporter.name.as_str()).collect()
    };
    assert_eq!(names(SourceFormat::Gltf, "Khronos glTF Blender I/O v5.0.21"), ["Blender"]);
    assert_eq!(names(SourceFormat::Gltf, "Khronos glTF Blender I/O v3.4.50"), ["Blender 3.4"]);
    assert_eq!(names(SourceFormat::Obj, "Blender 5.0.1"), ["Blender"]);
    assert_eq!(names(SourceFormat::Obj, "Created by Jmol 14.32.83"), ["Jmol"]);
    assert_eq!(names(SourceFormat::Gltf, "Created by Jmol 14.32.83"), [""; 0]);
    assert_eq!(names(SourceFormat::Gltf, ""), [""; 0]);
    assert_eq!(names(SourceFormat::Gltf, "Open CASCADE Technology 7.9.2 [dev.opencascade.org]").len(), 4);
}

#[test]
fn warnings_have_sections() {
    let vtk = source(SourceFormat::Gltf, "VTK");
    let warning = "has a colour for each of the 4 triangles, not for each vertex";
    let section = "docs/reference/exporters.md#vtk-vtkgltfexporter-gltf";
    assert_eq!(section_about(&vtk, warning).as_deref(), Some(section));
    assert_eq!(section_about(&vtk, "texture 'a.png' is missing"), None);
    assert_eq!(section_about(&source(SourceFormat::Gltf, "a program"), warning), None);
}

#[test]
fn what_helps_names_flags_that_exist() {
    let root = crate::args::command_tree::built();
    let render = root.find_subcommand("render").unwrap();
    let is_flag = |word: &&str| word.starts_with("--");
    let help =
        EXPORTERS.iter().flat_map(|exporter| &exporter.quirks).filter_map(|quirk| quirk.help.as_deref());
    let flags: HashSet<&str> = help.flat_map(str::split_whitespace).filter(is_flag).collect();
    assert!(flags.contains("--scale") && flags.contains("--up"), "{flags:?}");
    for flag in flags {
        let name = flag.trim_start_matches('-');
        assert!(render.get_arguments().any(|arg| arg.get_long() == Some(name)), "{flag}");
    }
}
