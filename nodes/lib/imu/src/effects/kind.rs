//! The list of the effects.

/// Gives the macro `$given` all effects, in their order: a doc line, the name of the kind, and where
/// its file has what the library knows of it.
macro_rules! with_effects {
    ($given:ident) => {
        $given! {
            /// Scatter of the reference.
            ReferenceNoise => reference_noise::SPEC,
            /// A reference that was low-passed.
            ReferenceSmoothing => reference_smoothing::SPEC,
            /// A reference interpolated between frames.
            ReferenceInterpolation => reference_interpolation::SPEC,
            /// A world of the reference that is not level.
            ReferenceTilt => reference_tilt::SPEC,
            /// A reference whose positions are a little too large or too small.
            ReferenceScale => reference_scale::SPEC,
            /// A reference that is not in metres.
            ReferenceUnits => reference_units::SPEC,
            /// A sensor turned on its segment.
            MountRotation => mount_rotation::SPEC,
            /// A sensor beside the reference frame.
            LeverArm => lever_arm::SPEC,
            /// A mount that turns once.
            MountSlip => mount_slip::SPEC,
            /// A sensor on soft tissue.
            SoftTissue => soft_tissue::SPEC,
            /// Stamps late by a constant.
            TimeOffset => time_offset::SPEC,
            /// A clock of another rate.
            ClockDrift => clock_drift::SPEC,
            /// A gyroscope late against the accelerometer.
            ChannelDelay => channel_delay::SPEC,
            /// Messages lost.
            DroppedSamples => dropped_samples::SPEC,
            /// Constant error of the specific force.
            AccelBias => bias::ACCEL,
            /// Constant error of the angular velocity.
            GyroBias => bias::GYRO,
            /// Gain of the accelerometer's axes.
            AccelScale => scale::ACCEL,
            /// Gain of the gyroscope's axes.
            GyroScale => scale::GYRO,
            /// Accelerometer axes that are not orthogonal.
            AccelMisalignment => misalignment::ACCEL,
            /// Gyroscope axes that are not orthogonal.
            GyroMisalignment => misalignment::GYRO,
            /// White noise of the accelerometer beyond the declared.
            AccelNoise => noise::ACCEL,
            /// White noise of the gyroscope beyond the declared.
            GyroNoise => noise::GYRO,
            /// Accelerometer bias that grows with time.
            AccelBiasDrift => bias_drift::ACCEL,
            /// Gyroscope bias that grows with time.
            GyroBiasDrift => bias_drift::GYRO,
            /// Accelerometer bias that is another each run.
            AccelTurnOnBias => turn_on_bias::ACCEL,
            /// Gyroscope bias that is another each run.
            GyroTurnOnBias => turn_on_bias::GYRO,
            /// Accelerometer bias that wanders about its mean.
            AccelBiasInstability => bias_instability::ACCEL,
            /// Gyroscope bias that wanders about its mean.
            GyroBiasInstability => bias_instability::GYRO,
            /// Accelerometer bias that walks away at random.
            AccelBiasWalk => bias_walk::ACCEL,
            /// Gyroscope bias that walks away at random.
            GyroBiasWalk => bias_walk::GYRO,
            /// Biases that follow the temperature while the device warms up.
            WarmUp => warm_up::SPEC,
            /// Range of the accelerometer.
            AccelSaturation => saturation::ACCEL,
            /// Range of the gyroscope.
            GyroSaturation => saturation::GYRO,
            /// Resolution of the accelerometer.
            AccelQuantization => quantization::ACCEL,
            /// Resolution of the gyroscope.
            GyroQuantization => quantization::GYRO,
            /// The device's own low-pass.
            LowPass => low_pass::SPEC,
            /// The accelerometer's own low-pass.
            AccelLowPass => channel_low_pass::ACCEL,
            /// The gyroscope's own low-pass.
            GyroLowPass => channel_low_pass::GYRO,
            /// Gyroscope that feels specific force.
            GyroGSensitivity => gyro_g_sensitivity::SPEC,
            /// A vibration at the sensor.
            Vibration => vibration::SPEC,
            /// Axes named otherwise.
            AxisConvention => axis_convention::SPEC,
            /// Accelerometer in other units.
            AccelUnits => units::ACCEL,
            /// Gyroscope in other units.
            GyroUnits => units::GYRO,
            /// Gravity left out or negated.
            GravityConvention => gravity_convention::SPEC,
        }
    };
}
pub(super) use with_effects;

macro_rules! kinds {
    ($($(#[$doc:meta])* $kind:ident => $file:ident::$spec:ident,)*) => {
        /// The effects that the library names.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
        pub enum EffectKind {
            $($(#[$doc])* $kind,)*
        }

        impl EffectKind {
            /// All of them, in order.
            pub const ALL: [Self; [$(Self::$kind),*].len()] = [$(Self::$kind),*];
        }
    };
}

with_effects!(kinds);
