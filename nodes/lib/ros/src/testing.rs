//! For tests: DDS in a private network namespace, so that nothing comes in from elsewhere and
//! nothing gets out.
//!
//! ```no_run
//! #[test]
//! fn nodes_find_each_other() {
//!     cromosim_ros::testing::in_private_network("nodes_find_each_other", || {
//!         // Start nodes with `cromosim_ros::testing::network()`, or child processes, which inherit the environment.
//!     });
//! }
//! ```

use std::process::{Command, Stdio};
use std::time::{SystemTime, UNIX_EPOCH};

use crate::discovery::{DiscoveryRange, Network};

/// Set inside: the test that runs there.
const INSIDE: &str = "CROMOSIM_PRIVATE_NETWORK";
const SET_UP: &str =
    "ip link set lo up && ip link set lo multicast on && ip route add 224.0.0.0/4 dev lo";

/// Runs a test's body in a private network namespace with a working loopback, multicast included.
///
/// The test program runs itself again inside the namespace, for this one test; `test` must be the
/// test's own full name as `cargo test` prints it (with its modules). Without root, a user
/// namespace is tried; where neither is allowed, the body runs here, on 127.0.0.1 and in a random
/// domain, and says so.
///
/// # Panics
/// Where the body fails.
pub fn in_private_network(test: &str, body: impl FnOnce()) {
    if std::env::var_os(INSIDE).is_some() {
        body();
        return;
    }
    let Some(mut command) = inside_private_network(&[
        "--exact",
        test,
        "--nocapture",
        "--test-threads=1",
        "--include-ignored",
    ]) else {
        eprintln!(
            "{test}: no private network namespace here, running on 127.0.0.1 in domain {}",
            network().domain_id
        );
        body();
        return;
    };
    let output = command.stdin(Stdio::null()).output();
    let output =
        output.unwrap_or_else(|error| panic!("{test}: cannot run itself in a namespace: {error}"));
    let text = [output.stdout, output.stderr]
        .map(|bytes| String::from_utf8_lossy(&bytes).into_owned())
        .concat();
    println!("{text}");
    assert!(
        output.status.success(),
        "{test} failed in its private network, see above"
    );
    assert!(
        text.contains("1 passed"),
        "{test} did not run in its private network: is that its full name?"
    );
}

/// This program with these arguments inside a new network namespace, where [`is_private`] is true;
/// none where namespaces are not allowed.
pub fn inside_private_network(arguments: &[&str]) -> Option<Command> {
    let unshare = if allowed("-n") {
        "-n"
    } else {
        allowed("-rn").then_some("-rn")?
    };
    let program = std::env::current_exe().ok()?;
    let mut command = Command::new("unshare");
    command
        .args([unshare, "bash", "-c"])
        .arg(format!("{SET_UP} && exec \"$0\" \"$@\""))
        .arg(program)
        .args(arguments);
    command.env(INSIDE, "1");
    // What the user's shell says about ROS must not reach the test.
    for variable in [
        "ROS_DOMAIN_ID",
        "ROS_LOCALHOST_ONLY",
        "ROS_AUTOMATIC_DISCOVERY_RANGE",
        "ROS_STATIC_PEERS",
        "RMW_IMPLEMENTATION",
    ] {
        command.env_remove(variable);
    }
    Some(command)
}

fn allowed(flag: &str) -> bool {
    let silent = Command::new("unshare")
        .args([flag, "bash", "-c", SET_UP])
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .status();
    silent.is_ok_and(|status| status.success())
}

/// True inside a private network namespace.
pub fn is_private() -> bool {
    std::env::var_os(INSIDE).is_some()
}

/// The network for a test's nodes: this machine only; domain 0 inside a namespace, else one that is
/// random for this process.
///
/// Child processes of a test get it by [`environment`].
pub fn network() -> Network {
    let domain_id = if is_private() { 0 } else { random_domain() };
    Network {
        domain_id,
        range: DiscoveryRange::Localhost,
        peers: Vec::new(),
    }
}

/// [`network`] as environment variables for child processes.
pub fn environment() -> [(&'static str, String); 2] {
    [
        ("ROS_DOMAIN_ID", network().domain_id.to_string()),
        ("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST".into()),
    ]
}

/// 1 to 200, the same for the whole process.
fn random_domain() -> u16 {
    static DOMAIN: std::sync::OnceLock<u16> = std::sync::OnceLock::new();
    *DOMAIN.get_or_init(|| {
        let nanos = SystemTime::now()
            .duration_since(UNIX_EPOCH)
            .map_or(0, |since| since.subsec_nanos());
        1 + ((nanos / 1000 + std::process::id()) % 200) as u16
    })
}
