//! The six standard parameter services and `/parameter_events`.

use std::sync::Arc;

use ros2_client::parameters::raw;
use ros2_client::rcl_interfaces::{
    DescribeParametersRequest, DescribeParametersResponse, GetParameterTypesRequest,
    GetParameterTypesResponse, GetParametersRequest, GetParametersResponse, ListParametersRequest,
    ListParametersResponse, ListParametersResult, SetParametersAtomicallyResponse,
    SetParametersRequest, SetParametersResponse,
};
use ros2_client::{ParameterValue, builtin_interfaces};

use super::declaration::Parameter;
use super::store::Parameters;
use crate::core::Core;
use crate::error::RosResult;
use crate::publisher::RawPublisher;
use crate::qos::Qos;
use crate::raw::RawMessage;
use crate::service::{ServiceServer, serve};

/// Changes parameters on behalf of the services, and tells everybody.
struct Setter {
    parameters: Parameters,
    core: Arc<Core>,
    events: RawPublisher,
}

impl Setter {
    fn set(&self, changes: &[raw::Parameter]) -> raw::SetParametersResult {
        let changes: Vec<_> = changes
            .iter()
            .map(|change| {
                (
                    change.name.clone(),
                    ParameterValue::from(change.value.clone()),
                )
            })
            .collect();
        match self.parameters.set_all(&changes, "parameter service") {
            Ok(changed) => {
                self.publish(changed);
                raw::SetParametersResult {
                    successful: true,
                    reason: String::new(),
                }
            }
            Err(error) => raw::SetParametersResult {
                successful: false,
                reason: error.to_string(),
            },
        }
    }

    fn publish(&self, changed: Vec<(String, ParameterValue)>) {
        let event = raw::ParameterEvent {
            stamp: builtin_interfaces::Time::from_nanos(self.core.clock.now().nanos),
            node: self.core.name.to_string(),
            new_parameters: Vec::new(),
            changed_parameters: changed
                .into_iter()
                .map(|(name, value)| raw::Parameter {
                    name,
                    value: value.into(),
                })
                .collect(),
            deleted_parameters: Vec::new(),
        };
        let sent = RawMessage::encode(&event).map(|raw| self.events.publish(raw));
        if !matches!(sent, Ok(Ok(()))) {
            log::warn!("/parameter_events: a change was not sent");
        }
    }
}

/// Offers the services below the node's name.
pub(crate) fn serve_parameters(
    core: &Arc<Core>,
    parameters: &Parameters,
) -> RosResult<Vec<ServiceServer>> {
    let events = RawPublisher::new(
        core,
        "/parameter_events".into(),
        "rcl_interfaces/msg/ParameterEvent",
        Qos::reliable().depth(1000),
    )?;
    let setter = Arc::new(Setter {
        parameters: parameters.clone(),
        core: Arc::clone(core),
        events,
    });
    let mut servers = readers(core, parameters)?;
    servers.extend(setters(core, &setter)?);
    Ok(servers)
}

/// The services that ask: values, types, names and descriptions.
fn readers(core: &Arc<Core>, parameters: &Parameters) -> RosResult<Vec<ServiceServer>> {
    let name = |service: &str| format!("{}/{service}", core.name);
    let [values, types, names, descriptions] = std::array::from_fn(|_| parameters.clone());
    let or_unset = |value: Option<ParameterValue>| value.unwrap_or(ParameterValue::NotSet);
    Ok(vec![
        serve(
            core,
            name("get_parameters"),
            "rcl_interfaces/srv/GetParameters",
            move |request: GetParametersRequest| {
                let value = |name: &String| or_unset(values.value(name)).into();
                GetParametersResponse {
                    values: request.names.iter().map(value).collect(),
                }
            },
        )?,
        serve(
            core,
            name("get_parameter_types"),
            "rcl_interfaces/srv/GetParameterTypes",
            move |request: GetParameterTypesRequest| {
                let kind = |name: &String| or_unset(types.value(name)).to_parameter_type() as u8;
                GetParameterTypesResponse {
                    values: request.names.iter().map(kind).collect(),
                }
            },
        )?,
        serve(
            core,
            name("list_parameters"),
            "rcl_interfaces/srv/ListParameters",
            move |request: ListParametersRequest| ListParametersResponse {
                result: list_names(names.names(), &request.prefixes, request.depth),
            },
        )?,
        serve(
            core,
            name("describe_parameters"),
            "rcl_interfaces/srv/DescribeParameters",
            move |request: DescribeParametersRequest| {
                let described = |name: &String| descriptor(name, descriptions.describe(name));
                DescribeParametersResponse {
                    values: request.names.iter().map(described).collect(),
                }
            },
        )?,
    ])
}

