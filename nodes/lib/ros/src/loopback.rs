//! Sockets that no other host reaches, and that reach none.
//!
//! RustDDS 0.15.1 binds its sockets to every address, whatever networks it is told to use ("not a
//! hard transport-level ACL"), reads them on a thread of its own at once, and has no hook between
//! the two. So this crate stands in for the C library's `bind`: while a participant is built that
//! keeps to this machine, each of its sockets is bound to the loopback device before it gets an
//! address. A packet from elsewhere then finds no socket, and one to elsewhere finds no way out.
//! Looking for the sockets afterwards would leave some milliseconds open.
//!
//! Where other hosts are named, sockets are on all devices, but hear these hosts and this machine
//! alone, and send no multicast out. RustDDS sends to whoever announces a multicast address by
//! multicast alone, which need not reach him; so this participant gets no sockets for it and
//! announces none.

use std::net::Ipv4Addr;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, MutexGuard};

use crate::wake::lock;

/// One participant is built at a time: the process has one `bind`.
static BUILDING: Mutex<()> = Mutex::new(());
static CIRCLE: Mutex<Option<Circle>> = Mutex::new(None);
static KEPT: AtomicUsize = AtomicUsize::new(0);

/// Whom a participant's sockets hear.
#[derive(Clone)]
pub(crate) enum Circle {
    /// What comes by the loopback device.
    Loopback,
    /// 127.0.0.0/8 and these addresses; no multicast leaves, and nobody gets these ports.
    Hosts {
        admitted: Vec<Ipv4Addr>,
        refused_ports: [u16; 2],
    },
    /// Everybody, but nobody gets these ports.
    Everybody { refused_ports: [u16; 2] },
}

/// While it lives, this process makes its IPv4 datagram sockets within a [`Circle`], or, with
/// [`Sockets::everywhere`], as it is asked to.
pub(crate) struct Sockets {
    _building: MutexGuard<'static, ()>,
}

impl Sockets {
    pub(crate) fn on_loopback() -> Self {
        Self::within(Circle::Loopback)
    }

    pub(crate) fn within(circle: Circle) -> Self {
        let building = lock(&BUILDING);
        KEPT.store(0, Ordering::SeqCst);
        *lock(&CIRCLE) = Some(circle);
        Self {
            _building: building,
        }
    }

    pub(crate) fn everywhere() -> Self {
        Self {
            _building: lock(&BUILDING),
        }
    }

    /// Whether sockets were kept within the circle.
    pub(crate) fn were_kept(&self) -> bool {
        KEPT.load(Ordering::SeqCst) > 0
    }
}

impl Drop for Sockets {
    fn drop(&mut self) {
        *lock(&CIRCLE) = None;
    }
}

#[cfg(target_os = "linux")]
mod linux {
    #![allow(unsafe_code)]

    use std::io;
    use std::net::Ipv4Addr;
    use std::sync::atomic::Ordering;

    use libc::{c_int, c_void, sockaddr, sockaddr_in, socklen_t};

    use super::{CIRCLE, Circle, KEPT};
    use crate::wake::lock;

    /// The C library's `bind` for the whole program: the linker takes this one.
    ///
    /// # Safety
    /// As the C library's: `address` points to `length` bytes.
    #[unsafe(no_mangle)]
    pub unsafe extern "C" fn bind(
        socket: c_int,
        address: *const sockaddr,
        length: socklen_t,
    ) -> c_int {
        let circle = lock(&CIRCLE).clone();
        if let Some(circle) = circle {
            // SAFETY: as this function's.
            let port = unsafe { port(address, length) };
            if keep_within(&circle, socket, port).is_err() {
                // The reason is in errno, as for any refusal of `bind`.
                return -1;
            }
        }
        // SAFETY: passed on as it came; the kernel checks what it is given.
        unsafe { libc::syscall(libc::SYS_bind, socket, address, length) as c_int }
    }

    /// The port of an IPv4 address.
    ///
    /// # Safety
    /// `address` points to `length` bytes.
    unsafe fn port(address: *const sockaddr, length: socklen_t) -> Option<u16> {
        if address.is_null() || (length as usize) < size_of::<sockaddr_in>() {
            return None;
        }
        // SAFETY: there are as many bytes; any of them make a `sockaddr_in`.
        let address = unsafe { address.cast::<sockaddr_in>().read_unaligned() };
        let is_ipv4 = c_int::from(address.sin_family) == libc::AF_INET;
        is_ipv4.then(|| u16::from_be(address.sin_port))
    }

