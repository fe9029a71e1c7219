//! `palmares task`: checks and tests of your own task.

mod check;
mod copy;
mod describe;
mod load;
mod model;
mod play;
mod show;

use clap::Subcommand;
use palmares_hand_tools::decompose::{self, DecomposeArgs, MeshOwner};
use palmares_hand_tools::world::{self, WorldArgs};
use std::process::ExitCode;

const CHECK_HELP: &str = "\
Exit code: 0 if the task is usable, 1 if not, 2 with --strict and warnings.

Examples:
  palmares task check my-task/            a folder with task.toml, and the
                                          meshes and URDFs that it names
  palmares task check my-task/task.toml --scenes 100 --hand my-hand/
  palmares task check my-task/ --hand softhand --model
                                          its parts, the time of a step, and the
                                          laws of the physics that act in it
  palmares task check balls --json        a built-in task; output for programs";

const SHOW_HELP: &str = "\
Examples:
  palmares task show pan                          its content, as text
  palmares task show my-task/ --seed 3 --output scene.png --camera top";

const COPY_HELP: &str = "\
Examples:
  palmares task copy balls my-balls/        writes my-balls/task.toml; edit it
  palmares task check my-balls/";

const IMPORT_HELP: &str = "\
Exit code: 0 without problems, 2 if the task was written with problems, 1 if nothing was written.

Examples:
  palmares task import world.xml --out my-task/
  palmares task import Klampt-examples/data/ --world tx90cups --out my-task/
                                          one world of a folder with several
  palmares task check my-task/";

const PLAY_HELP: &str = "\
Examples:
  palmares task play my-task/                     the hand reaches out, closes,
                                                  lifts and sweeps
  palmares task play my-task/ --script idle --replay idle.mcap
  palmares verify idle.mcap --task my-task/
To play it yourself in a browser: palmares serve --task my-task/, then
http://127.0.0.1:8080/drive";

const DECOMPOSE_HELP: &str = "\
Examples:
  palmares task decompose my-task/mug.stl           writes my-task/mug_pieces/
  palmares task decompose my-task/mug.stl --pieces 32 --resolution 128 --force
  palmares task decompose mug.stl --scale 0.001     a mesh in millimetres that
                                                    no task.toml names yet";

/// The commands for tasks.
#[derive(Debug, Subcommand)]
pub(crate) enum TaskCommand {
    /// Load a task, build scenes with several seeds, and check which hands fit where they start
    #[command(after_help = CHECK_HELP)]
    Check(check::CheckArgs),
    /// Print a task and the scene of a seed; with --output, write an image of one of its cameras
    #[command(after_help = SHOW_HELP)]
    Show(show::ShowArgs),
    /// Write the file of a built-in task, as a start for your own
    #[command(after_help = COPY_HELP)]
    Copy(copy::CopyArgs),
    /// Make a task of a Klamp't world: its rigid objects at their poses, its terrains as ground and boxes
    ///
    /// Meshes, mass, inertia, friction, restitution, colours and poses are kept; robots are not. All that was taken in other words, guessed
    /// or dropped, and all problems, are comments in task.toml. Goals are not in a world: the written ones raise each object.
    #[command(after_help = IMPORT_HELP)]
    Import(WorldArgs),
    /// Play a task with a fixed script, and print the referee's events
    #[command(after_help = PLAY_HELP)]
    Play(play::PlayArgs),
    /// Write the mesh of an object as convex pieces, and print the lines for the task.toml
    ///
    /// The simulation uses the convex hull of a mesh: holes and hollows are filled. This command cuts the mesh into convex pieces
    /// (V-HACD), writes them as STL files next to it, and prints the differences of volume and surface. The pieces are simulated
    /// and hashed; loading a task cuts nothing.
    #[command(after_help = DECOMPOSE_HELP)]
    Decompose(DecomposeArgs),
}

impl TaskCommand {
    /// Runs the command.
    ///
    /// # Errors
    /// The task or the hand cannot be read, the scene cannot be built, or nothing can be written.
    pub(crate) fn run(&self) -> anyhow::Result<ExitCode> {
        match self {
            TaskCommand::Check(args) => check::check(args),
            TaskCommand::Show(args) => show::show(args),
            TaskCommand::Copy(args) => copy::copy(args),
            TaskCommand::Import(args) => world::run(args),
            TaskCommand::Play(args) => play::play(args),
            TaskCommand::Decompose(args) => decompose::run(args, MeshOwner::Task),
        }
    }
}
