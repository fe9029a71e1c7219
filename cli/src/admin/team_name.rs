//! The name of a team on the command line.

use super::reason::Reason;
use clap::Args;

/// A team, and the reason of an action on it.
#[derive(Args, Debug)]
pub(super) struct TeamName {
    /// The team's name
    #[arg(allow_hyphen_values = true, value_parser = team_name)]
    pub(super) team: String,
    #[command(flatten)]
    pub(super) reason: Reason,
}

/// A name can begin with a hyphen, as `-fast`. Two are taken for an option that is misspelt.
pub(super) fn team_name(text: &str) -> Result<String, String> {
    if text.starts_with("--") {
        return Err("no option of this command; a team whose name begins with `--` needs the web page".into());
    }
    Ok(text.to_owned())
}
