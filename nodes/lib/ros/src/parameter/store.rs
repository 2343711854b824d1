//! The parameters of a node and the rules for changing them.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, MutexGuard, Weak};

use ros2_client::ParameterValue;

use super::declaration::Parameter;
use super::value::{ParameterScalar, to_text};
use crate::args::RosArgs;
use crate::error::{RosError, RosResult};
use crate::names::NodeName;
use crate::qos::{Durability, History, Qos, Reliability};
use crate::wake::{Bell, lock};

pub(crate) const USE_SIM_TIME: &str = "use_sim_time";
const QOS_OVERRIDES: &str = "qos_overrides.";

/// What takes up a configuration as changes would make it, or says why not.
pub(crate) type TakeUp = Box<dyn FnMut(&Parameters) -> RosResult<()> + Send>;

/// The parameters of a node. Cloning shares them.
#[derive(Clone, Default)]
pub struct Parameters {
    inner: Arc<Mutex<Store>>,
    /// Held while parameters change: by one caller at a time.
    take_up: Arc<Mutex<Option<TakeUp>>>,
}

#[derive(Clone, Default)]
struct Store {
    declared: BTreeMap<String, Parameter>,
    /// Names below which everything is taken into the configuration.
    open: Vec<String>,
    /// Full name of a `qos_overrides` parameter: value and place.
    qos: BTreeMap<String, (ParameterValue, String)>,
    bells: Vec<Weak<Bell>>,
}

impl Store {
    /// Whether an undeclared name is taken, as a part of the configuration.
    fn is_open(&self, name: &str) -> bool {
        let below = |prefix: &String| {
            name.strip_prefix(prefix.as_str())
                .is_some_and(|rest| rest.len() > 1 && rest.starts_with('.'))
        };
        self.open.iter().any(below)
    }
}

impl Parameters {
    /// `use_sim_time` alone.
    pub fn new() -> Self {
        let parameters = Self::default();
        let sim_time =
            Parameter::new(USE_SIM_TIME, false).about("Follow /clock instead of the system clock.");
        lock(&parameters.inner)
            .declared
            .insert(USE_SIM_TIME.to_owned(), sim_time);
        parameters
    }

    /// Declares a parameter; one of the same name is replaced.
    ///
    /// # Errors
    /// Where the default is outside its own bounds.
    pub fn declare(&self, parameter: Parameter) -> RosResult<()> {
        parameter.check(parameter.value.clone(), "default")?;
        lock(&self.inner)
            .declared
            .insert(parameter.name.clone(), parameter);
        Ok(())
    }

    /// Changes what is known about a declared parameter: `amend("rate_hz", |p|
    /// p.about("...").range(1.0, 1000.0))`.
    ///
    /// # Errors
    /// Where the parameter is unknown, or its value is outside the new bounds.
    pub fn amend(&self, name: &str, change: impl FnOnce(Parameter) -> Parameter) -> RosResult<()> {
        let parameter = self
            .describe(name)
            .ok_or_else(|| self.unknown("amend", name))?;
        self.declare(change(parameter))
    }

    /// Takes every parameter below `prefix.` into the configuration, without asking for its type.
    pub(crate) fn open_config(&self, prefix: &str) {
        lock(&self.inner).open.push(prefix.to_owned());
    }

    pub(crate) fn open_configs(&self) -> Vec<String> {
        lock(&self.inner).open.clone()
    }

    /// Takes over what parameter files and `-p` say for this node, in the order of the command
    /// line: the last one counts.
    ///
    /// # Errors
    /// Names file and line, or the argument, of a value that does not fit or a parameter that the
    /// node does not have.
    pub fn apply(&self, args: &RosArgs, node: &NodeName) -> RosResult<()> {
        for given in args.overrides().iter().filter(|given| given.is_for(node)) {
            if given.name.starts_with(QOS_OVERRIDES) {
                self.keep_qos(&given.name, given.value.clone(), &given.place)?;
            } else {
                let value = self.checked(&given.name, given.value.clone(), &given.place)?;
                self.store(&given.name, value);
            }
        }
        Ok(())
    }

