//! The interface files and the Rust structs say the same.
#![allow(clippy::unwrap_used)]

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

use cromosim_msgs::{Arity, Element, MessageType, known_type, known_types};

/// (type, name) of each field, and (name, value) of each constant, read from the text by rules of
/// its own.
type Parsed = (Vec<(String, String)>, Vec<(String, i64)>);

fn parse(definition: &str, package: &str) -> Parsed {
    let (mut fields, mut constants) = (Vec::new(), Vec::new());
    for line in definition.lines() {
        let line = line.split('#').next().unwrap().trim();
        if line.is_empty() {
            continue;
        }
        let (type_name, rest) = line.split_once(char::is_whitespace).unwrap();
        if let Some((name, value)) = rest.split_once('=') {
            constants.push((name.trim().to_owned(), value.trim().parse().unwrap()));
            continue;
        }
        let name = rest.split_whitespace().next().unwrap();
        let (element, brackets) = type_name
            .find('[')
            .map_or((type_name, ""), |at| type_name.split_at(at));
        let element = match element {
            own if own.starts_with(char::is_uppercase) => format!("{package}/{own}"),
            other => other.to_owned(),
        };
        fields.push((format!("{element}{brackets}"), name.to_owned()));
    }
    (fields, constants)
}

/// A field's type in the interface language, from the Rust side.
fn spelled(element: Element, arity: Arity) -> String {
    let element = match element {
        Element::Message(inner) => inner.name.replacen("/msg/", "/", 1),
        primitive => format!("{primitive:?}").to_lowercase(),
    };
    match arity {
        Arity::One => element,
        Arity::Array(length) => format!("{element}[{length}]"),
        Arity::Sequence => format!("{element}[]"),
    }
}

fn compare(message: &MessageType) {
    let package = message.name.split('/').next().unwrap();
    let (mut fields, constants) = parse(message.definition(), package);
    if fields.is_empty() {
        // CDR knows no empty structure: ROS 2 puts this member into every one.
        fields.push((
            "uint8".to_owned(),
            "structure_needs_at_least_one_member".to_owned(),
        ));
    }
    let rust: Vec<(String, String)> = message
        .fields
        .iter()
        .map(|field| {
            (
                spelled(field.field_type.element, field.field_type.arity),
                field.name.to_owned(),
            )
        })
        .collect();
    assert_eq!(rust, fields, "{}", message.name);
    let rust: Vec<(String, i64)> = message
        .constants
        .iter()
        .map(|(name, value)| ((*name).to_owned(), *value))
        .collect();
    assert_eq!(rust, constants, "{}", message.name);
}

fn interface_files(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            interface_files(&path, found);
        } else {
            found.push(path);
        }
    }
}

#[test]
fn fields_and_constants_agree_in_name_type_and_order() {
    for message in known_types() {
        compare(message);
    }
}

#[test]
fn every_interface_file_has_its_struct() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut files = Vec::new();
    interface_files(&root.join("msg"), &mut files);
    interface_files(&root.join("std"), &mut files);
    let mut from_files = BTreeSet::new();
    for path in &files {
        let stem = path.file_stem().unwrap().to_str().unwrap();
        let kind = path.extension().unwrap().to_str().unwrap();
        let package = match path.strip_prefix(root.join("std")) {
            Ok(inside) => inside.iter().next().unwrap().to_str().unwrap(),
            Err(_) => "cromosim_msgs",
        };
        let halves: &[&str] = if kind == "srv" {
            &["_Request", "_Response"]
        } else {
            &[""]
        };
        for half in halves {
            let name = format!("{package}/{kind}/{stem}{half}");
            let message =
                known_type(&name).unwrap_or_else(|| panic!("{}: no struct", path.display()));
            assert_eq!(
                message.file_text,
                fs::read_to_string(path).unwrap(),
                "{name}: the struct names another file"
            );
            from_files.insert(name);
        }
    }
    let from_rust: BTreeSet<String> = known_types()
        .iter()
        .map(|known| known.name.to_owned())
        .collect();
    assert_eq!(from_rust, from_files);
}

#[test]
fn the_build_file_for_colcon_lists_every_own_message() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let build = fs::read_to_string(root.join("CMakeLists.txt")).unwrap();
    let package = fs::read_to_string(root.join("package.xml")).unwrap();
    for own in known_types()
        .iter()
        .filter(|known| known.name.starts_with("cromosim_msgs/"))
    {
        let file = own.name.trim_start_matches("cromosim_msgs/");
        assert!(build.contains(&format!("\"{file}.msg\"")), "{file}");
        for dependency in own
            .fields
            .iter()
            .filter_map(|field| match field.field_type.element {
                Element::Message(inner) => inner.name.split('/').next(),
                _ => None,
            })
        {
            assert!(
                package.contains(&format!("<depend>{dependency}</depend>")),
                "{dependency}"
            );
            assert!(
                build.contains(&format!("find_package({dependency} REQUIRED)")),
                "{dependency}"
            );
        }
    }
}
