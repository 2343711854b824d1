//! Numbers as YAML files have them.

/// The shortest digits that read back as the same number, with a point and a signed exponent, as
/// YAML 1.1 asks for too.
pub(crate) fn number(value: f64) -> String {
    let text = format!("{value:?}");
    let Some((mantissa, exponent)) = text.split_once('e') else {
        return text;
    };
    let point = if mantissa.contains('.') { "" } else { ".0" };
    let sign = if exponent.starts_with('-') { "" } else { "+" };
    format!("{mantissa}{point}e{sign}{exponent}")
}
