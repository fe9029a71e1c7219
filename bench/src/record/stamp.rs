//! The record of a page that this program measures.

use super::line::Line;
use super::models::{models, root};
use super::pages::{self, RecordError};
use crate::machine::{self, Machine};
use palmares_tasks::identity;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Today's day, UTC.
pub fn today() -> String {
    jiff::Timestamp::now().strftime("%Y-%m-%d").to_string()
}

/// The fields of a JSON.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Record {
    /// The engine's fingerprint: results of the reference runs, joined by dots.
    pub engine: String,
    /// The first digits of the content hashes of hands, tasks and controllers. Pages from before the record have none.
    #[serde(default)]
    pub models: BTreeMap<String, String>,
    /// Commit of the repository; ends in `+` if files were changed.
    pub commit: String,
    /// Day, UTC.
    pub date: String,
    /// The machine.
    pub machine: Machine,
}

impl Record {
    /// That of a page that this program measures now.
    ///
    /// # Errors
    /// There is no such part, or a model that it names is not built in or cannot be read.
    pub fn now(part: &str) -> Result<Self, RecordError> {
        let part = pages::part(part)?;
        Ok(Record {
            engine: identity::fingerprint(),
            models: models(&part, &root())?,
            commit: machine::commit(),
            date: today(),
            machine: Machine::here(),
        })
    }

    /// As a line of a page.
    pub fn line(&self) -> Line {
        let Machine { processor, threads, system, .. } = &self.machine;
        Line {
            engine: self.engine.clone(),
            models: self.models.clone(),
            commit: self.commit.clone(),
            date: self.date.clone(),
            machine: format!("{processor}, {threads} threads, {system}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_line_of_a_record_is_read_as_it_is_written() {
        let record = Record::now("controllers").expect("a part");
        let line = record.line();
        assert_eq!(line.to_string().parse::<Line>().expect("a line"), line);
        let kinds: Vec<&str> = record.models.keys().filter_map(|name| name.split(' ').next()).collect();
        for kind in ["hand", "task", "controllers"] {
            assert!(kinds.contains(&kind), "{kind}: {kinds:?}");
        }
    }
}
