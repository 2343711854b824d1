#![allow(clippy::unwrap_used)]
use super::*;

/// Root mean square errors of central differences of the poses over 2h against what a motion states:
/// acceleration, m/s2, and angular velocity, rad/s; and the sizes of both.
fn errors_of_differences(links: &[Link], h: f64) -> ([f64; 2], [f64; 2]) {
    let (mut errors, mut sizes) = ([0.0; 2], [0.0; 2]);
    let times = 97;
    for k in 0..times {
        let time = 0.2 + 0.15 * f64::from(k);
        let [before, own, after] = [-h, 0.0, h].map(|away| Instant::of(links, time + away));
        let second = (before.position - 2.0 * own.position + after.position) / (h * h);
        let turn = before.world_from_sensor.inverse() * after.world_from_sensor;
        let rate = so3::log(&turn) / (2.0 * h);
        let stated = own.reading();
        let force = own.world_from_sensor.inverse() * (second - GRAVITY_IN_WORLD);
        errors[0] += (force - stated.specific_force).norm_squared();
        // Half of the turn is before the instant: the mean rate is in its axes, but for O(h^2).
        errors[1] += (rate - stated.angular_velocity).norm_squared();
        sizes[0] += own.acceleration.norm_squared();
        sizes[1] += own.angular_velocity.norm_squared();
    }
    let rms = |sums: [f64; 2]| sums.map(|sum| (sum / f64::from(times)).sqrt());
    (rms(errors), rms(sizes))
}

#[test]
fn what_is_stated_are_the_derivatives_of_the_poses() {
    for (name, draw) in KINDS {
        for seed in 0..4 {
            let links = draw(&mut Draws(ChaCha12Rng::seed_from_u64(seed)));
            let (coarse, size) = errors_of_differences(&links, 2e-3);
            let (fine, _) = errors_of_differences(&links, 1e-3);
            for channel in 0..2 {
                assert!(fine[channel] < 1e-2 * size[channel], "{name}: {fine:?}");
                // Second order: half the step, a quarter of the error.
                let order = (coarse[channel] / fine[channel]).log2();
                assert!((order - 2.0).abs() < 0.05, "{name} {channel}: {order}");
            }
        }
    }
}

/// Round a level circle of radius r at the rate w, outwards along x: `(-r w^2, 0, g)` and `(0, 0, w)`.
#[test]
fn an_even_circle_reads_as_it_should() {
    let (radius, rate) = (0.3, 4.0);
    let round = Course {
        start: 0.4,
        rate,
        waves: Vec::new(),
    };
    let links = [Link::Turn(Z, round), Link::Slide(X, Course::still(radius))];
    let reading = Instant::of(&links, 1.7).reading();
    let force = Vector3::new(-radius * rate * rate, 0.0, -GRAVITY_IN_WORLD.z);
    assert!((reading.specific_force - force).norm() < 1e-12);
    assert!((reading.angular_velocity - Z * rate).norm() < 1e-12);
}

/// A wave without an envelope is `A cos(w t + phase)`; far from its centre a burst is over.
#[test]
fn a_wave_has_the_derivatives_of_a_cosine_and_a_burst_ends() {
    let wave = Wave {
        size: 2.0,
        pulsation: 3.0,
        phase: 0.5,
        centre: 0.0,
        narrowness: 0.0,
    };
    let (sine, cosine) = (3.0f64 * 0.7 + 0.5).sin_cos();
    for (found, expected) in
        wave.at(0.7)
            .into_iter()
            .zip([2.0 * cosine, -6.0 * sine, -18.0 * cosine])
    {
        assert!((found - expected).abs() < 1e-12);
    }
    let burst = Wave {
        narrowness: 100.0,
        ..wave
    };
    assert!(burst.at(1.0).iter().all(|value| value.abs() < 1e-15));
}

#[test]
fn motions_come_again_and_are_as_fast_as_people() {
    let rms = |values: &[f64]| {
        let sum: f64 = values.iter().map(|value| value * value).sum();
        (sum / values.len() as f64).sqrt()
    };
    let [one, again, other, repeated] =
        [(5, 0), (5, 0), (6, 0), (5, 1)].map(|(seed, repeat)| analytic_motions(seed, repeat));
    assert_eq!(one.len(), KINDS.len());
    for (k, motion) in one.iter().enumerate() {
        assert_eq!(motion.sites.len(), POSITIONS.len());
        for (body, site) in motion.sites.iter().enumerate() {
            let of = |motions: &[KnownMotion]| motions[k].sites[body].poses.clone();
            assert_eq!(site.poses, of(&again));
            assert_ne!(site.poses, of(&other));
            assert_ne!(site.poses, of(&repeated));
            assert_eq!(site.poses.len(), site.readings.len());
            let force = |reading: &Reading| reading.specific_force.norm() + GRAVITY_IN_WORLD.z;
            let forces: Vec<f64> = site.readings.iter().map(force).collect();
            let rate = |reading: &Reading| reading.angular_velocity.norm();
            let rates: Vec<f64> = site.readings.iter().map(rate).collect();
            let found = [rms(&forces), rms(&rates)];
            assert!(
                (0.05..30.0).contains(&found[0]) && (0.2..12.0).contains(&found[1]),
                "{}: {found:?}",
                motion.name
            );
        }
    }
}
