//! Reads a schedule from a CSV file.

use palmares_protocol::{Code, utc};
use palmares_store::Slot;
use std::collections::BTreeSet;

/// The columns of the file.
const COLUMNS: [&str; 3] = ["team", "begins_at", "ends_at"];
/// Largest number of slots.
const MAX_SLOTS: usize = 100_000;
/// Most errors that are named.
const MAX_LISTED: usize = 50;

/// A line of the file, and what is wrong with it.
type Error = (u64, String);

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
/// A line is not a slot of a `known` team, or two slots of a team overlap; the text names every such line.
pub(crate) fn from_csv(text: &str, known: &BTreeSet<String>) -> Result<Vec<Slot>, (Code, String)> {
    let (slots, mut errors) = lines(text).map_err(|error| (Code::BadRequest, error))?;
    let unknown = slots.iter().filter(|(_, slot)| !known.contains(&slot.team));
    let unknown: Vec<_> = unknown
        .map(|(line, slot)| (*line, format!("no team {}; `team list` shows the teams", slot.team)))
        .collect();
    let mut of_team: Vec<_> = slots.iter().collect();
    of_team.sort_by(|(_, a), (_, b)| (&a.team, a.begins_unix_ms).cmp(&(&b.team, b.begins_unix_ms)));
    for pair in of_team.windows(2) {
        let [(before, one), (line, next)] = pair else { continue };
        if one.team == next.team && next.begins_unix_ms < one.ends_unix_ms {
            let (from, to) = (utc(one.begins_unix_ms), utc(one.ends_unix_ms));
            let text = format!("two slots of {} overlap: line {before} has {from} to {to}", one.team);
            errors.push((*line, text));
        }
    }
    let code = if errors.is_empty() { Code::NotFound } else { Code::BadRequest };
    errors.extend(unknown);
    errors.sort();
    if !errors.is_empty() {
        return Err((code, listed(&errors)));
    }
    if slots.is_empty() {
        return Err((Code::BadRequest, "the file has no slot; `schedule clear` removes all".to_owned()));
    }
    Ok(slots.into_iter().map(|(_, slot)| slot).collect())
}

/// Slots with the numbers of their lines, and what is wrong with the others.
type Lines = (Vec<(u64, Slot)>, Vec<Error>);

/// The lines that are slots, and the errors of the others.
///
/// # Errors
/// The head is not that of a schedule.
fn lines(text: &str) -> Result<Lines, String> {
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
    let (mut slots, mut errors) = (Vec::new(), Vec::new());
    for record in reader.records() {
        let record = match record {
            Ok(record) => record,
            Err(error) => {
                let line = error.position().map_or(0, csv::Position::line);
                errors.push((line, error.to_string()));
                continue;
            }
        };
        let line = record.position().map_or(0, csv::Position::line);
        if slots.len() == MAX_SLOTS {
            errors.push((line, format!("more than {MAX_SLOTS} slots")));
            break;
        }
        let field = |place: usize| record.get(place).unwrap_or_default();
        let mut time = |place: usize, name: &str| {
            let found = moment(field(place)).map_err(|error| format!("{name}: {error}"));
            found.map_err(|error| errors.push((line, error))).ok()
        };
        let (Some(begins_unix_ms), Some(ends_unix_ms)) = (time(begins, COLUMNS[1]), time(ends, COLUMNS[2]))
        else {
            continue;
        };
        let slot = Slot { begins_unix_ms, team: field(team).to_owned(), ends_unix_ms };
        if slot.ends_unix_ms <= slot.begins_unix_ms {
            errors.push((line, format!("the slot of {} ends before it begins", slot.team)));
        } else {
            slots.push((line, slot));
        }
    }
    Ok((slots, errors))
}

/// One error, or the number of them and a line for each of the first.
fn listed(errors: &[Error]) -> String {
    let said = |(line, error): &Error| format!("line {line}: {error}");
    match errors {
        [one] => said(one),
        _ => {
            let first = errors.iter().take(MAX_LISTED).map(|error| format!("\n{}", said(error)));
            let others = errors.len().saturating_sub(MAX_LISTED);
            let more = if others > 0 { format!("\nand {others} more") } else { String::new() };
            format!("{} errors:{}{more}", errors.len(), first.collect::<String>())
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<Vec<Slot>, (Code, String)> {
        from_csv(text, &["crabs", "eels", "squids"].map(str::to_owned).into())
    }

    #[test]
    fn a_file_is_read_with_either_separator_and_any_order_of_columns() {
        let commas = "team,begins_at,ends_at\ncrabs,2027-05-04T09:00:00+02:00,2027-05-04T07:40:00Z\n";
        let semicolons =
            "\u{feff}ends_at; team ;begins_at\r\n2027-05-04 09:40+02:00;\"crabs\";2027-05-04T07:00Z\r\n";
        for text in [commas, semicolons] {
            let slots = read(text).expect("a schedule");
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
            let (code, error) = read(text).expect_err(text);
            assert!(code == Code::BadRequest && error.contains(part), "{text}: {error}");
        }
    }

    #[test]
    fn every_bad_line_is_named() {
        let head = "team,begins_at,ends_at\n";
        let slot = "2027-05-04T09:00Z,2027-05-04T10:00Z\n";
        let backwards = "2027-05-04T09:00Z,2027-05-04T08:00Z\n";
        let (code, error) = read(&format!(
            "{head}eels,noon,night\ncrabs,{slot}newts,{slot}crabs,{slot}squids,{backwards}crabs,noon\n"
        ))
        .expect_err("six errors");
        let lines: Vec<&str> = error.lines().collect();
        assert_eq!((code, lines.len(), lines[0]), (Code::BadRequest, 7, "6 errors:"), "{error}");
        for (line, begin) in lines[1..].iter().zip([
            "line 2: begins_at: `noon`",
            "line 2: ends_at: `night`",
            "line 4: no team newts",
            "line 5: two slots of crabs overlap: line 3 has 2027-05-04T09:00:00Z to ",
            "line 6: the slot of squids ends before it begins",
            "line 7: ",
        ]) {
            assert!(line.starts_with(begin), "{error}");
        }
        let unknown = read(&format!("{head}newts,{slot}")).expect_err("no such team");
        assert_eq!(
            unknown,
            (Code::NotFound, "line 2: no team newts; `team list` shows the teams".to_owned())
        );
        let (_, many) =
            read(&format!("{head}{}", "crabs,noon,2027-05-04T08:00Z\n".repeat(60))).expect_err("60");
        assert!(many.starts_with("60 errors:\nline 2: ") && many.ends_with("\nand 10 more"), "{many}");
    }
}
