//! The mass on soft tissue: spring and damper in a segment frame that turns.
//!
//! Its displacement d (segment axes) follows
//! ```text
//! d'' = -wn^2 d - 2 z wn d' - f - 2 w x d' - alpha x d - w x (w x d)
//! ```
//! and it reads `-(wn^2 d + 2 z wn d')`. With `y = -wn^2 d` and `v = y' / wn` this is the filter of
//! [`SecondOrder`] on `u = f + g(y, v)`, and it reads `y + 2 z v`; Coriolis, Euler and centrifugal
//! terms are
//! ```text
//! g = -(2 wn w x v + alpha x y + w x (w x y)) / wn^2
//! ```
//! Spring and damper are stepped exactly, so that no stiffness is too large for the grid. f and g
//! are polynomials between the samples; g at a step's end, which hangs on the state there, is
//! extrapolated and corrected.

use std::f64::consts::TAU;

use nalgebra::{Matrix2, Vector2, Vector3};

use super::filter::SecondOrder;

/// Samples whose polynomial stands for f: degree 5, error O(h^6).
const FORCE_TAPS: usize = 6;
/// The first of them, counted from the start of the step.
const FIRST_FORCE: i32 = -2;
/// Samples whose polynomial stands for what has no sample beyond the step's end: degree 3, error
/// O(h^4).
const PAST_TAPS: usize = 4;
/// The first of them.
const FIRST_PAST: i32 = -2;
/// Corrections of the turning terms at a step's end. Each takes an error to `|w| h` of it or less.
const CORRECTIONS: usize = 3;
/// Relative change of an interval from which on the samples before it say nothing of its
/// polynomial.
const UNEVEN: f64 = 0.05;

/// A mass on spring and damper.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Tissue {
    /// Of the mass without rotation.
    pub filter: SecondOrder,
}

/// How the frame turns: angular velocity and acceleration in its own axes, rad/s and rad/s2.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Turning {
    pub velocity: Vector3<f64>,
    pub acceleration: Vector3<f64>,
}

/// y and v, m/s2.
#[derive(Clone, Copy, Debug)]
struct State {
    y: Vector3<f64>,
    v: Vector3<f64>,
}

impl State {
    fn stepped(&self, turn: &Matrix2<f64>) -> Self {
        Self {
            y: self.y * turn.m11 + self.v * turn.m12,
            v: self.y * turn.m21 + self.v * turn.m22,
        }
    }

    fn with(&self, input: &Vector3<f64>, tap: &Vector2<f64>) -> Self {
        Self {
            y: self.y + input * tap.x,
            v: self.v + input * tap.y,
        }
    }
}

impl Tissue {
    /// Replaces the specific force of the segment by what a sensor on the mass reads; series on one
    /// grid. It begins in its sag under the first sample.
    pub(super) fn apply(
        &self,
        forces: &mut [Vector3<f64>],
        turning: impl Fn(usize) -> Turning,
        rate_hz: f64,
    ) {
        let Some(&first) = forces.first() else { return };
        let (turn, taps) = self
            .filter
            .step_from::<FORCE_TAPS>(1.0 / rate_hz, FIRST_FORCE);
        let (_, past) = self
            .filter
            .step_from::<PAST_TAPS>(1.0 / rate_hz, FIRST_PAST);
        let last = forces.len() - 1;
        // The samples from k - 2 to k + 3, held at the ends; the series is overwritten behind them.
        let mut around = [first; FORCE_TAPS];
        for (ahead, tap) in around[3..].iter_mut().enumerate() {
            *tap = forces[(ahead + 1).min(last)];
        }
        let mut state = State {
            y: first,
            v: Vector3::zeros(),
        };
        let mut turned = [self.turning_terms(&state, &turning(0)); PAST_TAPS - 1];
        for k in 0..=last {
            forces[k] = self.reading(&state);
            let known = state.stepped(&turn);
            let known = taps
                .iter()
                .zip(&around)
                .fold(known, |state, (tap, force)| state.with(force, tap));
            state = self.corrected(known, &mut turned, &past, &turning((k + 1).min(last)));
            around.rotate_left(1);
            around[FORCE_TAPS - 1] = forces[(k + 4).min(last)];
        }
    }

