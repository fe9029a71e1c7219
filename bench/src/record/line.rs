//! The line of a page.
//!
//! `Engine b63c2a96….388b679f…; hand softhand 0123456789ab; task balls 0123456789ab; commit 0123456789; 2026-11-27; machine.`

use std::collections::BTreeMap;
use std::fmt;
use std::str::FromStr;

/// Word with which it begins.
const BEGIN: &str = "Engine ";
const COMMIT: &str = "commit ";

/// The first line of a page: its engine and its models.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Line {
    /// The engine's fingerprint.
    pub engine: String,
    /// Hashes of hands, tasks and controllers, by name.
    pub models: BTreeMap<String, String>,
    /// The commit.
    pub commit: String,
    /// The day.
    pub date: String,
    /// The machine in words.
    pub machine: String,
}

/// A line that begins as a record and is none.
#[derive(Debug, thiserror::Error, PartialEq, Eq)]
#[error(
    "`{line}`: {reason}; a record is `Engine FINGERPRINT; hand NAME HASH; …; commit HASH; YYYY-MM-DD; machine.`"
)]
pub struct BadLine {
    line: String,
    reason: String,
}

impl Line {
    /// The records of a page with the headings above them. In TOML they are comments.
    ///
    /// # Errors
    /// A line begins as a record and is none.
    pub fn all_of(page: &str) -> Result<Vec<(String, Line)>, BadLine> {
        let mut heading = String::new();
        let mut found = Vec::new();
        for line in page.lines() {
            let record = line.strip_prefix("# ").unwrap_or(line);
            if record.starts_with(BEGIN) {
                found.push((heading.clone(), record.parse()?));
            } else if line.starts_with('#') {
                heading = line.trim_start_matches(['#', ' ']).to_owned();
            }
        }
        Ok(found)
    }

    /// The changes since: `engine`, or names of models.
    pub fn changed(&self, engine: &str, models: &BTreeMap<String, String>) -> Vec<String> {
        let mut changed = Vec::new();
        if self.engine != engine {
            changed.push("engine".to_owned());
        }
        let other = |(name, hash): &(&String, &String)| self.models.get(*name) != Some(*hash);
        changed.extend(models.iter().filter(other).map(|(name, _)| name.clone()));
        changed
    }
}

impl fmt::Display for Line {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{BEGIN}{}; ", self.engine)?;
        for (name, hash) in &self.models {
            write!(f, "{name} {hash}; ")?;
        }
        write!(f, "{COMMIT}{}; {}; {}.", self.commit, self.date, self.machine)
    }
}

impl FromStr for Line {
    type Err = BadLine;

    fn from_str(line: &str) -> Result<Self, BadLine> {
        let bad = |reason: String| BadLine { line: line.to_owned(), reason };
        let parts: Vec<&str> =
            line.strip_prefix(BEGIN).unwrap_or_default().trim_end_matches('.').split("; ").collect();
        let [engine, models @ .., commit, date, machine] = parts.as_slice() else {
            return Err(bad(format!("{} parts between semicolons, at least 4 are needed", parts.len())));
        };
        let hex = |text: &str| !text.is_empty() && text.chars().all(|c| c.is_ascii_hexdigit());
        if !engine.split('.').all(hex) {
            return Err(bad(format!("`{engine}` is no fingerprint")));
        }
        let mut hashes = BTreeMap::new();
        for model in models {
            let Some((name, hash)) = model.rsplit_once(' ').filter(|(_, hash)| hex(hash)) else {
                return Err(bad(format!("`{model}` has no hash")));
            };
            hashes.insert(name.to_owned(), hash.to_owned());
        }
        let Some(commit) = commit.strip_prefix(COMMIT) else {
            return Err(bad(format!("`{commit}` is no commit")));
        };
        let day = date.split('-').map(str::len).eq([4, 2, 2]);
        if !day || !date.chars().all(|c| c.is_ascii_digit() || c == '-') {
            return Err(bad(format!("`{date}` is no day")));
        }
        Ok(Line {
            engine: (*engine).to_owned(),
            models: hashes,
            commit: commit.to_owned(),
            date: (*date).to_owned(),
            machine: (*machine).to_owned(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LINE: &str = "Engine 0a.1b; hand softhand 0123456789ab; task balls 00ff; commit 937dc9f6+; 2026-11-27; AMD EPYC, 2 threads.";

    #[test]
    fn a_line_is_read() {
        let line: Line = LINE.parse().expect("a record");
        assert_eq!(line.to_string(), LINE);
        assert_eq!((&*line.engine, &*line.commit, &*line.date), ("0a.1b", "937dc9f6+", "2026-11-27"));
        assert_eq!(line.models["hand softhand"], "0123456789ab");
        assert_eq!(line.machine, "AMD EPYC, 2 threads");
    }

    #[test]
    fn a_bad_line_says_what_is_wrong() {
        for (from, to, reason) in [
            ("0a.1b", "0a.?", "`0a.?` is no fingerprint"),
            ("0123456789ab", "soft", "`hand softhand soft` has no hash"),
            ("commit 9", "9", "`937dc9f6+` is no commit"),
            ("2026-11-27", "27 November", "`27 November` is no day"),
            ("; 2026-11-27; ", ", ", "3 parts"),
        ] {
            let error = LINE.replace(from, to).parse::<Line>();
            let text = error.map_err(|error| error.to_string()).expect_err(to);
            assert!(text.contains(reason) || to == ", ", "{to}: {text}");
        }
    }

    #[test]
    fn a_page_has_a_record_for_each_part() {
        let page = format!("# Throughput\n\n{LINE}\n\n## Engine room\n\n# With a server beside\n\n{LINE}\n");
        let headings: Vec<String> =
            Line::all_of(&page).expect("records").into_iter().map(|(heading, _)| heading).collect();
        assert_eq!(headings, ["Throughput", "With a server beside"]);
        assert_eq!(Line::all_of(&format!("# {LINE}\n[softhand]\n")).expect("a comment").len(), 1);
        assert!(Line::all_of("Engine unknown.\n").is_err());
    }

    #[test]
    fn what_has_changed_is_named() {
        let line: Line = LINE.parse().expect("a record");
        assert!(line.changed("0a.1b", &line.models).is_empty());
        let mut models = line.models.clone();
        models.insert("hand softhand".into(), "ffff".into());
        models.insert("controllers".into(), "ffff".into());
        assert_eq!(line.changed("0a.2c", &models), ["engine", "controllers", "hand softhand"]);
    }
}
