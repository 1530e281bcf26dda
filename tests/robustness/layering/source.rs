//! The modules of a crate, read from its text: what each defines, imports and names.
//!
//! No macro is expanded and no type is resolved. Tests, attributes, comments and strings do not count.

use std::collections::{BTreeMap, BTreeSet};

use super::tokens::{end_of_attribute, end_of_item, is_test_attribute, is_word, tokens};

/// The modules of a crate; the first is the root.
pub struct Modules(pub Vec<Module>);

/// A module, in a file of its own or inline in the file of another.
pub struct Module {
    pub file: String,
    pub parent: Option<usize>,
    pub children: BTreeMap<String, usize>,
    /// Functions, types, constants and macros that are defined here.
    pub items: BTreeSet<String>,
    pub imports: Vec<Import>,
    /// Paths of two or more segments outside `use`.
    pub paths: BTreeSet<Vec<String>>,
    /// Words outside `use`, which may be names that a glob import brings.
    pub words: BTreeSet<String>,
}

/// A leaf of a `use` tree.
pub struct Import {
    pub path: Vec<String>,
    /// Its name in this module, or `None` for a glob.
    pub name: Option<String>,
    /// `pub`, as far as anything.
    pub exported: bool,
}

impl Modules {
    /// Reads the files of a crate by their paths below its `src`, starting at `lib.rs`.
    pub fn read(files: &BTreeMap<String, String>) -> Modules {
        let mut modules = Modules(Vec::new());
        modules.add_file(files, "lib.rs".into(), None);
        modules
    }

    fn add_file(&mut self, files: &BTreeMap<String, String>, file: String, parent: Option<usize>) -> usize {
        let tokens = tokens(&files[&file]);
        let module = self.add(file, parent);
        if !is_test_attribute(&tokens, 0) {
            self.read_items(files, module, &tokens);
        }
        module
    }

    fn add(&mut self, file: String, parent: Option<usize>) -> usize {
        self.0.push(Module {
            file,
            parent,
            children: BTreeMap::new(),
            items: BTreeSet::new(),
            imports: Vec::new(),
            paths: BTreeSet::new(),
            words: BTreeSet::new(),
        });
        self.0.len() - 1
    }

    /// Reads the tokens between the braces of a module.
    fn read_items(&mut self, files: &BTreeMap<String, String>, module: usize, tokens: &[&str]) {
        let (mut i, mut depth) = (0, 0);
        while i < tokens.len() {
            let (token, next) = (tokens[i], tokens.get(i + 1).copied().unwrap_or(""));
            match token {
                "#" if matches!(next, "[" | "!") => {
                    let test = is_test_attribute(tokens, i);
                    i = end_of_attribute(tokens, i);
                    if test {
                        i = end_of_item(tokens, i);
                    }
                    continue;
                }
                "(" | "[" | "{" => depth += 1,
                ")" | "]" | "}" => depth -= 1,
                "use" if next != "<" => {
                    let exported = i > 0 && matches!(tokens[i - 1], "pub" | ")");
                    i += 1;
                    read_use(tokens, &mut i, &mut Vec::new(), exported, &mut self.0[module].imports);
                    continue;
                }
                "mod" if depth == 0 && is_word(next) => {
                    i = self.read_child(files, module, tokens, i);
                    continue;
                }
                "fn" | "struct" | "enum" | "union" | "trait" | "type" | "const" | "static"
                    if depth == 0 && !(i > 0 && matches!(tokens[i - 1], "*" | "<" | ",")) =>
                {
                    let name = if next == "mut" { tokens[i + 2] } else { next };
                    if is_word(name) && !matches!(name, "fn" | "unsafe" | "extern") {
                        self.0[module].items.insert(name.to_string());
                    }
                }
                "macro_rules" if depth == 0 && next == "!" => {
                    self.0[module].items.insert(tokens[i + 2].to_string());
                }
                _ => {}
            }
            if is_word(token) && (i == 0 || tokens[i - 1] != "::") {
                let mut path = vec![token.to_string()];
                while tokens.get(i + 1) == Some(&"::") && tokens.get(i + 2).is_some_and(|t| is_word(t)) {
                    path.push(tokens[i + 2].to_string());
                    i += 2;
                }
                if path.len() == 1 {
                    self.0[module].words.extend(path);
                } else {
                    self.0[module].words.insert(path[0].clone());
                    self.0[module].paths.insert(path);
                }
            }
            i += 1;
        }
    }

    /// Reads `mod name;` or `mod name { … }` at `i`; returns where it ends.
    fn read_child(
        &mut self,
        files: &BTreeMap<String, String>,
        module: usize,
        tokens: &[&str],
        i: usize,
    ) -> usize {
        let name = tokens[i + 1];
        let file = self.0[module].file.clone();
        let (child, end) = if tokens[i + 2] == "{" {
            let end = end_of_item(tokens, i);
            let child = self.add(file, Some(module));
            self.read_items(files, child, &tokens[i + 3..end - 1]);
            (child, end)
        } else {
            let folder = match file.rsplit_once('/') {
                Some((folder, "mod.rs")) => format!("{folder}/"),
                None if file == "lib.rs" => String::new(),
                _ => format!("{}/", file.trim_end_matches(".rs")),
            };
            let candidates = [format!("{folder}{name}.rs"), format!("{folder}{name}/mod.rs")];
            let found = candidates.into_iter().find(|file| files.contains_key(file));
            let path = found.unwrap_or_else(|| panic!("{file}: no file for `mod {name};`"));
            (self.add_file(files, path, Some(module)), i + 3)
        };
        self.0[module].children.insert(name.to_string(), child);
        end
    }
}

/// Reads one tree of a `use` declaration, whose path starts with `prefix`.
fn read_use(
    tokens: &[&str],
    i: &mut usize,
    prefix: &mut Vec<String>,
    exported: bool,
    imports: &mut Vec<Import>,
) {
    let depth = prefix.len();
    loop {
        match tokens[*i] {
            "::" => {}
            "{" => {
                *i += 1;
                while tokens[*i] != "}" {
                    read_use(tokens, i, prefix, exported, imports);
                    if tokens[*i] == "," {
                        *i += 1;
                    }
                }
                *i += 1;
                break;
            }
            "*" => {
                *i += 1;
                imports.push(Import { path: prefix.clone(), name: None, exported });
                break;
            }
            "self" if prefix.len() > depth || depth > 0 => {
                *i += 1;
                push_leaf(tokens, i, prefix, exported, imports);
                break;
            }
            word => {
                prefix.push(word.to_string());
                if tokens[*i + 1] != "::" {
                    *i += 1;
                    push_leaf(tokens, i, prefix, exported, imports);
                    break;
                }
            }
        }
        *i += 1;
    }
    prefix.truncate(depth);
}

/// Adds an import of `path` by its last segment, or by the name after `as`.
fn push_leaf(tokens: &[&str], i: &mut usize, path: &[String], exported: bool, imports: &mut Vec<Import>) {
    let mut name = path.last().cloned();
    if tokens[*i] == "as" {
        name = Some(tokens[*i + 1].to_string());
        *i += 2;
    }
    imports.push(Import { path: path.to_vec(), name, exported });
}
