//! How far the poses of a segment with markers are off, by what its markers leave of a rigid shape.

use cromosim_imu::PoseStd;
use nalgebra::{Matrix3, Vector3};

/// Residuals within this time before and after count for a frame, s: half of a footfall. No source.
const HALF_WIDTH_S: f64 = 0.1;

/// A frame's markers that were seen.
pub(super) struct FrameResiduals {
    /// Number of the frame.
    pub frame: usize,
    /// Of each: which it is, its place in the segment's shape, and by how much it lay elsewhere, m, in the segment's axes.
    pub seen: Vec<(usize, Vector3<f64>, Vector3<f64>)>,
}

/// The errors of a segment's poses, frame by frame.
///
/// Markers that are off by s along each axis, independently, leave `3 n - 6` squares of s from the nearest rigid shape (n
/// markers seen, at r from their centre; p is the place of any marker from there, seen or not):
///
/// ```text
/// s^2 = sum |residual|^2 / sum (3 n - 6)                       over the frames within 0.1 s
/// rotation^2 = s^2 tr(J^-1) / 3         J = sum (|r|^2 I - r r^T)
/// position^2 = s^2 (1 / n + mean over p of (|p|^2 tr(J^-1) - p^T J^-1 p) / 3)
/// ```
/// The position is that of a sensor somewhere among the markers (2 s^2 / n where all are seen, of which half is at their centre).
/// Skin and shoes bend smoothly: errors hold as long as the residuals do, whose mean squared step from frame to frame is
/// `2 s^2 (1 - exp(-(dt / correlation)^2 / 2))`.
pub(super) fn pose_stds(
    frames: &[FrameResiduals],
    shape: &[Vector3<f64>],
    rate_hz: f64,
) -> Vec<PoseStd> {
    let correlation_s = correlation_s(frames, rate_hz);
    let width = (HALF_WIDTH_S * rate_hz).round() as usize;
    let (mut first, mut end) = (0, 0);
    let std = |own: &FrameResiduals| {
        while frames[first].frame + width < own.frame {
            first += 1;
        }
        while end < frames.len() && frames[end].frame <= own.frame + width {
            end += 1;
        }
        let near = &frames[first..end];
        let free: usize = near.iter().map(|frame| 3 * frame.seen.len() - 6).sum();
        let squares: f64 = near.iter().map(FrameResiduals::squares).sum();
        let (position, rotation) = own.of_unit_markers(shape);
        let size = (squares / free as f64).sqrt();
        PoseStd {
            position_m: size * position,
            rotation_rad: size * rotation,
            correlation_s,
        }
    };
    frames.iter().map(std).collect()
}

impl FrameResiduals {
    fn squares(&self) -> f64 {
        let square = |(_, _, left): &(usize, Vector3<f64>, Vector3<f64>)| left.norm_squared();
        self.seen.iter().map(square).sum()
    }

    /// Standard deviations of position, m, and rotation, rad, where markers are off by 1 m.
    fn of_unit_markers(&self, shape: &[Vector3<f64>]) -> (f64, f64) {
        let count = self.seen.len() as f64;
        let places = self.seen.iter().map(|(_, place, _)| place);
        let centre = places.clone().sum::<Vector3<f64>>() / count;
        let about = |place: &Vector3<f64>| {
            let r = place - centre;
            Matrix3::identity() * r.norm_squared() - r * r.transpose()
        };
        // Markers in a line leave the turn about it open.
        let Some(inverse) = places.map(about).sum::<Matrix3<f64>>().try_inverse() else {
            return (f64::INFINITY, f64::INFINITY);
        };
        let turned = shape.iter().map(|place| (about(place) * inverse).trace());
        let turned = turned.sum::<f64>() / shape.len() as f64;
        (
            (1.0 / count + turned / 3.0).sqrt(),
            (inverse.trace() / 3.0).sqrt(),
        )
    }
}

