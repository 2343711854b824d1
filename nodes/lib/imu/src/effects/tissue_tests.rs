use super::*;

const RATE_HZ: f64 = 200.0;

fn tissue(natural_hz: f64, damping_ratio: f64) -> Tissue {
    Tissue {
        filter: SecondOrder {
            natural_hz,
            damping_ratio,
        },
    }
}

/// Gravity, and motion of some m/s2 up to 9 Hz.
fn force(t: f64) -> Vector3<f64> {
    let wave = |hz: f64, phase: f64| (TAU * hz * t + phase).sin();
    Vector3::new(
        3.0 * wave(2.0, 0.3) + wave(7.0, 1.0),
        2.0 * wave(3.1, 1.2),
        9.8 + 2.0 * wave(4.3, 0.1) + wave(9.0, 2.0),
    )
}

/// Up to 12 rad/s and 100 rad/s2.
fn turning(t: f64) -> Turning {
    let wave = |size: f64, hz: f64| {
        let (sin, cos) = (TAU * hz * t).sin_cos();
        [size * sin, size * TAU * hz * cos]
    };
    let axes = [wave(8.0, 1.3), wave(5.0, 2.1), wave(7.0, 0.7)];
    Turning {
        velocity: Vector3::from(axes.map(|axis| axis[0])),
        acceleration: Vector3::from(axes.map(|axis| axis[1])),
    }
}

/// The readings by Runge and Kutta's method on the equation of the module's documentation, in steps
/// of 20 us.
fn by_small_steps(tissue: &Tissue, count: usize) -> Vec<Vector3<f64>> {
    let steps = 250;
    let h = 1.0 / RATE_HZ / f64::from(steps);
    let (natural, z) = (TAU * tissue.filter.natural_hz, tissue.filter.damping_ratio);
    let spring = |d: &Vector3<f64>, speed: &Vector3<f64>| {
        -(d * (natural * natural) + speed * (2.0 * z * natural))
    };
    let slope = |t: f64, (d, speed): (Vector3<f64>, Vector3<f64>)| {
        let Turning {
            velocity: w,
            acceleration,
        } = turning(t);
        let turned = w.cross(&speed) * 2.0 + acceleration.cross(&d) + w.cross(&w.cross(&d));
        (speed, spring(&d, &speed) - force(t) - turned)
    };
    let (mut d, mut speed) = (-force(0.0) / (natural * natural), Vector3::zeros());
    let mut readings = Vec::new();
    for k in 0..count {
        readings.push(spring(&d, &speed));
        for step in 0..steps {
            let t = k as f64 / RATE_HZ + f64::from(step) * h;
            let after = |part: f64, of: &(Vector3<f64>, Vector3<f64>)| {
                (d + of.0 * (part * h), speed + of.1 * (part * h))
            };
            let a = slope(t, (d, speed));
            let b = slope(t + 0.5 * h, after(0.5, &a));
            let c = slope(t + 0.5 * h, after(0.5, &b));
            let e = slope(t + h, after(1.0, &c));
            d += (a.0 + (b.0 + c.0) * 2.0 + e.0) * (h / 6.0);
            speed += (a.1 + (b.1 + c.1) * 2.0 + e.1) * (h / 6.0);
        }
    }
    readings
}

fn largest_difference(a: &[Vector3<f64>], b: &[Vector3<f64>]) -> f64 {
    a.iter()
        .zip(b)
        .map(|(a, b)| (a - b).norm())
        .fold(0.0, f64::max)
}

#[test]
fn the_mass_moves_as_its_equation_says() {
    let count = 600;
    let time = |k: usize| k as f64 / RATE_HZ;
    for natural_hz in [2.0, 5.0, 9.6, 20.0, 60.0] {
        for damping_ratio in [0.05, 0.3, 1.2] {
            let tissue = tissue(natural_hz, damping_ratio);
            let expected = by_small_steps(&tissue, count);
            let mut offline: Vec<Vector3<f64>> = (0..count).map(|k| force(time(k))).collect();
            tissue.apply(&mut offline, |k| turning(time(k)), RATE_HZ);
            // At the ends there is no sample beyond.
            let kept = 40..count - 5;
            let error = largest_difference(&offline[kept.clone()], &expected[kept]);
            let mut live = StreamedTissue::new(tissue);
            let live: Vec<Vector3<f64>> = (0..count)
                .map(|k| live.push(force(time(k)), &turning(time(k)), 1.0 / RATE_HZ))
                .collect();
            let live_error = largest_difference(&live[40..], &expected[40..]);
            assert!(
                error < 0.005 && live_error < 0.05,
                "{natural_hz} Hz, {damping_ratio}: {error}, live {live_error}"
            );
        }
    }
}

#[test]
fn without_rotation_it_is_the_filter_of_base_excitation() {
    let tissue = tissue(9.0, 0.2);
    for hz in [0.5, 3.0, 9.0, 12.0, 25.0] {
        let mut series: Vec<Vector3<f64>> = (0..4000)
            .map(|k| Vector3::x() * (TAU * hz * f64::from(k) / RATE_HZ).sin())
            .collect();
        tissue.apply(&mut series, |_| Turning::default(), RATE_HZ);
        // (1 + 2 i z r) / (1 - r^2 + 2 i z r)
        let r = hz / 9.0;
        let (real, imaginary) = (1.0 - r * r, 0.4 * r);
        let square = real * real + imaginary * imaginary;
        let (a, b) = (
            (real + imaginary * imaginary) / square,
            (imaginary * real - imaginary) / square,
        );
        for (k, value) in series.iter().enumerate().take(3990).skip(2000) {
            let (sin, cos) = (TAU * hz * k as f64 / RATE_HZ).sin_cos();
            assert!(
                (value.x - a * sin - b * cos).abs() < 0.003 * a.hypot(b),
                "{hz} Hz"
            );
        }
    }
}

#[test]
fn a_mass_at_rest_stays_in_its_sag() {
    let gravity = Vector3::new(1.0, -2.0, 9.4);
    for natural_hz in [0.2, 2.0, 31.0, 60.0, 500.0] {
        let tissue = tissue(natural_hz, 0.3);
        let mut series = vec![gravity; 300];
        tissue.apply(&mut series, |_| Turning::default(), RATE_HZ);
        assert!(series.iter().all(|value| (value - gravity).norm() < 1e-8));
    }
}

#[test]
fn uneven_samples_are_followed() {
    let tissue = tissue(9.6, 0.3);
    let expected = by_small_steps(&tissue, 400);
    let mut live = StreamedTissue::new(tissue);
    let mut before = 0.0;
    for k in (0..400).filter(|k| k % 7 != 3) {
        let t = k as f64 / RATE_HZ;
        let reading = live.push(force(t), &turning(t), t - before);
        before = t;
        if k > 60 {
            assert!((reading - expected[k]).norm() < 0.3, "{k}");
        }
    }
    live.reset();
    assert_eq!(live.push(force(0.0), &turning(0.0), 0.1), force(0.0));
}
