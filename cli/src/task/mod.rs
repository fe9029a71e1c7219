//! `palmares task`: look at a task of one's own before anybody else does.

mod check;
mod copy;
mod describe;
mod load;
mod play;
mod show;

use clap::Subcommand;
use palmares_hand_tools::decompose::{self, DecomposeArgs, MeshOwner};
use std::process::ExitCode;

const CHECK_HELP: &str = "\
Exit code: 0 when the task is usable, 1 when it is not, 2 with --strict when there are warnings.

Examples:
  palmares task check my-task/            a folder with task.toml, and the meshes and URDFs that it names
  palmares task check my-task/task.toml --seeds 100 --hand my-hand/
  palmares task check balls --json        a task that comes with the program, for programs";

const SHOW_HELP: &str = "\
Examples:
  palmares task show pan                          what it consists of, as text
  palmares task show my-task/ --seed 3 --out scene.png --camera top";

const COPY_HELP: &str = "\
Examples:
  palmares task copy balls my-balls/              writes my-balls/task.toml, with its comments; change it, then
  palmares task check my-balls/";

const PLAY_HELP: &str = "\
Examples:
  palmares task play my-task/                     the hand reaches out, closes, lifts and sweeps
  palmares task play my-task/ --script idle --replay idle.mcap
  palmares verify idle.mcap --task my-task/
For a person to play it in the browser: palmares serve --task my-task/, then http://127.0.0.1:8080/drive";

const DECOMPOSE_HELP: &str = "\
Examples:
  palmares task decompose my-task/mug.stl                   writes my-task/mug_pieces/mug_01.stl and so on
  palmares task decompose my-task/mug.stl --pieces 32 --resolution 128 --force
  palmares task decompose mug.stl --scale 0.001             a mesh in millimetres that no task.toml names yet";

/// What to do with a task.
#[derive(Debug, Subcommand)]
pub(crate) enum TaskCommand {
    /// Load a task, build its scene with several seeds, and see which hands fit where they start
    #[command(after_help = CHECK_HELP)]
    Check(check::CheckArgs),
    /// Print what a task consists of and a seed's scene; with --out, a picture by one of its cameras
    #[command(after_help = SHOW_HELP)]
    Show(show::ShowArgs),
    /// Write the file of a task that comes with the program, to make one of your own of it
    #[command(after_help = COPY_HELP)]
    Copy(copy::CopyArgs),
    /// Play a task by a script that knows nothing of it, and tell what the referee noted
    #[command(after_help = PLAY_HELP)]
    Play(play::PlayArgs),
    /// Write a mesh of an object as convex pieces, and what to put into the task.toml in its place
    ///
    /// A mesh is played as its convex hull: holes and hollows are filled. This command cuts it into convex pieces (V-HACD),
    /// writes them as STL files beside it, and prints how much their volume differs from the mesh's and how far their surface
    /// lies from its own. The pieces are what is played and hashed; nothing is cut when a task is loaded.
    #[command(after_help = DECOMPOSE_HELP)]
    Decompose(DecomposeArgs),
}

impl TaskCommand {
    /// Does it.
    ///
    /// # Errors
    /// The task or the hand cannot be read, the scene cannot be built, or nothing can be written.
    pub(crate) fn run(&self) -> anyhow::Result<ExitCode> {
        match self {
            TaskCommand::Check(args) => check::check(args),
            TaskCommand::Show(args) => show::show(args),
            TaskCommand::Copy(args) => copy::copy(args),
            TaskCommand::Play(args) => play::play(args),
            TaskCommand::Decompose(args) => decompose::run(args, MeshOwner::Task),
        }
    }
}
