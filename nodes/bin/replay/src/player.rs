//! The relation of wall time to recorded time, under rate, pause and seek. Pure: time is passed in.

/// Recorded time runs as `recorded = anchor_recorded + rate (wall - anchor_wall)`, or stands still
/// while paused. All in nanoseconds.
#[derive(Clone, Debug, PartialEq)]
pub struct Player {
    rate: f64,
    paused: bool,
    anchor_wall: i64,
    anchor_recorded: i64,
}

impl Player {
    /// A player that stands at `recorded` at the wall time `wall`; the rate is positive.
    pub fn new(wall: i64, recorded: i64, rate: f64, paused: bool) -> Self {
        Self {
            rate,
            paused,
            anchor_wall: wall,
            anchor_recorded: recorded,
        }
    }

    /// Speed factor.
    pub fn rate(&self) -> f64 {
        self.rate
    }

    /// Whether recorded time stands still.
    pub fn paused(&self) -> bool {
        self.paused
    }

    /// Recorded time at `wall`.
    pub fn recorded_at(&self, wall: i64) -> i64 {
        if self.paused {
            self.anchor_recorded
        } else {
            self.anchor_recorded + ((wall - self.anchor_wall) as f64 * self.rate).round() as i64
        }
    }

    /// When `recorded` is due; never while paused.
    pub fn wall_of(&self, recorded: i64) -> Option<i64> {
        (!self.paused).then(|| {
            self.anchor_wall + ((recorded - self.anchor_recorded) as f64 / self.rate).round() as i64
        })
    }

    fn anchor(&mut self, wall: i64) {
        self.anchor_recorded = self.recorded_at(wall);
        self.anchor_wall = wall;
    }

    /// Stands still from `wall` on.
    pub fn pause(&mut self, wall: i64) {
        self.anchor(wall);
        self.paused = true;
    }

    /// Goes on from `wall` on.
    pub fn resume(&mut self, wall: i64) {
        self.anchor(wall);
        self.paused = false;
    }

    /// Another speed from `wall` on; false, and unchanged, where it is not positive.
    pub fn set_rate(&mut self, wall: i64, rate: f64) -> bool {
        let valid = rate.is_finite() && rate > 0.0;
        if valid {
            self.anchor(wall);
            self.rate = rate;
        }
        valid
    }

    /// Goes on at `recorded` from `wall` on.
    pub fn seek(&mut self, wall: i64, recorded: i64) {
        self.anchor_wall = wall;
        self.anchor_recorded = recorded;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    const S: i64 = 1_000_000_000;

    #[test]
    fn pause_resume_rate_and_seek_keep_recorded_time_continuous() {
        let mut player = Player::new(100 * S, 5 * S, 1.0, false);
        assert_eq!(player.recorded_at(102 * S), 7 * S);
        player.pause(102 * S);
        assert_eq!(player.recorded_at(200 * S), 7 * S);
        assert_eq!(player.wall_of(8 * S), None);
        player.resume(200 * S);
        assert_eq!(player.wall_of(8 * S), Some(201 * S));
        assert!(player.set_rate(201 * S, 2.0));
        assert_eq!(player.recorded_at(203 * S), 12 * S);
        player.seek(203 * S, S);
        assert_eq!(player.wall_of(3 * S), Some(204 * S));
    }

    #[test]
    fn a_rate_that_is_not_positive_changes_nothing() {
        let mut player = Player::new(0, 0, 1.0, false);
        let before = player.clone();
        for rate in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            assert!(!player.set_rate(S, rate));
            assert_eq!(player, before);
        }
    }
}
