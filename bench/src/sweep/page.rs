//! The page of a sweep.

use super::played::{LEAST, NEIGHBOURS, OUTLIER, Point, Row, outliers, worst};
use super::reasons::reason;
use super::scenes::RANGE_S;
use std::fmt::Write;

/// A part of a bound in few digits.
pub(crate) fn part(of_bound: f64) -> String {
    match of_bound {
        0.0 => "0".to_owned(),
        f64::INFINITY => "fails".to_owned(),
        it if it < 0.001 => "< 0.001".to_owned(),
        it if it < 10.0 => format!("{it:.3}"),
        it => format!("{it:.0}"),
    }
}

pub(crate) fn ms(dt_s: f64) -> String {
    format!("{:.3}", 1e3 * dt_s)
}

/// The distance of the worst point that is claimed, of the bound.
fn distance(row: &Row) -> f64 {
    worst(&row.claimed()).map_or(0.0, |worst| worst.of_bound())
}

/// Rows by the distance of their worst point, the farthest beyond first.
pub(super) fn by_distance(rows: &[Row]) -> Vec<&Row> {
    let mut sorted: Vec<&Row> = rows.iter().collect();
    sorted.sort_by(|a, b| distance(b).total_cmp(&distance(a)));
    sorted
}

/// Writes the page: record, explanation, the map of this name, tables.
pub(super) fn page(record: &str, rows: &[Row], map: Option<&str>) -> String {
    let (low, high) = (1e3 * RANGE_S.0, 1e3 * RANGE_S.1);
    let count = rows.first().map_or(0, |row| row.points.len());
    let sorted = by_distance(rows);
    let (beyond, within): (Vec<&Row>, Vec<&Row>) = sorted.iter().partition(|row| distance(row) > 1.0);
    let mut text = format!(
        "# Distance to the bound at every step\n\nWritten by `palmares-bench sweep`; do not edit.\n\n{record}\n\n\
         The gates of the physics play a case at a few steps. Here each case with a bound is played at {count} steps from {low} \
         to {high} ms. The steps have equal ratios, so that nearly none divides a round time.\n\n\
         The distance is the error of the case as a part of its bound: 0 is exact, 1 is at the bound, and more is beyond it. \
         Between two steps of the gates the bound is on the straight line of the logarithms. A step at which a run fails, or at \
         which a step does not converge, counts as beyond. A case is claimed from the shortest to the longest step of its gate. At \
         other steps its distance is listed at the end and counts for nothing.\n\n\
         A step stands out if its distance is more than {OUTLIER} times the median of the {} steps around it, and at least {LEAST}: a \
         wide bound does not hide such a step.\n\n",
        2 * NEIGHBOURS
    );
    let _ = writeln!(
        text,
        "{} of {} cases are within their bounds at every claimed step.\n",
        within.len(),
        rows.len()
    );
    if let Some(map) = map {
        let _ = writeln!(text, "![Distance of each case to its bound at each step]({map})\n");
    }
    if !beyond.is_empty() {
        text += "## Beyond a bound\n\n| case | largest distance | at, ms | median | steps beyond | reason |\n|---|---|---|---|---|---|\n";
        for row in &beyond {
            let why = reason(row.scene.name).unwrap_or("not understood");
            let _ = writeln!(text, "{} {} | {why} |", figures(row), steps_beyond(&row.claimed()));
        }
        text += "\n";
    }
    let (near, far): (Vec<&Row>, Vec<&Row>) = within.iter().partition(|row| distance(row) >= LEAST);
    text += "## Within the bounds\n\n| case | largest distance | at, ms | median | stand out, ms (distance) |\n|---|---|---|---|---|\n";
    for row in &near {
        let _ = writeln!(text, "{} {} |", figures(row), stand_out(&row.claimed()));
    }
    if !far.is_empty() {
        let names: Vec<String> = far.iter().map(|row| format!("`{}`", row.scene.name)).collect();
        let _ = writeln!(text, "\nNever farther than {LEAST}: {}.", names.join(", "));
    }
    let partly: Vec<&&Row> = sorted.iter().filter(|row| !row.unclaimed().is_empty()).collect();
    if !partly.is_empty() {
        text += "\n## At steps that are not claimed\n\n\
                 | case | claimed, ms | largest distance at other steps | at, ms | of these beyond |\n|---|---|---|---|---|\n";
        for row in partly {
            let (from, to) = row.scene.claimed_s;
            let others = row.unclaimed();
            let Some(worst) = worst(&others) else { continue };
            let _ = writeln!(
                text,
                "| `{}` | {} to {} | {} | {} | {} |",
                row.scene.name,
                1e3 * from,
                1e3 * to,
                part(worst.of_bound()),
                ms(worst.dt_s),
                steps_beyond(&others)
            );
        }
    }
    text
}

