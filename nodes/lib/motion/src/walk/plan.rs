//! The course of the embedded motion: where each foot steps and when.

use std::f64::consts::FRAC_PI_2;

use nalgebra::Vector2;

use super::feet::{Foot, FootSize, Footprint, STEP_LENGTH, STEP_S, Step};

/// Sideways distance of an ankle from the course, m: walking and standing.
const HALF_TRACK: f64 = 0.085;
const HALF_STANCE: f64 = 0.10;
/// How far the feet point outwards, rad.
const TOE_OUT: f64 = 0.10;
const FIRST_STRIKE_S: f64 = 0.95;
const WALKING_STEPS: usize = 9;
const TURN_BEGINS_S: f64 = 7.9;
const TURN_STEP_S: f64 = 0.48;
const START_X: f64 = -2.5;

/// Both feet's ways: `[left, right]`.
#[derive(Clone, Debug)]
pub(super) struct Plan {
    pub feet: [Foot; 2],
}

impl Plan {
    /// Stands, walks along x in nine steps (the first and the last shorter), stands, turns a
    /// quarter to the left in three steps, stands.
    pub fn new(sizes: [FootSize; 2]) -> Self {
        let print = |side: usize, x: f64, half_width: f64| Footprint {
            ankle: Vector2::new(x, SIDES[side] * half_width),
            heading: SIDES[side] * TOE_OUT,
        };
        let foot = |side: usize| Foot {
            size: sizes[side],
            first: print(side, START_X, HALF_STANCE),
            steps: Vec::new(),
        };
        let mut plan = Self {
            feet: [foot(0), foot(1)],
        };
        let mut x = START_X;
        for index in 0..WALKING_STEPS {
            let last = index + 1 == WALKING_STEPS;
            let advance = match index {
                0 => 0.72 * STEP_LENGTH,
                _ if last => 0.0, // the closing step, up to the other foot
                _ => STEP_LENGTH,
            };
            x += advance;
            let reach = if index == 0 || last { 0.75 } else { 1.0 };
            let half_width = if index + 2 >= WALKING_STEPS {
                HALF_STANCE
            } else {
                HALF_TRACK
            };
            let strike_s = FIRST_STRIKE_S + index as f64 * STEP_S;
            plan.step(
                index % 2,
                print(index % 2, x, half_width),
                strike_s,
                reach,
                0.012 + 0.012 * reach,
            );
        }
        let centre = Vector2::new(x, 0.0);
        for (index, turn) in [0.5, 1.0, 1.0].into_iter().enumerate() {
            let (side, turn) = (index % 2, turn * FRAC_PI_2);
            let to = Footprint {
                ankle: centre + Vector2::new(-turn.sin(), turn.cos()) * (SIDES[side] * HALF_STANCE),
                heading: turn + SIDES[side] * TOE_OUT,
            };
            plan.step(
                side,
                to,
                TURN_BEGINS_S + (index as f64 + 1.0) * TURN_STEP_S,
                0.35,
                0.035,
            );
        }
        plan
    }

    fn step(&mut self, side: usize, to: Footprint, strike_s: f64, vigour: f64, lift: f64) {
        let foot = &mut self.feet[side];
        let from = foot.steps.last().map_or(foot.first, |step| step.to);
        foot.steps.push(Step {
            from,
            to,
            strike_s,
            vigour,
            lift,
        });
    }

    /// All steps with the side of the foot: +1 left, -1 right.
    pub fn steps(&self) -> impl Iterator<Item = (f64, &Step)> {
        self.feet
            .iter()
            .zip(SIDES)
            .flat_map(|(foot, side)| foot.steps.iter().map(move |step| (side, step)))
    }
}

/// Left and right along the body's left.
pub(super) const SIDES: [f64; 2] = [1.0, -1.0];
