//! `palmares admin`: an organizer's commands, sent to a running server.

pub(crate) mod client;
mod hand;
mod import;
mod lists;
mod reason;
mod restore;
mod schedule;
mod team_name;
mod when;

use client::{Access, Client, Paged};
use lists::List;
use palmares_hand_tools::table;
use reason::Reason;
use team_name::TeamName;

use anyhow::{Context, bail};
use clap::{Args, Subcommand, ValueEnum};
use palmares_protocol::text::printable;
use serde_json::{Value, json};
use std::io::{IsTerminal, Write};
use std::path::PathBuf;

/// Options of `palmares admin`.
#[derive(Args, Debug)]
pub(crate) struct AdminOptions {
    #[command(flatten)]
    access: Access,
    /// Print lists as JSON, as the server sends them, for programs
    #[arg(long, global = true)]
    json: bool,
    #[command(subcommand)]
    command: AdminCommand,
}

#[derive(Debug, Subcommand)]
enum AdminCommand {
    /// Show the competition and its phase
    Status,
    /// Open the competition: sessions can begin
    Open(Reason),
    /// Close the competition: no new session can begin, open ones continue
    Close(Reason),
    /// Pause all sessions, also those that begin later: clocks and worlds stop. Asks for confirmation
    Pause(Confirmed),
    /// End the pause of all sessions. Asks for confirmation
    Resume(Confirmed),
    /// End all sessions and close the competition; open runs are scored. Asks for confirmation
    End(Confirmed),
    /// End the competition for good and publish the secret behind the seeds. Asks for confirmation
    Reveal(Confirmed),
    /// Show an announcement on the pages; an empty text withdraws the last one
    Announce {
        /// The text, at most 500 characters
        #[arg(allow_hyphen_values = true)]
        text: String,
        #[command(flatten)]
        reason: Reason,
    },
    /// Manage the time slots of teams
    #[command(subcommand)]
    Schedule(schedule::Schedule),
    /// Manage teams and their tokens
    #[command(subcommand)]
    Team(Team),
    /// Manage tokens of organizers and viewers
    #[command(subcommand)]
    Token(Token),
    /// Pause, end and void sessions, and grant them time
    #[command(subcommand)]
    Session(Session),
    /// List, show and void runs, verify them again, download their replays
    #[command(subcommand)]
    Run(Run),
    /// Decide on hands that teams uploaded
    #[command(subcommand)]
    Hand(Hand),
    /// Download a table
    Export {
        /// The table
        what: Table,
        /// Its format
        #[arg(long, default_value = "csv")]
        format: Format,
        /// A new file for the table [default: stdout]
        #[arg(long, short, value_name = "FILE")]
        output: Option<PathBuf>,
    },
    /// Print the audit: actions with time, organizer and reason
    Audit {
        /// Only records after this number
        #[arg(long, value_name = "NUMBER")]
        after: Option<u64>,
    },
    /// Download a backup of everything while the server runs. It contains secrets: keep it private
    Backup {
        /// A new file to write
        file: PathBuf,
    },
    /// Restore a backup into an empty data directory and database; the server must not run
    Restore(restore::RestoreOptions),
}

#[derive(Args, Debug)]
struct Confirmed {
    /// Do not ask for confirmation
    #[arg(long)]
    yes: bool,
    #[command(flatten)]
    reason: Reason,
}

#[derive(Args, Debug)]
struct Id {
    /// Its id, from the list
    id: String,
    #[command(flatten)]
    reason: Reason,
}

/// The rows of a long list.
#[derive(Args, Debug)]
struct Rows {
    /// Only those of this team
    #[arg(long, allow_hyphen_values = true)]
    team: Option<String>,
    /// Only those of this status, such as verified or pending
    #[arg(long)]
    status: Option<String>,
    /// Only those that began, or were uploaded, at this time or later: 2027-05-01T09:30 (UTC), or 90m for 90 minutes ago
    #[arg(long, value_name = "TIME", value_parser = when::unix_ms)]
    since: Option<i64>,
    /// Only those that began, or were uploaded, at this time or earlier
    #[arg(long, value_name = "TIME", value_parser = when::unix_ms)]
    until: Option<i64>,
    /// At most so many; of runs the newest [default: all]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    limit: Option<u32>,
}

