//! How the measured angular velocity follows the reference's.

use cromosim_imu::Reading;
use cromosim_spatial::KinematicTrack;
use nalgebra::{Matrix3, Vector3};

/// Part of the measured angular velocity's square that the reference's most turned axis has to explain, for their
/// ratio to be a unit's; no source. Noise that has nothing to do with it explains one part in as many as there
/// are readings.
pub(crate) const FOLLOWED: f64 = 0.2;
/// Mean square of the angular velocity about the least moved axis below which nothing is told of
/// the axes, rad2/s2: 0.05 rad/s.
const LEAST_SPREAD: f64 = 0.0025;

/// The measured angular velocity, and the reference's.
fn turns(row: &(&Reading, usize), track: &KinematicTrack) -> [Vector3<f64>; 2] {
    [
        row.0.angular_velocity,
        track.angular_velocity_in_segment[row.1],
    ]
}

/// Sums over rows of products of the measured angular velocity y and the reference's w, means taken out, for the
/// matrix of `y = A w + b` by least squares.
pub(crate) struct Turns {
    count: f64,
    yw: Matrix3<f64>,
    ww: Matrix3<f64>,
    yy: f64,
    /// With the means.
    squares: [f64; 2],
}

impl Turns {
    pub fn new(rows: &[(&Reading, usize)], track: &KinematicTrack) -> Self {
        Self::of_pairs(rows.iter().map(|row| turns(row, track)))
    }

    /// Of the means over so many rows each: what is slow alone.
    pub fn of_means(rows: &[(&Reading, usize)], track: &KinematicTrack, count: usize) -> Self {
        Self::of_pairs(rows.chunks_exact(count.max(1)).map(|several| {
            let sum = several.iter().fold([Vector3::zeros(); 2], |sum, row| {
                let own = turns(row, track);
                [sum[0] + own[0], sum[1] + own[1]]
            });
            sum.map(|sum| sum / several.len() as f64)
        }))
    }

    fn of_pairs(pairs: impl Iterator<Item = [Vector3<f64>; 2]> + Clone) -> Self {
        let count = pairs.clone().count().max(1) as f64;
        let mean = |k: usize| pairs.clone().map(|pair| pair[k]).sum::<Vector3<f64>>() / count;
        let (mean_y, mean_w) = (mean(0), mean(1));
        let mut sums = Self {
            count,
            yw: Matrix3::zeros(),
            ww: Matrix3::zeros(),
            yy: 0.0,
            squares: [0.0; 2],
        };
        for [y, w] in pairs {
            sums.squares[0] += y.norm_squared();
            sums.squares[1] += w.norm_squared();
            let (y, w) = (y - mean_y, w - mean_w);
            sums.yw += y * w.transpose();
            sums.ww += w * w.transpose();
            sums.yy += y.norm_squared();
        }
        sums
    }

    /// The reference's most turned axis: the readings per unit of its angular velocity about it, and the part of
    /// their square that these explain.
    pub fn about_most_turned_axis(&self) -> (f64, f64) {
        let turned = self.ww.symmetric_eigen();
        let (most, square) = turned.eigenvalues.argmax();
        let along = (self.yw * turned.eigenvectors.column(most)).norm();
        let square = square.max(f64::MIN_POSITIVE);
        (along / square, along.powi(2) / (square * self.yy))
    }

    /// Part of the measured angular velocity's square that this orthogonal matrix leaves unexplained, whatever the units.
    pub fn unexplained_by(&self, axes: &Matrix3<f64>) -> f64 {
        let along = (axes.transpose() * self.yw).trace().max(0.0);
        let squares = self.yy * self.ww.trace();
        1.0 - along.powi(2) / squares.max(f64::MIN_POSITIVE)
    }

    /// Ratio of the root mean squares, measured over the reference's.
    pub fn ratio(&self) -> f64 {
        let [measured, predicted] = self.squares;
        (measured / predicted.max(1e-12)).sqrt()
    }

    /// Whether the readings turn when the reference does about its most turned axis: what rests has the noise of
    /// both, whose ratio is anything.
    pub fn are_followed(&self) -> bool {
        self.about_most_turned_axis().1 > FOLLOWED
    }

    /// The matrix; none where the reference does not turn about all axes.
    pub fn matrix(&self) -> Option<Matrix3<f64>> {
        let spread = self.ww.symmetric_eigenvalues() / self.count;
        let inverse = self.ww.try_inverse()?;
        (spread.min() >= LEAST_SPREAD).then(|| self.yw * inverse)
    }

    /// Part of the measured angular velocity's square that no matrix explains; all of it where the reference
    /// does not turn about all axes.
    pub fn unexplained(&self) -> f64 {
        let explained = self.ww.try_inverse().map_or(0.0, |inverse| {
            (self.yw * inverse * self.yw.transpose()).trace()
        });
        1.0 - explained / self.yy.max(f64::MIN_POSITIVE)
    }
}
