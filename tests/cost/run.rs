//! A child process and what it used.
#![allow(unsafe_code)]

use std::fs;
use std::mem::zeroed;
use std::process::{Command, Stdio};

use crate::common::CROMOSIM;

/// What a process used until its end.
pub struct Used {
    /// Processor time, user and system.
    pub seconds: f64,
    /// The most that was resident.
    pub megabytes: f64,
}

/// Runs `cromosim`, which must succeed.
pub fn cromosim(arguments: &[&str]) -> Used {
    wait(Command::new(CROMOSIM).args(arguments))
}

/// Runs this very program, which must succeed.
pub fn this_program(arguments: &[&str]) -> Used {
    wait(Command::new(std::env::current_exe().unwrap()).args(arguments))
}

#[allow(clippy::zombie_processes)] // `wait4` waits for it.
fn wait(command: &mut Command) -> Used {
    // What it says is shown where it fails: progress would stand between the table's lines.
    let said = tempfile::NamedTempFile::new().expect("a temporary file");
    let stderr = said.reopen().expect("a temporary file");
    let child = command.stdout(Stdio::null()).stderr(stderr);
    let child = child.spawn().expect("it starts");
    let process = child.id() as libc::pid_t;
    let mut status = 0;
    // SAFETY: a structure of integers, which `wait4` fills.
    let mut usage: libc::rusage = unsafe { zeroed() };
    // SAFETY: both pointers are of this frame; the child is ours, and nobody else waits for it.
    let ended = unsafe { libc::wait4(process, &raw mut status, 0, &raw mut usage) };
    assert_eq!(ended, process);
    let said = || fs::read_to_string(&said).unwrap_or_default();
    assert_eq!(status, 0, "{command:?}: {}", said());
    let seconds = |time: libc::timeval| time.tv_sec as f64 + time.tv_usec as f64 * 1e-6;
    Used {
        seconds: seconds(usage.ru_utime) + seconds(usage.ru_stime),
        // Linux counts in kilobytes, of 1024 bytes.
        megabytes: usage.ru_maxrss as f64 * 1024.0 / 1e6,
    }
}
