//! People, ways of wearing and devices, drawn anew for each motion that is simulated: data to learn
//! from. What is drawn, and how, is what trainings ([`cromosim_learned::WearerRanges`]) and the
//! evaluation of activities draw.

use cromosim_spatial::{in_plain_words, meant};
use std::collections::BTreeMap;
use std::path::Path;

use cromosim_imu::{Device, Placement, PlacementSet};
use cromosim_learned::{DeviceRanges, draw_shape};
use cromosim_recording::Simulation;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha12Rng;
use serde::{Deserialize, Serialize};

use crate::EvaluationError;
use crate::activity::DeviceWearing;
use crate::seeds::mixed_seed;

const SCHEMA: &str = "cromosim/draws/1";
/// Nobody simulates a motion more often.
const MOST: u32 = 100_000;

/// What is drawn for each motion.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SimulationDraws {
    schema: String,
    /// Simulations of each motion.
    draws: u32,
    /// Standard deviation of the shape's coefficients; the motion's own shape where absent.
    #[serde(default)]
    shape: Option<f64>,
    /// The motion is played this many times as fast, uniform.
    #[serde(default = "as_recorded")]
    speed: [f64; 2],
    /// Placements that are worn in one of the ways of this name: site and mount are drawn.
    #[serde(default)]
    wearing: BTreeMap<String, String>,
    /// What devices differ by; the placements' own devices where absent.
    #[serde(default)]
    devices: Option<DeviceRanges>,
}

fn as_recorded() -> [f64; 2] {
    [1.0, 1.0]
}

/// One draw.
pub struct DrawnSimulation {
    /// Its placements and devices, and a seed of its own.
    pub simulation: Simulation,
    /// The shape; none where it is the motion's own.
    pub betas: Option<Vec<f64>>,
    /// How many times as fast the motion is played.
    pub speed: f64,
}

impl SimulationDraws {
    /// Reads a file.
    ///
    /// # Errors
    /// As [`Self::parse`], and a file that cannot be read.
    pub fn read(path: &Path) -> Result<Self, EvaluationError> {
        let text = cromosim_spatial::read_text(path).map_err(|source| EvaluationError::Read {
            path: path.to_owned(),
            source,
        })?;
        Self::parse(&text, path)
    }

    /// Parses a file's text; `path` names it in errors.
    ///
    /// # Errors
    /// What is wrong in it.
    pub fn parse(text: &str, path: &Path) -> Result<Self, EvaluationError> {
        let draws: Self = serde_norway::from_str(text).map_err(|error| EvaluationError::Yaml {
            file: path.display().to_string(),
            problem: in_plain_words(error),
        })?;
        let wrong = |field: &str, problem: String| EvaluationError::Draws {
            path: path.to_owned(),
            field: field.to_owned(),
            problem,
        };
        if draws.schema != SCHEMA {
            return Err(wrong("schema", format!("expected {SCHEMA}")));
        }
        if !(1..=MOST).contains(&draws.draws) {
            return Err(wrong("draws", format!("expected 1 to {MOST}")));
        }
        if draws
            .shape
            .is_some_and(|shape| !(0.0..=10.0).contains(&shape))
        {
            let problem = "expected 0 to 10 standard deviations".to_owned();
            return Err(wrong("shape", problem));
        }
        let [slow, fast] = draws.speed;
        if !(slow >= 0.1 && slow <= fast && fast <= 10.0) {
            let problem = "expected the slowest and the fastest, from 0.1 to 10".to_owned();
            return Err(wrong("speed", problem));
        }
        for (placement, way) in &draws.wearing {
            if DeviceWearing::for_placement(way).is_none() {
                let known = DeviceWearing::known_placements();
                let meant = meant(way, known.split(", "));
                let problem = format!("{way} is no way of wearing; there are {known}{meant}");
                return Err(wrong(&format!("wearing.{placement}"), problem));
            }
        }
        // What an effect does not allow is said now, not in the middle of the work.
        if let Some(devices) = &draws.devices {
            devices
                .draw(0)
                .map_err(|error| wrong("devices", error.to_string()))?;
        }
        Ok(draws)
    }

    /// Simulations of each motion.
    pub const fn count(&self) -> u32 {
        self.draws
    }

    /// Whether every placement that is worn somehow is one of these.
    ///
    /// # Errors
    /// [`EvaluationError::Draws`], which names the others.
    pub fn check(&self, placements: &PlacementSet, path: &Path) -> Result<(), EvaluationError> {
        let names = || placements.placements().iter().map(Placement::name);
        let mut wearing = self.wearing.keys();
        match wearing.find(|worn| !names().any(|name| name == *worn)) {
            None => Ok(()),
            Some(unknown) => Err(EvaluationError::Draws {
                path: path.to_owned(),
                field: format!("wearing.{unknown}"),
                problem: format!(
                    "no such placement; there are {}{}",
                    names().collect::<Vec<_>>().join(", "),
                    meant(unknown, names())
                ),
            }),
        }
    }