/// Name, largest distance, its step and the median distance of a case.
fn figures(row: &Row) -> String {
    let claimed = row.claimed();
    let mut parts: Vec<f64> = claimed.iter().map(Point::of_bound).collect();
    parts.sort_by(f64::total_cmp);
    let median = parts.get(parts.len() / 2).map_or(String::new(), |median| part(*median));
    let (most, at) =
        worst(&claimed).map_or((String::new(), String::new()), |it| (part(it.of_bound()), ms(it.dt_s)));
    format!("| `{}` | {most} | {at} | {median} |", row.scene.name)
}

fn steps_beyond(points: &[Point]) -> String {
    let beyond = points.iter().filter(|point| point.of_bound() > 1.0).count();
    format!("{beyond} of {}", points.len())
}

fn stand_out(points: &[Point]) -> String {
    let mut found = outliers(points);
    found.sort_by(|a, b| b.of_bound().total_cmp(&a.of_bound()));
    let shown: Vec<String> =
        found.iter().take(3).map(|it| format!("{} ({})", ms(it.dt_s), part(it.of_bound()))).collect();
    let more = if found.len() > 3 { format!(" and {} more", found.len() - 3) } else { String::new() };
    shown.join(", ") + &more
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sweep::played::tests::made_up;
    use crate::sweep::played::{scene, steps};

    fn row(case: &str, points: Vec<Point>) -> Row {
        Row { scene: scene(case).expect("a scene"), points }
    }

    #[test]
    fn a_case_beyond_its_bound_comes_first_with_a_reason() {
        let mut bad = made_up(None);
        bad[30].figure = f64::INFINITY;
        let rows =
            [row("free_flight", made_up(Some(20))), row("dead_rod", bad), row("hard_spin", made_up(None))];
        let text = page("record", &rows, Some("steps.svg"));
        let [at_rod, at_flight] =
            ["| `dead_rod` | fails", "| `free_flight` | 0.700"].map(|line| text.find(line));
        assert!(at_rod.is_some() && at_rod < at_flight, "{text}");
        assert!(text.contains("1 of 60 | not understood |") && text.contains("(0.700) |"), "{text}");
        assert!(text.contains("2 of 3 cases are within") && text.contains("(steps.svg)"), "{text}");
        assert!(!text.contains("not claimed\n"), "{text}");
    }

    #[test]
    fn a_step_that_is_not_claimed_is_listed_and_counts_for_nothing() {
        let mut points = made_up(None);
        points[59].figure = 7.0;
        let text = page("record", &[row("top_momentum", points)], None);
        assert!(text.contains("1 of 1 cases are within") && !text.contains("## Beyond"), "{text}");
        assert!(text.contains("| `top_momentum` | 0.25 to 8 | 7.000 | 16.000 | 1 of 10 |"), "{text}");
        let exact = steps(9).into_iter().map(|dt_s| Point { dt_s, figure: 0.0, bound: 1.0 }).collect();
        let text = page("record", &[row("free_flight", exact)], None);
        assert!(text.contains("Never farther than 0.01: `free_flight`."), "{text}");
    }
}