/// The services that change parameters: each for itself, or all or none.
fn setters(core: &Arc<Core>, setter: &Arc<Setter>) -> RosResult<[ServiceServer; 2]> {
    let name = |service: &str| format!("{}/{service}", core.name);
    let (one_by_one, together) = (Arc::clone(setter), Arc::clone(setter));
    Ok([
        serve(
            core,
            name("set_parameters"),
            "rcl_interfaces/srv/SetParameters",
            move |request: SetParametersRequest| {
                let set = |one| one_by_one.set(std::slice::from_ref(one));
                SetParametersResponse {
                    results: request.parameter.iter().map(set).collect(),
                }
            },
        )?,
        serve(
            core,
            name("set_parameters_atomically"),
            "rcl_interfaces/srv/SetParametersAtomically",
            move |request: SetParametersRequest| SetParametersAtomicallyResponse {
                result: together.set(&request.parameter),
            },
        )?,
    ])
}

/// As rclcpp lists: with no prefix, the names of at most `depth` parts (0: all); else the prefixes
/// themselves and what stands at most `depth` parts below them.
fn list_names(names: Vec<String>, prefixes: &[String], depth: u64) -> ListParametersResult {
    let parts = |name: &str| name.split('.').count() as u64;
    let shallow = |name: &str| depth == 0 || parts(name) <= depth;
    let below = |name: &str, prefix: &str| {
        name.strip_prefix(prefix)
            .and_then(|rest| rest.strip_prefix('.'))
            .is_some_and(shallow)
    };
    let wanted = |name: &String| match prefixes {
        [] => shallow(name),
        prefixes => prefixes
            .iter()
            .any(|prefix| name == prefix || below(name, prefix)),
    };
    let names: Vec<String> = names.into_iter().filter(wanted).collect();
    let mut prefixes: Vec<String> = names
        .iter()
        .filter_map(|name| name.rsplit_once('.'))
        .map(|(prefix, _)| prefix.to_owned())
        .collect();
    prefixes.sort();
    prefixes.dedup();
    ListParametersResult { names, prefixes }
}

fn descriptor(name: &str, parameter: Option<Parameter>) -> raw::ParameterDescriptor {
    let known = parameter.is_some();
    let parameter = parameter.unwrap_or_else(|| {
        Parameter::with_value(name, ParameterValue::NotSet).about("not a parameter of this node")
    });
    let whole = matches!(
        parameter.value,
        ParameterValue::Integer(_) | ParameterValue::IntegerArray(_)
    );
    let (integers, numbers): (Vec<_>, Vec<_>) = parameter.range.into_iter().partition(|_| whole);
    let integer_range = |(least, most): (f64, f64)| raw::IntegerRange {
        from_value: least as i64,
        to_value: most as i64,
        step: 1,
    };
    let number_range = |(least, most)| raw::FloatingPointRange {
        from_value: least,
        to_value: most,
        step: 0.0,
    };
    raw::ParameterDescriptor {
        name: name.to_owned(),
        r#type: parameter.value.to_parameter_type() as u8,
        description: parameter.description,
        additional_constraints: String::new(),
        read_only: parameter.read_only,
        dynamic_typing: known && parameter.untyped,
        floating_point_range: numbers.into_iter().map(number_range).collect(),
        integer_range: integers.into_iter().map(integer_range).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_listed_by_prefix_and_depth() {
        let names = || ["a", "n.b", "n.c.d", "nn.e"].map(String::from).to_vec();
        let list = |prefixes: &[&str], depth| {
            let prefixes: Vec<String> =
                prefixes.iter().map(|prefix| (*prefix).to_owned()).collect();
            list_names(names(), &prefixes, depth).names
        };
        assert_eq!(list(&[], 0), names());
        assert_eq!(list(&[], 1), ["a"]);
        assert_eq!(list(&["n"], 0), ["n.b", "n.c.d"]);
        assert_eq!(list(&["n"], 1), ["n.b"]);
        assert_eq!(list(&["a"], 1), ["a"]);
        assert_eq!(list_names(names(), &[], 0).prefixes, ["n", "n.c", "nn"]);
    }
}
