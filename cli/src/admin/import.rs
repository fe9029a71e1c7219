//! `palmares admin team import`: the teams of a CSV file, each with its token in a file of its own.
//!
//! A token file is made before its team, empty. So an interrupted import is completed by the next one: a team with an empty file gets a
//! new token, which replaces one that nobody has.

use super::client::Client;
use anyhow::{Context, anyhow, bail};
use clap::Args;
use palmares_hand_tools::table;
use palmares_protocol::text::printable;
use serde_json::{Value, json};
use std::fmt::Write as _;
use std::fs::{self, File, OpenOptions};
use std::io::{self, ErrorKind, Write};
use std::path::{Path, PathBuf};

/// Longest name of a token file, bytes; file systems allow 255.
const MAX_FILE_NAME: usize = 200;

/// Characters of a token: `plm_`, 16 digits of its id, `_`, 64 digits of its secret.
const TOKEN_LENGTH: usize = 85;

/// Options of the import.
#[derive(Args, Debug)]
pub(crate) struct TeamImportOptions {
    /// The CSV file
    file: PathBuf,

    /// Directory for the tokens, created if it is missing: NAME.token for each team, readable by you only
    #[arg(long, value_name = "DIR")]
    tokens: PathBuf,

    /// The reason, for the audit
    #[arg(long, allow_hyphen_values = true)]
    reason: Option<String>,
}

/// A row of the file.
#[derive(Clone, Debug, PartialEq)]
struct ImportRow {
    line: u64,
    team: String,
    label: String,
}

/// A line of the file with a problem.
type Problem = (u64, String);

/// The change to a team.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Step {
    Add,
    /// It was added by an import that was interrupted before its token was written.
    Complete,
    /// It exists, and so does its token file.
    Keep,
    /// It exists, without a token file here.
    KeepWithoutFile,
}

impl Step {
    fn word(self) -> &'static str {
        match self {
            Step::Add => "added",
            Step::Complete => "completed",
            Step::Keep => "kept",
            Step::KeepWithoutFile => "kept, no token file; `team rotate` makes a new token",
        }
    }
}

/// Adds the teams of the file.
pub(crate) fn import(client: &Client, options: &TeamImportOptions, as_json: bool) -> anyhow::Result<()> {
    let TeamImportOptions { file, tokens, reason } = options;
    let bytes = fs::read(file).with_context(|| format!("cannot read {}", file.display()))?;
    let (rows, mut problems) = rows(&bytes);
    let teams: Vec<Value> = rows.iter().map(|row| json!({"team": row.team, "label": row.label})).collect();
    let checked = client.post("/v1/admin/team/check", &json!({"teams": teams}))?["teams"].take();
    let mut planned = Vec::new();
    for (row, checked) in rows.into_iter().zip(checked.as_array().into_iter().flatten()) {
        match checked["problem"].as_str() {
            Some(why) => problems.push((row.line, format!("`{}`: {why}", row.team))),
            None => {
                // As the server stores it.
                let team = checked["team"].as_str().unwrap_or(&row.team).to_owned();
                match plan(&team, checked["exists"] == true, tokens) {
                    Ok((path, step)) => planned.push((ImportRow { team, ..row }, path, step)),
                    Err(why) => problems.push((row.line, format!("`{team}`: {why}"))),
                }
            }
        }
    }
    if !problems.is_empty() {
        problems.sort();
        let count = problems.len();
        let mut message = format!("{count} error{}; nothing was changed:", if count == 1 { "" } else { "s" });
        for (line, why) in &problems {
            let _ = write!(message, "\n{}:{line}: {}", file.display(), printable(why));
        }
        bail!(message);
    }
    create_private(tokens).with_context(|| format!("cannot create {}", tokens.display()))?;
    for (done, (row, path, step)) in planned.iter().enumerate() {
        carry_out(client, row, path, *step, reason.as_deref()).with_context(|| {
            let of = planned.len();
            format!(
                "line {}, `{}`: {done} of {of} teams are done; repeat the command, it continues",
                row.line, row.team
            )
        })?;
    }
    let out = |path: &Path, step: Step| match step {
        Step::KeepWithoutFile => Value::Null,
        _ => path.display().to_string().into(),
    };
    let text = if as_json {
        let teams = planned.iter().map(
            |(row, path, step)| json!({"team": row.team, "result": step.word(), "file": out(path, *step)}),
        );
        table::json(&json!({"teams": teams.collect::<Vec<_>>()})) + "\n"
    } else {
        let head = ["team", "", "token in"].map(str::to_owned).to_vec();
        let lines = planned.iter().map(|(row, path, step)| {
            vec![
                row.team.clone(),
                step.word().to_owned(),
                out(path, *step).as_str().unwrap_or("-").to_owned(),
            ]
        });
        table::aligned(&std::iter::once(head).chain(lines).collect::<Vec<_>>(), |_| false)
    };
    write!(io::stdout().lock(), "{text}").context("cannot write to stdout")
}

