//! The commands of `palmares`.

use crate::environment::without_empty_variables;
use crate::server::{self, ServeOptions};
use crate::task::TaskCommand;
use crate::{admin, health, keys, list, render, replay, schema, verify};
use clap::{CommandFactory, FromArgMatches, Parser, Subcommand};
use palmares_hand_tools::HandCommand;
use std::ffi::OsString;
use std::path::PathBuf;
use std::process::ExitCode;

/// Palmares: a competition server where remote controllers drive emulated compliant underactuated robot hands.
#[derive(Debug, Parser)]
#[command(version, about, propagate_version = true, arg_required_else_help = true, max_term_width = 80, after_help = AFTER_HELP)]
pub(crate) struct Cli {
    #[command(subcommand)]
    command: Command,
}

const AFTER_HELP: &str = "\
Quick start:
  palmares serve                 a practice server on http://127.0.0.1:8080
  open http://127.0.0.1:8080/    the leaderboard

The Python package (pip install palmares-*.whl) adds these commands:
  palmares demo                  a server, one run of an example, its score
  palmares evaluate FILE         play a controller over many scenes
  palmares grasps HAND OBJECTS   thousands of grasps, tried and proven, in a file
  palmares dataset RUNS          recorded runs as a dataset for imitation
  palmares hand design FILE      a hand whose numbers meet goals best
  palmares new FOLDER            a controller that plays, its test, a README
  palmares foxglove              a server's live runs in Foxglove
  palmares ros2                  a run as a node of ROS 2

Guides: docs/teams.md (writing a controller), docs/hands.md (your own hand),
docs/tasks.md (your own task), docs/organizers.md (a competition).
Log lines go to stderr; RUST_LOG=palmares=debug shows more.";

const SERVE_HELP: &str = "\
When the server is ready, it prints one line on stdout: `listening on
http://ADDRESS:PORT`. Ctrl-C (or SIGTERM) stops it: open runs are stopped and
scored first, within --shutdown-grace-s. The exit code is then 0, or 3 if some
runs did not finish: they are aborted at the next start.

Examples:
  palmares serve
  palmares serve --listen 0.0.0.0:8080 --data-dir /var/lib/palmares
  palmares serve --config competition.toml      (see docs/organizers.md)
  palmares serve --hand my-hand/                (see `palmares hand check`)
  palmares serve --task my-task/                (see `palmares task check`)
  palmares serve --listen 127.0.0.1:0           (any free port)";

const ADMIN_HELP: &str = "\
Examples, on the server's machine:
  palmares admin team add crabs             prints the team's token, once
  palmares admin open
  palmares admin session list               sessions with their ids and clocks
  palmares admin session grant ses_1f… --seconds 60 --reason \"late start\"
  palmares admin run void run_7c… --reason \"the network failed\"
  palmares admin export leaderboard -o leaderboard.csv
Example with a URL and the token in a file:
  palmares admin --url http://127.0.0.1:9000 --token-file organizer.token \\
      status";

const VERIFY_HELP: &str = "\
Examples:
  palmares verify run_7c3d8eb479d7f8ab.mcap --key 3b6a…
  palmares verify run_7c3d8eb479d7f8ab.mcap --task my-task/
  palmares verify season/ --json > verdicts.jsonl    all .mcap files in a folder
  palmares verify season/ --json --resume verdicts.jsonl > rest.jsonl
  palmares verify s3://cup/2026 --ray=FIRST:6379     a bucket, on a Ray cluster
                                                     (docs/replays.md)";

#[derive(Debug, Subcommand)]
enum Command {
    /// Run a server
    ///
    /// By default a practice server: teams need no token, choose their seeds and may observe the true state. With --config and
    /// mode = "official", teams have tokens, seeds are hidden, sessions are limited and scores are verified. Results are stored
    /// in a SQLite file in the data directory, which the first start creates, or in Postgres.
    #[command(after_help = SERVE_HELP)]
    Serve(ServeOptions),
    /// Manage an official competition: teams, tokens, sessions, runs, exports, backups
    ///
    /// Sends an organizer's commands to a running server. The first organizer's token is in the server's data directory, in
    /// organizer.token. Lists are tables, or JSON with --json; other output is JSON. The guide: docs/organizers.md.
    #[command(after_help = ADMIN_HELP)]
    Admin(admin::AdminOptions),
    /// Make the secrets of a competition before its first start, for several hosts or a container
    ///
    /// Makes seed.secret, signing.key and organizer.token in a new or empty folder, and prints what to publish. A server alone makes them by
    /// itself.
    Keys {
        /// The folder
        folder: PathBuf,
        /// Give folder and files to this account, a number, such as 10001 of the container; needs root
        #[arg(long, value_name = "UID")]
        owner: Option<u32>,
    },
    /// List the built-in hands
    Hands {
        /// Print one JSON list: name, joints, motors, sources, result in the task grasp
        #[arg(long)]
        json: bool,
    },
    /// List the built-in tasks
    Tasks,
    /// List the catalogue of objects
    Objects,
    /// Check, try or draw a hand, or decompose its meshes; your own hand or a built-in one
    ///
    /// A hand is a URDF, meshes and a hand.toml with its tendons. The guide: docs/hands.md.
    #[command(subcommand)]
    Hand(HandCommand),
    /// Copy, check, show or play a task, or decompose its meshes; your own task or a built-in one
    ///
    /// A task is a folder with a task.toml: scene, objects, regions, rules, cameras. The guide: docs/tasks.md.
    #[command(subcommand)]
    Task(TaskCommand),
    /// Check whether a server is ready, for health checks
    ///
    /// The exit code is 0 if the server is ready, else 1.
    Health(health::HealthOptions),
    /// Verify replays by simulating them again
    ///
    /// A replay is accepted if it is unchanged since the server signed it, and this program's simulation from tick 0 gives the
    /// recorded states, events and score. The exit code is 0 if every replay is accepted, 130 after Ctrl-C, else 1. A refused
    /// replay has a reason: not_a_replay, truncated, chain_broken, bad_signature, other_hand, other_task, other_engine,
    /// other_physics, state_differs, score_differs.
    #[command(after_help = VERIFY_HELP)]
    Verify(verify::VerifyOptions),
    /// Show the content of a replay
    ///
    /// Checks chain and signature, but does not simulate. Foxglove (https://foxglove.dev) shows the same file in 3D.
    Replay(replay::ReplayOptions),
    /// Make a film or a picture of a recorded run
    ///
    /// Simulates the run again and draws it, without a browser and without a graphics card. The ending of --output chooses the
    /// kind: .mp4, .gif, .png. For .mp4 it needs ffmpeg: on the PATH, or of the Python package imageio-ffmpeg.
    Render(render::RenderOptions),
    /// Print the schema of the messages (JSON Schema) or of the HTTP addresses (OpenAPI)
    Schema {
        /// The schema
        #[arg(value_enum, default_value_t = server::Description::Control)]
        what: server::Description,
    },
}