    /// Ties an IPv4 datagram socket to the loopback device, or lets it hear the circle alone; lets
    /// others be.
    fn keep_within(circle: &Circle, socket: c_int, port: Option<u16>) -> io::Result<()> {
        let is = |name, value| option(socket, name).map(|found| found == value);
        if !is(libc::SO_DOMAIN, libc::AF_INET)? || !is(libc::SO_TYPE, libc::SOCK_DGRAM)? {
            return Ok(());
        }
        let (admitted, refused_ports) = match circle {
            Circle::Loopback => (None, None),
            Circle::Hosts {
                admitted,
                refused_ports,
            } => (Some(admitted), Some(refused_ports)),
            Circle::Everybody { refused_ports } => (None, Some(refused_ports)),
        };
        let is_refused = |ports: &[u16; 2]| port.is_some_and(|port| ports.contains(&port));
        if refused_ports.is_some_and(is_refused) {
            // SAFETY: errno is this thread's own.
            unsafe { *libc::__errno_location() = libc::EADDRNOTAVAIL };
            return Err(io::Error::last_os_error());
        }
        if let Circle::Loopback = circle {
            tie_to_loopback(socket)?;
        }
        if let Some(admitted) = admitted {
            refuse_others(socket, admitted)?;
            let hops: c_int = 0;
            let (name, length) = (libc::IP_MULTICAST_TTL, size_of::<c_int>());
            let place = (&raw const hops).cast();
            set(socket, libc::IPPROTO_IP, name, place, length)?;
        }
        KEPT.fetch_add(1, Ordering::SeqCst);
        Ok(())
    }

    fn tie_to_loopback(socket: c_int) -> io::Result<()> {
        const DEVICE: &[u8] = b"lo\0";
        let (place, length) = (DEVICE.as_ptr().cast(), DEVICE.len());
        match set(
            socket,
            libc::SOL_SOCKET,
            libc::SO_BINDTODEVICE,
            place,
            length,
        ) {
            // Before Linux 5.7 only root may; what comes in can be refused without.
            Err(error) if error.raw_os_error() == Some(libc::EPERM) => refuse_others(socket, &[]),
            tied => tied,
        }
    }

    /// Drops each datagram whose source is neither in 127.0.0.0/8 nor admitted, before it is queued.
    /// (The kernel takes sources in 127.0.0.0/8 and own ones from the loopback device alone.) Who
    /// hears no other host has nobody to answer.
    fn refuse_others(socket: c_int, admitted: &[Ipv4Addr]) -> io::Result<()> {
        let step = |code: u32, jt, jf, k| libc::sock_filter {
            code: code as u16,
            jt,
            jf,
            k,
        };
        // Offset of the source address in the IPv4 header.
        let source = libc::SKF_NET_OFF as u32 + 12;
        let take = step(libc::BPF_RET | libc::BPF_K, 0, 0, u32::MAX);
        let equals = |value| step(libc::BPF_JMP | libc::BPF_JEQ | libc::BPF_K, 0, 1, value);
        let mut steps = vec![
            step(libc::BPF_LD | libc::BPF_B | libc::BPF_ABS, 0, 0, source),
            equals(127),
            take,
            step(libc::BPF_LD | libc::BPF_W | libc::BPF_ABS, 0, 0, source),
        ];
        for &address in admitted {
            steps.extend([equals(address.to_bits()), take]);
        }
        steps.push(step(libc::BPF_RET | libc::BPF_K, 0, 0, 0));
        let program = libc::sock_fprog {
            len: steps.len() as u16,
            filter: steps.as_mut_ptr(),
        };
        let program = std::ptr::from_ref(&program).cast();
        let length = size_of::<libc::sock_fprog>();
        set(
            socket,
            libc::SOL_SOCKET,
            libc::SO_ATTACH_FILTER,
            program,
            length,
        )
    }

    fn option(socket: c_int, name: c_int) -> io::Result<c_int> {
        let (mut value, mut length) = (0 as c_int, size_of::<c_int>() as socklen_t);
        let place = (&raw mut value).cast::<c_void>();
        // SAFETY: `place` has `length` bytes.
        let done = unsafe { libc::getsockopt(socket, libc::SOL_SOCKET, name, place, &mut length) };
        if done == 0 {
            Ok(value)
        } else {
            Err(io::Error::last_os_error())
        }
    }

    fn set(
        socket: c_int,
        level: c_int,
        name: c_int,
        value: *const c_void,
        length: usize,
    ) -> io::Result<()> {
        // SAFETY: callers give the address and length of one value that outlives the call.
        let done = unsafe { libc::setsockopt(socket, level, name, value, length as socklen_t) };
        if done == 0 {
            Ok(())
        } else {
            Err(io::Error::last_os_error())
        }
    }