/// The rows of a CSV file with a head, and the lines that have problems.
fn rows(bytes: &[u8]) -> (Vec<ImportRow>, Vec<Problem>) {
    // Spreadsheets write a byte order mark, and semicolons where the comma is a decimal sign.
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    let head = bytes.split(|byte| *byte == b'\n').next().unwrap_or_default();
    let delimiter = if head.contains(&b';') && !head.contains(&b',') { b';' } else { b',' };
    let mut reader = csv::ReaderBuilder::new()
        .has_headers(false)
        .flexible(true)
        .trim(csv::Trim::All)
        .delimiter(delimiter)
        .from_reader(bytes);
    let (mut rows, mut problems, mut columns, mut scheduled) = (Vec::new(), Vec::new(), None, false);
    for record in reader.records() {
        let record = match record {
            Ok(record) => record,
            Err(error) => {
                let line = line_of(bytes, error.position());
                let why = match error.kind() {
                    csv::ErrorKind::Utf8 { .. } => "not UTF-8".to_owned(),
                    _ => error.to_string(),
                };
                problems.push((line, why));
                continue;
            }
        };
        let line = line_of(bytes, record.position());
        let Some((count, name, label)) = columns else {
            let find = |wanted: &str| record.iter().position(|cell| cell.eq_ignore_ascii_case(wanted));
            scheduled = find("name").is_none();
            match find("name").or_else(|| find("team")) {
                Some(name) => columns = Some((record.len(), name, find("label"))),
                None => {
                    let why = "expected a head with the column `name`, and `label` if tokens have labels";
                    return (Vec::new(), vec![(line, why.into())]);
                }
            }
            continue;
        };
        let cell = |column: usize| record.get(column).unwrap_or_default().to_owned();
        if record.iter().all(str::is_empty) {
            continue;
        }
        if record.len() > count {
            let why = format!(
                "it has {} columns, the head {count}; put a cell with a comma into quotes",
                record.len()
            );
            problems.push((line, why));
            continue;
        }
        let row = ImportRow { line, team: cell(name), label: label.map(cell).unwrap_or_default() };
        // A schedule has a team once for each of its slots.
        let again =
            scheduled && rows.iter().any(|had: &ImportRow| had.team == row.team && had.label == row.label);
        if !again {
            rows.push(row);
        }
    }
    if columns.is_none() && problems.is_empty() {
        problems.push((1, "the file is empty; expected a head with the column `name`".into()));
    }
    (rows, problems)
}

/// The line of a record. The reader counts a line that ends with CR LF only in the next record, and does not count empty lines before one.
fn line_of(bytes: &[u8], position: Option<&csv::Position>) -> u64 {
    let begin = position.map_or(0, |position| position.byte() as usize).min(bytes.len());
    let blank = bytes[begin..].iter().take_while(|byte| b"\r\n".contains(byte)).count();
    bytes[..begin + blank].iter().filter(|byte| **byte == b'\n').count() as u64 + 1
}

/// The token file of a team, and what is to do.
fn plan(team: &str, exists: bool, tokens: &Path) -> Result<(PathBuf, Step), String> {
    let name = file_name(team);
    if name.len() > MAX_FILE_NAME {
        return Err(format!(
            "the name is too long for a file; add it with `team add` ({} bytes)",
            name.len()
        ));
    }
    let path = tokens.join(name);
    let content = match fs::read_to_string(&path) {
        Ok(content) => Some(content),
        Err(error) if error.kind() == ErrorKind::NotFound => None,
        Err(error) => return Err(format!("{}: {error}", path.display())),
    };
    let step = match (exists, content.as_deref().map(str::trim)) {
        (true, None) => Step::KeepWithoutFile,
        (true, Some("")) => Step::Complete,
        (false, None | Some("")) => Step::Add,
        (_, Some(token)) if token.len() != TOKEN_LENGTH || !token.starts_with("plm_") => {
            return Err(format!("{} is no token file; remove it, or name another directory", path.display()));
        }
        (true, Some(_)) => Step::Keep,
        (false, Some(_)) => {
            return Err(format!(
                "{} has a token, but there is no such team; name another directory",
                path.display()
            ));
        }
    };
    Ok((path, step))
}

