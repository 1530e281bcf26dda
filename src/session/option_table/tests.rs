use std::collections::HashSet;

use super::{OptionDef, option_defs};
use crate::options::{AovSelection, Options};
use crate::settings_hash::SettingsHash;

#[test]
fn names_are_unique_and_references_exist() {
    let mut names = HashSet::new();
    for def in option_defs() {
        assert!(names.insert(def.name) && def.alias.is_none_or(|alias| names.insert(alias)), "{}", def.name);
        assert!(!def.help.is_empty() && !def.help.contains(" --"), "{}", def.name);
        assert_eq!(def.takes_value(), !def.value_name.is_empty(), "{}", def.name);
        for other in def.conflicts.iter().chain(&def.requires) {
            assert!(OptionDef::find(other).is_some_and(|found| found.name == *other), "{other}");
        }
    }
}

#[test]
fn defaults_are_those_of_the_library() {
    let mut options = Options::default();
    for def in option_defs() {
        def.default.map_or(Ok(()), |text| options.set(def.name, text)).unwrap();
    }
    assert_eq!(format!("{options:?}"), format!("{:?}", Options::default()));
}

/// `--resume` renders again where an option has another value, and only there.
#[test]
fn options_that_differ_have_hashes_that_differ() {
    let mut count = 0;
    for def in option_defs() {
        let texts = if def.takes_value() { def.choices } else { &[""] };
        let set = |text: &str| {
            let mut options = Options::default();
            options.set(def.name, text).unwrap();
            options
        };
        let all: Vec<Options> =
            std::iter::once(Options::default()).chain(texts.iter().map(|text| set(text))).collect();
        for (a, b) in all.iter().flat_map(|a| all.iter().map(move |b| (a, b))) {
            let differ = format!("{a:?}") != format!("{b:?}");
            assert_eq!(SettingsHash::of(a) != SettingsHash::of(b), differ, "{}", def.name);
            count += usize::from(differ);
        }
    }
    assert!(count > 50, "{count}");
}

#[test]
fn choices_are_values() {
    for def in option_defs() {
        for choice in def.choices {
            let set = |text: &str| {
                let mut options = Options::default();
                options.set(def.name, text).unwrap();
                format!("{options:?}")
            };
            assert_eq!(set(&choice.to_uppercase()), set(choice), "{} {choice}", def.name);
        }
        if !def.choices.is_empty() {
            assert!(Options::default().set(def.name, "other").is_err(), "{}", def.name);
        }
    }
}

#[test]
fn the_help_of_aov_lists_all_names() {
    let summary = OptionDef::find("aov").unwrap().summary();
    let mut names = AovSelection::all().aovs.iter().map(|aov| aov.name()).collect::<Vec<_>>();
    names.push(crate::options::CRYPTOMATTE);
    assert_eq!(summary, format!("AOVs: {}", names.join(", ")));
}
