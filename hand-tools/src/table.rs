//! Output for people: tables, and JSON without terminal control characters.

use palmares_protocol::text::printable;
use serde_json::Value;
use std::fmt::Write;
use std::io::IsTerminal;
use unicode_width::UnicodeWidthStr;

/// A table: the first column is left-aligned, the others right-aligned.
pub fn table(rows: &[Vec<String>]) -> String {
    aligned(rows, |column| column > 0)
}

/// A table whose columns are right-aligned if `right` returns true, else left-aligned.
pub fn aligned(rows: &[Vec<String>], right: impl Fn(usize) -> bool) -> String {
    let rows: Vec<Vec<_>> = rows.iter().map(|row| row.iter().map(|cell| printable(cell)).collect()).collect();
    let columns = rows.iter().map(Vec::len).max().unwrap_or(0);
    let width =
        |k: usize| rows.iter().filter_map(|row| row.get(k)).map(|cell| cell.width()).max().unwrap_or(0);
    let widths: Vec<usize> = (0..columns).map(width).collect();
    let mut out = String::new();
    for row in &rows {
        let mut line = String::new();
        for (k, cell) in row.iter().enumerate() {
            let space = " ".repeat(widths[k] - cell.width());
            line += &if right(k) { format!("  {space}{cell}") } else { format!("  {cell}{space}") };
        }
        // Writing to a string cannot fail.
        let _ = writeln!(out, "{}", line.trim_end());
    }
    out
}

/// Columns of a terminal, and of a file or a pipe, for which wide tables are wrapped.
const TERMINAL_COLUMNS: usize = 80;
const FILE_COLUMNS: usize = 120;

/// Columns that a table on standard output may have.
pub fn columns() -> Option<usize> {
    Some(if std::io::stdout().is_terminal() { TERMINAL_COLUMNS } else { FILE_COLUMNS })
}

/// Columns of the widest line.
pub fn widest(text: &str) -> usize {
    text.lines().map(UnicodeWidthStr::width).max().unwrap_or(0)
}

/// A table whose columns from `first` on come in groups of `group`. Groups that do not fit into `width` columns go
/// below the others, each time after the first column.
pub fn wrapped(rows: &[Vec<String>], first: usize, group: usize, width: Option<usize>) -> String {
    let whole = table(rows);
    let columns = rows.iter().map(Vec::len).max().unwrap_or(0);
    let Some(width) = width.filter(|width| widest(&whole) > *width && columns > first) else { return whole };
    let part = |columns: &[usize]| -> String {
        let pick = |row: &Vec<String>| columns.iter().filter_map(|k| row.get(*k).cloned()).collect();
        table(&rows.iter().map(pick).collect::<Vec<Vec<String>>>())
    };
    let mut out = String::new();
    let mut now: Vec<usize> = (0..first).collect();
    for start in (first..columns).step_by(group.max(1)) {
        let more = start..columns.min(start + group.max(1));
        let longer: Vec<usize> = now.iter().copied().chain(more.clone()).collect();
        if widest(&part(&longer)) > width && now.len() > 1 {
            out += &part(&now);
            out.push('\n');
            now = std::iter::once(0).chain(more).collect();
        } else {
            now = longer;
        }
    }
    out + &part(&now)
}

/// Indented JSON. Invisible characters in its strings are escaped.
pub fn json(value: &Value) -> String {
    let text = format!("{value:#}");
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        // Outside of strings there is only ASCII.
        if c == '\n' || printable(c.encode_utf8(&mut [0; 4])).len() == c.len_utf8() {
            out.push(c);
        } else {
            for unit in c.encode_utf16(&mut [0; 2]) {
                let _ = write!(out, "\\u{unit:04x}");
            }
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json as value;

    #[test]
    fn tables_line_up() {
        let rows = |rows: &[&[&str]]| -> Vec<Vec<String>> {
            rows.iter().map(|row| row.iter().map(|cell| (*cell).to_owned()).collect()).collect()
        };
        assert_eq!(table(&rows(&[&["a", "1"], &["bcd", "-22"]])), "  a      1\n  bcd  -22\n");
        // A wide character takes two columns, a combining mark none; control characters are written as codes.
        let names = rows(&[&["蟹蟹", "1"], &["e\u{301}", "2"], &["a\u{1b}[2J", "3"]]);
        let lines = ["  蟹蟹          1", "  e\u{301}             2", "  a\\u{001B}[2J  3"];
        assert_eq!(table(&names).lines().collect::<Vec<_>>(), lines);
    }

    #[test]
    fn a_wide_table_is_wrapped_by_groups_of_columns() {
        let row = |name: &str, cell: &str| -> Vec<String> {
            [name, "rad"].into_iter().map(str::to_owned).chain((0..6).map(|k| format!("{cell}{k}"))).collect()
        };
        let rows = [row("joint", "tendon_"), row("a", "0.00")];
        assert_eq!(wrapped(&rows, 2, 2, None), table(&rows));
        assert_eq!(wrapped(&rows, 2, 2, Some(200)), table(&rows));
        let text = wrapped(&rows, 2, 2, Some(40));
        assert_eq!(
            text,
            "  joint  rad  tendon_0  tendon_1\n  a      rad     0.000     0.001\n\n  \
             joint  tendon_2  tendon_3\n  a         0.002     0.003\n\n  \
             joint  tendon_4  tendon_5\n  a         0.004     0.005\n"
        );
        // A column that is too wide alone is not cut.
        assert_eq!(wrapped(&rows, 2, 1, Some(5)).lines().count(), 3 * 7 - 1);
    }

    #[test]
    fn json_with_escapes_has_the_same_value() {
        let hostile = value!({"team": "a\u{202e}b\u{9b}\u{1b}\u{e0041}\n", "n": [1, 2.5], "蟹": "é"});
        let text = json(&hostile);
        assert!(text.contains("a\\u202eb\\u009b\\u001b\\udb40\\udc41\\n") && text.contains("蟹"), "{text}");
        assert_eq!(serde_json::from_str::<Value>(&text).expect("JSON"), hostile);
    }
}
