#![allow(clippy::unwrap_used)]
use super::*;
use crate::embedded_walk;

fn person(name: &str, others: &[Person]) -> Person {
    Person {
        name: name.to_owned(),
        label: label(name, others),
        begins_s: 0.0,
        motion: embedded_walk().slice(0.0, Some(0.1)).unwrap(),
    }
}

#[test]
fn labels_are_names_for_ros_and_differ() {
    let mut people: Vec<Person> = Vec::new();
    for (name, expected) in [
        ("3", "person_3"),
        ("img/__a b.c", "person_img_a_b_c"),
        ("img-a-b-c", "person_img_a_b_c_2"),
        ("é", "person"),
        ("", "person_2"),
    ] {
        people.push(person(name, &people));
        assert_eq!(people.last().unwrap().label, expected);
    }
}

#[test]
fn a_window_of_the_common_clock_cuts_everybody() {
    let walk = embedded_walk();
    let motion = walk.slice(0.0, Some(1.0)).unwrap();
    let cut = |arrives_s: f64, start_s: f64, duration_s: Option<f64>| {
        let options = MotionOptions {
            start_s,
            duration_s,
            ..Default::default()
        };
        let mut person = person("7", &[]);
        (person.begins_s, person.motion) = (arrives_s - start_s, motion.clone());
        let parts = within(Path::new("walk.pkl"), vec![person], &options)?;
        let PersonPart { person, frames } = &parts[0];
        let first = person.motion.frames[*frames.start()].clone();
        Ok::<_, MotionError>((
            person.time_of(*frames.start()),
            frames.clone().count(),
            first,
        ))
    };
    let rate_hz = motion.rate_hz;
    let frames = |seconds: f64| (seconds * rate_hz).round() as usize + 1;
    // There already: cut at the window's start; between two frames, the next one.
    let (begins_s, count, first) = cut(0.5, 1.0, None).unwrap();
    assert!((begins_s, count) == (0.0, frames(0.5)) && first == motion.frames[frames(0.5) - 1]);
    let (begins_s, _, first) = cut(0.0, 0.5 + 0.25 / rate_hz, None).unwrap();
    assert!((begins_s - 0.75 / rate_hz).abs() < 1e-9 && first == motion.frames[frames(0.5)]);
    // Still to come: later by so much, and with what is left of the window.
    let (begins_s, count, _) = cut(2.0, 0.5, Some(2.0)).unwrap();
    assert_eq!((begins_s, count), (1.5, frames(0.5)));
    // Still to come after the window, gone before it, between two frames of it.
    for (arrives_s, start_s, duration_s) in [
        (2.0, 0.5, Some(1.0)),
        (0.0, 1.5, None),
        (0.0, 0.25 / rate_hz, Some(0.5 / rate_hz)),
    ] {
        let said = cut(arrives_s, start_s, duration_s).unwrap_err().to_string();
        let there = format!("7 from {arrives_s:.3} to {:.3} s", arrives_s + 1.0);
        assert!(
            said.contains("at least two frames") && said.contains(&there),
            "{said}"
        );
        assert!(said.contains(&format!("start_s is {start_s}")), "{said}");
    }
    for (start_s, duration_s) in [(-1.0, None), (0.0, Some(0.0)), (f64::NAN, None)] {
        assert!(cut(0.0, start_s, duration_s).is_err());
    }
}
