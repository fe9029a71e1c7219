//! The page of hard cases.

use super::list::HardCase;
use super::peers::{Best, Peers};
use crate::rigs::softhand_in_words;
use crate::sweep::page::{ms, part};
use crate::sweep::reasons::reason;
use crate::sweep::{Point, RANGE_S, Row, bound};
use std::fmt::Write;

/// A hard case from all its starts.
pub(super) struct HardRow {
    /// The case.
    pub(super) hard: &'static HardCase,
    /// Its points from each start.
    pub(super) starts: Vec<Row>,
}

/// Points at the same step are equal to rounding.
fn same_step(a: f64, b: f64) -> bool {
    (a / b - 1.0).abs() < 1e-9
}

impl HardRow {
    /// The farthest of the points that are wanted, with its start.
    fn farthest(&self, wanted: impl Fn(&Row, &Point) -> bool) -> Option<(usize, Point)> {
        let of_start = |(start, row): (usize, &Row)| {
            let points: Vec<(usize, Point)> =
                row.points.iter().filter(|point| wanted(row, point)).map(|point| (start, *point)).collect();
            points
        };
        let all = self.starts.iter().enumerate().flat_map(of_start);
        // Of equal ones the first.
        all.reduce(|most, it| if it.1.of_bound() > most.1.of_bound() { it } else { most })
    }

    /// The farthest that its gate claims.
    fn claimed(&self) -> Option<(usize, Point)> {
        self.farthest(|row, point| row.scene.claims(point.dt_s))
    }

    /// The farthest at a step, and whether its gate claims the step.
    fn at(&self, dt_s: f64) -> Option<(Point, bool)> {
        let claims = self.starts.first()?.scene.claims(dt_s);
        Some((self.farthest(|_, point| same_step(point.dt_s, dt_s))?.1, claims))
    }
}

/// Writes the page: record, explanation, tables.
pub(super) fn page(record: &str, steps_s: &[f64], rows: &[HardRow], peers: &Peers) -> String {
    let beyond = |row: &&HardRow| row.claimed().is_some_and(|(_, point)| point.of_bound() > 1.0);
    let within = rows.len() - rows.iter().filter(beyond).count();
    let (low, high) = (steps_s.first().map_or(0.0, |s| 1e3 * s), steps_s.last().map_or(0.0, |s| 1e3 * s));
    let mut text = format!(
        "# Hard cases\n\nWritten by `palmares-bench hard-cases`; do not edit.\n\n{record}\n\n\
         Each case is played at {} steps from {low} to {high} ms in equal ratios, from up to eight starts. In the other starts every \
         object is up to 0.1 mm aside. The *distance* is the error of the case as a part of its bound: 0 is exact, 1 is at the bound, \
         and more is beyond it. The tables have the worst start. A run that fails, or in which a step does not converge, is beyond.\n\n\
         The bound is that of the gate, a test in `bench/src/gates/` that plays the case at some steps. A case is claimed from the shortest to the longest \
         step of its gate. Distances at other steps are in brackets and count for nothing.\n\n\
         Eight starts are played unless the column says why not. *Exact*: with its objects elsewhere the scene has another answer. \
         *No object*: nothing can be placed elsewhere. *Long*: a run takes more than ten seconds; {}\n\n",
        steps_s.len(),
        long(rows),
    );
    text += "Peers at their best: the longest step at which a committed [report](README.md) says that a run solves the scene, and the \
         smallest error of such a run with its distance to our bound. To solve a scene, the report asks for less than our bound. Where a \
         bound follows from the stiffness of our contacts, as that of an overlap, the distance of a peer says how soft its contacts are. A \
         case that no report has is *not played*.\n\n";
    text += &(softhand_in_words() + "\n\n");
    let _ = writeln!(
        text,
        "{within} of {} cases are within their bounds at every start and every one of these steps that is claimed. [steps.md](steps.md) has \
         fifty steps.\n",
        rows.len()
    );
    text += "| kind | case | what is hard | bound | farthest | at, ms | start | starts | peers at their best | gate, ms |\n\
             |---|---|---|---|---|---|---|---|---|---|\n";
    for row in rows {
        let _ = writeln!(text, "{}", summary(row, peers));
    }
    let reasons: Vec<&HardRow> = rows.iter().filter(beyond).collect();
    if !reasons.is_empty() {
        text += "\n## Beyond a bound\n\n| case | reason |\n|---|---|\n";
        for row in reasons {
            let why = reason(row.hard.case).unwrap_or("not understood");
            let _ = writeln!(text, "| `{}` | {why} |", row.hard.case);
        }
    }
    text += "\n## Distance to the bound at each step, worst start\n\n| case |";
    for dt_s in steps_s {
        let _ = write!(text, " {} ms |", short(1e3 * dt_s));
    }
    text += "\n|---|";
    text += &"---|".repeat(steps_s.len());
    text += "\n";
    for row in rows {
        let _ = write!(text, "| `{}` |", row.hard.case);
        for &dt_s in steps_s {
            let cell = match row.at(dt_s) {
                None => "–".to_owned(),
                Some((point, false)) => format!("({})", part(point.of_bound())),
                Some((point, true)) if point.of_bound() > 1.0 => format!("**{}**", part(point.of_bound())),
                Some((point, true)) => part(point.of_bound()),
            };
            let _ = write!(text, " {cell} |");
        }
        text += "\n";
    }
    text
}

