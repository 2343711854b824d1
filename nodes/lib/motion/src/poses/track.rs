//! One person's poses as a file has them.

use cromosim_arrays::Array;
use cromosim_body::{Gender, JOINT_COUNT, ShapeSpace};
use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};

/// Rotations of SMPL's joints: `[0]` is axes_from_pelvis, every other one is parent_from_joint.
pub(crate) type Rotations = [UnitQuaternion<f64>; JOINT_COUNT];

/// The axes of a track.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PoseAxes {
    /// A camera's: x right, y down, z forward. It may move.
    Camera,
    /// Those of a world with this direction upwards, a unit vector.
    Up(Vector3<f64>),
    /// Those of a world; up is where heads are.
    Detect,
}

/// One person of a file.
#[derive(Clone, Debug)]
pub struct PoseTrack {
    /// The file's name or number for the person; `0` where it holds one person without a name.
    pub person: String,
    /// Whose body the betas are for, where the file says so.
    pub gender: Option<Gender>,
    /// Whose shapes the betas tell.
    pub shape_space: ShapeSpace,
    /// (1, B) or (N, B), standard deviations; (1, 0) where the file has none.
    pub betas: Array<f64>,
    /// Numbers of the frames in the video, rising; 0, 1, 2 … where absent.
    pub frame_ids: Option<Vec<i64>>,
    /// One a frame, N.
    pub rotations: Vec<Rotations>,
    /// SMPL's `trans`, m, N; absent where the file has no position that can be trusted.
    pub trans: Option<Vec<Vector3<f64>>>,
    /// What turned `trans` after SMPL was evaluated, where frames differ in it: the pelvis stands
    /// at turn J_0 + trans.
    pub(crate) pelvis_turns: Option<Vec<UnitQuaternion<f64>>>,
    /// The axes of the above.
    pub axes: PoseAxes,
    /// Frames per second, Hz, where the file says so.
    pub rate_hz: Option<f64>,
    /// How sure each frame is, in [0, 1], N; absent where the file does not say.
    pub confidence: Option<Vec<f64>>,
}

impl PoseTrack {
    /// Shape coefficients over the track: the mean of its rows.
    pub fn mean_betas(&self) -> Vec<f64> {
        let [rows, count] = self.betas.shape[..] else {
            return Vec::new();
        };
        let column = |beta: usize| {
            (0..rows)
                .filter_map(|row| self.betas.values.get(row * count + beta))
                .sum::<f64>()
        };
        (0..count).map(|beta| column(beta) / rows as f64).collect()
    }

    /// Shape coefficients of one frame.
    pub(crate) fn betas_at(&self, frame: usize) -> &[f64] {
        let [rows, count] = self.betas.shape[..] else {
            return &[];
        };
        let row = if rows == 1 { 0 } else { frame };
        self.betas
            .values
            .get(row * count..(row + 1) * count)
            .unwrap_or_default()
    }

    /// Mean over the frames of where the pelvis' y axis, the upward one at rest, points.
    pub(crate) fn mean_upward(&self) -> Vector3<f64> {
        let sum: Vector3<f64> = self
            .rotations
            .iter()
            .map(|rotations| rotations[0] * Vector3::y())
            .sum();
        sum / self.rotations.len().max(1) as f64
    }
}

/// world_from_camera of a camera that is held level and looks along the world's x axis: x right, y
/// down, z forward become -y, -z, x.
pub(crate) fn world_from_level_camera() -> UnitQuaternion<f64> {
    let columns = Matrix3::from_columns(&[-Vector3::y(), -Vector3::z(), Vector3::x()]);
    UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(columns))
}