    #[cfg(test)]
    mod tests {
        #![allow(clippy::unwrap_used)]
        use std::net::UdpSocket;
        use std::os::fd::AsRawFd;
        use std::time::Duration;

        use super::*;
        use crate::loopback::Sockets;

        /// Whether a socket receives what is sent to 127.0.0.1 from this address.
        fn hears(admitted: Option<&[Ipv4Addr]>, sender: &str) -> bool {
            let socket = UdpSocket::bind("0.0.0.0:0").unwrap();
            if let Some(admitted) = admitted {
                refuse_others(socket.as_raw_fd(), admitted).unwrap();
            }
            let timeout = Some(Duration::from_millis(300));
            socket.set_read_timeout(timeout).unwrap();
            let to = ("127.0.0.1", socket.local_addr().unwrap().port());
            UdpSocket::bind((sender, 0))
                .unwrap()
                .send_to(b"x", to)
                .unwrap();
            socket.recv(&mut [0; 8]).is_ok()
        }

        #[test]
        fn where_sockets_cannot_be_tied_other_sources_are_dropped() {
            crate::testing::in_private_network(
                "loopback::linux::tests::where_sockets_cannot_be_tied_other_sources_are_dropped",
                || {
                    if !crate::testing::is_private() {
                        println!("skipped: no network namespaces here");
                        return;
                    }
                    let added = std::process::Command::new("ip")
                        .args(["addr", "add", "10.9.8.0/29", "dev", "lo"])
                        .status();
                    assert!(added.unwrap().success());
                    let (one, two) = ([10, 9, 8, 1].into(), [10, 9, 8, 2].into());
                    assert!(hears(None, "10.9.8.1") && hears(None, "127.0.0.2"));
                    assert!(!hears(Some(&[]), "10.9.8.1") && hears(Some(&[]), "127.0.0.2"));
                    for admitted in [&[two][..], &[one, two], &[two, one]] {
                        let of_one = admitted.contains(&one);
                        assert_eq!(hears(Some(admitted), "10.9.8.1"), of_one);
                        assert!(hears(Some(admitted), "10.9.8.2"));
                        assert!(!hears(Some(admitted), "10.9.8.3"));
                        assert!(hears(Some(admitted), "127.0.0.2"));
                    }
                },
            );
        }

        #[test]
        fn only_datagram_sockets_made_meanwhile_are_kept_here() {
            let device = |socket: &UdpSocket| {
                let mut name = [0_u8; libc::IFNAMSIZ];
                let mut length = name.len() as socklen_t;
                // SAFETY: the buffer has `length` bytes.
                let done = unsafe {
                    libc::getsockopt(
                        socket.as_raw_fd(),
                        libc::SOL_SOCKET,
                        libc::SO_BINDTODEVICE,
                        name.as_mut_ptr().cast(),
                        &mut length,
                    )
                };
                assert_eq!(done, 0);
                name[..length as usize].to_vec()
            };
            let kept = Sockets::on_loopback();
            let tied = UdpSocket::bind("0.0.0.0:0").unwrap();
            std::net::TcpListener::bind("127.0.0.1:0").unwrap();
            assert_eq!(KEPT.load(Ordering::SeqCst), 1);
            drop(kept);
            let free = Sockets::everywhere();
            assert_eq!(device(&UdpSocket::bind("0.0.0.0:0").unwrap()), b"");
            drop(free);
            assert_eq!(device(&tied), b"lo\0");
        }

        #[test]
        fn within_a_circle_of_hosts_no_multicast_leaves_and_some_ports_are_refused() {
            // While it is held, no socket that listens on every address is given this port; on 127.0.0.3 no other
            // test listens.
            let held = UdpSocket::bind("127.0.0.2:0").unwrap();
            let port = held.local_addr().unwrap().port();
            let here = ("127.0.0.3", port);
            let circle = Sockets::within(Circle::Hosts {
                admitted: vec![[10, 9, 8, 2].into()],
                refused_ports: [port, port],
            });
            let refused = UdpSocket::bind(here).unwrap_err();
            assert_eq!(refused.kind(), io::ErrorKind::AddrNotAvailable);
            let socket = UdpSocket::bind("127.0.0.1:0").unwrap();
            assert_eq!(socket.multicast_ttl_v4().unwrap(), 0);
            drop(circle);
            let socket = UdpSocket::bind(here).unwrap();
            assert_eq!(socket.multicast_ttl_v4().unwrap(), 1);
        }
    }
}
