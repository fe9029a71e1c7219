//! `palmares hand copy`: a built-in hand as a start for one's own.

use anyhow::{Context, bail};
use clap::Args;
use palmares_models::builtin::{builtin_hands, builtin_texts, builtin_variant, builtin_variants};
use std::fs;
use std::io::Write as _;
use std::path::PathBuf;
use std::process::ExitCode;

/// Arguments of `hand copy`.
#[derive(Debug, Args)]
pub struct CopyArgs {
    /// The name of a built-in hand
    hand: String,
    /// A variant of the hand, such as `rubbing` of softhand
    #[arg(long)]
    variant: Option<String>,
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
    let (source, settings, about) = match &args.variant {
        None => (args.hand.clone(), settings, None),
        Some(variant) => {
            let (settings, about) = builtin_variant(&args.hand, variant).with_context(|| {
                let known: Vec<&str> = builtin_variants(&args.hand).collect();
                let known = if known.is_empty() { "none".to_owned() } else { known.join(", ") };
                format!("no variant `{variant}` of `{}`; there is {known} (--variant)", args.hand)
            })?;
            (format!("{}_{variant}", args.hand), settings, Some(about))
        }
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
    let own = renamed(&settings, &source, name);
    fs::create_dir_all(&folder).with_context(|| format!("cannot make {}", folder.display()))?;
    let readme = about.map(|about| format!("# {name}\n\n{about}\n"));
    let files = [("hand.urdf", urdf), ("hand.toml", &own)];
    for (file, text) in files.into_iter().chain(readme.as_deref().map(|text| ("README.md", text))) {
        let path = folder.join(file);
        fs::write(&path, text).with_context(|| format!("cannot write {}", path.display()))?;
    }
    let folder = folder.display();
    writeln!(
        std::io::stdout(),
        "wrote {folder}: hand `{name}`, a copy of `{source}`. Next: palmares hand check {folder}"
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

    #[test]
    fn a_variant_is_a_hand_with_the_source_of_its_numbers() {
        for hand in builtin_hands() {
            for variant in builtin_variants(&hand.name) {
                let (settings, about) = builtin_variant(&hand.name, variant).expect("it is there");
                let own = renamed(&settings, &format!("{}_{variant}", hand.name), "mine");
                assert!(
                    own.contains("name = \"mine\"") && about.contains("a guess") && about.contains("range"),
                    "{own}"
                );
                let (urdf, _) = builtin_texts(&hand.name).expect("it is built in");
                let settings = Some((std::path::Path::new("hand.toml"), own.as_str()));
                let files = (std::path::Path::new("hand.urdf"), urdf);
                let loaded = palmares_models::read::from_text(files, settings, None, &Default::default())
                    .expect("a hand");
                assert!(loaded.hand.tendons.iter().any(|tendon| !tendon.guides.is_empty()));
            }
        }
    }
}