    /// The value of a parameter; none where it has another type or is not set.
    pub fn get<V: ParameterScalar>(&self, name: &str) -> Option<V> {
        V::from_value(&self.value(name)?)
    }

    /// The value of a parameter, whatever its type; none where it is not declared.
    pub fn value(&self, name: &str) -> Option<ParameterValue> {
        lock(&self.inner)
            .declared
            .get(name)
            .map(|parameter| parameter.value.clone())
    }

    /// All names, sorted.
    pub fn names(&self) -> Vec<String> {
        lock(&self.inner).declared.keys().cloned().collect()
    }

    /// Rings the bell after every change at run time.
    pub fn ring_at_change(&self, bell: &Arc<Bell>) {
        lock(&self.inner).bells.push(Arc::downgrade(bell));
    }

    /// Changes a parameter at run time, as the parameter services do.
    ///
    /// # Errors
    /// Where the parameter is unknown or read-only, or the value does not fit.
    pub fn set(&self, name: &str, value: impl ParameterScalar) -> RosResult<()> {
        self.set_all(&[(name.to_owned(), value.into_value())], "set")
            .map(drop)
    }

    /// Changes parameters at run time, all or none; the values as they are now.
    ///
    /// # Errors
    /// Where a parameter is unknown or read-only, a value does not fit, or the node cannot use it.
    pub(crate) fn set_all(
        &self,
        changes: &[(String, ParameterValue)],
        place: &str,
    ) -> RosResult<Vec<(String, ParameterValue)>> {
        let mut turn = self.turn();
        let mut checked = Vec::new();
        for (name, value) in changes {
            if self
                .describe(name)
                .is_some_and(|parameter| parameter.read_only)
            {
                return Err(RosError::ReadOnly {
                    place: place.to_owned(),
                    name: name.clone(),
                });
            }
            checked.push((name.clone(), self.checked(name, value.clone(), place)?));
        }
        // The node acts before anything is stored: nobody sees a change that it refuses.
        if let Some(take_up) = turn.as_mut()
            && checked.iter().any(|(name, _)| self.is_in_config(name))
        {
            take_up(&self.with(&checked))?;
        }
        checked
            .iter()
            .for_each(|(name, value)| self.store(name, value.clone()));
        lock(&self.inner)
            .bells
            .retain(|bell| bell.upgrade().inspect(|bell| bell.ring()).is_some());
        Ok(checked)
    }

