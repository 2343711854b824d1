//! The node `recorder` as a program of its own.

use std::process::ExitCode;

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    match cromosim_recorder::run(&arguments) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            cromosim_ros::say_error(format_args!("{error:#}"));
            ExitCode::from(2)
        }
    }
}
