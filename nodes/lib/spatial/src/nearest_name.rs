//! Names that somebody may have meant.

/// Of known names the one that takes the fewest changed letters for its length (Levenshtein 1966), the
/// first of equals; none where nothing is known.
pub fn nearest_name<'a>(name: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let likeness = |known: &'a str| (strsim::normalized_levenshtein(known, name), known);
    let (_, nearest) = known
        .into_iter()
        .map(likeness)
        .reduce(|best, other| if other.0 > best.0 { other } else { best })?;
    Some(nearest)
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
    }
}
