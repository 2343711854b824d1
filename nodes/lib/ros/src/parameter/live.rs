//! Parameters of a configuration that may change while the node runs.

use serde::de::DeserializeOwned;

use super::declaration::Parameter;
use super::store::Parameters;
use crate::error::{RosError, RosResult};

impl Parameters {
    /// Opens these parameters of the configuration to changes at run time. `take_up` gets the
    /// configuration as it would be and acts on it before the answer goes out; where it fails,
    /// nothing changes and its words are the answer's reason.
    ///
    /// `take_up` runs on the thread that asks, often the node's own: it should be short, and must
    /// not set parameters itself.
    ///
    /// # Errors
    /// Where a parameter is unknown.
    pub fn settable<C: DeserializeOwned>(
        &self,
        names: &[&str],
        mut take_up: impl FnMut(C) -> Result<(), String> + Send + 'static,
    ) -> RosResult<()> {
        let mut turn = self.turn();
        *turn = Some(Box::new(move |parameters| {
            take_up(parameters.config()?).map_err(|problem| RosError::Config { problem })
        }));
        for name in names {
            self.amend(name, |parameter| Parameter {
                read_only: false,
                ..parameter
            })?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use std::sync::{Arc, Mutex};

    use ros2_client::ParameterValue;

    use super::*;

    #[derive(Clone, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
    struct Config {
        rate: f64,
        seed: i64,
        file: String,
    }

    #[test]
    fn what_may_change_is_taken_up_or_refused_with_a_reason() {
        let parameters = Parameters::new();
        parameters.declare_config(&Config::default()).unwrap();
        assert!(parameters.set("rate", 2.0).is_err(), "not yet open");
        let taken = Arc::new(Mutex::new(Vec::new()));
        let list = Arc::clone(&taken);
        parameters
            .settable(&["rate", "seed"], move |config: Config| {
                if config.rate < 0.0 {
                    return Err(format!("no such rate: {}", config.rate));
                }
                list.lock().unwrap().push(config);
                Ok(())
            })
            .unwrap();
        parameters.set("rate", 2.0).unwrap();
        let refused = parameters.set("rate", -1.0).unwrap_err().to_string();
        assert!(refused.contains("no such rate: -1"), "{refused}");
        let closed = parameters.set("file", "x".to_owned()).unwrap_err();
        assert!(closed.to_string().contains("read-only"), "{closed}");
        parameters.set("use_sim_time", true).unwrap();
        let both = [
            ("seed".to_owned(), ParameterValue::Integer(3)),
            ("rate".to_owned(), ParameterValue::Double(4.0)),
        ];
        parameters.set_all(&both, "test").unwrap();
        let config = |rate, seed| Config {
            rate,
            seed,
            file: String::new(),
        };
        assert_eq!(
            *taken.lock().unwrap(),
            [config(2.0, 0), config(4.0, 3)],
            "each change once, those made together at once, others' not at all"
        );
        assert_eq!(parameters.config::<Config>().unwrap(), config(4.0, 3));
    }
}