/// How long residuals hold; 0 where they scatter from frame to frame.
fn correlation_s(frames: &[FrameResiduals], rate_hz: f64) -> f64 {
    let (mut steps, mut squares) = (0.0, 0.0);
    for [one, next] in frames.array_windows() {
        if one.frame + 1 != next.frame {
            continue;
        }
        for (marker, _, left) in &one.seen {
            let Some((_, _, after)) = next.seen.iter().find(|(other, _, _)| other == marker) else {
                continue;
            };
            steps += (after - left).norm_squared();
            squares += 0.5 * (after.norm_squared() + left.norm_squared());
        }
    }
    let held = 1.0 - steps / (2.0 * squares);
    if held > 0.0 && held < 1.0 {
        (-2.0 * held.ln()).sqrt().recip() / rate_hz
    } else {
        0.0
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use cromosim_imu::normal_pair;
    use cromosim_motion::fit_rigid;
    use rand::SeedableRng;
    use rand_chacha::ChaCha12Rng;

    use super::*;

    const SHAPE: [[f64; 3]; 4] = [
        [0.12, 0.0, 0.0],
        [-0.12, 0.0, 0.02],
        [0.05, 0.05, 0.0],
        [0.0, -0.04, 0.05],
    ];

    /// Mean squares along an axis of the markers' places, m2, and of the turn, rad2.
    type Errors = [f64; 2];

    /// The fit of markers that are off, in the shape's axes; how far it lays the markers from their true places, and its turn.
    fn fitted(frame: usize, off: &[(usize, Vector3<f64>)]) -> (FrameResiduals, Errors) {
        let pairs: Vec<_> = off
            .iter()
            .map(|(marker, off)| {
                let own = Vector3::from(SHAPE[*marker]);
                (own, own + off)
            })
            .collect();
        let (turn, shift) = fit_rigid(&pairs).unwrap();
        let seen = off.iter().zip(&pairs).map(|((marker, _), (own, place))| {
            let left = turn.inverse() * (place - shift) - own;
            (*marker, *own, left)
        });
        let seen = seen.collect();
        let moved = SHAPE.map(|place| {
            let place = Vector3::from(place);
            turn * place + shift - place
        });
        let squares = moved.map(|by| by.norm_squared()).iter().sum::<f64>();
        let errors = [squares / 12.0, turn.scaled_axis().norm_squared() / 3.0];
        (FrameResiduals { frame, seen }, errors)
    }

    /// Errors of the markers in so many frames at 100 Hz, of variance 1; they hold for so many seconds.
    fn errors(frames: usize, correlation_s: f64) -> Vec<[Vector3<f64>; 4]> {
        let mut random = ChaCha12Rng::seed_from_u64(5);
        let reach = (500.0 * correlation_s).round() as i32;
        // White noise through this kernel has the wanted correlation.
        let kernel: Vec<f64> = (-reach..=reach)
            .map(|k| (-(f64::from(k) / 100.0 / correlation_s.max(1e-9)).powi(2)).exp())
            .collect();
        let size = kernel.iter().map(|k| k * k).sum::<f64>().sqrt();
        let white: Vec<[Vector3<f64>; 4]> = (0..frames + kernel.len())
            .map(|_| [(); 4].map(|()| Vector3::from_fn(|_, _| normal_pair(&mut random)[0])))
            .collect();
        let held = |near: &[[Vector3<f64>; 4]]| {
            std::array::from_fn(|marker| {
                let weighed = near.iter().zip(&kernel).map(|(all, k)| all[marker] * *k);
                weighed.sum::<Vector3<f64>>() / size
            })
        };
        white.windows(kernel.len()).take(frames).map(held).collect()
    }

    #[test]
    fn poses_are_off_as_far_and_as_long_as_is_stated() {
        for (markers, correlation_s) in [
            (&[0, 1, 2, 3][..], 0.0),
            (&[0, 1, 2], 0.04),
            (&[1, 2, 3], 0.0),
        ] {
            let fits = errors(6000, correlation_s);
            let fits = fits.iter().enumerate().map(|(frame, drawn)| {
                let off: Vec<_> = markers.iter().map(|k| (*k, 2e-3 * drawn[*k])).collect();
                fitted(frame, &off)
            });
            let (frames, off): (Vec<_>, Vec<_>) = fits.unzip();
            let stated = pose_stds(&frames, &SHAPE.map(Vector3::from), 100.0);
            // Local sizes are themselves estimates, so that the ratio of the means is compared.
            let ratio = |which: usize, std: fn(&PoseStd) -> f64| {
                let found: f64 = off.iter().map(|errors| errors[which]).sum();
                found / stated.iter().map(|own| std(own).powi(2)).sum::<f64>()
            };
            let position = ratio(0, |std| std.position_m);
            let rotation = ratio(1, |std| std.rotation_rad);
            assert!(
                (0.92..1.08).contains(&position) && (0.92..1.08).contains(&rotation),
                "{markers:?}: {position} {rotation}"
            );
            let holds = stated[0].correlation_s;
            let white = correlation_s == 0.0 && holds < 0.006;
            assert!(
                white || (holds / correlation_s - 1.0).abs() < 0.05,
                "{holds}"
            );
        }
    }

    #[test]
    fn markers_in_a_line_say_nothing_of_their_turn() {
        let seen = [0.0, 0.1, 0.2].map(|x| (0, Vector3::x() * x, Vector3::y() * 1e-3));
        let seen = seen.to_vec();
        let stated = pose_stds(
            &[FrameResiduals { frame: 0, seen }],
            &[Vector3::zeros()],
            100.0,
        );
        assert!(stated[0].rotation_rad.is_infinite());
    }
}
