//! The ROS part of a command line.

use std::path::PathBuf;

use crate::error::{RosError, RosResult};
use crate::logging::LogLevels;
use crate::names::NodeName;
use crate::parameter::{Override, read_params_file};

/// What stands between `--ros-args` and `--` (or the end), and the rest of the command line.
///
/// ```
/// use cromosim_ros::RosArgs;
/// let args = RosArgs::parse(["--motion", "walk.bvh", "--ros-args", "-r", "__ns:=/left", "-p", "rate_hz:=100.0"])?;
/// assert_eq!(args.rest, ["--motion", "walk.bvh"]);
/// assert_eq!(args.node_name("virtual_imu")?.to_string(), "/left/virtual_imu");
/// # Ok::<(), cromosim_ros::RosError>(())
/// ```
#[derive(Clone, Debug, Default)]
pub struct RosArgs {
    /// The arguments that are not of ROS, in their order.
    pub rest: Vec<String>,
    /// How much is logged.
    pub log_levels: LogLevels,
    /// False with `--disable-rosout-logs`.
    pub rosout: bool,
    /// The enclave whose keys the node has, where security is enabled; none: `/`.
    pub enclave: Option<String>,
    remaps: Vec<Remap>,
    overrides: Vec<Override>,
}

/// `[node:]from:=to`.
#[derive(Clone, Debug, PartialEq, Eq)]
struct Remap {
    node: Option<String>,
    from: String,
    to: String,
}

impl RosArgs {
    /// The arguments of this process.
    ///
    /// # Errors
    /// As [`RosArgs::parse`].
    pub fn from_env() -> RosResult<Self> {
        Self::parse(std::env::args().skip(1))
    }

    /// Takes the ROS part out of a command line (without the program's name) and reads the
    /// parameter files it names.
    ///
    /// # Errors
    /// One line that names the argument, or the file and its line.
    pub fn parse<S: Into<String>>(arguments: impl IntoIterator<Item = S>) -> RosResult<Self> {
        let mut args = Self {
            rosout: true,
            ..Self::default()
        };
        let mut arguments = arguments.into_iter().map(Into::into);
        let mut of_ros = false;
        while let Some(argument) = arguments.next() {
            match argument.as_str() {
                "--ros-args" => of_ros = true,
                "--" if of_ros => of_ros = false,
                _ if of_ros => args.ros_argument(&argument, &mut arguments)?,
                _ => args.rest.push(argument),
            }
        }
        Ok(args)
    }

    fn ros_argument(
        &mut self,
        flag: &str,
        arguments: &mut impl Iterator<Item = String>,
    ) -> RosResult<()> {
        let mut value = || {
            arguments
                .next()
                .ok_or_else(|| wrong(flag, "expected a value after it"))
        };
        match flag {
            "-r" | "--remap" => self.remap(&value()?),
            "-p" | "--param" => self.param(&value()?),
            "--params-file" => {
                self.overrides
                    .extend(read_params_file(&PathBuf::from(value()?))?);
                Ok(())
            }
            "--log-level" => {
                let text = value()?;
                self.log_levels
                    .set(&text)
                    .map_err(|problem| wrong(&format!("--log-level {text}"), problem))
            }
            "-e" | "--enclave" => {
                self.enclave = Some(value()?);
                Ok(())
            }
            "--log-config-file" | "--log-file-name" => value().map(drop),
            "--disable-rosout-logs" => {
                self.rosout = false;
                Ok(())
            }
            "--enable-rosout-logs" => {
                self.rosout = true;
                Ok(())
            }
            "--enable-stdout-logs"
            | "--disable-stdout-logs"
            | "--enable-external-lib-logs"
            | "--disable-external-lib-logs" => Ok(()),
            other if other.contains(":=") => Err(wrong(
                other,
                "expected '-r' (remap) or '-p' (parameter) before it",
            )),
            other => Err(wrong(
                other,
                "not a ROS argument; end the ROS arguments with '--'",
            )),
        }
    }

    fn remap(&mut self, text: &str) -> RosResult<()> {
        let place = format!("-r {text}");
        let (from, to) = text
            .split_once(":=")
            .ok_or_else(|| wrong(&place, "expected FROM:=TO"))?;
        let (node, from) = match from.split_once(':') {
            Some((node, from)) => (Some(node.to_owned()), from),
            None => (None, from),
        };
        let to = to.strip_prefix("rostopic://").unwrap_or(to);
        let from = from.strip_prefix("rostopic://").unwrap_or(from);
        if from.is_empty() || to.is_empty() || node.as_deref() == Some("") {
            return Err(wrong(
                &place,
                "expected [NODE:]FROM:=TO, without empty parts",
            ));
        }
        self.remaps.push(Remap {
            node,
            from: from.to_owned(),
            to: to.to_owned(),
        });
        Ok(())
    }