/// The steps that are left out, in words.
fn long(rows: &[HardRow]) -> String {
    let left_out: Vec<String> = rows
        .iter()
        .filter(|row| row.hard.steps_s != RANGE_S)
        .map(|row| {
            let (low, high) = row.hard.steps_s;
            format!("`{}` is played from {} to {} ms.", row.hard.case, 1e3 * low, 1e3 * high)
        })
        .collect();
    if left_out.is_empty() { "no step is left out.".to_owned() } else { left_out.join(" ") }
}

/// A number of ms in at most three digits.
fn short(ms: f64) -> String {
    let digits = if ms < 1.0 {
        2
    } else if ms < 10.0 {
        1
    } else {
        0
    };
    format!("{ms:.digits$}")
}

/// A number in few digits, without needless zeros.
fn number(x: f64) -> String {
    match x.abs() {
        0.0 => "0".to_owned(),
        size if (1e-3..1e5).contains(&size) => {
            let digits = (2 - size.log10().floor() as i32).max(0) as usize;
            let text = format!("{x:.digits$}");
            if text.contains('.') {
                text.trim_end_matches('0').trim_end_matches('.').to_owned()
            } else {
                text
            }
        }
        _ => format!("{x:.1e}"),
    }
}

/// The line of a case.
fn summary(row: &HardRow, peers: &Peers) -> String {
    let HardCase { kind, case, hard, unit, gate, starts, .. } = row.hard;
    let (bound, farthest, at, start) = match row.claimed() {
        Some((start, point)) => {
            let distance = part(point.of_bound());
            let distance = if point.of_bound() > 1.0 { format!("**{distance}**") } else { distance };
            (format!("{} {unit}", number(point.bound)), distance, ms(point.dt_s), start.to_string())
        }
        None => (String::new(), "not claimed at these steps".to_owned(), String::new(), String::new()),
    };
    let (from, to) = row.starts.first().map_or((0.0, 0.0), |row| row.scene.claimed_s);
    let claimed =
        if from == to { format!("{}", 1e3 * from) } else { format!("{} to {}", 1e3 * from, 1e3 * to) };
    format!(
        "| {kind} | `{case}` | {hard} | {bound} | {farthest} | {at} | {start} | {} | {} | `{gate}`, {claimed} |",
        starts.words(),
        best(case, peers)
    )
}

