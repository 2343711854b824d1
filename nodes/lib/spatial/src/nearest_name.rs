//! Names that somebody may have meant.

use std::fmt::Display;

/// Of known names the one that takes the fewest changed letters for its length (Levenshtein 1966), the
/// first of equals; none where nothing is known.
pub fn nearest_name<'a>(name: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    nearest(name, known).map(|(_, nearest)| nearest)
}

/// The nearest name with its likeness, from 0 to 1 for the same.
fn nearest<'a>(name: &str, known: impl IntoIterator<Item = &'a str>) -> Option<(f64, &'a str)> {
    known
        .into_iter()
        .map(|known| (strsim::normalized_levenshtein(known, name), known))
        .reduce(|best, other| if other.0 > best.0 { other } else { best })
}

/// Half of the letters must be right for a name to be offered beside a list of all.
const ALIKE: f64 = 0.5;

/// The end of an error line that lists the known names: `; the nearest is NAME`, or nothing where there
/// is no choice or none is like it.
pub fn meant<'a>(name: &str, known: impl IntoIterator<Item = &'a str>) -> String {
    let known: Vec<&str> = known.into_iter().filter(|one| !one.is_empty()).collect();
    match nearest(name, known.iter().copied()) {
        Some((likeness, nearest)) if known.len() > 1 && likeness >= ALIKE => {
            format!("; the nearest is {nearest}")
        }
        _ => String::new(),
    }
}

/// What a parser of serde's says, without the names of types that only the source knows, and with the
/// nearest of the names that it expected where it found an unknown field or variant.
pub fn in_plain_words(problem: impl Display) -> String {
    let problem = without_types(&problem.to_string());
    let nearest = meant_by_serde(&problem).unwrap_or_default();
    problem + &nearest
}

/// What serde calls types, and what users write for them.
const TYPES: [(&str, &str); 7] = [
    (", expected struct ", ", expected a map of fields"),
    (", expected tuple struct ", ", expected a list"),
    (", expected unit struct ", ", expected nothing"),
    (", expected newtype struct ", ", expected a value"),
    (", expected enum ", ", expected a name"),
    (
        ", expected internally tagged enum ",
        ", expected a map of fields",
    ),
    (
        "data did not match any variant of untagged enum ",
        "none of the forms that this may have",
    ),
];

/// Of "invalid type: integer `5`, expected struct RawFile at line 1 column 1".
fn without_types(problem: &str) -> String {
    let found = TYPES
        .iter()
        .find_map(|(internal, plain)| Some((problem.split_once(internal)?, plain)));
    let Some(((before, after), plain)) = found else {
        return problem.to_owned();
    };
    let is_of_name = |letter: char| letter.is_alphanumeric() || letter == '_';
    let rest = after.trim_start_matches(is_of_name);
    format!("{before}{plain}{rest}")
}

/// Of "unknown field `given`, expected one of `this`, `that` at line 3 column 1".
fn meant_by_serde(problem: &str) -> Option<String> {
    let (_, slip) = ["unknown field `", "unknown variant `"]
        .iter()
        .find_map(|start| problem.split_once(start))?;
    let (given, rest) = slip.split_once('`')?;
    let expected = rest.strip_prefix(", expected ")?;
    Some(meant(given, expected.split('`').skip(1).step_by(2)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_name_with_the_fewest_slips_is_offered() {
        let known = ["lever_arm", "time_offset", "low_pass"];
        assert_eq!(nearest_name("leverarm", known), Some("lever_arm"));
        assert_eq!(nearest_name("lowpas", known), Some("low_pass"));
        let topics = ["/imu/left_wrist/data_raw", "/note"];
        assert_eq!(nearest_name("/imu/head/data", topics), Some(topics[0]));
        assert_eq!(nearest_name("x", []), None);
        assert_eq!(meant("lowpas", known), "; the nearest is low_pass");
        assert_eq!(meant("only", ["onlz"]), "");
        assert_eq!(meant("kinect", ["mixamo", "cmu"]), "");
    }

    #[test]
    fn types_of_the_source_are_not_named() {
        #[derive(Debug, serde::Deserialize)]
        struct RawFile {
            #[serde(rename = "point")]
            _point: Option<RawPoint>,
            #[serde(rename = "either")]
            _either: Option<RawEither>,
        }
        #[derive(Debug, serde::Deserialize)]
        #[expect(dead_code, reason = "only parsed")]
        struct RawPoint(f64, f64);
        #[derive(Debug, serde::Deserialize)]
        #[serde(untagged)]
        #[expect(dead_code, reason = "only parsed")]
        enum RawEither {
            Number(f64),
        }
        for (text, said) in [
            ("5", "invalid type: integer `5`, expected a map of fields"),
            ("point: x", "expected a list"),
            ("point: [1.0]", "expected a list with 2 elements"),
            ("either: x", "none of the forms that this may have"),
        ] {
            let problem = serde_norway::from_str::<RawFile>(text).expect_err("a slip");
            let problem = in_plain_words(problem);
            assert!(
                problem.contains(said) && !problem.contains("Raw"),
                "{problem}"
            );
        }
    }

    #[test]
    fn what_serde_expects_is_read_from_its_message() {
        #[derive(Debug, serde::Deserialize)]
        #[serde(deny_unknown_fields)]
        struct Settings {
            #[serde(rename = "rate_hz")]
            _rate_hz: Option<f64>,
            #[serde(rename = "scheme")]
            _scheme: Option<Choice>,
        }
        #[derive(Debug, serde::Deserialize)]
        #[serde(rename_all = "snake_case")]
        enum Choice {
            Spline,
            Adaptive,
        }
        let problem = |text: &str| {
            in_plain_words(serde_norway::from_str::<Settings>(text).expect_err("a slip"))
        };
        for (text, nearest) in [
            ("rate_khz: 1", "; the nearest is rate_hz"),
            ("scheme: splin", "; the nearest is spline"),
        ] {
            let problem = problem(text);
            assert!(problem.ends_with(nearest), "{problem}");
        }
        let of_a_number = problem("rate_hz: fast");
        assert!(!of_a_number.contains("nearest"), "{of_a_number}");
    }
}
