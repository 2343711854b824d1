//! Whether messages are signed and encrypted (SROS 2): ROS 2's own environment variables and
//! `--enclave`.

use std::path::{Path, PathBuf};
#[cfg(feature = "security")]
use std::sync::atomic::Ordering;

use rustdds::DomainParticipantBuilder;

use crate::args::RosArgs;
use crate::error::{RosError, RosResult};
#[cfg(feature = "security")]
use crate::raw::FILLED_UP;

/// What `ros2 security create_enclave` puts into an enclave's folder.
const FILES: [&str; 6] = [
    "identity_ca.cert.pem",
    "cert.pem",
    "key.pem",
    "permissions_ca.cert.pem",
    "governance.p7s",
    "permissions.p7s",
];

const NOT_BUILT: &str = "this program was built without the feature `security`";

/// How a node's messages are protected.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum Security {
    /// Not at all.
    #[default]
    Clear,
    /// By the keys and rules in this folder.
    Enclave(PathBuf),
}

impl Security {
    /// From `ROS_SECURITY_ENABLE`, `ROS_SECURITY_STRATEGY`, `ROS_SECURITY_KEYSTORE`,
    /// `ROS_SECURITY_ENCLAVE_OVERRIDE` and `--enclave`. As in ROS 2, a node of the strategy
    /// `Enforce` does not run in the clear; one of `Permissive`, the default, does where it has no
    /// keys, and says so.
    ///
    /// # Errors
    /// Names the variable, or what is missing.
    pub fn from_env(args: &RosArgs) -> RosResult<Self> {
        Self::from_variables(|variable| std::env::var(variable).ok(), args)
    }

    fn from_variables(get: impl Fn(&str) -> Option<String>, args: &RosArgs) -> RosResult<Self> {
        let get = |variable: &str| get(variable).filter(|value| !value.is_empty());
        // ROS 2 takes any other word for "no". Whoever writes 1, yes or enforce means it.
        let one_of = |variable, expected, no: &str, yes: &str| match get(variable) {
            None => Ok(false),
            Some(value) if value == no => Ok(false),
            Some(value) if value == yes => Ok(true),
            Some(value) => Err(RosError::Environment {
                variable,
                value,
                expected,
            }),
        };
        let enabled = one_of("ROS_SECURITY_ENABLE", "true or false", "false", "true")?;
        let (strategy, words) = ("ROS_SECURITY_STRATEGY", "Enforce or Permissive");
        let enforced = one_of(strategy, words, "Permissive", "Enforce")?;
        if !enabled {
            return Ok(Self::Clear);
        }
        let overriding = get("ROS_SECURITY_ENCLAVE_OVERRIDE");
        let enclave = overriding.as_deref().or(args.enclave.as_deref());
        let enclave = enclave.unwrap_or("/");
        match enclave_folder(get("ROS_SECURITY_KEYSTORE").as_deref(), enclave) {
            Ok(folder) => Ok(Self::Enclave(folder)),
            Err(problem) if enforced => Err(RosError::Security { problem }),
            Err(problem) => {
                log::warn!("ROS_SECURITY_ENABLE=true, but messages are in the clear: {problem}");
                Ok(Self::Clear)
            }
        }
    }

    /// The participant that is built has this protection.
    pub(crate) fn protect(
        &self,
        builder: DomainParticipantBuilder,
    ) -> RosResult<DomainParticipantBuilder> {
        match self {
            Self::Clear => Ok(builder),
            #[cfg(feature = "security")]
            Self::Enclave(folder) => {
                // Keys made by `ros2 security` have no password.
                let password = String::new();
                let files = rustdds::DomainParticipantSecurityConfigFiles::with_ros_default_names(
                    folder, password,
                );
                FILLED_UP.store(true, Ordering::Relaxed);
                Ok(builder.builtin_security(files))
            }
            #[cfg(not(feature = "security"))]
            Self::Enclave(folder) => Err(RosError::Security {
                problem: format!("{}: {NOT_BUILT}", folder.display()),
            }),
        }
    }
}

