//! Palmares: a competition server where remote controllers drive emulated compliant underactuated robot hands.

mod auth;
mod backup;
mod cli;
mod config;
mod hands;
mod http;
mod inspect;
mod metrics;
mod names;
mod net;
mod protocol;
mod replay;
mod rules;
mod session;
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
