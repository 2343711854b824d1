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
        within(&motion, arrives_s, &options).map(|part| {
            part.map(|(begins_s, part)| (begins_s, part.frames.len(), part.frames[0].clone()))
        })
    };
    let rate_hz = motion.rate_hz;
    let frames = |seconds: f64| (seconds * rate_hz).round() as usize + 1;
    // There already: cut at the window's start; between two frames, the next one.
    let (begins_s, count, first) = cut(0.5, 1.0, None).unwrap().unwrap();
    assert!((begins_s, count) == (0.0, frames(0.5)) && first == motion.frames[frames(0.5) - 1]);
    let (begins_s, _, first) = cut(0.0, 0.5 + 0.25 / rate_hz, None).unwrap().unwrap();
    assert!((begins_s - 0.75 / rate_hz).abs() < 1e-9 && first == motion.frames[frames(0.5)]);
    // Still to come: later by so much, and with what is left of the window.
    assert_eq!(
        cut(2.0, 0.5, Some(2.0))
            .unwrap()
            .map(|(begins_s, count, _)| (begins_s, count)),
        Some((1.5, frames(0.5)))
    );
    assert_eq!(cut(2.0, 0.5, Some(1.0)).unwrap(), None);
    // Gone.
    assert!(cut(0.0, 1.5, None).is_err());
}
