//! Settings that would refuse every reset of a task or a hand: they are found at the start, not on the day.

use anyhow::bail;
use palmares_models::hand::Hand;
use palmares_net::config::Config;
use palmares_tasks::{Seed, Task, build, inspect};
use std::sync::Arc;

/// Number of scenes that are tried of a task of the organizer's own.
const SCENES: u64 = 3;

/// The hands that can be played. Without `hands` in the file, those that cannot be are left out.
///
/// # Errors
/// The file allows a task or a hand that nobody could play.
pub(super) fn playable(
    config: &Config,
    tasks: &[Arc<Task>],
    hands: Vec<Arc<Hand>>,
) -> anyhow::Result<Vec<Arc<Hand>>> {
    let own = &tasks[tasks.len() - config.tasks.len()..];
    for (task, path) in own.iter().zip(&config.tasks) {
        if let Some(why) = without_scene(task) {
            bail!("{}: no scene of the task `{}` can be built: {why}", path.display(), task.name);
        }
    }
    known_tasks(config, tasks)?;
    let hands = with_ranges(config, hands)?;
    // A hand from a file is checked where it is read.
    let builtin = &hands[..hands.len() - config.hands.len()];
    for hand in builtin {
        let reasons = inspect::never_fits(hand, own);
        if reasons.is_empty() {
            continue;
        }
        let (name, reasons) = (&hand.name, inspect::join_reasons(&reasons));
        match &config.builtin_hands {
            Some(_) => {
                bail!("{}: hands: `{name}` cannot be played in every task:\n{reasons}", config.place())
            }
            None => tracing::warn!(hand = name, "it is refused in a task of your own: {reasons}"),
        }
    }
    Ok(hands)
}

/// Why no scene of a task can be built.
fn without_scene(task: &Task) -> Option<String> {
    let mut why = None;
    for seed in (0..SCENES).map(Seed::from_u64) {
        // One sound scene is enough.
        why = Some(build::build(task, None, seed).err()?);
    }
    why.map(|error| error.to_string())
}

/// Checks the names in `sensors_only`.
fn known_tasks(config: &Config, tasks: &[Arc<Task>]) -> anyhow::Result<()> {
    let known: Vec<&str> = tasks.iter().map(|task| task.name.as_str()).collect();
    match config.sensing.sensors_only().iter().find(|name| !known.contains(&name.as_str())) {
        Some(name) => {
            bail!("{}: sensors_only: no task `{name}`; there are: {}", config.place(), known.join(", "))
        }
        None => Ok(()),
    }
}

/// With `hand_spread`, the hands with ranges from which their numbers can be drawn.
fn with_ranges(config: &Config, hands: Vec<Arc<Hand>>) -> anyhow::Result<Vec<Arc<Hand>>> {
    if !config.hand_spread {
        return Ok(hands);
    }
    let names = |hands: &[Arc<Hand>]| {
        let names: Vec<String> = hands.iter().map(|hand| format!("`{}`", hand.name)).collect();
        names.join(", ")
    };
    let first_of_files = hands.len() - config.hands.len();
    let without = |(_, hand): &(usize, &Arc<Hand>)| hand.uncertain.is_empty();
    for (k, hand) in hands.iter().enumerate().filter(without) {
        let field = match (k >= first_of_files, &config.builtin_hands) {
            (true, _) => "hand_files",
            (false, Some(_)) => "hands",
            (false, None) => continue,
        };
        let all = palmares_models::builtin::builtin_hands().to_vec();
        let all: Vec<Arc<Hand>> = all.into_iter().chain(hands[first_of_files..].iter().cloned()).collect();
        let with: Vec<Arc<Hand>> = all.into_iter().filter(|hand| !hand.uncertain.is_empty()).collect();
        bail!(
            "{}: hand_spread = true draws the numbers of every hand from [uncertain] in its hand.toml, and `{}` of {field} has \
             none: every reset with it would be refused. Hands with ranges: {}. Leave it out, give it ranges, or set hand_spread = false",
            config.place(),
            hand.name,
            names(&with)
        );
    }
    let (with, without): (Vec<_>, Vec<_>) = hands.into_iter().partition(|hand| !hand.uncertain.is_empty());
    if !without.is_empty() {
        tracing::info!("hand_spread: without ranges, and left out: {}", names(&without));
    }
    Ok(with)
}
