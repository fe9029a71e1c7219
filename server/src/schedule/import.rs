//! Reads a schedule from a CSV file.

use crate::store::Slot;

/// The columns of the file.
const COLUMNS: [&str; 3] = ["team", "begins_at", "ends_at"];
/// Largest number of slots.
const MAX_SLOTS: usize = 100_000;

/// A moment with its offset from UTC, such as `2027-05-04T09:00:00+02:00` or `2027-05-04 09:00+02:00`, in ms since 1970 UTC.
///
/// # Errors
/// It is not such a text.
pub(crate) fn moment(text: &str) -> Result<i64, String> {
    palmares_protocol::unix_ms(text.trim()).ok_or_else(|| {
        format!("`{text}`: expected a time with its offset from UTC, such as 2027-05-04T09:00:00+02:00")
    })
}

/// The slots of a CSV file with the columns `team`, `begins_at` and `ends_at`, in any order; commas or semicolons separate them.
///
/// # Errors
/// A line is not a slot; the text names the line.
pub(crate) fn from_csv(text: &str) -> Result<Vec<Slot>, String> {
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let head = text.lines().next().unwrap_or_default();
    let delimiter = if head.contains(';') { b';' } else { b',' };
    let mut reader =
        csv::ReaderBuilder::new().delimiter(delimiter).trim(csv::Trim::All).from_reader(text.as_bytes());
    let headers = reader.headers().map_err(|error| format!("line 1: {error}"))?.clone();
    let column = |name: &str| {
        let place = headers.iter().position(|header| header == name);
        place.ok_or_else(|| format!("line 1: no column `{name}`; expected {}", COLUMNS.join(",")))
    };
    let [team, begins, ends] = [column(COLUMNS[0])?, column(COLUMNS[1])?, column(COLUMNS[2])?];
    if let Some(other) = headers.iter().find(|header| !COLUMNS.contains(header)) {
        return Err(format!("line 1: unknown column `{other}`; expected {}", COLUMNS.join(",")));
    }
    let mut slots = Vec::new();
    for record in reader.records() {
        let record = record.map_err(|error| error.to_string())?;
        let line = record.position().map_or(0, csv::Position::line);
        let field = |place: usize| record.get(place).unwrap_or_default();
        let time = |place: usize, name: &str| {
            moment(field(place)).map_err(|error| format!("line {line}: {name}: {error}"))
        };
        let slot = Slot {
            begins_unix_ms: time(begins, COLUMNS[1])?,
            team: field(team).to_owned(),
            ends_unix_ms: time(ends, COLUMNS[2])?,
        };
        if slot.ends_unix_ms <= slot.begins_unix_ms {
            return Err(format!("line {line}: the slot of {} ends before it begins", slot.team));
        }
        if slots.len() == MAX_SLOTS {
            return Err(format!("line {line}: more than {MAX_SLOTS} slots"));
        }
        slots.push(slot);
    }
    if slots.is_empty() {
        return Err("the file has no slot; `schedule clear` removes all".to_owned());
    }
    Ok(slots)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_read_with_either_separator_and_any_order_of_columns() {
        let commas = "team,begins_at,ends_at\ncrabs,2027-05-04T09:00:00+02:00,2027-05-04T07:40:00Z\n";
        let semicolons =
            "\u{feff}ends_at; team ;begins_at\r\n2027-05-04 09:40+02:00;\"crabs\";2027-05-04T07:00Z\r\n";
        for text in [commas, semicolons] {
            let slots = from_csv(text).expect("a schedule");
            let length_s = (slots[0].ends_unix_ms - slots[0].begins_unix_ms) / 1000;
            assert_eq!((slots.len(), slots[0].team.as_str(), length_s), (1, "crabs", 2400), "{text}");
        }
    }

    #[test]
    fn an_error_names_the_line_and_a_valid_form() {
        let head = "team,begins_at,ends_at\n";
        for (text, part) in [
            ("", "no column `team`"),
            ("team,begins_at,end\n", "no column `ends_at`"),
            ("team,begins_at,ends_at,task\n", "unknown column `task`"),
            (head, "no slot"),
            (&format!("{head}crabs,2027-05-04T09:00:00,2027-05-04T10:00:00Z\n"), "line 2: begins_at"),
            (&format!("{head}crabs,2027-05-04T09:00Z,noon\n"), "line 2: ends_at: `noon`: expected a time"),
            (&format!("{head}crabs,2027-05-04T09:00Z,2027-05-04T09:00Z\n"), "ends before it begins"),
            (&format!("{head}crabs,2027-05-04T09:00Z\n"), "line: 2"),
        ] {
            let error = from_csv(text).expect_err(text);
            assert!(error.contains(part), "{text}: {error}");
        }
    }
}