/// `KEYSTORE/enclaves/NAME`, with all its files.
fn enclave_folder(keystore: Option<&str>, enclave: &str) -> Result<PathBuf, String> {
    if cfg!(not(feature = "security")) {
        return Err(NOT_BUILT.into());
    }
    let keystore = keystore.ok_or("ROS_SECURITY_KEYSTORE names no keystore")?;
    let parts: Vec<&str> = enclave.split('/').skip(1).collect();
    let sound = enclave == "/"
        || enclave.starts_with('/') && !parts.iter().any(|part| matches!(*part, "" | "." | ".."));
    if !sound {
        return Err(format!(
            "enclave '{enclave}': expected an absolute name, such as /cromosim/recorder"
        ));
    }
    let folder = Path::new(keystore)
        .join("enclaves")
        .join(enclave.trim_start_matches('/'));
    match FILES.iter().find(|file| !folder.join(file).is_file()) {
        None => Ok(folder),
        Some(missing) => Err(format!(
            "{}: not there; `ros2 security create_enclave {keystore} {enclave}` makes it",
            folder.join(missing).display()
        )),
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    fn security(variables: &[(&str, &str)], line: &[&str]) -> Result<Security, String> {
        let line = std::iter::once("--ros-args").chain(line.iter().copied());
        let args = RosArgs::parse(line).unwrap();
        let get = |name: &str| {
            let found = variables.iter().find(|(key, _)| *key == name);
            found.map(|(_, value)| (*value).to_owned())
        };
        Security::from_variables(get, &args).map_err(|error| error.to_string())
    }

    const ON: (&str, &str) = ("ROS_SECURITY_ENABLE", "true");
    const ENFORCE: (&str, &str) = ("ROS_SECURITY_STRATEGY", "Enforce");

    #[test]
    fn who_enforces_security_is_never_left_in_the_clear() {
        assert_eq!(security(&[ENFORCE], &[]), Ok(Security::Clear));
        assert_eq!(security(&[ON], &[]), Ok(Security::Clear));
        for (variables, expected) in [
            (vec![ON, ENFORCE], "Enforce"),
            (
                vec![ON, ENFORCE, ("ROS_SECURITY_KEYSTORE", "/nowhere")],
                "Enforce",
            ),
            (vec![("ROS_SECURITY_ENABLE", "1")], "ROS_SECURITY_ENABLE=1"),
            (
                vec![ON, ("ROS_SECURITY_STRATEGY", "enforce")],
                "ROS_SECURITY_STRATEGY=enforce",
            ),
        ] {
            let text = security(&variables, &[]).unwrap_err();
            assert!(text.contains(expected) && !text.contains('\n'), "{text}");
        }
    }

    #[cfg(feature = "security")]
    #[test]
    fn enclaves_are_found_by_their_names() {
        let keystore = tempfile::tempdir().unwrap();
        let folder = keystore.path().join("enclaves/left/recorder");
        std::fs::create_dir_all(&folder).unwrap();
        let store = ("ROS_SECURITY_KEYSTORE", keystore.path().to_str().unwrap());
        let enclave = ["--enclave", "/left/recorder"];
        let text = security(&[ON, ENFORCE, store], &enclave).unwrap_err();
        assert!(
            text.contains("left/recorder/identity_ca.cert.pem"),
            "{text}"
        );
        for file in FILES {
            std::fs::write(folder.join(file), "").unwrap();
        }
        let found = Ok(Security::Enclave(folder));
        assert_eq!(security(&[ON, ENFORCE, store], &enclave), found);
        let overriding = ("ROS_SECURITY_ENCLAVE_OVERRIDE", "/left/recorder");
        assert_eq!(
            security(&[ON, store, overriding], &["--enclave", "/right"]),
            found
        );
        assert_eq!(
            security(&[ON, store], &["--enclave", "/right"]),
            Ok(Security::Clear)
        );
        for enclave in ["left/recorder", "/left/../left/recorder", "//left"] {
            let text = security(&[ON, ENFORCE, store], &["--enclave", enclave]).unwrap_err();
            assert!(text.contains("absolute name"), "{text}");
        }
    }
}
