//! Where the feet are: footprints, and the way from one to the next.
//!
//! A step lifts the heel while the ball stays (the toes stay flat), swings, comes down on the heel,
//! and rolls flat about it. Pivots change where the foot is flat and at rest, so that all
//! accelerations stay continuous.

use nalgebra::{Vector2, Vector3};

use super::smooth::{Knot, quintic};

/// Seconds from one heel strike to the next: 1.8 steps a second.
pub(super) const STEP_S: f64 = 1.0 / 1.8;
/// Step length of the steady walk, m.
pub(super) const STEP_LENGTH: f64 = 0.65;

const SWING_S: f64 = 0.42;
const HEEL_RISE_S: f64 = 0.29;
const ROLL_DOWN_S: f64 = 0.11;
/// Pitch of the foot at toe-off and heel strike, toes up positive, rad; and its rates, rad/s.
const PITCH_OFF: f64 = -0.82;
const RATE_OFF: f64 = -4.6;
const PITCH_STRIKE: f64 = 0.36;
const RATE_STRIKE: f64 = -1.2;
/// Pitch half-way through the swing.
const PITCH_MIDDLE: f64 = -0.38;
const RATE_MIDDLE: f64 = 5.6;

/// A flat foot: below its ankle, heading from x, rad.
#[derive(Clone, Copy, Debug)]
pub(super) struct Footprint {
    pub ankle: Vector2<f64>,
    pub heading: f64,
}

/// One step of one foot.
#[derive(Clone, Debug)]
pub(super) struct Step {
    pub from: Footprint,
    pub to: Footprint,
    pub strike_s: f64,
    /// 1 for a full walking step; scales how far the foot rolls.
    pub vigour: f64,
    /// How far the swing arches above the straight way, m.
    pub lift: f64,
}

/// The size of a foot: vectors in its own sagittal plane (forward, up), m.
#[derive(Clone, Copy, Debug)]
pub(super) struct FootSize {
    pub ankle_height: f64,
    pub ankle_from_ball: Vector2<f64>,
    pub ankle_from_heel: Vector2<f64>,
}

/// A foot at one time.
#[derive(Clone, Copy, Debug)]
pub(super) struct FootState {
    /// The ankle joint, m.
    pub ankle: Vector3<f64>,
    pub heading: f64,
    /// Toes up positive, rad.
    pub pitch: f64,
    /// The toes against the foot, upwards negative, rad.
    pub toes: f64,
}

/// One foot's whole way.
#[derive(Clone, Debug)]
pub(super) struct Foot {
    pub size: FootSize,
    pub first: Footprint,
    pub steps: Vec<Step>,
}

impl Step {
    pub fn off_s(&self) -> f64 {
        self.strike_s - SWING_S
    }

    fn heel_rise_s(&self) -> f64 {
        self.off_s() - HEEL_RISE_S
    }

    fn at_off(&self) -> Knot {
        Knot::passing(PITCH_OFF * self.vigour, RATE_OFF * self.vigour)
    }

    fn at_strike(&self) -> Knot {
        Knot::passing(PITCH_STRIKE * self.vigour, RATE_STRIKE * self.vigour)
    }

    fn pitch(&self, time: f64) -> f64 {
        let half_s = SWING_S / 2.0;
        let middle = Knot::passing(PITCH_MIDDLE * self.vigour, RATE_MIDDLE * self.vigour);
        let middle_s = self.off_s() + half_s;
        if time < self.off_s() {
            quintic(
                Knot::still(0.0),
                self.at_off(),
                HEEL_RISE_S,
                time - self.heel_rise_s(),
            )
        } else if time < middle_s {
            quintic(self.at_off(), middle, half_s, time - self.off_s())
        } else if time < self.strike_s {
            quintic(middle, self.at_strike(), half_s, time - middle_s)
        } else {
            quintic(
                self.at_strike(),
                Knot::still(0.0),
                ROLL_DOWN_S,
                time - self.strike_s,
            )
        }
    }

