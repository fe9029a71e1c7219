//! Export and import of all tables for backups, independent of the kind of database.

use super::database::Store;
use super::error::StoreError;
use serde_json::{Map, Number, Value};
use sqlx::any::{AnyRow, AnyTypeInfoKind};
use sqlx::{AssertSqlSafe, Column, Row, TypeInfo, ValueRef};

/// The tables, each after the tables that it refers to.
const TABLES: [&str; 12] = [
    "teams",
    "tokens",
    "slots",
    "hands",
    "audit",
    "settings",
    "announcements",
    "run_counters",
    "sessions",
    "runs",
    "run_paths",
    "alike_runs",
];

/// A table's name and rows.
pub type Table = (String, Vec<Map<String, Value>>);

fn decoding(column: &str, why: String) -> StoreError {
    StoreError::Query(sqlx::Error::ColumnDecode { index: column.to_owned(), source: why.into() })
}

fn json_row(row: &AnyRow) -> Result<Map<String, Value>, StoreError> {
    let mut fields = Map::new();
    for (i, column) in row.columns().iter().enumerate() {
        let raw = row.try_get_raw(i)?;
        let value = match raw.type_info().kind() {
            _ if raw.is_null() => Value::Null,
            AnyTypeInfoKind::BigInt | AnyTypeInfoKind::Integer => Value::from(row.try_get::<i64, _>(i)?),
            AnyTypeInfoKind::Double => Number::from_f64(row.try_get(i)?).map_or(Value::Null, Value::Number),
            AnyTypeInfoKind::Text => Value::from(row.try_get::<String, _>(i)?),
            _ => return Err(decoding(column.name(), format!("type {}", raw.type_info().name()))),
        };
        fields.insert(column.name().to_owned(), value);
    }
    Ok(fields)
}

/// The runs, with the order of their ends, which backups of 0.2.0 do not have.
fn with_order(rows: &[Map<String, Value>]) -> Vec<Map<String, Value>> {
    let mut rows = rows.to_vec();
    if rows.iter().any(|row| row.contains_key("ended_seq")) {
        return rows;
    }
    let mut ended: Vec<&mut Map<String, Value>> =
        rows.iter_mut().filter(|row| row.get("score").is_some_and(|score| !score.is_null())).collect();
    let text =
        |row: &Map<String, Value>| row.get("run_id").and_then(Value::as_str).unwrap_or_default().to_owned();
    ended.sort_by_cached_key(|row| (row.get("ended_at").and_then(Value::as_i64), text(row)));
    for (row, number) in ended.into_iter().zip(1_i64..) {
        row.insert("ended_seq".into(), number.into());
    }
    rows
}

impl Store {
    /// All tables, from one snapshot.
    pub async fn dump(&self) -> Result<Vec<Table>, StoreError> {
        let mut transaction = self.snapshot().await?;
        let mut tables = Vec::new();
        for name in TABLES {
            let query = sqlx::query(AssertSqlSafe(format!("SELECT * FROM {name}")));
            let rows = query.fetch_all(&mut *transaction).await?;
            tables.push((name.to_owned(), rows.iter().map(json_row).collect::<Result<_, _>>()?));
        }
        transaction.commit().await?;
        Ok(tables)
    }

    /// Whether all tables are empty.
    pub async fn is_empty(&self) -> Result<bool, StoreError> {
        Ok(self.dump().await?.iter().all(|(_, rows)| rows.is_empty()))
    }

    /// Fills an empty database, in one transaction. Unknown columns are refused.
    pub async fn fill(&self, tables: &[Table]) -> Result<(), StoreError> {
        let mut transaction = self.write().await?;
        for name in TABLES {
            let rows = tables.iter().find(|(table, _)| table == name).map(|(_, rows)| rows.as_slice());
            let numbered;
            let rows = match rows {
                Some(rows) if name == "runs" => {
                    numbered = with_order(rows);
                    numbered.as_slice()
                }
                rows => rows.unwrap_or_default(),
            };
            for row in rows {
                let mut values = Vec::new();
                let mut bound = 0;
                for (column, value) in row {
                    let word = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_';
                    if column.is_empty() || !column.chars().all(word) {
                        return Err(decoding(column, format!("no column of {name}")));
                    }
                    // NULL is not bound: a bound NULL would need a type.
                    if value.is_null() {
                        values.push("NULL".to_owned());
                    } else {
                        bound += 1;
                        values.push(format!("${bound}"));
                    }
                }
                let columns: Vec<&str> = row.keys().map(String::as_str).collect();
                let (columns, values) = (columns.join(", "), values.join(", "));
                let sql = format!("INSERT INTO {name} ({columns}) VALUES ({values})");
                let mut query = sqlx::query(AssertSqlSafe(sql));
                for (column, value) in row {
                    query = match value {
                        Value::Null => query,
                        Value::String(text) => query.bind(text.clone()),
                        Value::Number(number) => match (number.as_i64(), number.as_f64()) {
                            (Some(whole), _) => query.bind(whole),
                            (None, Some(real)) => query.bind(real),
                            _ => return Err(decoding(column, "number".into())),
                        },
                        _ => return Err(decoding(column, "neither number nor text".into())),
                    };
                }
                query.execute(&mut *transaction).await?;
            }
        }
        transaction.commit().await?;
        Ok(())
    }
}
