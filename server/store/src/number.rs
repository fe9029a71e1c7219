//! Numbers of the database: times in ms since 1970, signed integers.

use std::time::{SystemTime, UNIX_EPOCH};

/// Now, in ms since 1970 UTC.
pub fn unix_ms() -> i64 {
    let since = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
    i64::try_from(since.as_millis()).unwrap_or(i64::MAX)
}

/// A number as a signed SQL integer; it saturates.
pub(super) fn signed(number: u64) -> i64 {
    i64::try_from(number).unwrap_or(i64::MAX)
}
