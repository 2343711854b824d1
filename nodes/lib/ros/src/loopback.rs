//! Sockets that no other host reaches, and that reach none.
//!
//! RustDDS 0.15.1 binds its sockets to every address, whatever networks it is told to use ("not a
//! hard transport-level ACL"), reads them on a thread of its own at once, and has no hook between
//! the two. So this crate stands in for the C library's `bind`: while a participant is built that
//! keeps to this machine, each of its sockets is bound to the loopback device before it gets an
//! address. A packet from elsewhere then finds no socket, and one to elsewhere finds no way out.
//! Looking for the sockets afterwards would leave some milliseconds open.

use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Mutex, MutexGuard};

use crate::wake::lock;

/// One participant is built at a time: the process has one `bind`.
static BUILDING: Mutex<()> = Mutex::new(());
static KEEP_HERE: AtomicBool = AtomicBool::new(false);
static KEPT: AtomicUsize = AtomicUsize::new(0);

/// While it lives, this process makes its IPv4 datagram sockets on the loopback device, or, with
/// [`Sockets::everywhere`], as it is asked to.
pub(crate) struct Sockets {
    _building: MutexGuard<'static, ()>,
}

impl Sockets {
    pub(crate) fn on_loopback() -> Self {
        let building = lock(&BUILDING);
        KEPT.store(0, Ordering::SeqCst);
        KEEP_HERE.store(true, Ordering::SeqCst);
        Self {
            _building: building,
        }
    }

    pub(crate) fn everywhere() -> Self {
        Self {
            _building: lock(&BUILDING),
        }
    }

    /// Whether sockets were kept to the loopback device.
    pub(crate) fn were_kept(&self) -> bool {
        KEPT.load(Ordering::SeqCst) > 0
    }
}

impl Drop for Sockets {
    fn drop(&mut self) {
        KEEP_HERE.store(false, Ordering::SeqCst);
    }
}

#[cfg(target_os = "linux")]
mod linux {
    #![allow(unsafe_code)]

    use std::io;
    use std::sync::atomic::Ordering;

    use libc::{c_int, c_void, sockaddr, socklen_t};

    use super::{KEEP_HERE, KEPT};

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
        if KEEP_HERE.load(Ordering::SeqCst) && keep_here(socket).is_err() {
            // The reason is in errno, as for any refusal of `bind`.
            return -1;
        }
        // SAFETY: passed on as it came; the kernel checks what it is given.
        unsafe { libc::syscall(libc::SYS_bind, socket, address, length) as c_int }
    }

    /// Ties an IPv4 datagram socket to the loopback device; lets others be.
    fn keep_here(socket: c_int) -> io::Result<()> {
        let is = |name, value| option(socket, name).map(|found| found == value);
        if !is(libc::SO_DOMAIN, libc::AF_INET)? || !is(libc::SO_TYPE, libc::SOCK_DGRAM)? {
            return Ok(());
        }
        const DEVICE: &[u8] = b"lo\0";
        match set(
            socket,
            libc::SO_BINDTODEVICE,
            DEVICE.as_ptr().cast(),
            DEVICE.len(),
        ) {
            // Before Linux 5.7 only root may; what comes in can be refused without.
            Err(error) if error.raw_os_error() == Some(libc::EPERM) => refuse_others(socket)?,
            tied => tied?,
        }
        KEPT.fetch_add(1, Ordering::SeqCst);
        Ok(())
    }

    /// Drops each datagram whose source is not in 127.0.0.0/8, before it is queued. (The kernel takes
    /// such sources from the loopback device alone.) Who hears no other host has nobody to answer.
    fn refuse_others(socket: c_int) -> io::Result<()> {
        let step = |code: u32, jt, jf, k| libc::sock_filter {
            code: code as u16,
            jt,
            jf,
            k,
        };
        // Offset of the source address in the IPv4 header.
        let source = libc::SKF_NET_OFF as u32 + 12;
        let mut steps = [
            step(libc::BPF_LD | libc::BPF_B | libc::BPF_ABS, 0, 0, source),
            step(libc::BPF_JMP | libc::BPF_JEQ | libc::BPF_K, 0, 1, 127),
            step(libc::BPF_RET | libc::BPF_K, 0, 0, u32::MAX),
            step(libc::BPF_RET | libc::BPF_K, 0, 0, 0),
        ];
        let program = libc::sock_fprog {
            len: steps.len() as u16,
            filter: steps.as_mut_ptr(),
        };
        let program = std::ptr::from_ref(&program).cast();
        set(
            socket,
            libc::SO_ATTACH_FILTER,
            program,
            size_of::<libc::sock_fprog>(),
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

    fn set(socket: c_int, name: c_int, value: *const c_void, length: usize) -> io::Result<()> {
        // SAFETY: callers give the address and length of one value that outlives the call.
        let done =
            unsafe { libc::setsockopt(socket, libc::SOL_SOCKET, name, value, length as socklen_t) };
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

        /// What a socket receives from itself, sent to 127.0.0.1 from each of these addresses.
        fn hears(filtered: bool, sender: &str) -> bool {
            let socket = UdpSocket::bind("0.0.0.0:0").unwrap();
            if filtered {
                refuse_others(socket.as_raw_fd()).unwrap();
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
                        .args(["addr", "add", "10.9.8.1/32", "dev", "lo"])
                        .status();
                    assert!(added.unwrap().success());
                    assert!(hears(false, "10.9.8.1") && hears(false, "127.0.0.2"));
                    assert!(!hears(true, "10.9.8.1") && hears(true, "127.0.0.2"));
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
    }
}
