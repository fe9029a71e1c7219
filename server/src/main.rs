//! Palmares: a competition server where remote controllers drive emulated compliant underactuated robot hands.

mod api;
mod app;
mod auth;
mod backup;
mod cli;
mod competition;
mod compute;
mod config;
mod hands;
mod inspect;
mod lifecycle;
mod metrics;
mod names;
mod protocol;
mod replay;
mod rules;
mod session;
mod store;
mod telemetry;
mod transport;
mod watch;
mod world;

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