impl Rows {
    fn fields(&self) -> Vec<(&'static str, Option<String>)> {
        let number = |value: Option<i64>| value.map(|value| value.to_string());
        vec![
            ("team", self.team.clone()),
            ("status", self.status.clone()),
            ("since_unix_ms", number(self.since)),
            ("until_unix_ms", number(self.until)),
        ]
    }
}

#[derive(Debug, Subcommand)]
enum Team {
    /// Add a team; prints its token, which cannot be shown again
    Add(TeamName),
    /// Add the teams of a CSV file; writes each team's token into a file of its own
    ///
    /// The file has a head: the column `name` or `team`, and `label` for the holder of the token, if there is one. Other columns are ignored. All
    /// errors are printed with their lines before anything is changed. Teams that exist are kept. After an interruption, repeat the
    /// command: it continues.
    Import(import::TeamImportOptions),
    /// List the teams
    List,
    /// Replace a team's token; the old one ends at once
    Rotate(TeamName),
    /// Revoke a team's token
    Revoke(TeamName),
}

#[derive(Debug, Subcommand)]
enum Token {
    /// Create a token; it cannot be shown again
    Add {
        /// Its role
        role: Role,
        /// Its holder, for people; also in the audit of the holder's actions
        #[arg(long, default_value = "", allow_hyphen_values = true)]
        label: String,
    },
    /// List the tokens, without their secrets
    List,
    /// Revoke a token
    Revoke(Id),
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum Role {
    /// May use all these commands
    Organizer,
    /// May watch
    Viewer,
}

#[derive(Debug, Subcommand)]
enum Session {
    /// List the sessions
    List,
    /// Pause a session: its clock and its world stop
    Pause(Id),
    /// Resume a paused session
    Resume(Id),
    /// End a session; an open run is scored
    End(Id),
    /// Void a session and its runs; the team may have another. Requires --reason
    Void(Id),
    /// Make a session longer; an ended session opens again. Negative seconds take granted time back. Requires --reason
    Grant {
        #[command(flatten)]
        id: Id,
        /// Additional time, at most a day; -60 takes a minute of the granted time back
        #[arg(long, allow_negative_numbers = true)]
        seconds: f64,
    },
}

#[derive(Debug, Subcommand)]
enum Run {
    /// List the runs, oldest first
    List {
        #[command(flatten)]
        rows: Rows,
        /// Only runs of this task
        #[arg(long)]
        task: Option<String>,
    },
    /// List the pairs of runs of two teams with the same movements, the greatest common share first
    Similar {
        /// Only pairs with a run of this team
        #[arg(long, allow_hyphen_values = true)]
        team: Option<String>,
        /// Only runs of this task
        #[arg(long)]
        task: Option<String>,
        /// At most so many pairs, at most 1000
        #[arg(long, value_name = "N", default_value_t = 100)]
        limit: u32,
    },
    /// Show a run, and under `similar` other teams' runs with the same movements
    Show {
        /// Its id
        id: String,
    },
    /// Void a run: it counts for nothing, and its time is given back. Requires --reason
    Void(Id),
    /// Undo the void of a run: it counts again, and the time that was given back is taken again. Requires --reason
    Unvoid(Id),
    /// Verify a run again: its status becomes verified or rejected
    Reverify(Id),
    /// Download a run's replay
    Replay {
        /// Its id
        id: String,
        /// A new file to write
        #[arg(long, short, value_name = "FILE")]
        output: PathBuf,
    },
}

#[derive(Debug, Subcommand)]
enum Hand {
    /// List the uploaded hands, oldest first
    List(Rows),
    /// Print a hand's figures, with those of the built-in hands and the limits; draw it from three sides
    Show {
        /// Its id, from the list
        id: String,
        /// File of the drawing; a name that ends in .svg or .png
        #[arg(long, short, value_name = "FILE")]
        output: Option<PathBuf>,
    },
    /// Play a hand in each task with a fixed script that ignores the task: a score then comes from the hand's design
    Try {
        /// Its id, from the list
        id: String,
    },
    /// Approve a hand for official sessions
    Approve(Id),
    /// Bar a hand from official sessions, even if approved before. Requires --reason
    Reject(Id),
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum Table {
    /// Ranks and best runs
    Leaderboard,
    /// All sessions
    Sessions,
    /// All runs, with their seeds
    Runs,
    /// The audit
    Audit,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum Format {
    /// For spreadsheets
    Csv,
    /// For programs
    Json,
}

/// The name of a value on the command line.
fn word<T: ValueEnum>(value: T) -> String {
    value.to_possible_value().map(|value| value.get_name().to_owned()).unwrap_or_default()
}

fn by_name(name: &TeamName) -> Value {
    json!({"team": name.team, "reason": name.reason.reason})
}

fn by_id(field: &str, id: &Id) -> Value {
    json!({field: id.id, "reason": id.reason.reason})
}

/// The pages of the runs, newest first.
const RUNS: Paged =
    Paged { path: "/v1/admin/runs", rows: "runs", cursor: ("run_id", "after"), newest_first: true };
/// The pages of the uploaded hands, oldest first.
const HANDS: Paged =
    Paged { path: "/v1/admin/hands", rows: "hands", cursor: ("hand_id", "after"), newest_first: false };
/// The pages of the audit, oldest first.
const AUDIT: Paged =
    Paged { path: "/v1/admin/audit", rows: "records", cursor: ("seq", "after"), newest_first: false };

/// The request of a command.
enum Request {
    Get(String),
    /// A long list: its pages, the query, and most rows.
    Pages(&'static Paged, Vec<(&'static str, Option<String>)>, Option<u32>),
    Post(String, Value),
    Fetch(String, Option<PathBuf>),
}

impl AdminCommand {
    /// The list that it prints, if any.
    fn list(&self) -> Option<List> {
        match self {
            AdminCommand::Team(Team::List) => Some(List::Teams),
            AdminCommand::Token(Token::List) => Some(List::Tokens),
            AdminCommand::Session(Session::List) => Some(List::Sessions),
            AdminCommand::Run(Run::List { .. }) => Some(List::Runs),
            AdminCommand::Run(Run::Similar { .. }) => Some(List::Similar),
            AdminCommand::Hand(Hand::List(_)) => Some(List::Hands),
            AdminCommand::Audit { .. } => Some(List::Audit),
            _ => None,
        }
    }

