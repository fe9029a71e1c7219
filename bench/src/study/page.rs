//! The page of a study.

use super::findings::{Change, FACTOR, Finding, LEAST};
use super::played::{Played, STEPS_S, micros};
use super::scenes::SceneRow;
use crate::rigs::softhand_in_words;
use palmares_sim::Law;
use std::fmt::Write;

/// Largest number of cases that a sentence names.
const NAMED: usize = 4;

const HEAD: &str = "# What a scene needs\n\nWritten by `palmares-bench model`; do not edit.\n\n";

/// A number with two digits.
fn two(x: f64) -> String {
    match x.abs() {
        0.0 => "0".to_owned(),
        size if size >= 9.95 => format!("{x:.0}"),
        size if size >= 0.995 => format!("{x:.1}"),
        size if size >= 0.0995 => format!("{x:.2}"),
        size if size >= 0.00995 => format!("{x:.3}"),
        _ => format!("{x:.1e}"),
    }
}

fn percent(part: f64) -> String {
    match 100.0 * part {
        it if it > 0.0 && it < 1.0 => "< 1".to_owned(),
        it => format!("{it:.0}"),
    }
}

fn distance(of_bound: Option<f64>) -> String {
    of_bound.map_or("fails".to_owned(), two)
}

/// `1 case`, `2 cases`.
fn count(n: usize, of: &str) -> String {
    if n == 1 { format!("1 {of}") } else { format!("{n} {of}s") }
}

/// Writes the page.
pub(super) fn page(record: &str, rows: &[SceneRow], played: &[Played]) -> String {
    let mut text = HEAD.to_owned();
    let _ = writeln!(text, "{record}\n");
    text += "A scene pays for what is in it. The first three tables show what is in known scenes, what a step does, and which laws of \
             [physics.md](../physics.md#a-step-in-order) act. The last ones leave out each law and play the cases with a bound again. \
             `palmares task check TASK --hand HAND --model` prints the rows for a scene of your own.\n\n";
    text += &(softhand_in_words() + "\n\n");
    parts(&mut text, rows);
    step(&mut text, rows);
    laws(&mut text, rows);
    text += "## Without a law\n\n";
    let _ = writeln!(
        text,
        "Each case with a bound and {} of the SoftHand are played with all laws, and again without each law that acts in them. The \
         distance is the error as a part of its bound: more than 1 is beyond it. A case is farther or nearer if its distance is \
         multiplied or divided by more than {FACTOR}; distances below {LEAST} count as 0. Time is the CPU time of a step without the law, \
         as a part of that with it: the median over the cases in which the law acts. Both take turns on one machine.\n",
        count(played.iter().filter(|it| it.is_grasp && it.step_us == micros(STEPS_S[0])).count(), "grasp")
    );
    let findings = STEPS_S.map(|dt_s| {
        let at: Vec<&Played> = played.iter().filter(|it| it.step_us == micros(dt_s)).collect();
        (dt_s, Law::ALL.iter().map(|law| Finding::of(*law, &at)).collect::<Vec<Finding>>())
    });
    for (dt_s, findings) in &findings {
        table(&mut text, *dt_s, findings);
    }
    text += "## What each law buys\n\n";
    for (k, law) in Law::ALL.iter().enumerate() {
        let said = match findings.iter().all(|(_, findings)| findings[k].idle()) {
            true => "It acts in no case.".to_owned(),
            false => findings.each_ref().map(|(dt_s, findings)| sentence(*dt_s, &findings[k])).join(" "),
        };
        let _ = writeln!(text, "- **{}**. {said}", law.name());
    }
    let names = |of: fn(&[&Finding]) -> bool| -> Vec<&str> {
        let all = |k: usize| findings.iter().map(|(_, findings)| &findings[k]).collect::<Vec<&Finding>>();
        (0..Law::ALL.len()).filter(|&k| of(&all(k))).map(|k| Law::ALL[k].name()).collect()
    };
    let idle = names(|all| all.iter().all(|it| it.idle()));
    let nothing = names(|all| !all.iter().all(|it| it.idle()) && !all.iter().any(|it| it.buys()));
    for (said, of) in [("Nothing here is worse without", nothing), ("In no case here acts", idle)] {
        if !of.is_empty() {
            let _ = writeln!(text, "\n{said}: {}.", of.join("; "));
        }
    }
    let unseen: Vec<String> = played
        .iter()
        .filter(|it| it.steps == 0 && it.step_us == micros(STEPS_S[0]))
        .map(|it| format!("`{}`", it.subject))
        .collect();
    if !unseen.is_empty() {
        let _ = writeln!(
            text,
            "\nThe steps of {} are not counted, so that no law is left out there.",
            unseen.join(", ")
        );
    }
    text
}

