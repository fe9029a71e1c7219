//! Times of options: a moment in UTC, or a time before now.

use jiff::Timestamp;
use jiff::civil::DateTime;
use jiff::tz::TimeZone;
use std::str::FromStr;

/// Reads a time as ms since 1970: `2027-05-01T09:30`, `2027-05-01`, both in UTC, or `90m` for 90 minutes ago.
pub(crate) fn unix_ms(text: &str) -> Result<i64, String> {
    before(text, Timestamp::now().as_millisecond()).or_else(|| moment(text)).ok_or_else(|| {
        "expected a time in UTC, such as 2027-05-01T09:30, or a time before now: 30s, 90m, 2h, 3d".to_owned()
    })
}

fn before(text: &str, now_ms: i64) -> Option<i64> {
    let text = text.trim();
    let unit_ms = match text.chars().last()? {
        's' => 1000,
        'm' => 60_000,
        'h' => 3_600_000,
        'd' => 86_400_000,
        _ => return None,
    };
    let count: u32 = text[..text.len() - 1].parse().ok()?;
    now_ms.checked_sub(i64::from(count).checked_mul(unit_ms)?)
}

fn moment(text: &str) -> Option<i64> {
    let text = text.trim();
    let timestamp = Timestamp::from_str(text).ok().or_else(|| {
        let local = DateTime::from_str(text).ok()?;
        Some(TimeZone::UTC.to_ambiguous_zoned(local).compatible().ok()?.timestamp())
    });
    Some(timestamp?.as_millisecond())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_time_is_a_moment_in_utc_or_before_now() {
        for text in [
            "2026-11-21T05:22:40Z",
            "2026-11-21T05:22:40",
            "2026-11-21 05:22:40",
            "2026-11-21T06:22:40+01:00",
        ] {
            assert_eq!(unix_ms(text), Ok(1_795_238_560_000), "{text}");
        }
        assert_eq!(unix_ms("2026-11-21T05:22"), Ok(1_795_238_520_000));
        assert_eq!(unix_ms("2026-11-21"), Ok(1_795_219_200_000));
        assert_eq!(before("90m", 10_000_000), Some(4_600_000));
        assert_eq!(before("2d", 0), Some(-172_800_000));
        for text in ["", "m", "-3m", "yesterday", "2026-13-01", "3w"] {
            assert!(unix_ms(text).is_err_and(|why| why.contains("90m")), "{text}");
        }
    }
}
