//! What the poses' noise leaves behind a low-pass of a given bandwidth.

use cromosim_spatial::{PoseSmoothing, PoseSpline, PoseTimes, SampleVariance, Stamp};
use nalgebra::Isometry3;

use crate::schemes::spline::{self, SplineVariance};
use crate::{ImuError, KinematicSample, PoseStd, SensorFrame, SensorTrajectory};

/// Within so many periods of the bandwidth from an end each sample is judged by itself: there the
/// low-pass has poses on one side only.
const END_PERIODS: f64 = 1.0;
/// Farther inside one in so many periods of the bandwidth is, and those between by its neighbours: a
/// low-pass knows of nothing faster.
const STEP_PERIODS: f64 = 0.25;

/// Raises the variances of samples to what the noise that is learnt of the poses
/// (see [`PoseSpline::noise_of`]) leaves in them. Motion that the low-pass takes off is no error.
pub(crate) fn state(
    times: &PoseTimes,
    trajectory: &SensorTrajectory,
    bandwidth_hz: f64,
    samples: &mut [KinematicSample],
) -> Result<(), ImuError> {
    let frames = trajectory.frames();
    let poses: Vec<Isometry3<f64>> = frames.iter().map(|it| it.world_from_sensor).collect();
    let source = trajectory.source();
    let Some(noise) = PoseSpline::noise_of(times, &poses, source, bandwidth_hz)? else {
        return Ok(());
    };
    let own = with_noise(frames, noise.iter().map(|noise| noise.own));
    let low_pass = spline::fit(times, &own, PoseSmoothing::cutoff_hz(bandwidth_hz))?;
    let errors_of = |frames| SplineVariance::new(times, &low_pass, frames);
    let Some(of_own) = errors_of(&own)? else {
        return Ok(());
    };
    let is_white = noise.iter().all(|noise| noise.around == noise.own);
    let around = (!is_white).then(|| with_noise(frames, noise.iter().map(|noise| noise.around)));
    let of_around = match &around {
        Some(around) => errors_of(around)?,
        None => None,
    };
    let variance = |stamp: Stamp| {
        let mut variance = of_own.at(stamp);
        if let Some(of_around) = &of_around {
            let around = of_around.at(stamp);
            variance.unseen = [
                variance.acceleration - around.acceleration,
                variance.angular_velocity - around.angular_velocity,
            ];
        }
        variance
    };
    let span = [trajectory.start(), trajectory.end()];
    let judged: Vec<(usize, SampleVariance)> = judged(samples, span, bandwidth_hz)
        .into_iter()
        .map(|k| (k, variance(samples[k].stamp.clamp(span[0], span[1]))))
        .collect();
    for pair in judged.windows(2) {
        let [(from, before), (to, after)] = [pair[0], pair[1]];
        for (k, sample) in samples.iter_mut().enumerate().take(to + 1).skip(from) {
            let part = (k - from) as f64 / (to - from) as f64;
            sample.variance = sample.variance.larger(between(&before, &after, part));
        }
    }
    if let [(only, variance)] = judged[..] {
        samples[only].variance = samples[only].variance.larger(variance);
    }
    Ok(())
}

/// Frames whose poses have these standard deviations, m and rad.
fn with_noise(frames: &[SensorFrame], std: impl Iterator<Item = [f64; 2]>) -> Vec<SensorFrame> {
    let one = |(frame, [position_m, rotation_rad]): (&SensorFrame, [f64; 2])| {
        frame.with_pose_std(PoseStd {
            position_m,
            rotation_rad,
            correlation_s: 0.0,
        })
    };
    frames.iter().zip(std).map(one).collect()
}

/// Which samples are judged by themselves: the first and the last among them.
fn judged(samples: &[KinematicSample], [start, end]: [Stamp; 2], bandwidth_hz: f64) -> Vec<usize> {
    let period_s = 1.0 / bandwidth_hz;
    let (end_s, step_s) = (END_PERIODS * period_s, STEP_PERIODS * period_s);
    let mut judged: Vec<usize> = Vec::new();
    for (k, sample) in samples.iter().enumerate() {
        let at_end = (sample.stamp - start).min(end - sample.stamp) <= end_s;
        let due = judged
            .last()
            .is_none_or(|last| (sample.stamp - samples[*last].stamp).abs() >= step_s);
        if at_end || due || k + 1 == samples.len() {
            judged.push(k);
        }
    }
    judged
}

