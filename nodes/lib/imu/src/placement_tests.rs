#![allow(clippy::unwrap_used)]
use nalgebra::{UnitQuaternion, Vector3};

use super::*;
use crate::{Follow, Scheme, SiteChoice};

fn parse(placements: &str) -> Result<PlacementSet, ImuError> {
    PlacementSet::parse(
        &format!("schema: cromosim/placements/1\nplacements:\n{placements}"),
        "mine.yaml",
    )
}

fn refusal(placements: &str) -> String {
    parse(placements).unwrap_err().to_string()
}

#[test]
fn shipped_placements_are_the_demos_and_a_full_suits() {
    let names = |set: &PlacementSet| {
        set.placements()
            .iter()
            .map(|p| p.name().to_owned())
            .collect::<Vec<_>>()
    };
    let demo = PlacementSet::demo();
    assert_eq!(
        names(&demo),
        ["left_wrist", "right_ankle", "pelvis", "sternum", "head"]
    );
    assert!(demo.placements().iter().all(|p| p.rate_hz() == 100.0
        && p.scheme() == Scheme::default()
        && p.follow() == Follow::Skin));
    assert_eq!(
        demo.get("left_wrist").unwrap().site(),
        &SiteChoice::Named("left_watch".to_owned())
    );
    assert_eq!(PlacementSet::full17().placements().len(), 17);
}

#[test]
fn all_forms_are_read() {
    let set = parse(
        "  pocket: {point: [0.17, -0.42, 0.07], skin_distance: 0.01, mount: {rotvec: [0, 0, 1.5]}, follow: segment, rate_hz: 50}\n  \
         shin: {triangle: 1958, barycentrics: [0.7, 0.2, 0.1], rate_hz: 200, scheme: richardson, mount: {quaternion_xyzw: [0, 1, 0, 0]}}\n  \
         chest: {site: sternum, rate_hz: 60, device: mine.yaml, mount: {matrix: [[0, -1, 0], [1, 0, 0], [0, 0, 1]]}}\n",
    )
    .unwrap();
    let [pocket, shin, chest] = set.placements() else {
        panic!("three placements")
    };
    assert_eq!(
        (pocket.follow(), pocket.skin_distance(), pocket.rate_hz()),
        (Follow::Segment, 0.01, 50.0)
    );
    assert_eq!(
        pocket.site(),
        &SiteChoice::NearestTo(Vector3::new(0.17, -0.42, 0.07))
    );
    assert!((pocket.mount().scaled_axis() - Vector3::z() * 1.5).norm() < 1e-12);
    assert_eq!(
        (shin.scheme(), shin.site()),
        (
            Scheme::Richardson,
            &SiteChoice::Triangle {
                triangle: 1958,
                barycentrics: [0.7, 0.2, 0.1]
            }
        )
    );
    assert!((shin.mount().angle() - std::f64::consts::PI).abs() < 1e-12);
    assert_eq!(chest.device(), Some("mine.yaml"));
    assert!(
        chest.mount().angle_to(&UnitQuaternion::from_scaled_axis(
            Vector3::z() * std::f64::consts::FRAC_PI_2
        )) < 1e-9
    );
}

#[test]
fn a_list_with_names_and_defaults_are_read() {
    let text = "schema: cromosim/placements/1\ndefaults: {rate_hz: 64, device: ideal, scheme: triangle, follow: segment}\nplacements:\n\
                - {name: a, site: sternum}\n- {name: b, site: sacrum, rate_hz: 32, follow: skin}\n";
    let set = PlacementSet::parse(text, "list.yaml").unwrap();
    let (a, b) = (set.get("a").unwrap(), set.get("b").unwrap());
    assert_eq!(
        (a.rate_hz(), a.follow(), a.device(), a.scheme()),
        (64.0, Follow::Segment, Some("ideal"), Scheme::Triangle)
    );
    assert_eq!((b.rate_hz(), b.follow()), (32.0, Follow::Skin));
}

#[test]
fn resolved_placements_are_written_and_read_back() {
    for set in [
        PlacementSet::demo(),
        PlacementSet::full17(),
        parse("  x: {triangle: 7, barycentrics: [0, 0.5, 0.5], rate_hz: 9}\n").unwrap(),
    ] {
        assert_eq!(
            PlacementSet::parse(&set.to_yaml(), "again.yaml").unwrap(),
            set,
            "{}",
            set.to_yaml()
        );
    }
}