    fn toes(&self, time: f64) -> f64 {
        if time < self.off_s() {
            self.pitch(time)
        } else {
            quintic(
                self.at_off(),
                Knot::still(0.0),
                0.8 * SWING_S,
                time - self.off_s(),
            )
        }
    }

    /// The ankle's way through the air: quintics between the ends that the pivots prescribe, and an
    /// arch.
    fn swing(&self, size: &FootSize, time: f64) -> Vector3<f64> {
        let start = pivoted(&self.from, size, size.ankle_from_ball, self.at_off());
        let end = pivoted(&self.to, size, size.ankle_from_heel, self.at_strike());
        let u = (time - self.off_s()) / SWING_S;
        let way = Vector3::from_fn(|axis, _| {
            quintic(start[axis], end[axis], SWING_S, time - self.off_s())
        });
        // Highest at 3/8 of the way: the toes leave the floor before they move on.
        way + Vector3::z() * (self.lift * 199.0 * u.powi(3) * (1.0 - u).powi(5))
    }
}

/// The ankle's coordinates (and their rates) while the foot pitches about a pivot of its flat pose.
fn pivoted(
    print: &Footprint,
    size: &FootSize,
    ankle_from_pivot: Vector2<f64>,
    pitch: Knot,
) -> [Knot; 3] {
    let (sine, cosine) = pitch.position.sin_cos();
    let turned = Vector2::new(
        ankle_from_pivot.x * cosine - ankle_from_pivot.y * sine,
        ankle_from_pivot.x * sine + ankle_from_pivot.y * cosine,
    );
    let across = Vector2::new(-turned.y, turned.x);
    let velocity = across * pitch.velocity;
    let acceleration = across * pitch.acceleration - turned * pitch.velocity.powi(2);
    let (heading_sine, heading_cosine) = print.heading.sin_cos();
    let way = turned - ankle_from_pivot;
    let level = |start: f64, share: f64| Knot {
        position: start + share * way.x,
        velocity: share * velocity.x,
        acceleration: share * acceleration.x,
    };
    let up = Knot {
        position: size.ankle_height + way.y,
        velocity: velocity.y,
        acceleration: acceleration.y,
    };
    [
        level(print.ankle.x, heading_cosine),
        level(print.ankle.y, heading_sine),
        up,
    ]
}

impl Foot {
    /// The foot at a time: on its first print before the first step, on the last one after the
    /// last.
    pub fn at(&self, time: f64) -> FootState {
        let Some(step) = self
            .steps
            .iter()
            .rev()
            .find(|step| time >= step.heel_rise_s())
        else {
            return self.flat(&self.first);
        };
        let pitch = step.pitch(time);
        let pivot = |print: &Footprint, ankle_from_pivot: Vector2<f64>| {
            let knots = pivoted(print, &self.size, ankle_from_pivot, Knot::still(pitch));
            Vector3::from_fn(|axis, _| knots[axis].position)
        };
        let (ankle, heading) = if time < step.off_s() {
            (
                pivot(&step.from, self.size.ankle_from_ball),
                step.from.heading,
            )
        } else if time < step.strike_s {
            let turn = quintic(
                Knot::still(step.from.heading),
                Knot::still(step.to.heading),
                SWING_S,
                time - step.off_s(),
            );
            (step.swing(&self.size, time), turn)
        } else {
            (pivot(&step.to, self.size.ankle_from_heel), step.to.heading)
        };
        FootState {
            ankle,
            heading,
            pitch,
            toes: step.toes(time),
        }
    }

    fn flat(&self, print: &Footprint) -> FootState {
        let ankle = Vector3::new(print.ankle.x, print.ankle.y, self.size.ankle_height);
        FootState {
            ankle,
            heading: print.heading,
            pitch: 0.0,
            toes: 0.0,
        }
    }
}
