//! `palmares task copy`.

use anyhow::{Context, bail};
use clap::Args;
use palmares_tasks::Task;
use std::fs::{self, File};
use std::io::{ErrorKind, Write};
use std::path::PathBuf;
use std::process::ExitCode;

/// Options of `palmares task copy`.
#[derive(Debug, Args)]
pub(crate) struct CopyArgs {
    /// The name of a built-in task
    task: String,
    /// The new task's folder; created if it is missing
    folder: PathBuf,
    /// The new task's name [default: the folder's name]
    #[arg(long, value_name = "NAME")]
    name: Option<String>,
}

/// Writes the task's file under another name; never overwrites a file.
pub(super) fn copy(args: &CopyArgs) -> anyhow::Result<ExitCode> {
    let Some(toml) = Task::builtin_toml(&args.task) else {
        let known: Vec<String> = Task::builtin().iter().map(|task| task.name.clone()).collect();
        bail!("no built-in task `{}`; there are {}", args.task, known.join(", "));
    };
    let name = match (&args.name, args.folder.file_name().and_then(|name| name.to_str())) {
        (Some(name), _) => name,
        (None, Some(name)) => name,
        (None, None) => bail!("{}: name the task with --name NAME", args.folder.display()),
    };
    if Task::builtin_toml(name).is_some() {
        bail!("`{name}` is a built-in task; choose another --name");
    }
    let file = args.folder.join(Task::FILE);
    let own = toml.replacen(&format!("name = \"{}\"", args.task), &format!("name = {name:?}"), 1);
    Task::parse(&file.display().to_string(), &own)?;
    let failed = || format!("cannot write {}", file.display());
    fs::create_dir_all(&args.folder).with_context(failed)?;
    let mut to = match File::create_new(&file) {
        Err(error) if error.kind() == ErrorKind::AlreadyExists => {
            bail!("{} exists already; nothing was written", file.display())
        }
        opened => opened.with_context(failed)?,
    };
    to.write_all(own.as_bytes()).with_context(failed)?;
    writeln!(std::io::stdout(), "wrote {}: task `{name}`, a copy of `{}`", file.display(), args.task)?;
    Ok(ExitCode::SUCCESS)
}
