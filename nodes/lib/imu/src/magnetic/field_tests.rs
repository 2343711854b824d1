#![allow(clippy::unwrap_used)]

use super::*;

#[test]
fn a_place_has_the_field_of_its_model() {
    // Of NOAA's test values for WMM2025: 80 N, 0 E, height 0, 2025.0.
    let field = AmbientField::resolve("80N,0E,2025-01-01")
        .unwrap()
        .earth_in_world();
    let nanotesla = field * 1e9;
    assert!((nanotesla.y - 6521.6).abs() < 1.0, "north {}", nanotesla.y);
    assert!((nanotesla.x - 145.9).abs() < 1.0, "east {}", nanotesla.x);
    assert!(
        (-nanotesla.z - 54791.5).abs() < 2.0,
        "down {}",
        -nanotesla.z
    );
}

#[test]
fn the_x_axis_may_point_elsewhere() {
    let to = |heading| {
        AmbientField::of_place([52.5, 13.4, 0.0], "2026-01-01", heading)
            .unwrap()
            .earth_in_world()
    };
    let (east, north, south) = (to(90.0), to(0.0), to(180.0));
    // With x to the north, what was along y (north) is along x, and y is west.
    assert!((north.x - east.y).abs() < 1e-15 && (north.y + east.x).abs() < 1e-15);
    assert!((south.x + east.y).abs() < 1e-15);
    assert!(east.y > 1.5e-5 && east.z < -4e-5, "{east}");
}

#[test]
fn a_dipole_adds_what_a_magnet_does() {
    let text = "schema: cromosim/magnetic_field/1\nfield_in_world: [0, 2e-5, -4e-5]\ndisturbances: [{at: [1, 0, 0], moment: [0, 0, 3]}]";
    let field = AmbientField::parse(text, "f.yaml").unwrap();
    let far = field.at(&Vector3::new(1.0, 1e3, 0.0)) - field.earth_in_world();
    assert!(far.norm() < 1e-15);
    // On the axis 2 mu_0 m / (4 pi r^3), across it half of that, against the moment.
    let above = field.at(&Vector3::new(1.0, 0.0, 0.5)) - field.earth_in_world();
    assert!(
        (above - Vector3::z() * 2e-7 * 3.0 / 0.125).norm() < 1e-13,
        "{above}"
    );
    let beside = field.at(&Vector3::new(1.5, 0.0, 0.0)) - field.earth_in_world();
    assert!(
        (beside + Vector3::z() * 1e-7 * 3.0 / 0.125).norm() < 1e-13,
        "{beside}"
    );
    assert!(field.at(&Vector3::new(1.0, 0.0, 0.0)).norm().is_finite());
}

#[test]
fn what_is_no_field_is_said() {
    for (text, word) in [
        ("20,0,-43", "1 uT is 1e-6 T"),
        ("52.5N,13.4E", "expected a vector"),
        ("52.5N,13.4E,2019-01-01", "date outside"),
        ("52.5N,13.4E,yesterday", "YYYY-MM-DD"),
        ("95N,13.4E,2026-01-01", "latitude"),
        ("nan,0,0", "tesla"),
    ] {
        let error = AmbientField::resolve(text).unwrap_err().to_string();
        assert!(
            error.contains(word) && error.contains(text),
            "{text}: {error}"
        );
    }
    for (body, word) in [
        ("", "one of field_in_world and place"),
        (
            "field_in_world: [0, 0, 4e-5]\nx_axis_heading: 3",
            "take it out",
        ),
        (
            "field_in_world: [0, 0, 4e-5]\ndisturbances: [{at: [.nan, 0, 0], moment: [0, 0, 0]}]",
            "entry 1",
        ),
        ("field: 3", "unknown field"),
    ] {
        let text = format!("schema: cromosim/magnetic_field/1\n{body}");
        let error = AmbientField::parse(&text, "f.yaml")
            .unwrap_err()
            .to_string();
        assert!(
            error.contains(word) && error.contains("f.yaml"),
            "{body}: {error}"
        );
    }
}

#[test]
fn the_shipped_file_is_one() {
    let path = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../../../config/magnetic_field.yaml"
    );
    let field = AmbientField::resolve(path).unwrap();
    let strength = field.earth_in_world().norm();
    assert!((4.9e-5..5.1e-5).contains(&strength), "{strength}");
    assert!(field.at(&Vector3::new(1.0, 0.5, 0.8)) != field.earth_in_world());
}
