//! Motions whose poses, accelerations and angular velocities are closed forms: no spline, no
//! differences, no integration over time.
//!
//! A motion is a chain of slides along and turns about axes that are fixed in the link before. What a
//! link adds is that of a moving frame: with r from the chain's last point to the next (world axes), a
//! turns' rate w and its derivative e, `p + r`, `a + e x r + w x (w x r) + 2 w x r' + r''`, and, for
//! a turn about the axis u, `w + u f'`, `e + u f'' + w x u f'`, `R exp(u f)`.
//!
//! Readings are those of the instant, 240 times a second. No low-pass is needed, as the physics'
//! impacts do: nearly all of the fastest burst (9 Hz under an envelope of 0.08 s, whose spectrum has
//! a standard deviation of 2 Hz) is below 15 Hz.

use std::f64::consts::TAU;

use cromosim_imu::{GRAVITY_IN_WORLD, Reading, normal_pair};
use cromosim_spatial::so3;
use nalgebra::{Complex, Isometry3, UnitQuaternion, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha12Rng;

use super::truth::{KnownMotion, KnownSite, POSITIONS};
use crate::seeds::mixed_seed;

/// Of poses and readings, Hz; the physics' rate.
pub(super) const RATE_HZ: f64 = 240.0;
/// Length of a motion, s.
const SECONDS: f64 = 15.0;
/// Mean time from a burst to the next, s.
const BETWEEN_BURSTS_S: f64 = 1.2;
/// How fast people sway, Hz.
const SWAY_HZ: [f64; 2] = [0.2, 0.8];
/// Bursts' oscillation, Hz, and the standard deviation of their envelope, s.
const BURST_HZ: [f64; 2] = [1.0, 9.0];
const BURST_S: [f64; 2] = [0.08, 0.5];

/// How a motion is drawn.
type Draw = fn(&mut Draws) -> Vec<Link>;

const KINDS: [(&str, Draw); 5] = [
    ("sways_and_bursts", sways_and_bursts),
    ("pendulum", pendulum),
    ("cone", cone),
    ("screw", screw),
    ("circle", circle),
];

/// One motion of each kind with as many bodies as there are positions, each drawn anew; the same for
/// the same seed and repeat.
pub(super) fn analytic_motions(seed: u64, repeat: u64) -> Vec<KnownMotion> {
    let motion = |(kind, (name, draw)): (usize, &(&'static str, Draw))| {
        let body = |body: usize| {
            let seed = mixed_seed(&[seed, kind as u64, repeat, body as u64]);
            let mut draws = Draws(ChaCha12Rng::seed_from_u64(seed));
            known(&draw(&mut draws))
        };
        KnownMotion {
            name,
            rate_hz: RATE_HZ,
            sites: (0..POSITIONS.len()).map(body).collect(),
        }
    };
    KINDS.iter().enumerate().map(motion).collect()
}

/// Poses and readings at [`RATE_HZ`].
fn known(links: &[Link]) -> KnownSite {
    let instants: Vec<Instant> = (0..=(SECONDS * RATE_HZ) as usize)
        .map(|k| Instant::of(links, k as f64 / RATE_HZ))
        .collect();
    KnownSite {
        position: "body",
        poses: instants.iter().map(Instant::pose).collect(),
        readings: instants.iter().map(Instant::reading).collect(),
    }
}

/// A summand of a course: `f = A exp(-q s^2 / 2) cos(w s + phase)`, where s is the time from its
/// centre.
#[derive(Clone, Copy)]
struct Wave {
    /// A, m or rad.
    size: f64,
    /// w, rad/s.
    pulsation: f64,
    /// rad.
    phase: f64,
    /// s.
    centre: f64,
    /// q, 1/s2: one over the square of the envelope's standard deviation; 0 without an envelope.
    narrowness: f64,
}

impl Wave {
    /// f, f', f'' at a time, s: the real parts of z, g z and (g^2 - q) z, where
    /// `z = A exp(-q s^2 / 2 + i (w s + phase))` and `g = z' / z = -q s + i w`.
    fn at(&self, time: f64) -> [f64; 3] {
        let (s, q) = (time - self.centre, self.narrowness);
        let z = Complex::from_polar(
            self.size * (-0.5 * q * s * s).exp(),
            self.pulsation * s + self.phase,
        );
        let g = Complex::new(-q * s, self.pulsation);
        [z.re, (g * z).re, ((g * g - q) * z).re]
    }
}

/// How far a link slides, m, or turns, rad: `start + rate t` and waves.
#[derive(Clone, Default)]
struct Course {
    start: f64,
    rate: f64,
    waves: Vec<Wave>,
}

impl Course {
    fn still(start: f64) -> Self {
        Self {
            start,
            ..Self::default()
        }
    }

    /// The course with its first and second derivative at a time, s.
    fn at(&self, time: f64) -> [f64; 3] {
        let mut sum = [self.start + self.rate * time, self.rate, 0.0];
        for wave in &self.waves {
            let own = wave.at(time);
            (0..3).for_each(|order| sum[order] += own[order]);
        }
        sum
    }

    /// `factor` times as far.
    fn scaled(mut self, factor: f64) -> Self {
        self.start *= factor;
        self.rate *= factor;
        self.waves.iter_mut().for_each(|wave| wave.size *= factor);
        self
    }
}

/// A link of a chain; axes are unit vectors that are fixed in the link before.
enum Link {
    Slide(Vector3<f64>, Course),
    Turn(Vector3<f64>, Course),
}

/// The end of a chain at a time; world axes.
struct Instant {
    /// m.
    position: Vector3<f64>,
    /// m/s2.
    acceleration: Vector3<f64>,
    world_from_sensor: UnitQuaternion<f64>,
    /// rad/s.
    angular_velocity: Vector3<f64>,
    /// rad/s2.
    angular_acceleration: Vector3<f64>,
}

impl Instant {
    fn of(links: &[Link], time: f64) -> Self {
        let rest = Self {
            position: Vector3::zeros(),
            acceleration: Vector3::zeros(),
            world_from_sensor: UnitQuaternion::identity(),
            angular_velocity: Vector3::zeros(),
            angular_acceleration: Vector3::zeros(),
        };
        links.iter().fold(rest, |before, link| match link {
            Link::Slide(axis, course) => before.slid(axis, course.at(time)),
            Link::Turn(axis, course) => before.turned(axis, course.at(time)),
        })
    }

    /// Behind a slide by f along an axis.
    fn slid(self, axis: &Vector3<f64>, [f, first, second]: [f64; 3]) -> Self {
        let axis = self.world_from_sensor * axis;
        let (arm, rate) = (axis * f, self.angular_velocity);
        let tangential = self.angular_acceleration.cross(&arm);
        let centripetal = rate.cross(&rate.cross(&arm));
        let coriolis = 2.0 * rate.cross(&(axis * first));
        Self {
            position: self.position + arm,
            acceleration: self.acceleration + tangential + centripetal + coriolis + axis * second,
            ..self
        }
    }

    /// Behind a turn by f about an axis.
    fn turned(self, own_axis: &Vector3<f64>, [f, first, second]: [f64; 3]) -> Self {
        let axis = self.world_from_sensor * own_axis;
        let added = axis * first;
        Self {
            world_from_sensor: self.world_from_sensor * so3::exp(&(own_axis * f)),
            angular_velocity: self.angular_velocity + added,
            angular_acceleration: self.angular_acceleration
                + axis * second
                + self.angular_velocity.cross(&added),
            ..self
        }
    }

    fn pose(&self) -> Isometry3<f64> {
        Isometry3::from_parts(self.position.into(), self.world_from_sensor)
    }

    fn reading(&self) -> Reading {
        let sensor_from_world = self.world_from_sensor.inverse();
        Reading {
            specific_force: sensor_from_world * (self.acceleration - GRAVITY_IN_WORLD),
            angular_velocity: sensor_from_world * self.angular_velocity,
        }
    }
}

const X: Vector3<f64> = Vector3::new(1.0, 0.0, 0.0);
const Y: Vector3<f64> = Vector3::new(0.0, 1.0, 0.0);
const Z: Vector3<f64> = Vector3::new(0.0, 0.0, 1.0);
const AXES: [Vector3<f64>; 3] = [X, Y, Z];

/// Position and attitude sway without end, and now and then burst together.
fn sways_and_bursts(draws: &mut Draws) -> Vec<Link> {
    let bursts = draws.bursts();
    let mut links = Vec::new();
    for axis in AXES {
        let mut waves = vec![draws.sway([0.05, 0.2]), draws.sway([0.05, 0.2])];
        for burst in &bursts {
            // By its largest acceleration, m/s2.
            let size = draws.size([1.0, 15.0]) / (burst.pulsation.powi(2) + burst.narrowness);
            waves.push(draws.again(burst, size));
        }
        links.push(Link::Slide(
            axis,
            Course {
                waves,
                ..Course::default()
            },
        ));
    }
    links.push(draws.attitude());
    for axis in AXES {
        let mut waves = vec![draws.sway([0.1, 0.4])];
        for burst in &bursts {
            // By its largest angular velocity, rad/s.
            let size = draws.size([0.3, 5.0]) / (burst.pulsation.powi(2) + burst.narrowness).sqrt();
            waves.push(draws.again(burst, size));
        }
        links.push(Link::Turn(
            axis,
            Course {
                waves,
                ..Course::default()
            },
        ));
    }
    links
}

/// A rod that swings about two level axes at one frequency, as arms and legs do, and twists.
fn pendulum(draws: &mut Draws) -> Vec<Link> {
    let heading = Course::still(draws.angle());
    let hz = draws.size([0.4, 1.2]);
    let swing = draws.wave([0.2, 0.7], hz);
    let across = draws.wave([0.02, 0.2], hz);
    let twist = draws.sway([0.1, 0.5]);
    let only = |wave: Wave| Course {
        waves: vec![wave],
        ..Course::default()
    };
    vec![
        Link::Turn(Z, heading),
        Link::Turn(Y, only(swing)),
        Link::Turn(X, only(across)),
        Link::Slide(Z, Course::still(-draws.size([0.2, 0.7]))),
        Link::Turn(Z, only(twist)),
        draws.attitude(),
    ]
}

/// A rod that goes round on a cone whose opening nods.
fn cone(draws: &mut Draws) -> Vec<Link> {
    let round = Course {
        start: draws.angle(),
        rate: draws.either() * TAU * draws.size([0.4, 1.2]),
        waves: Vec::new(),
    };
    let hz = draws.size([1.0, 3.0]);
    let opening = Course {
        start: draws.size([0.2, 0.6]),
        rate: 0.0,
        waves: vec![draws.wave([0.02, 0.1], hz)],
    };
    vec![
        Link::Turn(Z, round),
        Link::Turn(Y, opening),
        Link::Slide(Z, Course::still(-draws.size([0.2, 0.7]))),
        draws.attitude(),
    ]
}

/// Round and along an axis of any direction, at a rate that sways.
fn screw(draws: &mut Draws) -> Vec<Link> {
    let metres_a_turn = draws.size([0.05, 0.3]);
    let hz = draws.size(SWAY_HZ);
    round(draws, hz, metres_a_turn)
}

/// Round an axis, at a rate that changes faster than people sway.
fn circle(draws: &mut Draws) -> Vec<Link> {
    let hz = draws.size([0.8, 2.0]);
    round(draws, hz, 0.0)
}

/// A screw whose rate w varies within `w (1 ± part)`, `hz` times a second.
fn round(draws: &mut Draws, hz: f64, metres_a_turn: f64) -> Vec<Link> {
    let rate = draws.either() * TAU * draws.size([0.2, 0.8]);
    let part = draws.size([0.4, 1.2]);
    let mut varying = draws.wave([1.0, 1.0], hz);
    varying.size = part * rate / varying.pulsation;
    let course = Course {
        start: draws.angle(),
        rate,
        waves: vec![varying],
    };
    vec![
        draws.attitude(),
        Link::Turn(Z, course.clone()),
        Link::Slide(Z, course.scaled(metres_a_turn / TAU)),
        Link::Slide(X, Course::still(draws.size([0.1, 0.4]))),
        draws.attitude(),
    ]
}

/// Random numbers for one body.
struct Draws(ChaCha12Rng);

impl Draws {
    /// A size within a range; its logarithm is uniform.
    fn size(&mut self, [low, high]: [f64; 2]) -> f64 {
        low * (high / low).powf(self.0.random::<f64>())
    }

    /// Uniform, rad.
    fn angle(&mut self) -> f64 {
        TAU * self.0.random::<f64>()
    }

    /// 1 or -1.
    fn either(&mut self) -> f64 {
        if self.0.random::<bool>() { 1.0 } else { -1.0 }
    }

    /// A fixed turn about an axis of any direction: uniform in angle, not among rotations, which
    /// nothing here rests on.
    fn attitude(&mut self) -> Link {
        let ([x, y], [z, _]) = (normal_pair(&mut self.0), normal_pair(&mut self.0));
        let axis = Vector3::new(x, y, z).try_normalize(0.0).unwrap_or(X);
        Link::Turn(axis, Course::still(self.angle()))
    }

    /// Without an envelope.
    fn wave(&mut self, sizes: [f64; 2], hz: f64) -> Wave {
        Wave {
            size: self.size(sizes),
            pulsation: TAU * hz,
            phase: self.angle(),
            centre: 0.0,
            narrowness: 0.0,
        }
    }

    fn sway(&mut self, sizes: [f64; 2]) -> Wave {
        let hz = self.size(SWAY_HZ);
        self.wave(sizes, hz)
    }

    /// Bursts of size 1, whose times are those of a Poisson process.
    fn bursts(&mut self) -> Vec<Wave> {
        let (mut bursts, mut centre) = (Vec::new(), 0.0);
        loop {
            centre -= BETWEEN_BURSTS_S * (1.0 - self.0.random::<f64>()).ln();
            if centre > SECONDS {
                return bursts;
            }
            let hz = self.size(BURST_HZ);
            let narrowness = self.size(BURST_S).powi(-2);
            bursts.push(Wave {
                centre,
                narrowness,
                ..self.wave([1.0, 1.0], hz)
            });
        }
    }

    /// A burst on another axis: of this size, with a phase of its own.
    fn again(&mut self, burst: &Wave, size: f64) -> Wave {
        let phase = self.angle();
        Wave {
            size,
            phase,
            ..*burst
        }
    }
}

#[cfg(test)]
#[path = "analytic_tests.rs"]
mod tests;
