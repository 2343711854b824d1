//! Which peers a node looks for: ROS 2's own environment variables.

use std::net::{IpAddr, Ipv4Addr};

use rustdds::{DomainParticipant, DomainParticipantBuilder};

use crate::error::{RosError, RosResult, dds};
use crate::loopback::{Circle, Sockets};
use crate::peers;
use crate::security::Security;

/// How far a node looks for peers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum DiscoveryRange {
    /// Nowhere: the node stays alone. As for packets, the same as `Localhost`.
    Off,
    /// On this machine: no packet leaves it, none of another host is taken. The suite's default.
    Localhost,
    /// In the local network, by multicast on all its interfaces.
    Subnet,
    /// As the middleware sees fit: here the same as `Subnet`.
    SystemDefault,
}

/// The network that a node takes part in.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct Network {
    /// DDS domain, 0 to 232; nodes see each other only within one domain.
    pub domain_id: u16,
    /// How far the node looks.
    pub range: DiscoveryRange,
    /// Hosts that it looks at in the place of multicast, and whose nodes look at this one; none
    /// under `Off`. With `Localhost` no other host is heard.
    pub peers: Vec<Ipv4Addr>,
}

impl Default for Network {
    fn default() -> Self {
        Self {
            domain_id: 0,
            range: DiscoveryRange::Localhost,
            peers: Vec::new(),
        }
    }
}

impl Network {
    /// From `ROS_DOMAIN_ID`, `ROS_AUTOMATIC_DISCOVERY_RANGE`, `ROS_LOCALHOST_ONLY` and
    /// `ROS_STATIC_PEERS`. Nothing set: domain 0, this machine only.
    ///
    /// As in ROS 2, `ROS_LOCALHOST_ONLY=1` wins over the range; `ROS_LOCALHOST_ONLY=0` alone means
    /// the subnet.
    ///
    /// # Errors
    /// Names the variable and what it may be.
    pub fn from_env() -> RosResult<Self> {
        Self::from_variables(|variable| std::env::var(variable).ok())
    }

    fn from_variables(get: impl Fn(&str) -> Option<String>) -> RosResult<Self> {
        let get = |variable: &str| get(variable).filter(|value| !value.is_empty());
        let wrong = |variable, value: String, expected| RosError::Environment {
            variable,
            value,
            expected,
        };
        let domain_id = match get("ROS_DOMAIN_ID") {
            None => 0,
            // Above 232 the ports of RTPS pass 65535.
            Some(text) => match text.trim().parse::<u16>() {
                Ok(id) if id <= 232 => id,
                _ => return Err(wrong("ROS_DOMAIN_ID", text, "a whole number from 0 to 232")),
            },
        };
        let only_localhost = match get("ROS_LOCALHOST_ONLY").as_deref() {
            None => None,
            Some("1") => Some(true),
            Some("0") => Some(false),
            Some(other) => return Err(wrong("ROS_LOCALHOST_ONLY", other.to_owned(), "0 or 1")),
        };
        let range = match get("ROS_AUTOMATIC_DISCOVERY_RANGE") {
            None => None,
            Some(text) => Some(match text.to_ascii_uppercase().as_str() {
                "OFF" => DiscoveryRange::Off,
                "LOCALHOST" => DiscoveryRange::Localhost,
                "SUBNET" => DiscoveryRange::Subnet,
                "SYSTEM_DEFAULT" => DiscoveryRange::SystemDefault,
                _ => {
                    return Err(wrong(
                        "ROS_AUTOMATIC_DISCOVERY_RANGE",
                        text,
                        "OFF, LOCALHOST, SUBNET or SYSTEM_DEFAULT",
                    ));
                }
            }),
        };
        let range = match (only_localhost, range) {
            (Some(true), _) => DiscoveryRange::Localhost,
            (_, Some(range)) => range,
            (Some(false), None) => DiscoveryRange::Subnet,
            (None, None) => DiscoveryRange::Localhost,
        };
        // As in ROS 2, ROS_LOCALHOST_ONLY=1 knows no other hosts at all.
        let peers = match get("ROS_STATIC_PEERS") {
            Some(text) if only_localhost != Some(true) => peers::parse(&text)?,
            _ => Vec::new(),
        };
        Ok(Self {
            domain_id,
            range,
            peers,
        })
    }

