//! Several simulations of one motion in one file of columns, each of a person, wearing and devices of
//! its own (`--draw`).

use cromosim_evaluation::{DrawnSimulation, SimulationDraws};
use cromosim_recording::columns::{ColumnsHeader, ColumnsWriter};
use cromosim_recording::{Aside, PlayedPerson, write_file_with};
use serde_json::json;

use crate::simulate_setup::{Output, Setup, Written};

/// Simulates and writes one draw after the other.
pub fn simulate_draws(
    setup: &Setup,
    draws: &SimulationDraws,
    people: &[PlayedPerson],
    output: Output<'_>,
) -> anyhow::Result<Written> {
    let header = ColumnsHeader {
        recording: output.recording.to_owned(),
        metadata: setup.settings_of(people),
    };
    let placements = setup.simulation.placements().placements().len();
    let aside = Aside::beside(output.path, placements);
    let check = || setup.interrupt.check();
    let rows = write_file_with(output.path, setup.force, |file| {
        let mut columns = ColumnsWriter::new(file, output.path, &header)?;
        for number in 0..draws.count() {
            let drawn = draws.draw(&setup.simulation, output.recording, number)?;
            for person in people {
                let person = person.varied(drawn.betas.as_deref(), drawn.speed);
                let mut simulated = drawn.simulation.simulate(&person, &aside, check, || ())?;
                columns.write_person(number.cast_signed(), &person, &mut simulated, check)?;
            }
            columns.note(&format!("draw.{number}"), said_of(&drawn));
        }
        anyhow::Ok(columns.finish()?)
    })?;
    let (out, source) = (output.path.display(), &people[0].motion.name);
    let draws = draws.count();
    let line = if setup.json {
        json!({"out": out.to_string(), "rows": rows, "draws": draws, "source": source}).to_string()
    } else {
        format!("{out}: {rows} rows, {draws} draws of {placements} placements, of {source}")
    };
    Ok(Written { count: rows, line })
}

/// What was drawn, as YAML with comments.
fn said_of(drawn: &DrawnSimulation) -> String {
    let placements = drawn.simulation.placements();
    let mut text = format!(
        "# speed {}\n# shape {:?}\n{}",
        drawn.speed,
        drawn.betas,
        placements.to_yaml()
    );
    let devices = drawn.simulation.devices().iter();
    for (placement, device) in placements.placements().iter().zip(devices) {
        text += &device.to_yaml(&format!("device of {}", placement.name()));
    }
    text
}