    /// The state at a step's end, of which `known` lacks the turning terms; `turned` are those of the
    /// last three samples, and is moved on.
    fn corrected(
        &self,
        known: State,
        turned: &mut [Vector3<f64>; PAST_TAPS - 1],
        taps: &[Vector2<f64>; PAST_TAPS],
        turning: &Turning,
    ) -> State {
        let known = taps
            .iter()
            .zip(turned.iter())
            .fold(known, |state, (tap, terms)| state.with(terms, tap));
        let mut terms = turned[0] - turned[1] * 3.0 + turned[2] * 3.0;
        let mut state = known;
        for _ in 0..CORRECTIONS {
            state = known.with(&terms, &taps[PAST_TAPS - 1]);
            terms = self.turning_terms(&state, turning);
        }
        turned.rotate_left(1);
        turned[PAST_TAPS - 2] = terms;
        state
    }

    /// g.
    fn turning_terms(&self, state: &State, turning: &Turning) -> Vector3<f64> {
        let natural = TAU * self.filter.natural_hz;
        let (w, alpha) = (&turning.velocity, &turning.acceleration);
        let coriolis = w.cross(&state.v) * (2.0 * natural);
        let euler = alpha.cross(&state.y);
        let centrifugal = w.cross(&w.cross(&state.y));
        -(coriolis + euler + centrifugal) / (natural * natural)
    }

    fn reading(&self, state: &State) -> Vector3<f64> {
        state.y + state.v * (2.0 * self.filter.damping_ratio)
    }
}

/// The mass as samples come: between them f is the polynomial through the last four, as nothing of
/// the future is known.
#[derive(Clone, Debug)]
pub(super) struct StreamedTissue {
    tissue: Tissue,
    /// Interval, its matrix and its weights: made anew where the interval changes.
    prepared: (f64, Matrix2<f64>, [Vector2<f64>; PAST_TAPS]),
    moving: Option<Moving>,
}

/// State, and f and g of the last samples.
#[derive(Clone, Debug)]
struct Moving {
    state: State,
    forces: [Vector3<f64>; PAST_TAPS - 1],
    turned: [Vector3<f64>; PAST_TAPS - 1],
}

impl StreamedTissue {
    pub(super) fn new(tissue: Tissue) -> Self {
        Self {
            tissue,
            prepared: (0.0, Matrix2::identity(), [Vector2::zeros(); PAST_TAPS]),
            moving: None,
        }
    }

    /// What the sensor reads for a force that comes `interval` seconds after the one before; the
    /// first finds the mass in its sag.
    pub(super) fn push(
        &mut self,
        force: Vector3<f64>,
        turning: &Turning,
        interval: f64,
    ) -> Vector3<f64> {
        let Some(moving) = &mut self.moving else {
            let state = State {
                y: force,
                v: Vector3::zeros(),
            };
            let terms = self.tissue.turning_terms(&state, turning);
            self.moving = Some(Moving {
                state,
                forces: [force; PAST_TAPS - 1],
                turned: [terms; PAST_TAPS - 1],
            });
            return self.tissue.reading(&state);
        };
        if (interval - self.prepared.0).abs() > 1e-9 {
            let is_uneven = (interval / self.prepared.0 - 1.0).abs() > UNEVEN;
            let (turn, taps) = self
                .tissue
                .filter
                .step_from::<PAST_TAPS>(interval, FIRST_PAST);
            self.prepared = (interval, turn, taps);
            if is_uneven {
                let [.., last] = moving.forces;
                let [.., terms] = moving.turned;
                // Straight from the sample before: where its line came from.
                moving.forces = [2.0, 1.0, 0.0].map(|back| last + (last - force) * back);
                moving.turned = [terms; PAST_TAPS - 1];
            }
        }
        let (_, turn, taps) = &self.prepared;
        let known = moving
            .forces
            .iter()
            .chain([&force])
            .zip(taps)
            .fold(moving.state.stepped(turn), |state, (force, tap)| {
                state.with(force, tap)
            });
        moving.forces.rotate_left(1);
        moving.forces[PAST_TAPS - 2] = force;
        moving.state = self
            .tissue
            .corrected(known, &mut moving.turned, taps, turning);
        self.tissue.reading(&moving.state)
    }

    /// Begins anew with the next input.
    pub(super) fn reset(&mut self) {
        self.moving = None;
    }
}

#[cfg(test)]
#[path = "tissue_tests.rs"]
mod tests;