    /// What takes up changes; whoever holds it changes alone.
    pub(crate) fn turn(&self) -> MutexGuard<'_, Option<TakeUp>> {
        lock(&self.take_up)
    }

    fn is_in_config(&self, name: &str) -> bool {
        self.describe(name)
            .is_some_and(|parameter| parameter.in_config)
    }

    /// A copy with these values, which nobody else sees.
    fn with(&self, values: &[(String, ParameterValue)]) -> Self {
        let copy = Self {
            inner: Arc::new(Mutex::new(lock(&self.inner).clone())),
            take_up: Arc::default(),
        };
        values
            .iter()
            .for_each(|(name, value)| copy.store(name, value.clone()));
        copy
    }

    pub(crate) fn describe(&self, name: &str) -> Option<Parameter> {
        lock(&self.inner).declared.get(name).cloned()
    }

    pub(crate) fn config_values(&self) -> Vec<(String, ParameterValue)> {
        let store = lock(&self.inner);
        store
            .declared
            .values()
            .filter(|parameter| parameter.in_config)
            .map(|p| (p.name.clone(), p.value.clone()))
            .collect()
    }

    fn checked(&self, name: &str, value: ParameterValue, place: &str) -> RosResult<ParameterValue> {
        let (parameter, open) = {
            let store = lock(&self.inner);
            (store.declared.get(name).cloned(), store.is_open(name))
        };
        match parameter {
            Some(parameter) => parameter.check(value, place),
            None if open => Ok(value),
            None => Err(self.unknown(place, name)),
        }
    }

    fn store(&self, name: &str, value: ParameterValue) {
        let mut store = lock(&self.inner);
        let in_config = store.is_open(name);
        let fresh = || Parameter {
            untyped: true,
            in_config,
            read_only: in_config,
            ..Parameter::with_value(name, ParameterValue::NotSet)
        };
        store
            .declared
            .entry(name.to_owned())
            .or_insert_with(fresh)
            .value = value;
    }

    fn unknown(&self, place: &str, name: &str) -> RosError {
        let names = self.names();
        // A part of a name ('rate' for 'rate_hz') is as good as a slip of the finger.
        let part =
            |known: &str| name.len() > 2 && (known.starts_with(name) || name.starts_with(known));
        let close = |known: &str| {
            part(known) || strsim::levenshtein(name, known) <= (name.len() / 3).max(2)
        };
        let nearest = names
            .iter()
            .filter(|known| close(known))
            .min_by_key(|known| strsim::levenshtein(name, known))
            .cloned();
        RosError::UnknownParameter {
            place: place.to_owned(),
            name: name.to_owned(),
            nearest,
        }
    }

    fn keep_qos(&self, name: &str, value: ParameterValue, place: &str) -> RosResult<()> {
        let expected = "the name qos_overrides./TOPIC.publisher.POLICY or qos_overrides./TOPIC.subscription.POLICY";
        let refuse = || RosError::ParameterValue {
            place: place.to_owned(),
            name: name.to_owned(),
            expected: expected.to_owned(),
            found: to_text(&value),
        };
        let parts: Vec<&str> = name.rsplitn(3, '.').collect();
        let [policy, "publisher" | "subscription", topic] = parts[..] else {
            return Err(refuse());
        };
        if !topic
            .strip_prefix(QOS_OVERRIDES)
            .is_some_and(|topic| topic.starts_with('/'))
        {
            return Err(refuse());
        }
        // Tried on a default now, so that a wrong value is refused at the start and not when the
        // topic comes up.
        Qos::default().override_policy(policy, &plain_text(&value), place, name)?;
        lock(&self.inner)
            .qos
            .insert(name.to_owned(), (value, place.to_owned()));
        Ok(())
    }

    /// What `qos_overrides` make of a preset, declared as read-only parameters as ROS 2 does.
    pub(crate) fn overridden(&self, topic: &str, side: &str, mut qos: Qos) -> RosResult<Qos> {
        let name = |policy: &str| format!("{QOS_OVERRIDES}{topic}.{side}.{policy}");
        for policy in ["history", "depth", "reliability", "durability"] {
            let given = lock(&self.inner).qos.get(&name(policy)).cloned();
            if let Some((value, place)) = given {
                qos.override_policy(policy, &plain_text(&value), &place, &name(policy))?;
            }
        }
        let (history, depth) = match qos.history {
            History::KeepLast(depth) => ("keep_last", i64::from(depth)),
            History::KeepAll => ("keep_all", 0),
        };
        let reliability = if qos.reliability == Reliability::Reliable {
            "reliable"
        } else {
            "best_effort"
        };
        let durability = if qos.durability == Durability::Volatile {
            "volatile"
        } else {
            "transient_local"
        };
        self.declare(Parameter::new(&name("depth"), depth).read_only())?;
        for (policy, text) in [
            ("history", history),
            ("reliability", reliability),
            ("durability", durability),
        ] {
            self.declare(Parameter::new(&name(policy), text.to_owned()).read_only())?;
        }
        Ok(qos)
    }
}

fn plain_text(value: &ParameterValue) -> String {
    match value {
        ParameterValue::String(text) => text.clone(),
        other => to_text(other),
    }
}

#[cfg(test)]
#[path = "store_tests.rs"]
mod tests;
