//! Names of nodes, topics, services and types, and what DDS calls them.

use std::fmt;

use crate::error::{RosError, RosResult};

/// A node's namespace and name; shown as `/namespace/name`.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct NodeName {
    namespace: String,
    name: String,
}

impl NodeName {
    /// From a namespace (`/`, `/left/arm`; the leading slash may be left out) and a name.
    ///
    /// # Errors
    /// Where a part is empty, starts with a digit, or has other characters than letters, digits and
    /// underscores.
    pub fn new(namespace: &str, name: &str) -> RosResult<Self> {
        let tokens = namespace.trim_start_matches('/');
        if !tokens.is_empty() {
            tokens
                .split('/')
                .try_for_each(|token| check_token(token, namespace))?;
        }
        check_token(name, name)?;
        Ok(Self {
            namespace: format!("/{tokens}"),
            name: name.to_owned(),
        })
    }

    /// The namespace: `/`, or `/left/arm`.
    pub fn namespace(&self) -> &str {
        &self.namespace
    }

    /// The name without its namespace.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The name of a topic or service as this node sees it, absolute: `~/x` stands below the node,
    /// `x` below its namespace.
    ///
    /// # Errors
    /// Where the name breaks ROS 2's rules.
    pub fn resolve(&self, name: &str) -> RosResult<String> {
        let absolute = match name.strip_prefix('~') {
            Some("") => self.to_string(),
            Some(rest) if rest.starts_with('/') => format!("{self}{rest}"),
            Some(_) => return Err(bad_name(name, "'~' must be followed by '/'")),
            None if name.starts_with('/') => name.to_owned(),
            None => join(&self.namespace, name),
        };
        absolute
            .split('/')
            .skip(1)
            .try_for_each(|token| check_token(token, name))?;
        Ok(absolute)
    }
}

impl fmt::Display for NodeName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&join(&self.namespace, &self.name))
    }
}

fn join(namespace: &str, name: &str) -> String {
    if namespace.ends_with('/') {
        format!("{namespace}{name}")
    } else {
        format!("{namespace}/{name}")
    }
}

fn bad_name(name: &str, problem: &str) -> RosError {
    RosError::Name {
        name: name.to_owned(),
        problem: problem.to_owned(),
    }
}

fn check_token(token: &str, whole: &str) -> RosResult<()> {
    if token.is_empty() {
        return Err(bad_name(
            whole,
            "empty part (a slash too many, or nothing at all)",
        ));
    }
    if token.starts_with(|c: char| c.is_ascii_digit()) {
        return Err(bad_name(whole, "a part starts with a digit"));
    }
    if let Some(bad) = token
        .chars()
        .find(|c| !(c.is_ascii_alphanumeric() || *c == '_'))
    {
        return Err(bad_name(
            whole,
            &format!("character '{bad}' is not allowed (letters, digits, underscores)"),
        ));
    }
    Ok(())
}

/// The three prefixes under which ROS 2 puts its names into DDS.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    Topic,
    Request,
    Response,
}

impl Kind {
    /// `/imu/data` -> `rt/imu/data`; services have a suffix too: `/node/get_parameters` ->
    /// `rq/node/get_parametersRequest`.
    pub(crate) fn dds_name(self, absolute: &str) -> String {
        match self {
            Kind::Topic => format!("rt{absolute}"),
            Kind::Request => format!("rq{absolute}Request"),
            Kind::Response => format!("rr{absolute}Reply"),
        }
    }
}

/// The ROS 2 topic behind a DDS topic (`rt/imu/data` -> `/imu/data`); none for services and for
/// what is not of ROS.
pub(crate) fn topic_from_dds(dds_name: &str) -> Option<&str> {
    dds_name
        .strip_prefix("rt")
        .filter(|name| name.starts_with('/'))
}

/// `sensor_msgs/msg/Imu` -> `sensor_msgs::msg::dds_::Imu_`.
///
/// # Errors
/// Where the type does not have three parts of letters, digits and underscores.
pub fn dds_type_name(ros_type: &str) -> RosResult<String> {
    let parts: Vec<&str> = ros_type.split('/').collect();
    let [package, kind, name] = parts[..] else {
        return Err(bad_name(
            ros_type,
            "a type has three parts: package/msg/Name",
        ));
    };
    [package, kind, name]
        .into_iter()
        .try_for_each(|token| check_token(token, ros_type))?;
    Ok(format!("{package}::{kind}::dds_::{name}_"))
}

/// `sensor_msgs::msg::dds_::Imu_` -> `sensor_msgs/msg/Imu`; none where DDS has a type that is not
/// of ROS.
pub fn ros_type_name(dds_type: &str) -> Option<String> {
    let parts: Vec<&str> = dds_type.split("::").collect();
    let [package, kind, "dds_", name] = parts[..] else {
        return None;
    };
    let name = name.strip_suffix('_')?;
    [package, kind, name]
        .into_iter()
        .try_for_each(|token| check_token(token, dds_type))
        .ok()?;
    Some(format!("{package}/{kind}/{name}"))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn names_resolve_as_in_ros() {
        let node = NodeName::new("/left", "virtual_imu").unwrap();
        assert_eq!(node.to_string(), "/left/virtual_imu");
        assert_eq!(node.resolve("imu/data").unwrap(), "/left/imu/data");
        assert_eq!(node.resolve("/tf").unwrap(), "/tf");
        assert_eq!(node.resolve("~/pause").unwrap(), "/left/virtual_imu/pause");
        assert_eq!(NodeName::new("", "n").unwrap().resolve("a").unwrap(), "/a");
        assert_eq!(
            NodeName::new("left/arm", "n").unwrap().namespace(),
            "/left/arm"
        );
    }

    #[test]
    fn bad_names_are_refused() {
        let node = NodeName::new("/", "n").unwrap();
        for bad in ["", "/", "a//b", "a/", "2a", "a b", "~x", "{node}"] {
            assert!(node.resolve(bad).is_err(), "{bad}");
        }
        assert!(NodeName::new("/a/", "n").is_err());
        assert!(NodeName::new("/", "a/b").is_err());
    }

    #[test]
    fn types_and_topics_go_to_dds_and_back() {
        assert_eq!(
            dds_type_name("sensor_msgs/msg/Imu").unwrap(),
            "sensor_msgs::msg::dds_::Imu_"
        );
        assert_eq!(
            ros_type_name("sensor_msgs::msg::dds_::Imu_").unwrap(),
            "sensor_msgs/msg/Imu"
        );
        assert_eq!(
            dds_type_name("rcl_interfaces/srv/GetParameters_Request").unwrap(),
            "rcl_interfaces::srv::dds_::GetParameters_Request_"
        );
        for bad in ["Imu", "sensor_msgs/Imu", "sensor_msgs/msg/", "a/b/c/d"] {
            assert!(dds_type_name(bad).is_err(), "{bad}");
        }
        for foreign in ["ShapeType", "a::b::c_", "a::msg::dds_::X"] {
            assert_eq!(ros_type_name(foreign), None);
        }
        assert_eq!(Kind::Topic.dds_name("/imu/data"), "rt/imu/data");
        assert_eq!(Kind::Request.dds_name("/n/get"), "rq/n/getRequest");
        assert_eq!(Kind::Response.dds_name("/n/get"), "rr/n/getReply");
        assert_eq!(topic_from_dds("rt/imu/data"), Some("/imu/data"));
        assert_eq!(topic_from_dds("ros_discovery_info"), None);
        assert_eq!(topic_from_dds("rtx"), None);
    }
}