fn parts(text: &mut String, rows: &[SceneRow]) {
    *text += "## Parts\n\nCoordinates are 6 for the base of a hand and for each object, and one for each joint. Rows are those of tendons, \
              springs across joints, pins and dry friction.\n\n\
              | scene | coordinates | joints | motors | rows | bodies | shapes |\n|---|---|---|---|---|---|---|\n";
    for SceneRow { scene, coordinates, joints, motors, rows, bodies, shapes, .. } in rows {
        let _ = writeln!(
            text,
            "| {scene} | {coordinates} | {joints} | {motors} | {rows} | {bodies} | {shapes} |"
        );
    }
}

fn step(text: &mut String, rows: &[SceneRow]) {
    *text += "\n## A step\n\nMeans over the steps of 1 ms. Near pairs are shapes whose boxes, grown by 2 cm, meet; the solver has the pairs \
              and points that can touch within the step. Time has its parts for dynamics, collision and solver.\n\n\
              | scene | near pairs | pairs | points | iterations | µs | parts, % |\n|---|---|---|---|---|---|---|\n";
    for row in rows {
        let SceneRow { scene, near_pairs, pairs, points, iterations, step_us, .. } = row;
        let [near, pairs, points, iterations, us] =
            [near_pairs, pairs, points, iterations, step_us].map(|x| two(*x));
        let parts = row.parts.map(percent).join(", ");
        let _ = writeln!(text, "| {scene} | {near} | {pairs} | {points} | {iterations} | {us} | {parts} |");
    }
}

fn laws(text: &mut String, rows: &[SceneRow]) {
    *text += "\n## Laws that act\n\nPercent of the steps in which each acts. The last column is the CPU time of a step without all other laws, \
              as a part of that with them; their course is the same.\n\n| scene | laws, % of the steps | time without the others |\n|---|---|---|\n";
    for row in rows {
        let laws: Vec<String> =
            row.laws.iter().map(|(law, part)| format!("{law} {}", percent(*part))).collect();
        let laws = if laws.is_empty() { "none".to_owned() } else { laws.join("; ") };
        let _ = writeln!(text, "| {} | {laws} | {:.2} |", row.scene, row.without_idle);
    }
    let mut idle: Vec<f64> = rows.iter().map(|row| row.without_idle).collect();
    idle.sort_by(f64::total_cmp);
    if let Some(median) = idle.get(idle.len() / 2) {
        let _ = writeln!(text, "\nThe median of the last column is {median:.2}.\n");
    }
}

fn table(text: &mut String, dt_s: f64, findings: &[Finding]) {
    let (cases, grasps) = findings.first().map_or((0, 0), |it| (it.cases, it.grasps));
    let _ = writeln!(
        text,
        "Steps of {} ms, {}, {}:\n\n| without | acts in | time | beyond | farther | nearer | grasps kept |\n|---|---|---|---|---|---|---|",
        1e3 * dt_s,
        count(cases, "case"),
        count(grasps, "grasp")
    );
    if let Some(first) = findings.first() {
        let _ = writeln!(text, "| no law |  | 1 |  |  |  | {} |", first.kept[0]);
    }
    for it in findings {
        let time = it.time.map_or("–".to_owned(), |time| format!("{time:.2}"));
        let [beyond, farther, nearer] = [&it.beyond, &it.farther, &it.nearer].map(Vec::len);
        let _ = writeln!(
            text,
            "| {} | {} | {time} | {beyond} | {farther} | {nearer} | {} |",
            it.law.name(),
            it.acts,
            it.kept[1]
        );
    }
    *text += "\n";
}

