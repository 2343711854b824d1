//! Time and duration.

ros_message! {
    "builtin_interfaces/msg/Time", "../std/builtin_interfaces/msg/Time.msg", Message;
    /// A point in time.
    #[derive(Copy, Default, Eq)]
    pub struct Time {
        /// Whole seconds since the clock's epoch.
        pub sec: i32,
        /// Nanoseconds after `sec`, below 1e9.
        pub nanosec: u32,
    }
}

ros_message! {
    "builtin_interfaces/msg/Duration", "../std/builtin_interfaces/msg/Duration.msg", Message;
    /// A span of time.
    #[derive(Copy, Default, Eq)]
    pub struct Duration {
        /// Whole seconds, rounded towards minus infinity.
        pub sec: i32,
        /// Nanoseconds after `sec`, below 1e9.
        pub nanosec: u32,
    }
}

macro_rules! nanoseconds {
    ($name:ident) => {
        impl $name {
            /// From nanoseconds. What 32 bits of seconds cannot hold (after January 2038)
            /// saturates.
            pub const fn from_nanos(nanos: i64) -> Self {
                const BILLION: i64 = 1_000_000_000;
                let sec = nanos.div_euclid(BILLION);
                if sec > i32::MAX as i64 {
                    return Self {
                        sec: i32::MAX,
                        nanosec: 999_999_999,
                    };
                }
                if sec < i32::MIN as i64 {
                    return Self {
                        sec: i32::MIN,
                        nanosec: 0,
                    };
                }
                Self {
                    sec: sec as i32,
                    nanosec: nanos.rem_euclid(BILLION) as u32,
                }
            }

            /// Nanoseconds. Exact for every value, `nanosec` above 1e9 included.
            pub const fn nanos(self) -> i64 {
                self.sec as i64 * 1_000_000_000 + self.nanosec as i64
            }
        }
    };
}

nanoseconds!(Time);
nanoseconds!(Duration);
