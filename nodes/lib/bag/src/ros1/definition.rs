//! Message definitions of ROS 1: what stands in a connection's record.

use std::collections::BTreeMap;

/// Types in types, at most.
const DEEPEST: usize = 32;

/// What is read one after the other.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Field {
    pub(crate) kind: Kind,
    pub(crate) arity: Arity,
}

#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Kind {
    /// Of so many bytes.
    Number(usize),
    /// Bytes behind their count.
    Text,
    /// Seconds and nanoseconds, both of 32 bits: a time or a duration.
    Time,
    /// `std_msgs/Header`: ROS 2's has no `seq` at its beginning.
    Header,
    Message(Vec<Field>),
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Arity {
    One,
    Array(usize),
    Sequence,
}

/// A definition as it is read, and as ROS 2 writes it.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Definition {
    pub(crate) fields: Vec<Field>,
    /// `ros2msg` text.
    pub(crate) ros2_text: String,
}

/// One type of a definition: its fields as name of type, arity and the rest of the line.
struct Section<'a> {
    lines: Vec<&'a str>,
}

/// Parses the definition of `package/Name`.
pub(crate) fn parse(type_name: &str, text: &str) -> Result<Definition, String> {
    let mut sections: BTreeMap<String, Section<'_>> = BTreeMap::new();
    let mut order = vec![type_name.to_owned()];
    sections.insert(type_name.to_owned(), Section { lines: Vec::new() });
    for line in text.lines() {
        let trimmed = line.trim();
        if let Some(name) = trimmed.strip_prefix("MSG:") {
            order.push(name.trim().to_owned());
            sections.insert(name.trim().to_owned(), Section { lines: Vec::new() });
        } else if !(trimmed.len() > 8 && trimmed.bytes().all(|byte| byte == b'='))
            && let Some(section) = order.last().and_then(|name| sections.get_mut(name))
        {
            section.lines.push(line);
        }
    }
    let fields = fields_of(type_name, &sections, 0)?;
    Ok(Definition {
        fields,
        ros2_text: ros2_text(&order, &sections),
    })
}

/// The type's name and the rest of a line that declares a field; none for comments and constants.
fn declaration(line: &str) -> Option<(&str, &str)> {
    let code = line.split('#').next().unwrap_or_default().trim();
    let (name, rest) = code.split_once(char::is_whitespace)?;
    (!rest.contains('=')).then(|| (name, rest.trim()))
}

fn arity(name: &str) -> Result<(&str, Arity), String> {
    let Some((element, count)) = name.split_once('[') else {
        return Ok((name, Arity::One));
    };
    match count.trim_end_matches(']').trim() {
        "" => Ok((element, Arity::Sequence)),
        count => match count.parse() {
            Ok(count) => Ok((element, Arity::Array(count))),
            Err(_) => Err(format!("{name:?} is no type")),
        },
    }
}

/// A type's whole name: bare ones are of the package they stand in.
fn whole_name(element: &str, within: &str, sections: &BTreeMap<String, Section<'_>>) -> String {
    if element == "Header" {
        return "std_msgs/Header".to_owned();
    }
    if element.contains('/') {
        return element.to_owned();
    }
    let package = within.split('/').next().unwrap_or_default();
    let own = format!("{package}/{element}");
    if sections.contains_key(&own) {
        return own;
    }
    let ending = format!("/{element}");
    let other = sections.keys().find(|name| name.ends_with(&ending));
    other.cloned().unwrap_or(own)
}

fn fields_of(
    name: &str,
    sections: &BTreeMap<String, Section<'_>>,
    depth: usize,
) -> Result<Vec<Field>, String> {
    if depth > DEEPEST {
        return Err(format!("{name} holds itself"));
    }
    let section = sections
        .get(name)
        .ok_or_else(|| format!("{name} is not defined"))?;
    let mut fields = Vec::new();
    for (type_name, _) in section.lines.iter().filter_map(|line| declaration(line)) {
        let (element, arity) = arity(type_name)?;
        let kind = match element {
            "bool" | "byte" | "char" | "int8" | "uint8" => Kind::Number(1),
            "int16" | "uint16" => Kind::Number(2),
            "int32" | "uint32" | "float32" => Kind::Number(4),
            "int64" | "uint64" | "float64" => Kind::Number(8),
            "string" => Kind::Text,
            "time" | "duration" => Kind::Time,
            other => match whole_name(other, name, sections).as_str() {
                "std_msgs/Header" => Kind::Header,
                whole => Kind::Message(fields_of(whole, sections, depth + 1)?),
            },
        };
        fields.push(Field { kind, arity });
    }
    Ok(fields)
}

/// Definitions in ROS 2's words: times are messages, and a header has no `seq`.
fn ros2_text(order: &[String], sections: &BTreeMap<String, Section<'_>>) -> String {
    const RULE: &str =
        "================================================================================";
    let mut text = String::new();
    let (mut time, mut duration) = (false, false);
    for (index, name) in order.iter().enumerate() {
        if index > 0 {
            text.push_str(&format!("{RULE}\nMSG: {name}\n"));
        }
        for line in sections.get(name).map_or(&[][..], |section| &section.lines) {
            let Some((type_name, rest)) = declaration(line) else {
                text.push_str(line);
                text.push('\n');
                continue;
            };
            if name == "std_msgs/Header" && rest == "seq" {
                continue;
            }
            let (element, suffix) =
                type_name.split_at(type_name.find('[').unwrap_or(type_name.len()));
            let element = match element {
                "time" => {
                    time = true;
                    "builtin_interfaces/Time".to_owned()
                }
                "duration" => {
                    duration = true;
                    "builtin_interfaces/Duration".to_owned()
                }
                "char" => "uint8".to_owned(),
                "Header" => "std_msgs/Header".to_owned(),
                other => other.to_owned(),
            };
            text.push_str(&format!("{element}{suffix} {rest}\n"));
        }
    }
    for (used, name) in [(time, "Time"), (duration, "Duration")] {
        if used {
            text.push_str(&format!(
                "{RULE}\nMSG: builtin_interfaces/{name}\nint32 sec\nuint32 nanosec\n"
            ));
        }
    }
    text
}
