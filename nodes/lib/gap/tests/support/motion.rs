//! Motions that are known exactly: position and rotation vector are sums of sinusoids, and all
//! derivatives follow by hand.

use std::f64::consts::TAU;
use std::ops::Range;

use cromosim_spatial::{KinematicTrack, Stamp};
use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha12Rng;

/// `amplitude sin(2 pi hz t + phase)`, each axis with its own phase.
#[derive(Clone, Debug)]
struct Term {
    hz: f64,
    amplitude: Vector3<f64>,
    phase: Vector3<f64>,
}

/// Position [m] and rotation vector [rad] over seconds.
#[derive(Clone, Debug, Default)]
pub struct Motion {
    position: Vec<Term>,
    rotation: Vec<Term>,
}

/// One instant: derivatives up to the second, the angular ones in the segment's axes.
#[derive(Clone, Copy, Debug)]
pub struct Instant {
    pub position: Vector3<f64>,
    pub acceleration_in_world: Vector3<f64>,
    pub world_from_segment: UnitQuaternion<f64>,
    pub angular_velocity: Vector3<f64>,
    pub angular_acceleration: Vector3<f64>,
}

/// A line each quarter of a hertz, whose derivatives of an order have the same size and are so large in all (root mean
/// square by axis).
fn lines(size: f64, order: i32, band_hz: Range<f64>, seed: u64) -> impl Iterator<Item = Term> {
    let mut random = ChaCha12Rng::seed_from_u64(seed);
    let count = (4.0 * (band_hz.end - band_hz.start)) as usize;
    (0..count).map(move |k| {
        let hz = band_hz.start + 0.25 * (k as f64 + random.random_range(0.2..0.8));
        let size = size * (2.0 / count as f64).sqrt() / (TAU * hz).powi(order);
        Term {
            hz,
            amplitude: Vector3::repeat(size),
            phase: Vector3::from_fn(|_, _| random.random_range(0.0..TAU)),
        }
    })
}

impl Motion {
    /// Ten terms from 0.2 to 4 Hz each: some 4 m/s2 and 2 rad/s (root mean square of the vectors),
    /// and 80 degrees of turn.
    pub fn random(seed: u64) -> Self {
        let mut random = ChaCha12Rng::seed_from_u64(seed);
        let terms = |random: &mut ChaCha12Rng, order: i32, size: f64, most: f64| {
            let term = |k: i32, random: &mut ChaCha12Rng| {
                // Evenly over the octaves, none at another's place.
                let hz = 0.2 * 20f64.powf((f64::from(k) + random.random_range(0.1..0.9)) / 10.0);
                let largest = (size / (TAU * hz).powi(order)).min(most);
                let amplitude = Vector3::from_fn(|_, _| largest * random.random_range(0.6..1.4));
                Term {
                    hz,
                    amplitude,
                    phase: Vector3::from_fn(|_, _| random.random_range(0.0..TAU)),
                }
            };
            (0..10).map(|k| term(k, random)).collect()
        };
        Self {
            position: terms(&mut random, 2, 1.2, 0.3),
            rotation: terms(&mut random, 1, 0.5, 0.4),
        }
    }

    /// The same way in more time.
    #[must_use]
    pub fn slowed(mut self, factor: f64) -> Self {
        for term in self.position.iter_mut().chain(&mut self.rotation) {
            term.hz /= factor;
        }
        self
    }

    /// Rest at the origin, level.
    pub fn rest() -> Self {
        Self::default()
    }

    /// To and fro at one frequency: some 0.6 m/s2, and a twentieth of a radian a second about one axis.
    pub fn sway(hz: f64) -> Self {
        let term = |amplitude: Vector3<f64>, phase: f64| Term {
            hz,
            amplitude,
            phase: Vector3::repeat(phase),
        };
        let (rate, place) = (TAU * hz, Vector3::new(0.1, 0.85, -0.2));
        Self {
            position: vec![term(place / rate.powi(2), 0.4)],
            rotation: vec![term(Vector3::new(0.02, 0.07, 0.02) / rate, 1.1)],
        }
    }