#[test]
fn refusals_name_file_placement_and_field() {
    let cases = [
        (
            "  a: {site: sternum, rate_hz: -100}",
            "mine.yaml: placement `a`: rate_hz: -100 is out of range; it must be positive",
        ),
        (
            "  a: {site: sternum, rate_hz: .nan}",
            "rate_hz: NaN is out of range",
        ),
        (
            "  a: {site: sternum}",
            "mine.yaml: placement `a`: rate_hz: missing; give it here or under `defaults`",
        ),
        ("  a: {rate_hz: 100}", "placement `a`: site: 0 of `site`"),
        (
            "  a: {rate_hz: 100, site: x, point: [0, 0, 0]}",
            "placement `a`: site: 2 of `site`",
        ),
        (
            "  a: {rate_hz: 100, triangle: 3}",
            "placement `a`: barycentrics: missing",
        ),
        (
            "  a: {rate_hz: 100, barycentrics: [1, 0, 0]}",
            "placement `a`: triangle: missing",
        ),
        (
            "  a: {rate_hz: 100, point: [0, .inf, 0]}",
            "placement `a`: point: inf is out of range",
        ),
        (
            "  left wrist: {site: sternum, rate_hz: 100}",
            "placement `left wrist`: name: `left wrist` is no ROS name",
        ),
        (
            "  1st: {site: sternum, rate_hz: 100}",
            "`1st` is no ROS name",
        ),
        (
            "  a__b: {site: sternum, rate_hz: 100}",
            "`a__b` is no ROS name",
        ),
        (
            "- {site: sternum, rate_hz: 100}",
            "placement `#1`: name: `` is no ROS name",
        ),
        (
            "- {name: a, site: s, rate_hz: 1}\n- {name: a, site: s, rate_hz: 1}",
            "placement `a`: name: there is another placement",
        ),
        (
            "  a: {site: sternum, rate_hz: 100, skin_distance: 3}",
            "skin_distance: 3 is out of range; metres",
        ),
        (
            "  a: {site: sternum, rate_hz: 100, colour: red}",
            "mine.yaml: placement `a`: fields: unknown field `colour`",
        ),
        (
            "  a: {site: sternum, rate_hz: 100, scheme: magic}",
            "mine.yaml: placement `a`: fields:",
        ),
        (
            "  a: {site: s, rate_hz: 1, mount: {}}",
            "placement `a`: mount: 0 of `rotvec`",
        ),
        (
            "  a: {site: s, rate_hz: 1, mount: {matrix: [[2, 0, 0], [0, 1, 0], [0, 0, 1]]}}",
            "mount.matrix: the matrix is not a rotation",
        ),
        (
            "  a: {site: s, rate_hz: 1, mount: {matrix: [[1, 0, 0], [0, 1, 0], [0, 0, -1]]}}",
            "mount.matrix: the matrix is not a rotation",
        ),
        (
            "  a: {site: s, rate_hz: 1, mount: {quaternion_xyzw: [0, 0, 0, 0]}}",
            "mount.quaternion_xyzw: 0 is out of range",
        ),
        (
            "  a: {site: s, rate_hz: 1, mount: {rotvec: [0, .nan, 0]}}",
            "mount.rotvec: NaN is out of range",
        ),
        (
            "  a: {name: b, site: s, rate_hz: 1}",
            "placement `a`: name: given twice",
        ),
        (
            "  7",
            "mine.yaml: placement `(all)`: placements: expected a map or a list",
        ),
    ];
    for (text, expected) in cases {
        let message = refusal(text);
        assert!(message.contains(expected), "{text}\n{message}\n{expected}");
        assert!(!message.contains('\n'), "one line: {message}");
    }
}

#[test]
fn files_of_another_kind_are_refused() {
    let other =
        PlacementSet::parse("schema: cromosim/effects/1\nplacements: {}\n", "e.yaml").unwrap_err();
    assert_eq!(
        other.to_string(),
        "e.yaml: schema: expected `cromosim/placements/1`, found `cromosim/effects/1`"
    );
    assert!(
        PlacementSet::parse("schema: [\n", "broken.yaml")
            .unwrap_err()
            .to_string()
            .starts_with("broken.yaml: ")
    );
    let missing = PlacementSet::read(Path::new("no/such/file.yaml")).unwrap_err();
    assert!(
        missing.to_string().starts_with("no/such/file.yaml: "),
        "{missing}"
    );
}
