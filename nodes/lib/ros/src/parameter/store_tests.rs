#![allow(clippy::unwrap_used)]

use super::*;

fn parameters() -> Parameters {
    let parameters = Parameters::new();
    parameters
        .declare(
            Parameter::new("rate_hz", 100.0)
                .about("Output rate.")
                .range(1.0, 1000.0),
        )
        .unwrap();
    parameters
        .declare(Parameter::new("seed", 1_i64).read_only())
        .unwrap();
    parameters
}

fn apply(parameters: &Parameters, line: &[&str]) -> RosResult<()> {
    let args = RosArgs::parse(std::iter::once("--ros-args").chain(line.iter().copied()))?;
    parameters.apply(&args, &args.node_name("n")?)
}

#[test]
fn the_last_word_on_the_command_line_counts() {
    let text = "/**:\n  ros__parameters:\n    rate_hz: 10\n    seed: 5\nn:\n  ros__parameters:\n    rate_hz: 20\n\
                m:\n  ros__parameters:\n    rate_hz: 30\n";
    let file = tempfile::Builder::new().suffix(".yaml").tempfile().unwrap();
    std::fs::write(file.path(), text).unwrap();
    let path = file.path().to_str().unwrap();
    for (line, rate_hz) in [
        (vec!["--params-file", path], 20.0),
        (vec!["--params-file", path, "-p", "rate_hz:=40"], 40.0),
        (vec!["-p", "rate_hz:=40", "--params-file", path], 20.0),
        (vec!["-p", "rate_hz:=40", "-p", "m:rate_hz:=50"], 40.0),
    ] {
        let given = parameters();
        apply(&given, &line).unwrap();
        assert_eq!(given.get::<f64>("rate_hz"), Some(rate_hz), "{line:?}");
    }
    let given = parameters();
    apply(&given, &["--params-file", path]).unwrap();
    assert_eq!(given.get::<i64>("seed"), Some(5));
    std::fs::write(
        file.path(),
        "n:\n  ros__parameters:\n    rate_hz: 10\n    sede: 5\n",
    )
    .unwrap();
    let error = apply(&given, &["--params-file", path])
        .unwrap_err()
        .to_string();
    assert!(
        error.ends_with(".yaml, line 4: unknown parameter 'sede', did you mean 'seed'?"),
        "{error}"
    );
}

#[test]
fn bounds_types_and_names_are_checked_with_their_place() {
    for (given, expected) in [
        (
            "rate_hz:=0.5",
            "--ros-args -p rate_hz:=0.5: parameter 'rate_hz': expected 1 to 1000, found 0.5",
        ),
        ("rate_hz:=-100", "expected 1 to 1000, found -100"),
        ("rate_hz:=.nan", "expected 1 to 1000"),
        ("seed:=1.5", "expected an integer, found 1.5"),
        ("sede:=1", "unknown parameter 'sede', did you mean 'seed'?"),
        ("rate:=1", "did you mean 'rate_hz'?"),
        (
            "entirely_different:=1",
            "unknown parameter 'entirely_different'",
        ),
        (
            "qos_overrides./imu.publisher.depth:=0",
            "expected a whole number from 1, found '0'",
        ),
        (
            "qos_overrides.imu.publisher.depth:=1",
            "qos_overrides./TOPIC.publisher.POLICY",
        ),
        (
            "qos_overrides./imu.publisher.deep:=1",
            "one of the policies",
        ),
    ] {
        let text = apply(&parameters(), &["-p", given])
            .unwrap_err()
            .to_string();
        assert!(text.contains(expected), "{text}");
    }
}

#[test]
fn changes_at_run_time_follow_the_rules_all_or_none() {
    let parameters = parameters();
    parameters.set("rate_hz", 50.0).unwrap();
    assert!(
        parameters
            .set("seed", 2_i64)
            .unwrap_err()
            .to_string()
            .contains("read-only")
    );
    let both = [
        ("rate_hz".to_owned(), ParameterValue::Double(60.0)),
        ("nowhere".to_owned(), ParameterValue::Boolean(true)),
    ];
    assert!(parameters.set_all(&both, "test").is_err());
    assert_eq!(parameters.get::<f64>("rate_hz"), Some(50.0));
    parameters.set("rate_hz", 70_i64).unwrap();
    assert_eq!(parameters.get::<f64>("rate_hz"), Some(70.0));
}

#[test]
fn qos_overrides_change_presets_and_show_as_parameters() {
    let parameters = parameters();
    let line = [
        "-p",
        "qos_overrides./imu.publisher.depth:=50",
        "-p",
        "qos_overrides./imu.publisher.reliability:=best_effort",
    ];
    apply(&parameters, &line).unwrap();
    let qos = parameters
        .overridden("/imu", "publisher", Qos::reliable())
        .unwrap();
    assert_eq!(qos, Qos::reliable().depth(50).best_effort());
    assert_eq!(
        parameters
            .overridden("/imu", "subscription", Qos::reliable())
            .unwrap(),
        Qos::reliable()
    );
    assert_eq!(
        parameters.get::<i64>("qos_overrides./imu.publisher.depth"),
        Some(50)
    );
    assert_eq!(
        parameters
            .get::<String>("qos_overrides./imu.publisher.durability")
            .as_deref(),
        Some("volatile")
    );
    assert!(
        parameters
            .set("qos_overrides./imu.publisher.depth", 5_i64)
            .is_err()
    );
}