    /// To and fro at one frequency, widely: some 5 m/s2, and a radian a second about all axes.
    pub fn swing(hz: f64) -> Self {
        let rate = TAU * hz;
        let term = |amplitude: Vector3<f64>, phase: Vector3<f64>| Term {
            hz,
            amplitude,
            phase,
        };
        Self {
            position: vec![term(
                Vector3::new(4.0, 5.0, 3.0) / rate.powi(2),
                Vector3::new(0.3, 1.2, 2.5),
            )],
            rotation: vec![term(
                Vector3::new(0.9, 0.7, 1.0) / rate,
                Vector3::new(0.1, 2.0, 4.1),
            )],
        }
    }

    /// To and fro in one plane, half a radian about the axis across it; some 3 m/s2.
    pub fn pendulum() -> Self {
        let term = |hz: f64, amplitude: Vector3<f64>| Term {
            hz,
            amplitude,
            phase: Vector3::new(0.4, 0.4, 1.9),
        };
        Self {
            position: vec![
                term(0.6, Vector3::new(0.3, 0.0, 0.0)),
                term(1.2, Vector3::new(0.0, 0.0, 0.04)),
            ],
            rotation: vec![term(0.6, Vector3::new(0.0, 0.5, 0.0))],
        }
    }

    /// Half a radian to and fro about one axis, a hundredth of it about the others; some 3 m/s2.
    pub fn turning_about_one_axis() -> Self {
        let term = |hz: f64, amplitude: Vector3<f64>, phase: Vector3<f64>| Term {
            hz,
            amplitude,
            phase,
        };
        let phases = Vector3::new(0.7, 2.1, 3.9);
        Self {
            position: vec![
                term(0.9, Vector3::new(0.08, 0.03, 0.05), phases),
                term(1.7, Vector3::new(0.01, 0.02, 0.01), phases),
            ],
            rotation: vec![term(1.1, Vector3::new(0.008, 0.5, 0.006), phases)],
        }
    }

    /// The same with a shiver that no reference resolves: forty lines from 6 to 24 Hz, their accelerations (m/s2
    /// in all) in proportion to the frequency.
    #[must_use]
    pub fn shivering(mut self, acceleration: f64, seed: u64) -> Self {
        let mut random = ChaCha12Rng::seed_from_u64(seed);
        let lines: Vec<f64> = (0..40).map(|k| 6.0 + 0.45 * f64::from(k)).collect();
        let all = lines.iter().map(|hz| hz * hz).sum::<f64>().sqrt();
        self.position.extend(lines.iter().map(|hz| {
            let size = acceleration * hz / all / (TAU * hz).powi(2);
            Term {
                hz: *hz,
                amplitude: Vector3::repeat(size),
                phase: Vector3::from_fn(|_, _| random.random_range(0.0..TAU)),
            }
        }));
        self
    }

    /// The same with lines a quarter of a hertz apart, each of as much acceleration (m/s2 in all, by axis).
    #[must_use]
    pub fn humming(mut self, acceleration: f64, band_hz: Range<f64>, seed: u64) -> Self {
        self.position.extend(lines(acceleration, 2, band_hz, seed));
        self
    }

    /// The same with such lines of the rotation vector, each of as much angular velocity (rad/s).
    #[must_use]
    pub fn trembling(mut self, angular_velocity: f64, band_hz: Range<f64>, seed: u64) -> Self {
        self.rotation
            .extend(lines(angular_velocity, 1, band_hz, seed));
        self
    }

    /// The same with all frequencies so many times as high, as vigorous.
    #[must_use]
    pub fn faster(mut self, factor: f64) -> Self {
        let terms = |terms: &mut Vec<Term>, order: i32| {
            for term in terms {
                term.hz *= factor;
                term.amplitude /= factor.powi(order);
            }
        };
        terms(&mut self.position, 2);
        terms(&mut self.rotation, 1);
        self
    }

    /// As good as the same, again and again after so many seconds.
    #[must_use]
    pub fn repeated(mut self, after_s: f64) -> Self {
        for term in self.position.iter_mut().chain(&mut self.rotation) {
            term.hz = (term.hz * after_s).round() / after_s;
        }
        self
    }