    /// The effect that an organizer confirms first, if any.
    fn effect(&self) -> Option<&'static str> {
        let (sure, effect) = match self {
            AdminCommand::Pause(sure) => (sure, "stops the clocks and worlds of all sessions of"),
            AdminCommand::Resume(sure) => (sure, "continues the clocks and worlds of all sessions of"),
            AdminCommand::End(sure) => {
                (sure, "ends all sessions for good, scores their open runs and closes")
            }
            AdminCommand::Reveal(sure) => (sure, "publishes the secret behind the seeds and ends for good"),
            _ => return None,
        };
        (!sure.yes).then_some(effect)
    }

    fn request(&self) -> Request {
        use Request::{Fetch, Get, Pages};
        let get = |path: &str| Get(path.to_owned());
        let post = |action: &str, body: Value| Request::Post(format!("/v1/admin/{action}"), body);
        let why = |reason: &Reason| json!({"reason": reason.reason});
        match self {
            AdminCommand::Status => get("/v1/competition"),
            AdminCommand::Open(reason) => post("competition/open", why(reason)),
            AdminCommand::Close(reason) => post("competition/close", why(reason)),
            AdminCommand::Pause(sure) => post("competition/pause", why(&sure.reason)),
            AdminCommand::Resume(sure) => post("competition/resume", why(&sure.reason)),
            AdminCommand::End(sure) => post("competition/end", why(&sure.reason)),
            AdminCommand::Reveal(sure) => post("competition/reveal", why(&sure.reason)),
            AdminCommand::Announce { text, reason } => {
                post("announcement", json!({"text": text, "reason": reason.reason}))
            }
            AdminCommand::Team(Team::Add(name)) => post("team/add", by_name(name)),
            // It sends several requests.
            AdminCommand::Team(Team::Import(_)) | AdminCommand::Team(Team::List) => get("/v1/admin/teams"),
            AdminCommand::Team(Team::Rotate(name)) => post("team/rotate", by_name(name)),
            AdminCommand::Team(Team::Revoke(name)) => post("team/revoke", by_name(name)),
            AdminCommand::Token(Token::Add { role, label }) => {
                post("token/add", json!({"role": word(*role), "label": label}))
            }
            AdminCommand::Token(Token::List) => get("/v1/admin/tokens"),
            AdminCommand::Token(Token::Revoke(id)) => post("token/revoke", by_id("token_id", id)),
            AdminCommand::Session(Session::List) => get("/v1/sessions"),
            AdminCommand::Session(Session::Pause(id)) => post("session/pause", by_id("session_id", id)),
            AdminCommand::Session(Session::Resume(id)) => post("session/resume", by_id("session_id", id)),
            AdminCommand::Session(Session::End(id)) => post("session/end", by_id("session_id", id)),
            AdminCommand::Session(Session::Void(id)) => post("session/void", by_id("session_id", id)),
            AdminCommand::Session(Session::Grant { id, seconds }) => {
                let mut body = by_id("session_id", id);
                body["seconds"] = json!(seconds);
                post("session/grant", body)
            }
            AdminCommand::Run(Run::List { rows, task }) => {
                let mut fields = rows.fields();
                fields.push(("task", task.clone()));
                Pages(&RUNS, fields, rows.limit)
            }
            AdminCommand::Run(Run::Similar { team, task, limit }) => Get(client::with_query(
                "/v1/admin/similar",
                &[("team", team.clone()), ("task", task.clone()), ("limit", Some(limit.to_string()))],
            )),
            AdminCommand::Run(Run::Show { id }) => Get(format!("/v1/runs/{}", client::escaped(id))),
            AdminCommand::Run(Run::Void(id)) => post("run/void", by_id("run_id", id)),
            AdminCommand::Run(Run::Unvoid(id)) => post("run/unvoid", by_id("run_id", id)),
            AdminCommand::Run(Run::Reverify(id)) => post("run/reverify", by_id("run_id", id)),
            AdminCommand::Run(Run::Replay { id, output }) => {
                Fetch(format!("/v1/runs/{}/replay", client::escaped(id)), Some(output.clone()))
            }
            AdminCommand::Hand(Hand::List(rows)) => Pages(&HANDS, rows.fields(), rows.limit),
            AdminCommand::Hand(Hand::Show { id, .. } | Hand::Try { id }) => {
                Get(format!("/v1/admin/hands/{}", client::escaped(id)))
            }
            AdminCommand::Hand(Hand::Approve(id)) => post("hand/approve", by_id("hand_id", id)),
            AdminCommand::Hand(Hand::Reject(id)) => post("hand/reject", by_id("hand_id", id)),
            AdminCommand::Export { what, format, output } => {
                Fetch(format!("/v1/admin/export/{}?format={}", word(*what), word(*format)), output.clone())
            }
            AdminCommand::Audit { after } => {
                Pages(&AUDIT, vec![("after", after.map(|after| after.to_string()))], None)
            }
            AdminCommand::Backup { file } => Fetch("/v1/admin/backup".into(), Some(file.clone())),
            // Handled before: a restore needs no server, and the schedule has its own form.
            AdminCommand::Restore(_) | AdminCommand::Schedule(_) => get("/v1/competition"),
        }
    }
}

/// Runs the command.
pub(crate) fn admin(options: &AdminOptions) -> anyhow::Result<()> {
    if let AdminCommand::Restore(options) = &options.command {
        return restore::restore(options);
    }
    let client = Client::new(&options.access)?;
    let json = options.json;
    match &options.command {
        AdminCommand::Hand(Hand::Show { id, output }) => {
            return hand::show(&client, id, output.as_deref(), json);
        }
        AdminCommand::Schedule(command) => return schedule::schedule(&client, command, json),
        AdminCommand::Team(Team::Import(options)) => return import::import(&client, options, json),
        AdminCommand::Hand(Hand::Try { id }) => return hand::attempt(&client, id, json),
        AdminCommand::Hand(Hand::Approve(id)) => hand::warn(&client, &id.id)?,
        _ => {}
    }
    if let Some(effect) = options.command.effect() {
        confirm(&client, effect)?;
    }
    let answer = match options.command.request() {
        Request::Get(path) => client.get(&path)?,
        Request::Pages(list, fields, limit) => client.pages(list, fields, limit)?,
        Request::Post(path, body) => client.post(&path, &body)?,
        Request::Fetch(path, None) => {
            let mut out = std::io::stdout().lock();
            client.fetch(&path, &mut out)?;
            return out.flush().context("cannot write to stdout");
        }
        Request::Fetch(path, Some(file)) => return fetch_into(&client, &path, &file, &options.command),
    };
    let text = match options.command.list() {
        Some(list) if !json => list.table(&answer),
        _ => table::json(&answer) + "\n",
    };
    write!(std::io::stdout().lock(), "{text}").context("cannot write to stdout")
}

/// Asks for the competition's name at the terminal.
fn confirm(client: &Client, effect: &str) -> anyhow::Result<()> {
    let competition = client.get("/v1/competition")?;
    let name = competition["name"].as_str().unwrap_or_default();
    let shown = printable(name);
    if !std::io::stdin().is_terminal() {
        bail!("this {effect} `{shown}`; there is no terminal for a confirmation: repeat it with --yes");
    }
    eprint!("This {effect} `{shown}`.\nType the competition's name to go on: ");
    let mut typed = String::new();
    std::io::stdin().read_line(&mut typed).context("cannot read the answer")?;
    if typed.trim() != name.trim() {
        bail!("`{}` is not its name; nothing was changed", printable(typed.trim()));
    }
    Ok(())
}

/// Downloads into a new file that only its owner can read. An incomplete file is removed.
fn fetch_into(
    client: &Client,
    path: &str,
    file: &std::path::Path,
    command: &AdminCommand,
) -> anyhow::Result<()> {
    let mut options = std::fs::OpenOptions::new();
    options.write(true).create_new(true);
    #[cfg(unix)]
    std::os::unix::fs::OpenOptionsExt::mode(&mut options, 0o600);
    let mut new =
        options.open(file).with_context(|| format!("cannot create the new file {}", file.display()))?;
    let fetched = client.fetch(path, &mut new).and_then(|()| {
        new.sync_all()?;
        // The directory of a ZIP archive is at its end: an incomplete archive has none.
        if matches!(command, AdminCommand::Backup { .. })
            && zip::ZipArchive::new(std::fs::File::open(file)?).is_err()
        {
            bail!("the backup is incomplete");
        }
        Ok(())
    });
    if fetched.is_err() {
        std::fs::remove_file(file).with_context(|| format!("cannot remove {}", file.display()))?;
    }
    fetched?;
    eprintln!("{} written", file.display());
    Ok(())
}
