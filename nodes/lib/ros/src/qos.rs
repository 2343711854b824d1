//! Quality of service: how many messages are kept, and whether lost ones are sent again.

use std::time::Duration;

use ros2_client::QosProfile;
use ros2_client::qos::{self, WhenFull};
use rustdds::{QosPolicies, policy};

use crate::error::{RosError, RosResult};

/// Whether lost messages are sent again.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Reliability {
    /// Lost messages stay lost; the publisher never waits. Does not match subscriptions that ask
    /// for `Reliable`.
    BestEffort,
    /// Lost messages are sent again.
    Reliable,
}

/// Whether late subscriptions get what was published before.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Durability {
    /// They do not.
    Volatile,
    /// They get the publisher's last `depth` messages.
    TransientLocal,
}

/// How many messages are kept.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum History {
    /// The last ones, this many.
    KeepLast(u32),
    /// All, up to the middleware's bounds.
    KeepAll,
}

/// Quality of service of one publisher or subscription, with the presets of the suite.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Qos {
    /// Whether lost messages are sent again.
    pub reliability: Reliability,
    /// Whether late subscriptions get earlier messages.
    pub durability: Durability,
    /// How many messages are kept.
    pub history: History,
    /// How long `publish` may wait for reliable subscriptions that are more than 8192 messages
    /// behind, before it gives up a message.
    pub max_blocking: Duration,
}

impl Qos {
    /// The default of every topic: reliable, keep last 10, volatile.
    pub const fn reliable() -> Self {
        Self {
            reliability: Reliability::Reliable,
            durability: Durability::Volatile,
            history: History::KeepLast(10),
            max_blocking: Duration::from_millis(100),
        }
    }

    /// `/tf`: reliable, keep last 100, volatile.
    pub const fn tf() -> Self {
        Self::reliable().depth(100)
    }

    /// `/tf_static`: reliable, keep last 1, transient local.
    pub const fn tf_static() -> Self {
        Self::reliable().depth(1).transient_local()
    }

    /// `/clock`: best effort, keep last 1, volatile.
    pub const fn clock() -> Self {
        Self::reliable().depth(1).best_effort()
    }

    /// The recorder's subscriptions: reliable, keep last 1000, volatile. They match only reliable
    /// publishers.
    pub const fn recorder() -> Self {
        Self::reliable().depth(1000)
    }

    /// ROS 2's sensor data: best effort, keep last 5, volatile. As a subscription it matches every
    /// publisher.
    pub const fn sensor_data() -> Self {
        Self::reliable().depth(5).best_effort()
    }

    /// ROS 2's services: reliable, keep last 10, volatile.
    pub const fn services() -> Self {
        Self::reliable()
    }

    /// With the last `depth` messages kept.
    #[must_use]
    pub const fn depth(mut self, depth: u32) -> Self {
        self.history = History::KeepLast(depth);
        self
    }

    /// Without sending again.
    #[must_use]
    pub const fn best_effort(mut self) -> Self {
        self.reliability = Reliability::BestEffort;
        self
    }

    /// With earlier messages for late subscriptions.
    #[must_use]
    pub const fn transient_local(mut self) -> Self {
        self.durability = Durability::TransientLocal;
        self
    }

    /// True where a subscription that asks for `requested` gets the messages of a publisher that
    /// offers `self`.
    pub fn satisfies(&self, requested: &Qos) -> bool {
        (self.reliability == Reliability::Reliable
            || requested.reliability == Reliability::BestEffort)
            && (self.durability == Durability::TransientLocal
                || requested.durability == Durability::Volatile)
    }

    /// A subscription for this offer that matches it and keeps at least `depth` messages: what a
    /// recorder asks for.
    #[must_use]
    pub fn matching_subscription(&self, depth: u32) -> Qos {
        let history = match self.history {
            History::KeepLast(offered) => History::KeepLast(offered.max(depth)),
            History::KeepAll => History::KeepAll,
        };
        Qos { history, ..*self }
    }

    /// How many received messages wait for the program: the depth, and at least 64, as RustDDS
    /// keeps them too.
    pub(crate) fn queue_length(self) -> usize {
        match self.history {
            History::KeepLast(depth) => (depth as usize).max(64),
            History::KeepAll => usize::MAX,
        }
    }

    /// As ros2-client knows it.
    pub(crate) fn to_profile(self) -> QosProfile {
        let profile = QosProfile::publisher_default()
            .durability(match self.durability {
                Durability::Volatile => qos::Durability::Volatile,
                Durability::TransientLocal => qos::Durability::TransientLocal,
            })
            .history(match self.history {
                History::KeepLast(depth) => qos::History::KeepLast {
                    depth: depth.clamp(1, i32::MAX as u32) as usize,
                },
                History::KeepAll => qos::History::KeepAll,
            });
        match self.reliability {
            Reliability::BestEffort => profile.reliability_best_effort(),
            Reliability::Reliable => {
                profile.reliability_reliable(WhenFull::Wait(self.max_blocking))
            }
        }
    }

