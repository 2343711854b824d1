//! Hosts that are looked for by their addresses, where no multicast reaches them:
//! `ROS_STATIC_PEERS`.
//!
//! RustDDS 0.15.1 announces a participant by multicast, to its own machine, and to participants
//! that it knows; no setting adds other addresses. But whoever it knows, it announces itself to, at
//! once and every ten seconds, at all addresses that this one has told. So each host is introduced
//! to it as a participant that does nothing but listen, at the well-known ports of a host's first
//! participants (RTPS 2.5, 9.6.2.3). Whoever listens there hears the true announcement and answers
//! as to any other. The introduction goes to the participant's own port and names it as the only
//! receiver; it never leaves this machine.

use std::io;
use std::net::{Ipv4Addr, SocketAddr, ToSocketAddrs, UdpSocket};

use rustdds::{DomainParticipant, GUID, RTPSEntity};

use crate::error::{RosError, RosResult};

/// Participants of a host that are looked for; as many as RustDDS looks for on its own.
const PARTICIPANTS: u16 = 12;
/// How long an introduction is valid, s: longer than a node runs. (RustDDS adds to it, and the
/// longest that can be written would overflow.)
const VALID_S: i32 = 1_000_000_000;

/// The addresses of hosts as `ROS_STATIC_PEERS` has them: names or IPv4 addresses, separated by
/// semicolons. Those of this machine's loopback are left out: it is looked at anyway.
pub(crate) fn parse(text: &str) -> RosResult<Vec<Ipv4Addr>> {
    let mut found = Vec::new();
    for host in text
        .split(';')
        .map(str::trim)
        .filter(|host| !host.is_empty())
    {
        let address = resolve(host).ok_or_else(|| RosError::Environment {
            variable: "ROS_STATIC_PEERS",
            value: text.to_owned(),
            expected: "IPv4 addresses or known names of hosts, separated by semicolons",
        })?;
        if !address.is_loopback() && !found.contains(&address) {
            found.push(address);
        }
    }
    Ok(found)
}

fn resolve(host: &str) -> Option<Ipv4Addr> {
    // The C library would take 10.9.8 for 10.9.0.8.
    if host.chars().all(|c| c.is_ascii_digit() || c == '.') {
        return host.parse().ok();
    }
    let addresses = (host, 0).to_socket_addrs().ok()?;
    let mut addresses = addresses.filter_map(|address| match address {
        SocketAddr::V4(address) => Some(*address.ip()),
        SocketAddr::V6(_) => None,
    });
    addresses.next()
}

/// This machine's own addresses on the ways to these hosts.
pub(crate) fn own_addresses(peers: &[Ipv4Addr]) -> Vec<Ipv4Addr> {
    let mut found = Vec::new();
    for &peer in peers {
        match own_address(peer) {
            Ok(own) if found.contains(&own) => {}
            Ok(own) => found.push(own),
            Err(error) => log::warn!("ROS_STATIC_PEERS: no way to {peer}: {error}"),
        }
    }
    found
}

/// The kernel picks it; nothing is sent.
fn own_address(peer: Ipv4Addr) -> io::Result<Ipv4Addr> {
    const ANY_PORT: u16 = 7410;
    let socket = UdpSocket::bind((Ipv4Addr::UNSPECIFIED, 0))?;
    socket.connect((peer, ANY_PORT))?;
    match socket.local_addr()?.ip() {
        std::net::IpAddr::V4(own) => Ok(own),
        std::net::IpAddr::V6(_) => Err(io::ErrorKind::AddrNotAvailable.into()),
    }
}

/// The ports of RTPS at which participants of a domain are announced by multicast, and at which they
/// hear what is sent to all.
pub(crate) fn multicast_ports(domain_id: u16) -> [u16; 2] {
    [base_port(domain_id), base_port(domain_id) + 1]
}

fn base_port(domain_id: u16) -> u16 {
    7400 + 250 * domain_id
}

/// Where a host's participant of this number hears announcements.
fn announcement_port(domain_id: u16, participant: u16) -> u16 {
    base_port(domain_id) + 10 + 2 * participant
}