/// The finding of a law at a step in words.
fn sentence(dt_s: f64, it: &Finding) -> String {
    let step = format!("At {} ms,", 1e3 * dt_s);
    if it.idle() {
        return format!("{step} it acts in no case.");
    }
    let mut said = Vec::new();
    if !it.beyond.is_empty() {
        let verb = if it.beyond.len() == 1 { "goes beyond its bound" } else { "go beyond their bounds" };
        said.push(format!("{} {verb} without it: {}", count(it.beyond.len(), "case"), named(&it.beyond)));
    }
    if !it.farther.is_empty() {
        let verb = if it.farther.len() == 1 { "is" } else { "are" };
        said.push(format!("{} {verb} farther: {}", count(it.farther.len(), "case"), named(&it.farther)));
    }
    if !it.nearer.is_empty() {
        let verb = if it.nearer.len() == 1 { "is" } else { "are" };
        said.push(format!("{} {verb} nearer: {}", count(it.nearer.len(), "case"), named(&it.nearer)));
    }
    if it.kept[0] != it.kept[1] {
        said.push(format!("{} of {} grasps are kept instead of {}", it.kept[1], it.grasps, it.kept[0]));
    }
    if said.is_empty() {
        return format!("{step} nothing changes without it in {}.", count(it.acts, "case"));
    }
    format!("{step} {}.", said.join("; "))
}

fn named(changes: &[Change]) -> String {
    let of = |it: &Change| format!("`{}` ({} → {})", it.subject, distance(it.with), distance(it.without));
    let shown: Vec<String> = changes.iter().take(NAMED).map(of).collect();
    let more =
        if changes.len() > NAMED { format!(" and {} more", changes.len() - NAMED) } else { String::new() };
    shown.join(", ") + &more
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::study::played::tests::made_up;

    fn row() -> SceneRow {
        SceneRow {
            commit: "abc".to_owned(),
            scene: "kapla".to_owned(),
            coordinates: 612,
            joints: 0,
            rows: 0,
            motors: 0,
            bodies: 102,
            shapes: 103,
            near_pairs: 812.4,
            pairs: 408.2,
            points: 1632.0,
            iterations: 1.53,
            step_us: 712.0,
            parts: [0.0, 0.254, 0.746],
            laws: vec![("anchors".to_owned(), 1.0), ("sleep".to_owned(), 0.004)],
            without_idle: 0.984,
        }
    }

    #[test]
    fn the_page_says_what_the_runs_say() {
        let runs = [
            made_up("disc", Law::Patches, [Some(0.642), Some(2.3)]),
            made_up("box", Law::Anchors, [Some(0.5), Some(0.5)]),
            made_up("grasp of the box 3", Law::Patches, [Some(0.0), None]),
            Played { steps: 0, without: Vec::new(), ..made_up("placed", Law::Sleep, [Some(0.1), None]) },
        ];
        let text = page("record", &[row()], &runs);
        for line in [
            "| kapla | 612 | 0 | 0 | 0 | 102 | 103 |",
            "| kapla | 812 | 408 | 1632 | 1.5 | 712 | 0, 25, 75 |",
            "| kapla | anchors 100; sleep < 1 | 0.98 |",
            "The median of the last column is 0.98.",
            "Steps of 1 ms, 3 cases, 1 grasp:",
            "| patches | 1 | 0.90 | 1 | 0 | 0 | 0 |",
            "| sleep | 0 | – | 0 | 0 | 0 | 1 |",
            "- **patches**. At 1 ms, 1 case goes beyond its bound without it: `disc` (0.64 → 2.3); 0 of 1 grasps are kept instead of 1. At \
             4 ms, it acts in no case.",
            "The steps of `placed` are not counted",
        ] {
            assert!(text.contains(line), "{line}\n{text}");
        }
        let nothing =
            text.lines().find(|line| line.starts_with("Nothing here")).expect("one law buys nothing");
        assert_eq!(nothing, "Nothing here is worse without: anchors.");
        let idle =
            text.lines().find(|line| line.starts_with("In no case here acts")).expect("most laws do not act");
        assert!(idle.contains("sleep") && !idle.contains("patches"), "{idle}");
    }

    #[test]
    fn numbers_have_two_digits() {
        let found = [0.0, 1234.0, 12.34, 9.96, 1.234, 0.999, 0.1234, 0.0123, 1.2e-7].map(two);
        assert_eq!(found, ["0", "1234", "12", "10", "1.2", "1.0", "0.12", "0.012", "1.2e-7"]);
        assert_eq!([0.0, 0.004, 0.5, 1.0].map(percent), ["0", "< 1", "50", "100"]);
    }
}