    /// As DDS knows it, by ros2-client's own mapping.
    pub(crate) fn to_dds(self) -> QosPolicies {
        QosPolicies::from(self.to_profile())
    }

    /// From a peer's announcement. DDS does not announce the history: it reads as keep last 0.
    pub(crate) fn from_dds(qos: &QosPolicies) -> Self {
        let reliability = match qos.reliability() {
            Some(policy::Reliability::Reliable { .. }) => Reliability::Reliable,
            _ => Reliability::BestEffort,
        };
        let durability = match qos.durability() {
            None | Some(policy::Durability::Volatile) => Durability::Volatile,
            Some(_) => Durability::TransientLocal,
        };
        let history = match qos.history() {
            Some(policy::History::KeepAll) => History::KeepAll,
            Some(policy::History::KeepLast { depth }) => History::KeepLast(depth.max(0) as u32),
            None => History::KeepLast(0),
        };
        Self {
            reliability,
            durability,
            history,
            ..Self::reliable()
        }
    }

    /// Applies one policy of a `qos_overrides` parameter: `depth`, `reliability`, `durability` or
    /// `history`.
    pub(crate) fn override_policy(
        &mut self,
        policy: &str,
        value: &str,
        place: &str,
        name: &str,
    ) -> RosResult<()> {
        let refuse = |expected: &str| RosError::ParameterValue {
            place: place.to_owned(),
            name: name.to_owned(),
            expected: expected.to_owned(),
            found: format!("'{value}'"),
        };
        match policy {
            "depth" => {
                let depth = value
                    .parse::<u32>()
                    .ok()
                    .filter(|depth| *depth >= 1)
                    .ok_or_else(|| refuse("a whole number from 1"))?;
                if self.history != History::KeepAll {
                    self.history = History::KeepLast(depth);
                }
            }
            "reliability" => match value {
                "reliable" => self.reliability = Reliability::Reliable,
                "best_effort" => self.reliability = Reliability::BestEffort,
                "system_default" => {}
                _ => return Err(refuse("'reliable', 'best_effort' or 'system_default'")),
            },
            "durability" => match value {
                "volatile" => self.durability = Durability::Volatile,
                "transient_local" => self.durability = Durability::TransientLocal,
                "system_default" => {}
                _ => return Err(refuse("'volatile', 'transient_local' or 'system_default'")),
            },
            "history" => match value {
                "keep_last" if self.history == History::KeepAll => {
                    self.history = History::KeepLast(10)
                }
                "keep_all" => self.history = History::KeepAll,
                "keep_last" | "system_default" => {}
                _ => return Err(refuse("'keep_last', 'keep_all' or 'system_default'")),
            },
            _ => {
                return Err(refuse(
                    "one of the policies depth, reliability, durability, history",
                ));
            }
        }
        Ok(())
    }
}

impl Default for Qos {
    fn default() -> Self {
        Self::reliable()
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn policies_survive_dds() {
        for qos in [
            Qos::reliable(),
            Qos::tf(),
            Qos::tf_static(),
            Qos::clock(),
            Qos::recorder(),
            Qos::sensor_data(),
        ] {
            assert_eq!(Qos::from_dds(&qos.to_dds()), qos);
        }
        assert_eq!(Qos::tf().history, History::KeepLast(100));
        assert_eq!(Qos::tf_static().durability, Durability::TransientLocal);
        assert_eq!(Qos::clock().reliability, Reliability::BestEffort);
    }

    #[test]
    fn offers_are_matched_as_in_dds() {
        assert!(Qos::reliable().satisfies(&Qos::sensor_data()));
        assert!(!Qos::sensor_data().satisfies(&Qos::reliable()));
        assert!(!Qos::reliable().satisfies(&Qos::tf_static()));
        for offered in [Qos::reliable(), Qos::clock(), Qos::tf_static()] {
            let asked = offered.matching_subscription(1000);
            assert!(offered.satisfies(&asked));
            assert_eq!(asked.history, History::KeepLast(1000));
        }
    }

    #[test]
    fn overrides_are_checked() {
        let mut qos = Qos::reliable();
        for (policy, value) in [
            ("depth", "5"),
            ("reliability", "best_effort"),
            ("durability", "transient_local"),
        ] {
            qos.override_policy(policy, value, "here", "p").unwrap();
        }
        assert_eq!(qos, Qos::sensor_data().transient_local());
        let error = qos
            .override_policy(
                "reliability",
                "sometimes",
                "here",
                "qos_overrides./x.publisher.reliability",
            )
            .unwrap_err();
        assert!(error.to_string().contains("'best_effort'"), "{error}");
        assert!(qos.override_policy("depth", "0", "here", "p").is_err());
    }
}
