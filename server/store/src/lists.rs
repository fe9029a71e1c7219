//! Lists for organizers, by page: runs and hands of a team, a task, a status or a time.

use super::database::Store;
use super::error::StoreError;
use super::hands::HandRow;
use super::runs::RunRecord;
use sqlx::any::AnyRow;
use sqlx::{AssertSqlSafe, FromRow};

/// The rows of a list. A field that is None lets all rows pass.
#[derive(Clone, Debug, Default)]
pub struct ListFilter {
    /// Their team.
    pub team: Option<String>,
    /// Their task; of runs.
    pub task: Option<String>,
    /// Their status.
    pub status: Option<String>,
    /// The earliest begin of a run or upload of a hand, ms since 1970.
    pub since_unix_ms: Option<i64>,
    /// The latest one.
    pub until_unix_ms: Option<i64>,
    /// The last row of the page before: its id.
    pub after: Option<String>,
    /// Most rows.
    pub limit: u32,
}

/// Rows of a list, and whether there are more.
pub(crate) type Page<T> = (Vec<T>, bool);

impl Store {
    /// Runs, newest first.
    pub async fn list_runs(&self, filter: &ListFilter) -> Result<Page<RunRecord>, StoreError> {
        let (mut runs, more): Page<RunRecord> =
            self.list("runs", "run_id", "started_at", "DESC", filter).await?;
        let ids: Vec<&str> = runs.iter().map(|run| run.run_id.as_str()).collect();
        let mut similar = self.similar_runs(Some(&ids)).await?;
        for run in &mut runs {
            run.similar = similar.remove(&run.run_id);
        }
        Ok((runs, more))
    }

    /// Uploaded hands, oldest first.
    pub async fn list_hands(&self, filter: &ListFilter) -> Result<Page<HandRow>, StoreError> {
        self.list("hands", "hand_id", "created_at", "ASC", filter).await
    }

    /// The rows of a table in the order of a time, then of their ids.
    async fn list<T>(
        &self,
        table: &str,
        id: &str,
        time: &str,
        order: &str,
        filter: &ListFilter,
    ) -> Result<Page<T>, StoreError>
    where
        T: for<'r> FromRow<'r, AnyRow> + Send + Unpin,
    {
        let mut conditions = Vec::new();
        let mut texts = Vec::new();
        let after = if order == "DESC" { "<" } else { ">" };
        for (value, condition) in [
            (&filter.team, "team = $".to_owned()),
            (&filter.task, "task = $".to_owned()),
            (&filter.status, "status = $".to_owned()),
            (
                &filter.after,
                format!("({time}, {id}) {after} (SELECT {time}, {id} FROM {table} WHERE {id} = $"),
            ),
        ] {
            if let Some(value) = value {
                texts.push(value.clone());
                let end = if condition.contains('(') { ")" } else { "" };
                conditions.push(format!("{condition}{}{end}", texts.len()));
            }
        }
        let (count, mut times) = (texts.len(), Vec::new());
        for (value, comparison) in [(filter.since_unix_ms, ">="), (filter.until_unix_ms, "<=")] {
            if let Some(value) = value {
                times.push(value);
                conditions.push(format!("{time} {comparison} ${}", count + times.len()));
            }
        }
        let limited = count + times.len() + 1;
        let which = if conditions.is_empty() { "1 = 1".to_owned() } else { conditions.join(" AND ") };
        let sql = format!(
            "SELECT * FROM {table} WHERE {which} ORDER BY {time} {order}, {id} {order} LIMIT ${limited}"
        );
        let mut query = sqlx::query_as(AssertSqlSafe(sql));
        for text in texts {
            query = query.bind(text);
        }
        for time in times {
            query = query.bind(time);
        }
        let mut rows: Vec<T> = query.bind(i64::from(filter.limit) + 1).fetch_all(&self.pool()).await?;
        let more = rows.len() > filter.limit as usize;
        rows.truncate(filter.limit as usize);
        Ok((rows, more))
    }
}
