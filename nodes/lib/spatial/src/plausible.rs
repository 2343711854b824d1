//! What bodies and sensors cannot do, or hardly ever: the one table of physical bounds. Who reads a
//! quantity judges it here; what lies beyond the second limit is refused, beyond the first it is
//! worth a warning.

use std::f64::consts::TAU;
use std::fmt;

/// A limit of a quantity, and why it is one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limit {
    /// In the bound's unit.
    pub value: f64,
    /// Whose record, or which reason.
    pub reason: &'static str,
}

/// What is unlikely and what is impossible of one quantity.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bound {
    /// The quantity, for people.
    pub what: &'static str,
    /// Its unit.
    pub unit: &'static str,
    /// Values above are unlikely.
    pub likely: Limit,
    /// Values above are impossible; infinite where nothing is.
    pub possible: Limit,
    /// What is most often wrong where a value is beyond.
    pub check: &'static str,
}

/// Nothing is impossible of this quantity.
const ANYTHING: Limit = Limit {
    value: f64::INFINITY,
    reason: "",
};

/// Speed of a person's pelvis between two frames.
pub const PELVIS_SPEED: Bound = Bound {
    what: "speed of the pelvis",
    unit: "m/s",
    likely: Limit {
        value: 12.5,
        reason: "the fastest runner reached 12.4 m/s (Berlin 2009)",
    },
    possible: Limit {
        value: 170.0,
        reason: "the fastest skydiver reached 601 km/h, 167 m/s (2016)",
    },
    check: "are positions in metres, does the frame rate hold, does the track jump?",
};

/// Speed of a person's pelvis that half of the frames exceed: a jump of the track does not count.
pub const LASTING_PELVIS_SPEED: Bound = Bound {
    what: "median speed of the pelvis",
    unit: "m/s",
    likely: Limit {
        value: 12.5,
        reason: "the fastest runner reached 12.4 m/s (Berlin 2009)",
    },
    possible: Limit {
        value: 71.0,
        reason: "the fastest skier reached 255 km/h (2023)",
    },
    check: "are positions in metres, and not in centimetres?",
};

/// Height of a person's pelvis above the world's zero.
pub const PELVIS_HEIGHT: Bound = Bound {
    what: "height of the pelvis",
    unit: "m",
    likely: Limit {
        value: 10.0,
        reason: "recordings are made on a floor",
    },
    // Those by satellite navigation count from the sea.
    possible: ANYTHING,
    check: "are positions in metres, and not in centimetres?",
};

/// Acceleration of a person's pelvis that half of the frames exceed.
pub const LASTING_PELVIS_ACCELERATION: Bound = Bound {
    what: "median acceleration of the pelvis",
    unit: "m/s2",
    likely: Limit {
        value: 60.0,
        reason: "6 g, what few exercises reach for a moment; or the track is noisy",
    },
    possible: Limit {
        value: 454.0,
        reason: "46.3 g, the most that a person has survived for a moment (Stapp 1954)",
    },
    check: "are positions in metres, does the frame rate hold, does the track jump?",
};

/// Angular velocity of a joint between two frames.
pub const JOINT_SPEED: Bound = Bound {
    what: "angular velocity of a joint",
    unit: "rad/s",
    likely: Limit {
        value: 160.0,
        reason: "a pitcher's shoulder, the fastest joint, reaches 9000 degrees/s",
    },
    // A single frame turned over is common in marker and video tracks.
    possible: ANYTHING,
    check: "does a joint turn over between two frames?",
};

/// Angular velocity of a joint that half of the frames exceed.
pub const LASTING_JOINT_SPEED: Bound = Bound {
    what: "median angular velocity of a joint",
    unit: "rad/s",
    likely: Limit {
        value: 20.0,
        reason: "no limb is swung faster for long",
    },
    possible: Limit {
        value: 36.0,
        reason: "342 turns a minute, the fastest spin on skates (2015)",
    },
    check: "are angles in radians, does the frame rate hold?",
};

/// Size of a shape coefficient.
pub const BETA: Bound = Bound {
    what: "shape coefficient",
    unit: "standard deviations",
    likely: Limit {
        value: 5.0,
        reason: "one person in a million",
    },
    possible: Limit {
        value: 15.0,
        reason: "far beyond everybody whom the models learnt shapes from",
    },
    check: "do the betas belong to this body model?",
};

/// Angle of a body joint's rotation vector.
pub const JOINT_ANGLE: Bound = Bound {
    what: "rotation vector of a joint",
    unit: "rad",
    likely: Limit {
        value: TAU,
        reason: "a full turn",
    },
    possible: Limit {
        value: TAU,
        reason: "a full turn, which no joint makes",
    },
    check: "are angles in radians?",
};