    /// The same motion some seconds on: other poses, the same spectrum.
    pub fn later(&self, seconds: f64) -> Self {
        let shifted = |terms: &[Term]| {
            terms
                .iter()
                .map(|term| Term {
                    phase: term.phase.add_scalar(TAU * term.hz * seconds),
                    ..term.clone()
                })
                .collect()
        };
        Self {
            position: shifted(&self.position),
            rotation: shifted(&self.rotation),
        }
    }

    pub fn at(&self, t: f64) -> Instant {
        let [position, _, acceleration_in_world] = sum(&self.position, t);
        let [r, r_dot, r_ddot] = sum(&self.rotation, t);
        // Unit quaternion (c(x), s(x) r) of x = |r|^2: c = cos(|r|/2), s = sin(|r|/2) / |r|.
        let x = r.norm_squared();
        let (x_dot, x_ddot) = (
            2.0 * r.dot(&r_dot),
            2.0 * (r_dot.norm_squared() + r.dot(&r_ddot)),
        );
        let [c, s, s1, s2] = half_angle(x);
        let (c1, c2) = (-s / 4.0, -s1 / 4.0);
        let quaternion = |w: f64, v: Vector3<f64>| Quaternion::new(w, v.x, v.y, v.z);
        let q = quaternion(c, r * s);
        let q_dot = quaternion(c1 * x_dot, r * (s1 * x_dot) + r_dot * s);
        let q_ddot = quaternion(
            c2 * x_dot * x_dot + c1 * x_ddot,
            r * (s2 * x_dot * x_dot + s1 * x_ddot) + r_dot * (2.0 * s1 * x_dot) + r_ddot * s,
        );
        Instant {
            position,
            acceleration_in_world,
            world_from_segment: UnitQuaternion::new_unchecked(q),
            // w = 2 q* q'; of its derivative 2 (q*' q' + q* q'') the first part is real.
            angular_velocity: (q.conjugate() * q_dot).imag() * 2.0,
            angular_acceleration: (q.conjugate() * q_ddot).imag() * 2.0,
        }
    }

    /// The kinematics on a grid that begins `from` seconds after `zero`.
    pub fn track(&self, zero: Stamp, from: f64, to: f64, rate_hz: f64) -> KinematicTrack {
        let mut track = KinematicTrack {
            start: zero.plus_seconds(from),
            rate_hz,
            ..KinematicTrack::default()
        };
        for k in 0..((to - from) * rate_hz) as usize {
            let now = self.at(from + k as f64 / rate_hz);
            track.world_from_segment.push(now.world_from_segment);
            track
                .acceleration_in_segment
                .push(now.world_from_segment.inverse() * now.acceleration_in_world);
            track.angular_velocity_in_segment.push(now.angular_velocity);
            track
                .angular_acceleration_in_segment
                .push(now.angular_acceleration);
        }
        track
    }
}

/// Value and two derivatives.
fn sum(terms: &[Term], t: f64) -> [Vector3<f64>; 3] {
    let [mut value, mut first, mut second] = [Vector3::zeros(); 3];
    for term in terms {
        let rate = TAU * term.hz;
        let (sine, cosine) = (
            term.phase.map(|phase| (rate * t + phase).sin()),
            term.phase.map(|phase| (rate * t + phase).cos()),
        );
        value += term.amplitude.component_mul(&sine);
        first += term.amplitude.component_mul(&cosine) * rate;
        second -= term.amplitude.component_mul(&sine) * (rate * rate);
    }
    [value, first, second]
}

/// c, s and the first two derivatives of s; near zero by their series.
fn half_angle(x: f64) -> [f64; 4] {
    if x < 1e-4 {
        return [
            1.0 - x / 8.0 + x * x / 384.0,
            0.5 - x / 48.0 + x * x / 3840.0,
            -1.0 / 48.0 + x / 1920.0,
            1.0 / 1920.0,
        ];
    }
    let angle = x.sqrt();
    let (c, s) = ((angle / 2.0).cos(), (angle / 2.0).sin() / angle);
    let s1 = (c - 2.0 * s) / (4.0 * x);
    let s2 = (-s / 4.0 - 2.0 * s1) / (4.0 * x) - s1 / x;
    [c, s, s1, s2]
}
