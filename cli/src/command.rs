//! What `palmares` can be asked.

use crate::server::{self, ServeOptions};
use crate::task::TaskCommand;
use crate::{admin, health, list, replay, schema, verify};
use clap::{Parser, Subcommand};
use palmares_hand_tools::HandCommand;
use std::process::ExitCode;

/// Palmares: a competition server where remote controllers drive emulated compliant underactuated robot hands.
#[derive(Debug, Parser)]
#[command(version, about, propagate_version = true, arg_required_else_help = true, after_help = AFTER_HELP)]
pub(crate) struct Cli {
    #[command(subcommand)]
    command: Command,
}

const AFTER_HELP: &str = "\
Quick start:
  palmares serve                 a practice server on http://127.0.0.1:8080
  open http://127.0.0.1:8080/    the leaderboard

With the Python package installed (pip install palmares-*.whl) there are two more commands:
  palmares demo                  a server, one run of an example controller, its score
  palmares evaluate FILE         play a controller over many scenes

Guides: docs/teams.md (writing a controller), docs/hands.md (a hand of your own), docs/tasks.md (a task of your own),
docs/organizers.md (a competition).
Log lines go to stderr; RUST_LOG=palmares=debug shows more of them.";

const SERVE_HELP: &str = "\
When it is ready it prints one line on stdout, `listening on http://ADDRESS:PORT`. Ctrl-C (or SIGTERM) ends it:
open runs are stopped and scored first, for which they have --shutdown-grace-s. The exit code is then 0, or 3 when some
did not finish: those are marked at the next start.

Examples:
  palmares serve
  palmares serve --listen 0.0.0.0:8080 --data-dir /var/lib/palmares
  palmares serve --config competition.toml      (see docs/organizers.md)
  palmares serve --hand my-hand/                (see `palmares hand check`)
  palmares serve --task my-task/                (see `palmares task check`)
  palmares serve --listen 127.0.0.1:0           (any free port)";

const ADMIN_HELP: &str = "\
Examples, where the server runs:
  palmares admin team add crabs                           prints the team's token, once
  palmares admin open
  palmares admin session list                             sessions with their ids and clocks
  palmares admin session grant ses_1f… --seconds 60 --reason \"late start\"
  palmares admin run void run_7c… --reason \"the network failed\"
  palmares admin export leaderboard -o leaderboard.csv
Elsewhere, with the token in a file:
  palmares admin --url http://127.0.0.1:9000 --token-file organizer.token status";

const VERIFY_HELP: &str = "\
Examples:
  palmares verify run_7c3d8eb479d7f8ab.mcap --key 3b6a…
  palmares verify run_7c3d8eb479d7f8ab.mcap --task my-task/
  palmares verify --json replays/*.mcap";

#[derive(Debug, Subcommand)]
enum Command {
    /// Run a server
    ///
    /// For practice: teams connect without a token, choose their own seeds and may see the full state. With --config
    /// and mode = "official": teams have tokens, seeds are hidden, sessions are limited, scores are verified. Results
    /// are kept in a SQLite file in the data directory, which is created on the first start, or in Postgres.
    #[command(after_help = SERVE_HELP)]
    Serve(ServeOptions),
    /// Run an official competition: teams, tokens, sessions, verdicts, exports, backups
    ///
    /// Sends commands to a running server as an organizer. The first organizer's token lies in the server's data
    /// directory, in organizer.token. Lists are tables, and JSON with --json; other answers are JSON. The guide:
    /// docs/organizers.md.
    #[command(after_help = ADMIN_HELP)]
    Admin(admin::AdminOptions),
    /// List the hands that come with the program
    Hands,
    /// List the tasks that come with the program
    Tasks,
    /// List the catalogue of objects
    Objects,
    /// Check or draw a hand, or take a mesh of it apart; one of your own or one that comes with the program
    ///
    /// A hand is a URDF, meshes and a hand.toml that says what its tendons do. The guide: docs/hands.md.
    #[command(subcommand)]
    Hand(HandCommand),
    /// Copy, check, show, play a task, or take a mesh of it apart; one of your own or one that comes with the program
    ///
    /// A task is a folder with a task.toml: scene, objects, regions, rules, cameras. The guide: docs/tasks.md.
    #[command(subcommand)]
    Task(TaskCommand),
    /// Ask a server whether it can take work; for health checks
    ///
    /// Exits with 0 when the server answers that it is ready, else with 1.
    Health(health::HealthOptions),
    /// Play replays again and tell whether they come to the same states and the same score
    ///
    /// A replay is accepted when nobody changed a bit of it since the server signed it, and this program, simulating
    /// from tick 0, comes to the recorded states, events and score. Exits with 0 when every file is accepted, else
    /// with 1 and the reason: not_a_replay, truncated, chain_broken, bad_signature, other_hand, other_task,
    /// other_engine, other_physics, state_differs, score_differs.
    #[command(after_help = VERIFY_HELP)]
    Verify(verify::VerifyOptions),
    /// Tell what is in a replay
    ///
    /// Checks chain and signature, but does not simulate. Foxglove (https://foxglove.dev) shows the same file in 3D.
    Replay(replay::ReplayOptions),
    /// Print the description of the messages (JSON Schema) or of the HTTP addresses (OpenAPI)
    Schema {
        /// Which
        #[arg(value_enum, default_value_t = server::Description::Control)]
        what: server::Description,
    },
}

impl Cli {
    /// Does what was asked. Errors are for the caller to print; the code is for a failure that was reported already.
    pub(crate) fn run(self) -> anyhow::Result<ExitCode> {
        match self.command {
            Command::Serve(options) => return server::serve(&options),
            Command::Admin(options) => admin::admin(&options)?,
            Command::Hands => list::hands()?,
            Command::Tasks => list::tasks()?,
            Command::Objects => list::objects()?,
            Command::Hand(command) => return command.run(&server::hand_limits),
            Command::Task(command) => return command.run(),
            Command::Health(options) => health::health(&options)?,
            Command::Verify(options) => return verify::verify(&options),
            Command::Replay(options) => return replay::replay(&options),
            Command::Schema { what } => schema::schema(what)?,
        }
        Ok(ExitCode::SUCCESS)
    }
}

#[cfg(test)]
mod tests {
    use super::Cli;
    use clap::CommandFactory;

    #[test]
    fn the_definition_is_sound() {
        Cli::command().debug_assert();
    }

    /// `cargo test --package palmares --no-default-features` runs it.
    #[cfg(not(feature = "server"))]
    #[test]
    fn without_the_server_its_commands_say_why_they_are_refused() {
        use clap::Parser;
        for line in ["serve --listen 127.0.0.1:0 --data-dir x", "schema openapi"] {
            let asked = Cli::parse_from(std::iter::once("palmares").chain(line.split(' ')));
            let refused = asked.run().expect_err("refused").to_string();
            assert!(refused.starts_with("this build has no server"), "{refused}");
        }
    }
}
