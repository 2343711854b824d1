#![allow(clippy::unwrap_used)]
use cromosim_motion::embedded_walk;

use super::*;

fn clip() -> ActivityClip {
    let motion = embedded_walk().slice(1.0, Some(5.0)).unwrap();
    let labels = vec![Some(2); motion.frames.len()];
    ActivityClip {
        poses: motion.frames,
        rate_hz: motion.rate_hz,
        labels,
    }
}

fn draw(seed: u64) -> ClipDraw {
    ClipDraw {
        clip: 0,
        seed,
        speed: 1.0,
        samples: 90,
        windows: vec![(15, 2), (45, 2)],
    }
}

fn mean_norm(examples: &Examples, channels: std::ops::Range<usize>) -> f32 {
    let rows: Vec<&[f32]> = examples.values.chunks(examples.channels).collect();
    rows.iter()
        .map(|row| {
            row[channels.clone()]
                .iter()
                .map(|value| value * value)
                .sum::<f32>()
                .sqrt()
        })
        .sum::<f32>()
        / rows.len() as f32
}

#[test]
fn people_and_devices_differ_and_gravity_stays() {
    let (model, clips, settings) = (BodyModel::embedded(), [clip()], Settings::full(1));
    let wearings = [
        DeviceWearing::for_placement("pocket").unwrap(),
        DeviceWearing::for_placement("wrist").unwrap(),
    ];
    let player = ClipPlayer {
        model: &model,
        clips: &clips,
        wearings: &wearings,
        learned: None,
        settings: &settings,
    };
    let cut = |seed, simulator, in_place| {
        windows(
            &[draw(seed)],
            &[player.play(&draw(seed), simulator, in_place).unwrap()],
            None,
            &settings,
        )
        .unwrap()
    };
    let (one, other) = (
        cut(1, Simulator::Analytic, false),
        cut(2, Simulator::Analytic, false),
    );
    assert_eq!(
        (one.len(), one.channels, one.steps),
        (2, 12, settings.window)
    );
    assert_ne!(one.values, other.values);
    assert_eq!(one, cut(1, Simulator::Analytic, false));
    // Walking shakes a phone and a watch about the g that both feel.
    for channels in [0..3, 6..9] {
        let felt = mean_norm(&one, channels);
        println!("{felt:.2} m/s2");
        assert!((felt - 9.8).abs() < 3.0, "{felt}");
    }
    // At the joint, and in place, the same person turns alike but feels other forces.
    for another in [
        cut(1, Simulator::Joint, false),
        cut(1, Simulator::Analytic, true),
    ] {
        let apart = |channels: std::ops::Range<usize>| {
            let mut difference = one.clone();
            difference
                .values
                .iter_mut()
                .zip(&another.values)
                .for_each(|(value, other)| *value -= other);
            mean_norm(&difference, channels) / mean_norm(&one, 3..6)
        };
        assert!(
            apart(0..3) > 0.05 && apart(3..6) < 0.5,
            "{} {}",
            apart(0..3),
            apart(3..6)
        );
    }
    let refused = player
        .play(&draw(1), Simulator::Learned, false)
        .err()
        .map(|error| error.to_string());
    assert!(refused.unwrap().contains("--learned"));
}
