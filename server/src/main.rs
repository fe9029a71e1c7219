//! Palmares: a competition server where remote controllers drive emulated compliant underactuated robot hands.

mod api;
mod cli;
mod config;
mod metrics;
mod protocol;
mod replay;
mod session;
#[allow(dead_code, unused_imports, reason = "the competition uses the rest")]
mod store;
mod telemetry;
mod watch;
mod ws;

use clap::Parser;
use std::process::ExitCode;

fn main() -> ExitCode {
    match cli::Cli::parse().run() {
        Ok(code) => code,
        Err(error) => {
            eprintln!("palmares: {error:#}");
            ExitCode::FAILURE
        }
    }
}