/// Makes a participant announce itself to these hosts, from now on.
pub(crate) fn introduce(participant: &DomainParticipant, peers: &[Ipv4Addr]) -> io::Result<()> {
    let (domain_id, number) = (participant.domain_id(), participant.participant_id());
    let own_port = announcement_port(domain_id, number);
    let socket = UdpSocket::bind((Ipv4Addr::LOCALHOST, 0))?;
    for &peer in peers {
        let introduced = introduction(participant.guid(), domain_id, peer);
        socket.send_to(&introduced, (Ipv4Addr::LOCALHOST, own_port))?;
    }
    Ok(())
}

/// RTPS message (2.5, 8.3 and 9.4) for the participant with this prefix: a DATA submessage of
/// SPDPdiscoveredParticipantData (8.5.3.2, 9.6.2.2), little endian, as of a participant at `peer`.
fn introduction(receiver: GUID, domain_id: u16, peer: Ipv4Addr) -> Vec<u8> {
    const VERSION: [u8; 2] = [2, 4];
    const VENDOR: [u8; 2] = [0x01, 0x12]; // RustDDS, whose participant this stands for
    const LITTLE_ENDIAN: u8 = 1;
    const HAS_DATA: u8 = 4;
    let prefix = [&VENDOR[..], b"intr", &peer.octets(), &[0, 0]].concat();

    let mut parameters = Vec::new();
    let mut parameter = |id: u16, value: &[u8]| {
        parameters.extend(id.to_le_bytes());
        parameters.extend((value.len() as u16).to_le_bytes());
        parameters.extend(value);
    };
    parameter(0x0015, &[VERSION[0], VERSION[1], 0, 0]); // PID_PROTOCOL_VERSION
    parameter(0x0016, &[VENDOR[0], VENDOR[1], 0, 0]); // PID_VENDORID
    parameter(0x0050, &[&prefix[..], &[0, 0, 1, 0xc1]].concat()); // PID_PARTICIPANT_GUID
    for number in 0..PARTICIPANTS {
        let (kind, port) = (1_i32, u32::from(announcement_port(domain_id, number)));
        let (kind, port) = (kind.to_le_bytes(), port.to_le_bytes());
        let locator = [&kind[..], &port, &[0; 12], &peer.octets()].concat();
        parameter(0x0032, &locator); // PID_METATRAFFIC_UNICAST_LOCATOR, UDPv4
    }
    let valid = [VALID_S.to_le_bytes(), [0; 4]].concat();
    parameter(0x0002, &valid); // PID_PARTICIPANT_LEASE_DURATION
    parameter(0x0058, &2_u32.to_le_bytes()); // PID_BUILTIN_ENDPOINT_SET: hears of participants
    parameter(0x0001, &[]); // PID_SENTINEL

    // Extra flags, where the inline QoS would begin, SPDP's reader and writer, sequence number 1,
    // then PL_CDR_LE.
    let mut data = vec![0, 0, 16, 0, 0, 1, 0, 0xc7, 0, 1, 0, 0xc2];
    data.extend([0, 0, 0, 0, 1, 0, 0, 0, 0, 3, 0, 0]);
    data.extend(parameters);
    let submessage = |id: u8, flags: u8, content: &[u8]| {
        let length = (content.len() as u16).to_le_bytes();
        [&[id, flags, length[0], length[1]][..], content].concat()
    };
    [
        &b"RTPS"[..],
        &VERSION,
        &VENDOR,
        &prefix,
        &submessage(0x0e, LITTLE_ENDIAN, &receiver.to_bytes()[..12]), // INFO_DST
        &submessage(0x15, LITTLE_ENDIAN | HAS_DATA, &data),
    ]
    .concat()
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn hosts_are_addresses_and_names() {
        let found = parse(" 10.9.8.2;localhost; 127.0.0.1 ;10.9.8.3;10.9.8.2;").unwrap();
        assert_eq!(found, [[10, 9, 8, 2].into(), Ipv4Addr::new(10, 9, 8, 3)]);
        assert_eq!(parse("").unwrap(), Vec::<Ipv4Addr>::new());
        for wrong in ["10.9.8", "no such host", "10.9.8.2,10.9.8.3"] {
            let said = parse(wrong).unwrap_err().to_string();
            assert!(
                said.contains("ROS_STATIC_PEERS") && said.contains(wrong),
                "{said}"
            );
        }
    }

    #[test]
    fn ports_are_those_of_the_standard() {
        assert_eq!(multicast_ports(0), [7400, 7401]);
        assert_eq!(announcement_port(0, 0), 7410);
        assert_eq!(announcement_port(2, 3), 7400 + 500 + 16);
    }
}