    /// The draw of a number, from 0 on, of a recording; another recording, number or seed of the
    /// simulation is another draw.
    ///
    /// # Errors
    /// What an effect or a site does not allow.
    pub fn draw(
        &self,
        simulation: &Simulation,
        recording: &str,
        number: u32,
    ) -> Result<DrawnSimulation, EvaluationError> {
        let mut numbers = vec![simulation.options().seed, u64::from(number)];
        numbers.extend(recording.bytes().map(u64::from));
        let seed = mixed_seed(&numbers);
        let mut random = ChaCha12Rng::seed_from_u64(seed);
        let betas = self
            .shape
            .map(|spread| draw_shape(&mut random, simulation.model(), spread));
        let [slow, fast] = self.speed;
        let speed = slow + (fast - slow) * random.random::<f64>();
        let (mut worn, mut devices) = (BTreeMap::new(), Vec::new());
        for (placement, own) in simulation
            .placements()
            .placements()
            .iter()
            .zip(simulation.devices())
        {
            let way = self.wearing.get(placement.name());
            if let Some(wearing) = way.and_then(|way| DeviceWearing::for_placement(way)) {
                let drawn = wearing.draw(&mut random);
                worn.insert(placement.name().to_owned(), moved(placement, &drawn)?);
            }
            devices.push(match &self.devices {
                Some(ranges) => {
                    let drawn = ranges.draw(random.random())?;
                    let noise = drawn.noise();
                    Device::white(noise.accel_density, noise.gyro_density)
                        .with_effects(drawn.effects().clone())
                }
                None => own.clone(),
            });
        }
        let placements = simulation.placements().clone();
        let placements = placements.map(|own| worn.remove(own.name()).unwrap_or(own));
        Ok(DrawnSimulation {
            simulation: simulation.varied(placements, devices, seed),
            betas,
            speed,
        })
    }
}

/// The placement as a drawn person wears it.
fn moved(
    placement: &Placement,
    worn: &crate::activity::WornDevice,
) -> Result<Placement, EvaluationError> {
    let moved = Placement::at_site(placement.name(), worn.site, placement.rate_hz());
    let moved = moved.map_err(|(field, problem)| EvaluationError::Site {
        site: worn.site.to_owned(),
        field,
        problem: problem.to_string(),
    })?;
    let moved = moved.with_scheme(placement.scheme()).with_mount(worn.mount);
    Ok(match placement.device() {
        Some(device) => moved.with_device(device),
        None => moved,
    })
}

#[cfg(test)]
mod tests {
    use cromosim_body::BodyModel;
    use cromosim_recording::SimulationOptions;

    use super::*;

    fn simulation(seed: u64) -> Simulation {
        let given = ["wrist=left_watch".to_owned(), "hip=left_pocket".to_owned()];
        let placements = PlacementSet::at_sites(&given, "test").unwrap();
        let options = SimulationOptions {
            seed,
            ..SimulationOptions::default()
        };
        Simulation::new(BodyModel::embedded(), placements, Path::new("."), options).unwrap()
    }

    fn draws(text: &str) -> Result<SimulationDraws, EvaluationError> {
        let text = format!("schema: {SCHEMA}\n{text}");
        SimulationDraws::parse(&text, Path::new("draws.yaml"))
    }

    #[test]
    fn each_number_recording_and_seed_is_a_draw_of_its_own() {
        let draws =
            draws("draws: 4\nshape: 0.8\nspeed: [0.9, 1.1]\nwearing: {hip: pocket}\ndevices: {}")
                .unwrap();
        let told = |seed: u64, recording: &str, number: u32| {
            let drawn = draws.draw(&simulation(seed), recording, number).unwrap();
            let devices = drawn.simulation.devices().iter();
            let devices: Vec<String> = devices.map(|device| device.to_yaml("")).collect();
            let placements = drawn.simulation.placements().to_yaml();
            format!("{:?} {} {placements} {devices:?}", drawn.betas, drawn.speed)
        };
        assert_eq!(told(0, "a", 0), told(0, "a", 0));
        let mut all: Vec<String> = (0..20).map(|number| told(0, "a", number)).collect();
        all.extend([told(0, "b", 0), told(1, "a", 0)]);
        all.sort();
        all.dedup();
        assert_eq!(all.len(), 22);
        let pockets = all.iter().filter(|told| told.contains("right_pocket"));
        assert!((3..19).contains(&pockets.count()), "either pocket");
        assert!(
            all.iter().all(|told| told.contains("left_watch")),
            "the wrist stays"
        );
    }

    #[test]
    fn nothing_to_draw_leaves_all_as_it_is() {
        let simulation = simulation(3);
        let drawn = draws("draws: 1")
            .unwrap()
            .draw(&simulation, "a", 0)
            .unwrap();
        assert_eq!((drawn.betas, drawn.speed), (None, 1.0));
        let (own, drawn) = (simulation.placements(), drawn.simulation.placements());
        assert_eq!(own.to_yaml(), drawn.to_yaml());
    }

    #[test]
    fn what_cannot_be_drawn_is_refused() {
        for (text, words) in [
            ("draws: 0", "draws.yaml: draws: expected 1 to"),
            ("draws: 1\nshape: -1", "draws.yaml: shape:"),
            ("draws: 1\nspeed: [2, 1]", "draws.yaml: speed:"),
            (
                "draws: 1\nwearing: {hip: nose}",
                "wearing.hip: nose is no way of wearing",
            ),
            (
                "draws: 1\ndevices: {low_pass_hz: [-5, -1]}",
                "draws.yaml: devices:",
            ),
            ("draws: 1\nshapes: 1", "draws.yaml"),
        ] {
            let error = draws(text).unwrap_err().to_string();
            assert!(error.contains(words) && !error.contains('\n'), "{error}");
        }
        let draws = draws("draws: 1\nwearing: {knee: thigh}").unwrap();
        let simulation = simulation(0);
        let error = draws.check(simulation.placements(), Path::new("draws.yaml"));
        let error = error.unwrap_err().to_string();
        assert!(
            error.contains("wearing.knee: no such placement; there are wrist, hip"),
            "{error}"
        );
    }
}
