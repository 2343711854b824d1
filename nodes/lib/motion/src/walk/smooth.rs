//! Functions of time with continuous accelerations.

/// Position, velocity and acceleration at one end of a quintic.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Knot {
    pub position: f64,
    pub velocity: f64,
    pub acceleration: f64,
}

impl Knot {
    /// At rest.
    pub const fn still(position: f64) -> Self {
        Self {
            position,
            velocity: 0.0,
            acceleration: 0.0,
        }
    }

    /// Passing by at a steady velocity.
    pub const fn passing(position: f64, velocity: f64) -> Self {
        Self {
            position,
            velocity,
            acceleration: 0.0,
        }
    }
}

/// The quintic from one knot to the next, `duration` apart, at `time` after the first; clamped to
/// its ends.
pub(super) fn quintic(from: Knot, to: Knot, duration: f64, time: f64) -> f64 {
    let u = (time / duration).clamp(0.0, 1.0);
    let (v0, v1) = (from.velocity * duration, to.velocity * duration);
    let (a0, a1) = (
        from.acceleration * duration * duration,
        to.acceleration * duration * duration,
    );
    let way = to.position - from.position - v0 - 0.5 * a0;
    let speed = v1 - v0 - a0;
    let push = a1 - a0;
    let c3 = 10.0 * way - 4.0 * speed + 0.5 * push;
    let c4 = -15.0 * way + 7.0 * speed - push;
    let c5 = 6.0 * way - 3.0 * speed + 0.5 * push;
    from.position + u * (v0 + u * (0.5 * a0 + u * (c3 + u * (c4 + u * c5))))
}

/// From 0 to 1 while `u` goes from 0 to 1, at rest at both ends up to the third derivative.
pub(super) fn smooth_step(u: f64) -> f64 {
    let u = u.clamp(0.0, 1.0);
    u * u * u * u * (35.0 - u * (84.0 - u * (70.0 - 20.0 * u)))
}

/// 1 at 0 and 0 from 1 and -1 on, with three continuous derivatives.
pub(super) fn bump(u: f64) -> f64 {
    (1.0 - u * u).max(0.0).powi(4)
}

/// From 0 to 1 around `rise`, back to 0 around `fall`, each over `width`.
pub(super) fn plateau(time: f64, rise: f64, fall: f64, width: f64) -> f64 {
    smooth_step((time - rise) / width + 0.5) - smooth_step((time - fall) / width + 0.5)
}

/// The mean of `SAMPLES` values of a function, evenly over `window` around `time`.
pub(super) fn mean_around<const SAMPLES: usize, V>(
    time: f64,
    window: f64,
    function: impl Fn(f64) -> V,
) -> V
where
    V: std::ops::Add<Output = V> + std::ops::Mul<f64, Output = V>,
{
    let at = |index: usize| function(time + ((index as f64 + 0.5) / SAMPLES as f64 - 0.5) * window);
    (1..SAMPLES).fold(at(0), |sum, index| sum + at(index)) * (1.0 / SAMPLES as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_quintic_meets_its_knots() {
        let (from, to) = (
            Knot {
                position: 1.0,
                velocity: -2.0,
                acceleration: 3.0,
            },
            Knot {
                position: 0.5,
                velocity: 4.0,
                acceleration: -5.0,
            },
        );
        let (duration, h) = (0.7, 1e-4);
        let at = |time| quintic(from, to, duration, time);
        assert!((at(0.0) - 1.0).abs() < 1e-12 && (at(duration) - 0.5).abs() < 1e-12);
        assert!(((at(h) - at(0.0)) / h + 2.0).abs() < 1e-3);
        assert!(((at(duration) - at(duration - h)) / h - 4.0).abs() < 1e-3);
        assert!(((at(2.0 * h) - 2.0 * at(h) + at(0.0)) / (h * h) - 3.0).abs() < 0.05);
        assert!(
            ((at(duration) - 2.0 * at(duration - h) + at(duration - 2.0 * h)) / (h * h) + 5.0)
                .abs()
                < 0.05
        );
    }

    #[test]
    fn steps_and_plateaus_go_from_nought_to_one() {
        assert_eq!(
            (smooth_step(-1.0), smooth_step(0.5), smooth_step(2.0)),
            (0.0, 0.5, 1.0)
        );
        assert_eq!(
            (
                plateau(0.0, 1.0, 3.0, 0.4),
                plateau(2.0, 1.0, 3.0, 0.4),
                plateau(4.0, 1.0, 3.0, 0.4)
            ),
            (0.0, 1.0, 0.0)
        );
        assert_eq!((bump(0.0), bump(1.0), bump(-3.0)), (1.0, 0.0, 0.0));
        assert!((mean_around::<8, _>(2.0, 1.0, |time| time) - 2.0).abs() < 1e-12);
    }
}