/// The peers' best in words.
fn best(case: &str, peers: &Peers) -> String {
    let of = peers.of(case);
    if of.is_empty() {
        return "not played".to_owned();
    }
    let words = |(name, best): &(&str, Best)| match best {
        Best::Fails => format!("{name}: at no step"),
        Best::Unfinished => format!("{name}: unfinished"),
        Best::Solves { longest, nearest, figure } => {
            let value = figure.value.unwrap_or(f64::INFINITY);
            let bound = bound(case, 1e-3 * nearest.dt_ms).or(figure.within).filter(|bound| *bound > 0.0);
            let distance =
                bound.map_or(String::new(), |bound| format!(", distance {}", part(value.abs() / bound)));
            format!(
                "{name}: to {} ms with `{}`; least {} {} with `{}` at {} ms{distance}",
                longest.dt_ms,
                longest.settings,
                number(value),
                figure.unit,
                nearest.settings,
                nearest.dt_ms
            )
        }
    };
    of.iter().map(words).collect::<Vec<_>>().join("; ")
}

#[cfg(test)]
mod tests {
    use super::super::list::CASES;
    use super::*;
    use crate::record::root;
    use crate::sweep::{scene, steps};

    fn row(case: &str, figures: &[f64]) -> HardRow {
        let hard = CASES.iter().find(|hard| hard.case == case).expect("a hard case");
        let scene = scene(case).expect("a scene");
        let start = |figure: &f64| {
            let point = |dt_s| Point { dt_s, figure: if dt_s > 10e-3 { *figure } else { 0.0 }, bound: 2.0 };
            Row { scene, points: steps(3).into_iter().map(point).collect() }
        };
        HardRow { hard, starts: figures.iter().map(start).collect() }
    }

    /// The committed page, beside the committed reports that it quotes.
    #[test]
    fn what_peers_do_at_their_best_is_what_the_reports_say() {
        let peers = Peers::read().expect("the reports are there");
        let file = root().join("docs/report/hard.md");
        let text = std::fs::read_to_string(&file).expect("the page is there");
        for HardCase { case, .. } in CASES {
            let name = format!("`{case}`");
            let cells = text.lines().map(|line| line.split(" | ").collect::<Vec<_>>());
            let row = cells.into_iter().find(|cells| cells.len() == 10 && cells[1] == name);
            let said = row.unwrap_or_else(|| panic!("hard.md has no {name}"))[8].to_owned();
            assert_eq!(said, best(case, &peers), "{name}: `cargo xtask pages-of-record --only hard`");
        }
    }

    #[test]
    fn the_worst_start_is_shown_and_one_beyond_its_bound_has_a_reason() {
        let peers = Peers::read().expect("the reports are there");
        let rows =
            [row("coin_rim", &[0.5, 1.0, 0.7]), row("hard_spin", &[0.1, 5.0]), row("top_momentum", &[9.0])];
        let text = page("record", &steps(3), &rows, &peers);
        assert!(text.contains("2 of 3 cases are within"), "{text}");
        assert!(text.contains("| `coin_rim` | 0 | 0 | 0.500 |"), "{text}");
        assert!(
            text.contains("| `hard_spin` | 0 | 0 | **2.500** |")
                && text.contains("| `hard_spin` | known error"),
            "{text}"
        );
        // Its gate ends at 8 ms.
        assert!(text.contains("| `top_momentum` | 0 | 0 | (4.500) |"), "{text}");
        assert!(text.contains("| 0.500 | 16.000 | 1 | 8 |"), "{text}");
    }

    #[test]
    fn numbers_are_short() {
        for (x, text) in
            [(0.02, "0.02"), (3.2e-5, "3.2e-5"), (10.0, "10"), (0.0, "0"), (1.884, "1.88"), (2500.0, "2500")]
        {
            assert_eq!(number(x), text);
        }
        assert_eq!([0.25, 0.397, 2.52, 16.0].map(short), ["0.25", "0.40", "2.5", "16"]);
    }
}
