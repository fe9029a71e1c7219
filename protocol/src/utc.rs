//! Times for people.

/// A time in ms since 1970 as ISO 8601, to the second, UTC.
pub fn utc(unix_ms: i64) -> String {
    match jiff::Timestamp::from_second(unix_ms.div_euclid(1000)) {
        Ok(moment) => moment.to_string(),
        // Before or after the calendar.
        Err(_) => format!("{unix_ms} ms since 1970"),
    }
}

/// A time in ISO 8601 with its offset from UTC, in ms since 1970; None if the text is not one.
pub fn unix_ms(text: &str) -> Option<i64> {
    text.parse::<jiff::Timestamp>().ok().map(jiff::Timestamp::as_millisecond)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_time_needs_its_offset() {
        let noon = Some(1_809_511_200_000);
        for text in ["2027-05-05T10:00:00Z", "2027-05-05T12:00:00+02:00", "2027-05-05 12:00+02"] {
            assert_eq!(unix_ms(text), noon, "{text}");
            assert_eq!(unix_ms(text).map(utc).as_deref(), Some("2027-05-05T10:00:00Z"));
        }
        for text in ["2027-05-05T10:00:00", "2027-05-05", "noon", "", "2027-13-05T10:00:00Z"] {
            assert_eq!(unix_ms(text), None, "{text}");
        }
    }
}
