//! Models that come with the suite: what `cromosim train config/training/NAME.yaml` wrote. Their
//! cards lie beside them in `models`.

use std::path::Path;

use crate::{LearnedError, LearnedSimulator, Network, Quantity};

/// Name, and the weights' files.
type Model = (&'static str, [&'static [u8]; 2]);

macro_rules! model {
    ($name:literal) => {
        (
            $name,
            [
                include_bytes!(concat!("../models/", $name, "/acceleration.safetensors")),
                include_bytes!(concat!(
                    "../models/",
                    $name,
                    "/angular_velocity.safetensors"
                )),
            ],
        )
    };
}

const MODELS: [Model; 5] = [
    model!("motion_capture"),
    model!("motion_capture_60"),
    model!("streaming"),
    model!("streaming_video"),
    model!("video"),
];

impl LearnedSimulator {
    /// Names of the models that come with the suite.
    pub fn names() -> Vec<&'static str> {
        MODELS.iter().map(|(name, _)| *name).collect()
    }

    /// A model that comes with the suite.
    ///
    /// # Errors
    /// [`LearnedError::UnknownModel`].
    pub fn named(name: &str) -> Result<Self, LearnedError> {
        let Some((_, files)) = MODELS.iter().find(|(known, _)| *known == name) else {
            return Err(LearnedError::UnknownModel {
                name: name.to_owned(),
                known: Self::names().join(", "),
            });
        };
        let [acceleration, angular_velocity] = [0, 1].map(|which| {
            let path =
                Path::new(name).join(format!("{}.safetensors", Quantity::BOTH[which].name()));
            Network::from_bytes(files[which], &path).map(|(network, notes)| (path, network, notes))
        });
        Self::from_files([acceleration?, angular_velocity?])
    }

    /// A folder that `cromosim train` wrote, or the name of a model that comes with the suite where
    /// there is no such folder.
    ///
    /// # Errors
    /// As [`LearnedSimulator::read`] and [`LearnedSimulator::named`].
    pub fn find(folder_or_name: &Path) -> Result<Self, LearnedError> {
        match folder_or_name.to_str() {
            Some(name) if !folder_or_name.exists() && !name.contains(['/', '\\', '.']) => {
                Self::named(name)
            }
            _ => Self::read(folder_or_name),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Input;

    #[test]
    fn every_model_that_comes_with_the_suite_is_sound() {
        for name in LearnedSimulator::names() {
            let input = LearnedSimulator::find(Path::new(name)).unwrap().input();
            assert_eq!(input == Input::Streaming, name.starts_with("streaming"));
        }
        let error = LearnedSimulator::find(Path::new("mocap"))
            .unwrap_err()
            .to_string();
        assert!(
            error.contains("mocap")
                && error.contains(
                    "motion_capture, motion_capture_60, streaming, streaming_video, video"
                ),
            "{error}"
        );
        assert!(
            LearnedSimulator::find(Path::new("models/mocap"))
                .unwrap_err()
                .to_string()
                .contains("models/mocap/acceleration")
        );
    }
}
