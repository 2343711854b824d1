//! A training in a file: weights, Adam's moments, the best weights, how far it is.

use std::fs;
use std::path::Path;

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use super::adam::Adam;
use super::options::TrainOptions;
use super::state::{Best, Training};
use crate::tensors::{self, Named, TensorFile};
use crate::{LearnedError, Network, NetworkShape};

/// The metadata's key.
const KEY: &str = "cromosim_training";
const NAMES: [&str; 4] = ["weights", "adam.first", "adam.second", "best.weights"];

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Header {
    shape: NetworkShape,
    options: TrainOptions,
    step: u64,
    stale: u64,
    best: Option<BestHeader>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct BestHeader {
    step: u64,
    /// Bits of the f64, which a text might round.
    loss_bits: u64,
}

impl Training {
    /// Writes a checkpoint, whole or not at all.
    ///
    /// # Errors
    /// Where it cannot be written.
    pub fn write(&self, path: &Path) -> Result<(), LearnedError> {
        let best = self.best.as_ref().map(|best| BestHeader {
            step: best.step,
            loss_bits: best.loss.to_bits(),
        });
        let (shape, options) = (self.network.shape().clone(), self.options.clone());
        let header = Header {
            shape,
            options,
            step: self.step,
            stale: self.stale,
            best,
        };
        let values = [
            Some(self.network.parameters()),
            Some(&self.adam.first),
            Some(&self.adam.second),
            self.best.as_ref().map(|best| best.network.parameters()),
        ];
        let named = NAMES.into_iter().zip(values).filter_map(|(name, values)| {
            let values = values?;
            Some(Named {
                name: name.to_owned(),
                shape: vec![values.len()],
                values,
            })
        });
        tensors::write_whole(
            path,
            &tensors::to_bytes(named.collect(), KEY, &header, path)?,
        )
    }

    /// Reads a checkpoint, to go on from it.
    ///
    /// # Errors
    /// Where the file cannot be read or is no sound checkpoint, or where it was written with
    /// another shape or other options.
    pub fn resume(
        path: &Path,
        shape: &NetworkShape,
        options: &TrainOptions,
    ) -> Result<Self, LearnedError> {
        let bytes = tensors::read_bounded(path, 4)?;
        let file = TensorFile::parse(&bytes, path)?;
        let header: Header = file.header(KEY)?;
        same(path, "shape", &header.shape, shape)?;
        same(path, "options", &header.options, options)?;
        header.shape.check()?;
        options.check(shape)?;
        let count = shape.parameters();
        let used = if header.best.is_some() { 4 } else { 3 };
        file.refuse_others(|name| NAMES[..used].contains(&name))?;
        let values = |index: usize| file.values(NAMES[index], &[count]);
        let best = match header.best {
            None => None,
            Some(best) => {
                let network = Network::from_parameters(shape.clone(), values(3)?);
                Some(Best {
                    network,
                    step: best.step,
                    loss: f64::from_bits(best.loss_bits),
                })
            }
        };
        Ok(Self {
            options: options.clone(),
            network: Network::from_parameters(shape.clone(), values(0)?),
            adam: Adam {
                first: values(1)?,
                second: values(2)?,
            },
            step: header.step,
            best,
            stale: header.stale,
        })
    }

    /// Goes on from the checkpoint where there is one, else begins anew.
    ///
    /// # Errors
    /// As [`Training::resume`] and [`Training::new`].
    pub fn resume_or_new(
        path: &Path,
        shape: NetworkShape,
        options: TrainOptions,
    ) -> Result<Self, LearnedError> {
        if fs::exists(path).unwrap_or(true) {
            Self::resume(path, &shape, &options)
        } else {
            Self::new(shape, options)
        }
    }
}

/// Refuses where file and wish differ, by the name of the first field that does.
fn same<T: Serialize + DeserializeOwned + PartialEq>(
    path: &Path,
    what: &'static str,
    in_file: &T,
    wished: &T,
) -> Result<(), LearnedError> {
    // Through text as the file's was, since a number may come back from text with another last bit.
    let through_text =
        serde_json::to_string(wished).and_then(|text| serde_json::from_str::<T>(&text));
    if through_text.as_ref().is_ok_and(|wished| wished == in_file) {
        return Ok(());
    }
    let value = |value: &T| serde_json::to_value(value).unwrap_or_default();
    let (in_file, wished) = (value(in_file), value(wished));
    let nothing = serde_json::Map::new();
    let (in_file, wished) = (
        in_file.as_object().unwrap_or(&nothing),
        wished.as_object().unwrap_or(&nothing),
    );
    let differing = in_file
        .iter()
        .find(|(field, value)| wished.get(*field) != Some(value));
    let text = |value: Option<&serde_json::Value>| {
        value.map_or_else(|| "nothing".to_owned(), ToString::to_string)
    };
    let field = differing.map_or("", |(field, _)| field);
    Err(LearnedError::OtherTraining {
        path: path.into(),
        field: format!("{what}.{field}"),
        in_file: text(in_file.get(field)),
        wished: text(wished.get(field)),
    })
}
