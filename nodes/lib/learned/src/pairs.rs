//! Motion and what a real (or virtual) device measured of it.

use cromosim_imu::{GRAVITY_IN_WORLD, KinematicSample, Reading};
use cromosim_spatial::Stamp;
use nalgebra::{UnitQuaternion, Vector3};

use crate::align::reading_at;
use crate::{LearnedError, Quantity, SiteMotion, align};

/// What a network should say of one sample, world axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Target {
    /// Measured specific force, turned into the world, gravity taken off, m/s2.
    pub acceleration: Vector3<f64>,
    /// Measured, turned into the world, rad/s.
    pub angular_velocity: Vector3<f64>,
}

/// A motion with a target for each of its samples; none where nothing was measured.
#[derive(Clone, Debug)]
pub struct Pair {
    /// Recording and placement, for messages and scores.
    pub name: String,
    /// Whose motion it is: what is held out together.
    pub subject: String,
    /// The placement: where on the body.
    pub position: String,
    /// The motion as a simulation gets it.
    pub motion: SiteMotion,
    /// As many as the motion has samples.
    pub targets: Vec<Option<Target>>,
    /// What was measured, in the axes of the reference's sensor frame: what a simulation is
    /// compared with.
    pub measured: Vec<Option<Reading>>,
}

/// Names of a pair.
#[derive(Clone, Debug)]
pub struct PairNames {
    /// See [`Pair::name`].
    pub name: String,
    /// See [`Pair::subject`].
    pub subject: String,
    /// See [`Pair::position`].
    pub position: String,
}

impl Pair {
    /// Turns readings into the world: `a_G = R_GB R_BS a_S + g`, `w_G = R_GB R_BS w_S`, at the
    /// reference's time, where R_GB is the reference's orientation and R_BS the fitted mount. Time
    /// and mount are fitted to `reference`, the best motion that is known; `motion` is what the
    /// simulation is given, which may be worse (from video), on the same stamps.
    ///
    /// # Errors
    /// As [`align()`].
    pub fn new(
        names: PairNames,
        motion: SiteMotion,
        reference: &SiteMotion,
        stamps: &[Stamp],
        readings: &[Reading],
    ) -> Result<Self, LearnedError> {
        let alignment = align(&reference.kinematics, stamps, readings)?;
        let turned = |sample: &KinematicSample| {
            let reading = reading_at(
                stamps,
                readings,
                sample.stamp.plus_seconds(alignment.time_offset),
            )?;
            let reference_from_chip = alignment.reference_from_chip;
            Some(Reading {
                specific_force: reference_from_chip * reading.specific_force,
                angular_velocity: reference_from_chip * reading.angular_velocity,
            })
        };
        let mut measured: Vec<_> = reference.kinematics.iter().map(turned).collect();
        measured.resize(motion.len(), None);
        let in_world = |(reading, sample): (&Option<Reading>, &KinematicSample)| {
            let world_from_sensor = sample.world_from_sensor.rotation;
            (*reading).map(
                |Reading {
                     specific_force,
                     angular_velocity,
                 }| Target {
                    acceleration: world_from_sensor * specific_force + GRAVITY_IN_WORLD,
                    angular_velocity: world_from_sensor * angular_velocity,
                },
            )
        };
        let mut targets: Vec<_> = measured
            .iter()
            .zip(&reference.kinematics)
            .map(in_world)
            .collect();
        targets.resize(motion.len(), None);
        let PairNames {
            name,
            subject,
            position,
        } = names;
        Ok(Self {
            name,
            subject,
            position,
            motion,
            targets,
            measured,
        })
    }

    /// The target of a sample, turned, in units of [`Quantity::scale`]; on top of the analytic
    /// value where `residual`.
    pub fn target(
        &self,
        sample: usize,
        quantity: Quantity,
        residual: bool,
        turn: &UnitQuaternion<f64>,
    ) -> Option<[f32; 3]> {
        let target = (*self.targets.get(sample)?)?;
        let kinematic = self.motion.kinematics.get(sample)?;
        let (value, analytic) = match quantity {
            Quantity::Acceleration => (target.acceleration, kinematic.acceleration_in_world),
            Quantity::AngularVelocity => {
                (target.angular_velocity, kinematic.angular_velocity_in_world)
            }
        };
        let wanted = if residual { value - analytic } else { value };
        let wanted = turn * wanted / quantity.scale();
        Some([wanted.x as f32, wanted.y as f32, wanted.z as f32])
    }
}
