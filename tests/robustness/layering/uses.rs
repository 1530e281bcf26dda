//! Uses of names between files, followed through re-exports to the file that defines each name.

use std::collections::{BTreeMap, BTreeSet};

use super::source::{Import, Modules};

/// The names that a file takes from another, by both.
pub type Uses = BTreeMap<(String, String), BTreeSet<String>>;

/// The target of a path.
enum Named {
    Module(usize),
    /// An item by its name, and the module that defines it.
    Item(usize, String),
}

/// Paths in the middle of their resolution, which imports that go in circles would otherwise repeat for ever.
type Open = BTreeSet<(usize, String)>;

/// All names that files take from each other. A module that is only passed on or walked through is not used;
/// a `pub use` alone takes nothing, unless `with_exports` is set.
pub fn uses(modules: &Modules, with_exports: bool) -> Uses {
    let mut uses = Uses::new();
    for (number, module) in modules.0.iter().enumerate() {
        let mut add = |named: Option<Named>| {
            if let Some(Named::Item(from, name)) = named
                && modules.0[from].file != module.file
            {
                let files = (module.file.clone(), modules.0[from].file.clone());
                uses.entry(files).or_default().insert(name);
            }
        };
        for import in &module.imports {
            let named = modules.resolve(number, &import.path, &mut Open::new());
            let taken = with_exports || !import.exported;
            match (named, &import.name) {
                (Some(Named::Module(from)), None) => {
                    for word in module.words.iter().filter(|word| !module.items.contains(*word)) {
                        add(modules.find(from, word, true, &mut Open::new()));
                    }
                }
                (named, name) if taken || name.as_ref().is_none_or(|name| module.words.contains(name)) => {
                    add(named)
                }
                _ => {}
            }
        }
        for path in &module.paths {
            add(modules.resolve(number, path, &mut Open::new()));
        }
    }
    uses
}

impl Modules {
    /// Resolves a path in a module, if it is of this crate.
    fn resolve(&self, module: usize, path: &[String], open: &mut Open) -> Option<Named> {
        let mut at = match path.first()?.as_str() {
            "crate" => 0,
            "self" => module,
            "super" => self.0[module].parent?,
            first => match self.find(module, first, path.len() == 1, open)? {
                Named::Module(at) => at,
                item => return Some(item),
            },
        };
        for (i, segment) in path.iter().enumerate().skip(1) {
            at = match segment.as_str() {
                "super" => self.0[at].parent?,
                segment => match self.find(at, segment, i + 1 == path.len(), open) {
                    Some(Named::Module(at)) => at,
                    Some(item) => return Some(item),
                    // Made by a macro.
                    None => return Some(Named::Item(at, segment.to_string())),
                },
            };
        }
        Some(Named::Module(at))
    }

    /// Looks up a name in a module: first its definitions, then its imports. The last segment of a path prefers
    /// an item to a module.
    fn find(&self, number: usize, name: &str, last: bool, open: &mut Open) -> Option<Named> {
        let module = &self.0[number];
        let item = || module.items.contains(name).then(|| Named::Item(number, name.to_string()));
        let child = || module.children.get(name).map(|child| Named::Module(*child));
        if let Some(named) = if last { item().or_else(child) } else { child().or_else(item) } {
            return Some(named);
        }
        if !open.insert((number, name.to_string())) {
            return None;
        }
        let mut imported = |import: &Import| {
            if import.name.is_some() {
                return self.resolve(number, &import.path, open);
            }
            match self.resolve(number, &import.path, open)? {
                Named::Module(from) if from != number => self.find(from, name, last, open),
                _ => None,
            }
        };
        let by_name = module.imports.iter().filter(|import| import.name.as_deref() == Some(name));
        let globs = module.imports.iter().filter(|import| import.name.is_none());
        let named = by_name.chain(globs).find_map(&mut imported);
        open.remove(&(number, name.to_string()));
        named
    }
}

/// Files that use each other, and what ties them.
#[derive(Debug)]
pub struct Cycle {
    pub files: BTreeSet<String>,
    /// A line for each pair: `a.rs -> b.rs: X, y`.
    pub ties: Vec<String>,
}

/// The strongly connected components of more than one file.
pub fn cycles(uses: &Uses) -> Vec<Cycle> {
    let mut targets: BTreeMap<&str, Vec<&str>> = BTreeMap::new();
    for (from, to) in uses.keys() {
        targets.entry(from).or_default().push(to);
    }
    let reached: BTreeMap<&str, BTreeSet<&str>> =
        targets.keys().map(|file| (*file, reach(file, &targets))).collect();
    let tied = |a: &str, b: &str| {
        reached.get(a).is_some_and(|all| all.contains(b)) && reached.get(b).is_some_and(|all| all.contains(a))
    };
    let mut cycles: Vec<Cycle> = Vec::new();
    for file in targets.keys().filter(|file| tied(file, file)) {
        if cycles.iter().any(|cycle| cycle.files.contains(*file)) {
            continue;
        }
        let files: BTreeSet<String> =
            targets.keys().filter(|other| tied(file, other)).map(ToString::to_string).collect();
        let inside = uses.iter().filter(|((from, to), _)| files.contains(from) && files.contains(to));
        let tie = |((from, to), names): (&(String, String), &BTreeSet<String>)| {
            format!("{from} -> {to}: {}", names.iter().cloned().collect::<Vec<_>>().join(", "))
        };
        let ties = inside.map(tie).collect();
        cycles.push(Cycle { files, ties });
    }
    cycles
}

/// All files that lie at the end of one use or more.
fn reach<'a>(file: &str, targets: &BTreeMap<&str, Vec<&'a str>>) -> BTreeSet<&'a str> {
    let mut reached = BTreeSet::new();
    let mut waiting: Vec<&str> = targets[file].clone();
    while let Some(file) = waiting.pop() {
        if reached.insert(file) {
            waiting.extend(targets.get(file).into_iter().flatten());
        }
    }
    reached
}
