//! Times for people.

/// A time in ms since 1970 as ISO 8601, to the second, UTC.
pub fn utc(unix_ms: i64) -> String {
    match jiff::Timestamp::from_second(unix_ms.div_euclid(1000)) {
        Ok(moment) => moment.to_string(),
        // Before or after the calendar.
        Err(_) => format!("{unix_ms} ms since 1970"),
    }
}