/// The name of a team's token file: what is no letter, digit, space, `-`, `_` or `.` is escaped, and so is a first `.` or `-`.
fn file_name(team: &str) -> String {
    let mut name = String::new();
    for (k, c) in team.char_indices() {
        let plain = c.is_alphanumeric() || " -_.".contains(c);
        if plain && !(k == 0 && ".-".contains(c)) {
            name.push(c);
        } else {
            for byte in c.encode_utf8(&mut [0; 4]).bytes() {
                // Writing to a string cannot fail.
                let _ = write!(name, "%{byte:02X}");
            }
        }
    }
    name + ".token"
}

/// Adds a team, or completes it, and writes its token.
fn carry_out(
    client: &Client,
    row: &ImportRow,
    path: &Path,
    step: Step,
    reason: Option<&str>,
) -> anyhow::Result<()> {
    let action = match step {
        Step::Add => "add",
        Step::Complete => "rotate",
        Step::Keep | Step::KeepWithoutFile => return Ok(()),
    };
    let mut file = private(path).with_context(|| format!("cannot write {}", path.display()))?;
    let body = json!({"team": row.team, "label": row.label, "reason": reason});
    let answer = client.post(&format!("/v1/admin/team/{action}"), &body)?;
    let token = answer["token"].as_str().ok_or_else(|| anyhow!("the response has no token"))?;
    writeln!(file, "{token}")
        .and_then(|()| file.sync_all())
        .with_context(|| format!("cannot write {}", path.display()))
}

/// A file that only its owner can read: a new one, or the empty one of an interrupted import.
fn private(path: &Path) -> io::Result<File> {
    let mut options = OpenOptions::new();
    options.write(true).create(true).truncate(false);
    #[cfg(unix)]
    std::os::unix::fs::OpenOptionsExt::mode(&mut options, 0o600);
    let file = options.open(path)?;
    #[cfg(unix)]
    file.set_permissions(std::os::unix::fs::PermissionsExt::from_mode(0o600))?;
    Ok(file)
}

fn create_private(folder: &Path) -> io::Result<()> {
    if folder.is_dir() {
        return Ok(());
    }
    let mut builder = fs::DirBuilder::new();
    builder.recursive(true);
    #[cfg(unix)]
    std::os::unix::fs::DirBuilderExt::mode(&mut builder, 0o700);
    builder.create(folder)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(line: u64, team: &str, label: &str) -> ImportRow {
        ImportRow { line, team: team.into(), label: label.into() }
    }

    #[test]
    fn the_columns_are_found_by_their_names() {
        let wanted = vec![row(2, "crabs", "Ana"), row(3, "sea, horses", "")];
        for text in [
            "name,label\ncrabs,Ana\n\"sea, horses\",\n",
            "\u{feff}Name;Label\r\ncrabs;Ana\r\nsea, horses;\r\n",
            "country,label,name\nIT, Ana ,crabs\nPE,,\"sea, horses\"\n\n,,\n",
        ] {
            assert_eq!(rows(text.as_bytes()), (wanted.clone(), vec![]), "{text}");
        }
        let spaced = "name\r\n\r\ncrabs\r\n\r\n\r\neels\r\n";
        assert_eq!(rows(spaced.as_bytes()).0, [row(3, "crabs", ""), row(6, "eels", "")]);
        for text in
            ["name\ncrabs\n", "team,begins_at\ncrabs,2027-05-04T09:00:00Z\ncrabs,2027-05-05T09:00:00Z\n"]
        {
            assert_eq!(rows(text.as_bytes()), (vec![row(2, "crabs", "")], vec![]));
        }
    }

    #[test]
    fn every_bad_line_is_found() {
        let (good, problems) = rows(b"name,label\na,b,c\ncrabs,x\n\xff\xfe,y\n\"eels\nor not\",z\nd,e,f\n");
        assert_eq!(good, [row(3, "crabs", "x"), row(5, "eels\nor not", "z")]);
        let lines: Vec<(u64, &str)> = problems.iter().map(|(line, why)| (*line, why.as_str())).collect();
        assert_eq!((lines[0].0, lines[1], lines[2].0), (2, (4, "not UTF-8"), 7), "{problems:?}");
        assert!(lines[0].1.contains("3 columns, the head 2"), "{problems:?}");
        for text in ["", "crabs\neels\n"] {
            let (good, problems) = rows(text.as_bytes());
            assert!(
                good.is_empty() && problems[0].0 == 1 && problems[0].1.contains("`name`"),
                "{problems:?}"
            );
        }
    }

    #[test]
    fn a_team_has_a_file_name_of_its_own() {
        for (team, name) in [
            ("crabs", "crabs.token"),
            ("Team 蟹_2.0", "Team 蟹_2.0.token"),
            ("../../etc", "%2E.%2F..%2Fetc.token"),
            ("-rf", "%2Drf.token"),
            ("a%2F", "a%252F.token"),
            ("50% < 3", "50%25 %3C 3.token"),
        ] {
            assert_eq!(file_name(team), name);
        }
    }
}
