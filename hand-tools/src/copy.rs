//! `palmares hand copy`: a built-in hand as a start for one's own.

use anyhow::{Context, bail};
use clap::Args;
use palmares_models::builtin::{builtin_hands, builtin_texts};
use std::fs;
use std::io::Write as _;
use std::path::PathBuf;
use std::process::ExitCode;

/// Arguments of `hand copy`.
#[derive(Debug, Args)]
pub struct CopyArgs {
    /// The name of a built-in hand
    hand: String,
    /// The new hand's folder [default: my-HAND]
    #[arg(long, short, alias = "output", value_name = "FOLDER")]
    out: Option<PathBuf>,
    /// The new hand's name [default: the folder's name]
    #[arg(long)]
    name: Option<String>,
    /// Replace the files of an existing folder
    #[arg(long)]
    force: bool,
}

/// Writes the hand's files under another name.
///
/// # Errors
/// There is no such hand, the name is taken, the folder exists, or nothing can be written.
pub(crate) fn run(args: &CopyArgs) -> anyhow::Result<ExitCode> {
    let Some((urdf, settings)) = builtin_texts(&args.hand) else {
        let names: Vec<&str> = builtin_hands().iter().map(|hand| hand.name.as_str()).collect();
        bail!("no built-in hand `{}`; there are {}", args.hand, names.join(", "));
    };
    let folder = args.out.clone().unwrap_or_else(|| PathBuf::from(format!("my-{}", args.hand)));
    let name = match (&args.name, folder.file_name().and_then(|name| name.to_str())) {
        (Some(name), _) => name,
        (None, Some(name)) => name,
        (None, None) => bail!("{}: name the hand with --name NAME", folder.display()),
    };
    let plain = |c: char| c.is_ascii_alphanumeric() || matches!(c, '_' | '-' | '.');
    if name.is_empty() || name.len() > 64 || name.starts_with('.') || !name.chars().all(plain) {
        bail!(
            "the name `{name}`; valid: 1 to 64 letters, digits, '_', '-' and '.', the first no '.' (--name)"
        );
    }
    if builtin_hands().iter().any(|hand| hand.name == *name) {
        bail!("`{name}` is a built-in hand; choose another --name");
    }
    if folder.exists() && !args.force {
        bail!("{} exists; nothing was written (--force replaces its files)", folder.display());
    }
    let own = renamed(&settings, &args.hand, name);
    fs::create_dir_all(&folder).with_context(|| format!("cannot make {}", folder.display()))?;
    for (file, text) in [("hand.urdf", urdf), ("hand.toml", &own)] {
        let path = folder.join(file);
        fs::write(&path, text).with_context(|| format!("cannot write {}", path.display()))?;
    }
    let folder = folder.display();
    writeln!(
        std::io::stdout(),
        "wrote {folder}: hand `{name}`, a copy of `{}`. Next: palmares hand check {folder}",
        args.hand
    )?;
    Ok(ExitCode::SUCCESS)
}

/// The `hand.toml` of a built-in hand for its copy.
fn renamed(settings: &str, hand: &str, name: &str) -> String {
    let own = settings.replacen(&format!("name = \"{hand}\""), &format!("name = \"{name}\""), 1);
    // The README stays behind: it is about the built-in hand.
    own.replacen(
        "Where each number comes from: README.md.",
        &format!("A copy of the built-in hand `{hand}`."),
        1,
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_copy_names_no_file_that_is_not_copied() {
        for hand in builtin_hands() {
            let (_, settings) = builtin_texts(&hand.name).expect("it is built in");
            let own = renamed(&settings, &hand.name, "mine");
            assert!(own.contains("name = \"mine\"") && !own.contains("README"), "{own}");
        }
    }
}