impl Cli {
    /// Reads the arguments, the first of which is the program's name, and the environment. Ends the process if they are not valid.
    pub(crate) fn read(arguments: impl IntoIterator<Item = OsString>) -> Self {
        let mut command = without_empty_variables(Self::command());
        let read = command.try_get_matches_from_mut(arguments);
        let read = read.and_then(|found| Self::from_arg_matches(&found).map_err(|e| e.format(&mut command)));
        read.unwrap_or_else(|error| error.exit())
    }

    /// Runs the command. The caller prints an error; the exit code is for a failure that is reported already.
    pub(crate) fn run(self) -> anyhow::Result<ExitCode> {
        match self.command {
            Command::Serve(options) => return server::serve(&options),
            Command::Admin(options) => admin::admin(&options)?,
            Command::Keys { folder, owner } => keys::keys(&folder, owner)?,
            Command::Hands { json } => list::hands(json)?,
            Command::Tasks => list::tasks()?,
            Command::Objects => list::objects()?,
            Command::Hand(command) => return command.run(&server::hand_limits),
            Command::Task(command) => return command.run(),
            Command::Health(options) => health::health(&options)?,
            Command::Verify(options) => return verify::verify(&options),
            Command::Replay(options) => return replay::replay(&options),
            Command::Render(options) => return render::render(&options),
            Command::Schema { what } => schema::schema(what)?,
        }
        Ok(ExitCode::SUCCESS)
    }
}

#[cfg(test)]
mod tests {
    use super::Cli;
    use clap::{CommandFactory, Parser};

    #[test]
    fn the_definition_is_sound() {
        Cli::command().debug_assert();
    }

    #[test]
    fn help_has_at_most_80_columns() {
        fn check(command: &mut clap::Command) {
            let help = command.render_long_help().to_string();
            // The synopsis is one line, to copy.
            for line in help.lines().filter(|line| !line.starts_with("Usage: ")) {
                assert!(line.chars().count() <= 80, "{}: {line}", command.get_name());
            }
            command.get_subcommands_mut().for_each(check);
        }
        let mut command = Cli::command();
        command.build();
        check(&mut command);
    }

    #[test]
    fn old_spellings_of_options_still_work() {
        for (arguments, old, new) in [
            ("task check balls", "--seeds 3", "--scenes 3"),
            ("task show balls", "--out a.png", "--output a.png"),
            ("replay run.mcap --cameras wrist", "--out a.mcap", "--output a.mcap"),
            ("render run.mcap", "--out a.mp4", "--output a.mp4"),
            ("hand show pinch", "--out a.svg", "--output a.svg"),
            ("hand check pinch", "--out a.svg", "--output a.svg"),
            ("hand try pinch", "--task balls", "--only balls"),
        ] {
            let parsed = [old, new].map(|option| {
                let words = format!("palmares {arguments} {option}");
                let cli = Cli::try_parse_from(words.split(' '));
                format!("{:?}", cli.unwrap_or_else(|error| panic!("{words}: {error}")))
            });
            assert_eq!(parsed[0], parsed[1], "{arguments}");
        }
    }

    /// `cargo test --package palmares --no-default-features` runs it.
    #[cfg(not(feature = "server"))]
    #[test]
    fn without_the_server_its_commands_say_why_they_are_refused() {
        for line in ["serve --listen 127.0.0.1:0 --data-dir x", "schema openapi"] {
            let parsed = Cli::parse_from(std::iter::once("palmares").chain(line.split(' ')));
            let refused = parsed.run().expect_err("refused").to_string();
            assert!(refused.starts_with("this build has no server"), "{refused}");
        }
    }
}