/// Angle of the pelvis' rotation vector, which a spinning dancer may count on.
pub const PELVIS_ANGLE: Bound = Bound {
    what: "rotation vector of the pelvis",
    unit: "rad",
    likely: Limit {
        value: 2.0 * TAU,
        reason: "two full turns",
    },
    possible: Limit {
        value: 2.0 * TAU,
        reason: "two full turns: a fit may count one turn on, no more",
    },
    check: "are angles in radians?",
};

/// Angle of the rotation vector of a sensor's mount.
pub const MOUNT_ANGLE: Bound = Bound {
    what: "rotation vector of a mount",
    unit: "rad",
    likely: Limit {
        value: TAU,
        reason: "a full turn",
    },
    possible: Limit {
        value: TAU,
        reason: "a full turn",
    },
    check: "radians, not degrees",
};

/// Distance of a placement's point from the skin that it is meant to name.
pub const POINT_FROM_SKIN: Bound = Bound {
    what: "distance of the point from the nearest skin",
    unit: "m",
    likely: Limit {
        value: 0.05,
        reason: "a hand's thickness",
    },
    possible: Limit {
        value: 0.2,
        reason: "no sensor is worn farther from the skin",
    },
    check: "metres in the T-pose: x left, y up, z forward, as the README of `body` says",
};

/// Speed of a rigid body (robot, prop) between two poses.
pub const RIGID_SPEED: Bound = Bound {
    what: "speed of the body",
    unit: "m/s",
    likely: Limit {
        value: 150.0,
        reason: "no robot or drone has moved faster",
    },
    possible: Limit {
        value: 1000.0,
        reason: "faster than any aircraft with an engine that breathes air",
    },
    check: "are positions in metres and stamps in their unit?",
};

/// A value beyond one of its bound's limits.
#[derive(Clone, Debug, PartialEq)]
pub struct Oddity {
    /// Which bound.
    pub bound: &'static Bound,
    /// The value.
    pub value: f64,
    /// Where: a frame, a joint; empty where there is one place alone.
    pub place: String,
}

impl Bound {
    /// Whether a value is odd: above the likely limit, or no number.
    pub fn judge(&'static self, value: f64, place: impl Into<String>) -> Option<Oddity> {
        let within = value <= self.likely.value;
        (!within).then(|| Oddity {
            bound: self,
            value,
            place: place.into(),
        })
    }
}

impl Oddity {
    /// Whether it is more than unlikely.
    pub fn is_impossible(&self) -> bool {
        let possible = self.value <= self.bound.possible.value;
        !possible
    }
}

impl fmt::Display for Oddity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Bound {
            what,
            unit,
            likely,
            possible,
            check,
        } = self.bound;
        let (word, limit) = if self.is_impossible() {
            ("impossible", possible)
        } else {
            ("unlikely", likely)
        };
        let place = if self.place.is_empty() {
            String::new()
        } else {
            format!(" ({})", self.place)
        };
        write!(
            f,
            "{what} {}{place}: {word} above {} {unit} ({}); {check}",
            short(self.value),
            short(limit.value),
            limit.reason
        )
    }
}

/// As many digits as say something.
fn short(value: f64) -> String {
    if value.abs() < 100.0 {
        format!("{value:.2}")
    } else {
        format!("{value:.0}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn limits_are_in_order_and_have_reasons() {
        for bound in [
            PELVIS_SPEED,
            LASTING_PELVIS_SPEED,
            LASTING_PELVIS_ACCELERATION,
            PELVIS_HEIGHT,
            JOINT_SPEED,
            LASTING_JOINT_SPEED,
            BETA,
            JOINT_ANGLE,
            PELVIS_ANGLE,
            MOUNT_ANGLE,
            POINT_FROM_SKIN,
            RIGID_SPEED,
        ] {
            assert!(bound.likely.value <= bound.possible.value, "{bound:?}");
            assert!(!bound.likely.reason.is_empty() && !bound.check.is_empty());
            assert!(bound.possible.value.is_infinite() || !bound.possible.reason.is_empty());
        }
    }

    #[test]
    fn a_value_is_plain_unlikely_or_impossible_and_says_so() {
        assert_eq!(PELVIS_SPEED.judge(12.0, ""), None);
        let unlikely = PELVIS_SPEED.judge(13.0, "frame 7").expect("odd");
        assert!(!unlikely.is_impossible());
        assert!(
            unlikely
                .to_string()
                .starts_with("speed of the pelvis 13.00 (frame 7): unlikely above 12.50 m/s"),
            "{unlikely}"
        );
        let impossible = PELVIS_SPEED.judge(2400.0, "").expect("odd");
        assert!(impossible.is_impossible());
        assert!(
            impossible
                .to_string()
                .contains("2400: impossible above 170 m/s")
        );
        assert!(
            PELVIS_SPEED
                .judge(f64::NAN, "")
                .is_some_and(|odd| odd.is_impossible())
        );
    }
}