    /// Made by RustDDS's builder: ros2-client's options know the domain only, not the networks.
    pub(crate) fn participant(&self, security: &Security) -> RosResult<DomainParticipant> {
        let peers = match self.range {
            DiscoveryRange::Off => &[][..],
            _ => &self.peers,
        };
        if !peers.is_empty() && matches!(security, Security::Enclave(_)) {
            log::warn!("ROS_STATIC_PEERS: secured nodes are not announced to other hosts");
        }
        let own = peers::own_addresses(peers);
        let builder = DomainParticipantBuilder::new(self.domain_id);
        let builder = match self.range {
            DiscoveryRange::Off => builder
                .with_only_networks(std::iter::empty::<IpAddr>())
                .same_host_loopback(false),
            DiscoveryRange::Localhost => {
                let here = [Ipv4Addr::LOCALHOST].into_iter();
                builder.with_only_networks(here.chain(own.iter().copied()))
            }
            DiscoveryRange::Subnet | DiscoveryRange::SystemDefault => builder,
        };
        let builder = security.protect(builder)?;
        let keeps_here = matches!(self.range, DiscoveryRange::Off | DiscoveryRange::Localhost);
        let refused_ports = peers::multicast_ports(self.domain_id);
        let sockets = match (keeps_here, peers.is_empty()) {
            (true, true) => Sockets::on_loopback(),
            (true, false) => Sockets::within(Circle::Hosts {
                admitted: [peers, &own[..]].concat(),
                refused_ports,
            }),
            (false, true) => Sockets::everywhere(),
            (false, false) => Sockets::within(Circle::Everybody { refused_ports }),
        };
        let doing = || format!("join DDS domain {}", self.domain_id);
        // All of its sockets are bound when this returns.
        let participant = builder.build().map_err(|error| dds(doing(), error))?;
        if keeps_here && !sockets.were_kept() {
            let problem = "its sockets cannot be kept to this machine; \
                           ROS_AUTOMATIC_DISCOVERY_RANGE=SUBNET talks to the network";
            // Sockets are tied to a device by other calls elsewhere.
            if cfg!(target_os = "linux") {
                return Err(dds(doing(), problem));
            }
            log::warn!("packets of other hosts are not refused on this system");
        }
        drop(sockets);
        peers::introduce(&participant, peers).map_err(|error| dds(doing(), error))?;
        Ok(participant)
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    fn network(variables: &[(&str, &str)]) -> RosResult<Network> {
        Network::from_variables(|name| {
            variables
                .iter()
                .find(|(key, _)| *key == name)
                .map(|(_, value)| (*value).to_owned())
        })
    }

    #[test]
    fn variables_are_read_as_in_ros() {
        assert_eq!(
            network(&[]).unwrap(),
            Network {
                domain_id: 0,
                range: DiscoveryRange::Localhost,
                peers: Vec::new(),
            }
        );
        let peers = |variables: &[(&str, &str)]| network(variables).unwrap().peers;
        let named = ("ROS_STATIC_PEERS", "10.9.8.2;10.9.8.3");
        let both = [Ipv4Addr::new(10, 9, 8, 2), Ipv4Addr::new(10, 9, 8, 3)];
        assert_eq!(peers(&[named]), both);
        assert!(peers(&[named, ("ROS_LOCALHOST_ONLY", "1")]).is_empty());
        assert_eq!(network(&[("ROS_DOMAIN_ID", "42")]).unwrap().domain_id, 42);
        let range = |variables: &[(&str, &str)]| network(variables).unwrap().range;
        assert_eq!(
            range(&[("ROS_AUTOMATIC_DISCOVERY_RANGE", "SUBNET")]),
            DiscoveryRange::Subnet
        );
        assert_eq!(
            range(&[("ROS_AUTOMATIC_DISCOVERY_RANGE", "off")]),
            DiscoveryRange::Off
        );
        assert_eq!(
            range(&[
                ("ROS_AUTOMATIC_DISCOVERY_RANGE", "SUBNET"),
                ("ROS_LOCALHOST_ONLY", "1")
            ]),
            DiscoveryRange::Localhost
        );
        assert_eq!(
            range(&[("ROS_LOCALHOST_ONLY", "0")]),
            DiscoveryRange::Subnet
        );
        assert_eq!(
            range(&[
                ("ROS_LOCALHOST_ONLY", "0"),
                ("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
            ]),
            DiscoveryRange::Localhost
        );
    }

    #[test]
    fn wrong_variables_are_named() {
        for (variable, value) in [
            ("ROS_DOMAIN_ID", "233"),
            ("ROS_DOMAIN_ID", "x"),
            ("ROS_LOCALHOST_ONLY", "yes"),
            ("ROS_AUTOMATIC_DISCOVERY_RANGE", "near"),
            ("ROS_STATIC_PEERS", "10.9.8.2 10.9.8.3"),
        ] {
            let text = network(&[(variable, value)]).unwrap_err().to_string();
            assert!(text.contains(variable) && text.contains(value), "{text}");
        }
    }
}