    fn param(&mut self, text: &str) -> RosResult<()> {
        let place = format!("-p {text}");
        let (name, value) = text
            .split_once(":=")
            .ok_or_else(|| wrong(&place, "expected NAME:=VALUE"))?;
        let (node, name) = match name.split_once(':') {
            Some((node, name)) => (node, name),
            None => ("/**", name),
        };
        if name.is_empty() || node.is_empty() {
            return Err(wrong(
                &place,
                "expected [NODE:]NAME:=VALUE, without empty parts",
            ));
        }
        self.overrides
            .extend(Override::from_yaml(&place, node, name, value)?);
        Ok(())
    }

    /// The node's name, after `__node` (or `__name`) and `__ns`.
    ///
    /// # Errors
    /// Where the result is not a valid name.
    pub fn node_name(&self, default: &str) -> RosResult<NodeName> {
        let special = |names: &[&str]| {
            let hit = |remap: &&Remap| {
                names.contains(&remap.from.as_str())
                    && remap.node.as_deref().is_none_or(|node| node == default)
            };
            self.remaps.iter().find(hit).map(|remap| remap.to.as_str())
        };
        NodeName::new(
            special(&["__ns"]).unwrap_or("/"),
            special(&["__node", "__name"]).unwrap_or(default),
        )
    }

    /// The absolute name of a topic or service of `node`, after remapping; the first rule that fits
    /// counts.
    ///
    /// # Errors
    /// Where a name breaks ROS 2's rules.
    pub fn resolve(&self, node: &NodeName, name: &str) -> RosResult<String> {
        let absolute = node.resolve(name)?;
        for remap in self
            .remaps
            .iter()
            .filter(|remap| !remap.from.starts_with("__"))
        {
            let for_us = remap
                .node
                .as_deref()
                .is_none_or(|wanted| wanted == node.name() || wanted == node.to_string());
            if for_us && node.resolve(&remap.from)? == absolute {
                return node.resolve(&remap.to);
            }
        }
        Ok(absolute)
    }

    pub(crate) fn overrides(&self) -> &[Override] {
        &self.overrides
    }
}

fn wrong(place: &str, problem: &str) -> RosError {
    RosError::Argument {
        place: format!("--ros-args {place}"),
        problem: problem.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn the_ros_part_is_taken_out_wherever_it_stands() {
        let line = [
            "a",
            "--ros-args",
            "-r",
            "x:=y",
            "-e",
            "/enclave",
            "--",
            "b",
            "--ros-args",
            "--disable-rosout-logs",
        ];
        let args = RosArgs::parse(line).unwrap();
        assert_eq!(args.rest, ["a", "b"]);
        assert!(!args.rosout);
        assert_eq!(args.enclave.as_deref(), Some("/enclave"));
        let node = args.node_name("n").unwrap();
        assert_eq!(args.resolve(&node, "x").unwrap(), "/y");
        assert_eq!(args.resolve(&node, "z").unwrap(), "/z");
    }

    #[test]
    fn nodes_are_renamed_and_topics_remapped() {
        let line = [
            "--ros-args",
            "-r",
            "__ns:=/left",
            "-r",
            "n:__node:=m",
            "-r",
            "other:imu:=/wrong",
            "-r",
            "m:imu:=~/imu",
            "-r",
            "/tf:=tf",
        ];
        let args = RosArgs::parse(line).unwrap();
        let node = args.node_name("n").unwrap();
        assert_eq!(node.to_string(), "/left/m");
        assert_eq!(args.resolve(&node, "imu").unwrap(), "/left/m/imu");
        assert_eq!(args.resolve(&node, "/left/imu").unwrap(), "/left/m/imu");
        assert_eq!(args.resolve(&node, "/tf").unwrap(), "/left/tf");
        assert_eq!(args.node_name("k").unwrap().to_string(), "/left/k");
    }

    #[test]
    fn wrong_arguments_are_named() {
        for (line, expected) in [
            (vec!["-r", "xy"], "-r xy: expected FROM:=TO"),
            (vec!["-r"], "-r: expected a value after it"),
            (vec!["x:=y"], "x:=y: expected '-r'"),
            (vec!["--frob"], "--frob: not a ROS argument"),
            (vec!["-p", "rate"], "-p rate: expected NAME:=VALUE"),
            (vec!["--log-level", "loud"], "--log-level loud"),
            (vec!["--params-file", "/nowhere.yaml"], "/nowhere.yaml"),
        ] {
            let line = std::iter::once("--ros-args").chain(line);
            let text = RosArgs::parse(line).unwrap_err().to_string();
            assert!(text.contains(expected) && !text.contains('\n'), "{text}");
        }
    }
}