fn between(before: &SampleVariance, after: &SampleVariance, part: f64) -> SampleVariance {
    let mix = |of: fn(&SampleVariance) -> f64| (1.0 - part) * of(before) + part * of(after);
    let unseen = [
        mix(|variance| variance.unseen[0]),
        mix(|variance| variance.unseen[1]),
    ];
    SampleVariance {
        acceleration: mix(|variance| variance.acceleration),
        angular_velocity: mix(|variance| variance.angular_velocity),
        orientation: mix(|variance| variance.orientation),
        unseen,
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use cromosim_spatial::{so3, uniform_stamps};
    use nalgebra::Vector3;
    use rand::SeedableRng;
    use rand_chacha::ChaCha12Rng;

    use crate::test_motions::{frames, wrist};
    use crate::{
        Differentiation, KinematicSample, SensorFrame, SensorTrajectory, Trim, normal_pair,
        simulate_kinematics,
    };

    const BANDWIDTH: Differentiation = Differentiation::Bandwidth(10.0);

    fn low_passed(frames: Vec<SensorFrame>) -> Vec<KinematicSample> {
        let trajectory = SensorTrajectory::new(frames).unwrap();
        let stamps = uniform_stamps(trajectory.start(), trajectory.end(), 100.0).unwrap();
        simulate_kinematics(&trajectory, BANDWIDTH, &stamps).unwrap()
    }

    /// 1 mm and 0.5 degrees about each axis.
    fn noisy(exact: &[SensorFrame], seed: u64) -> Vec<SensorFrame> {
        let mut random = ChaCha12Rng::seed_from_u64(seed);
        let mut normal = |std: f64| {
            let ([x, y], [z, _]) = (normal_pair(&mut random), normal_pair(&mut random));
            Vector3::new(x, y, z) * std
        };
        let disturb = |frame: &SensorFrame| {
            let mut frame = *frame;
            let turn = so3::exp(&normal(0.5_f64.to_radians()));
            frame.world_from_sensor.rotation = turn * frame.world_from_sensor.rotation;
            frame.world_from_sensor.translation.vector += normal(0.001);
            frame
        };
        exact.iter().map(disturb).collect()
    }

    /// Mean squares per axis of what noise does to samples, over what they state: of acceleration and
    /// angular velocity.
    fn over_stated(pairs: &[(KinematicSample, KinematicSample)]) -> [f64; 2] {
        let (mut found, mut stated) = ([0.0; 2], [0.0; 2]);
        for (exact, noisy) in pairs {
            let apart = [
                noisy.acceleration_in_world - exact.acceleration_in_world,
                noisy.angular_velocity_in_world - exact.angular_velocity_in_world,
            ];
            let variance = noisy.variance;
            let own = [variance.acceleration, variance.angular_velocity];
            for channel in 0..2 {
                found[channel] += apart[channel].norm_squared() / 3.0;
                stated[channel] += own[channel];
            }
        }
        [found[0] / stated[0], found[1] / stated[1]]
    }

    #[test]
    fn a_low_pass_states_what_noise_leaves_in_its_middle_and_at_its_ends() {
        let exact = frames(wrist, 100.0, 3.0);
        let known = low_passed(exact.clone());
        let (mut middle, mut ends) = (Vec::new(), Vec::new());
        for seed in 0..60 {
            let pairs = known.iter().copied().zip(low_passed(noisy(&exact, seed)));
            for (k, pair) in pairs.enumerate() {
                if (30..=270).contains(&k) {
                    middle.push(pair);
                } else if k == 0 || k == 300 {
                    ends.push(pair);
                }
            }
        }
        for (place, pairs) in [("middle", middle), ("ends", ends)] {
            let ratios = over_stated(&pairs);
            println!("{place}: {ratios:.2?}");
            assert!(ratios.iter().all(|it| (0.7..1.4).contains(it)), "{place}");
        }
    }

    #[test]
    fn the_ends_of_a_low_pass_are_trimmed() {
        let samples = low_passed(noisy(&frames(wrist, 100.0, 3.0), 7));
        let span = Trim::Uncertain.span(&samples).unwrap();
        let gone = [
            *span.start() - samples[0].stamp,
            samples[samples.len() - 1].stamp - *span.end(),
        ];
        assert!(gone.iter().all(|s| (0.02..0.15).contains(s)), "{gone:?}");
    }
}
