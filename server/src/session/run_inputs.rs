//! The inputs of a run: its seed, official or the client's own, and its hand.

use super::failure::{random_hex, store_failed};
use super::session::Sessions;
use palmares_models::hand::Hand;
use palmares_protocol::text::shortened;
use palmares_protocol::{Code, Refusal};
use palmares_tasks::{Seed, Task};
use std::sync::Arc;

/// The seed of a run, and the number by which it is known.
pub(super) struct RunKey {
    pub(super) seed: Seed,
    /// The number behind the seed, in practice.
    pub(super) number: Option<u64>,
    /// Number of the run among the team's runs of the task, officially.
    pub(super) k: Option<u64>,
}

/// A random practice seed, short enough to type.
fn random_seed() -> Result<u64, Refusal> {
    let hex = random_hex(4)?;
    Ok(u64::from_str_radix(&hex, 16).unwrap_or_default())
}

/// The seed of the next run.
pub(super) async fn run_key(
    sessions: &Sessions,
    team: &str,
    task: &Task,
    requested: Option<u64>,
) -> Result<RunKey, Refusal> {
    if !sessions.competition.rules.official() {
        let number = match requested {
            Some(number) => number,
            None => random_seed()?,
        };
        return Ok(RunKey { seed: Seed::from_u64(number), number: Some(number), k: None });
    }
    let k = sessions.store.next_k(team, &task.name).await.map_err(store_failed("the run"))?;
    let seed = sessions.competition.rules.seed(&task.name, k, team).ok_or_else(|| {
        tracing::error!("an official session without a seed secret");
        Refusal::new(Code::Internal, "server fault: the seed secret is missing")
    })?;
    Ok(RunKey { seed, number: None, k: Some(k) })
}

/// Returns the number of a run that could not be opened: the next run gets it.
pub(super) async fn give_back_number(
    sessions: &Sessions,
    team: &str,
    task: &Task,
    k: Option<u64>,
) -> Result<(), Refusal> {
    let Some(k) = k else { return Ok(()) };
    sessions.store.give_back_k(team, &task.name, k).await.map_err(store_failed("the run's number"))
}

/// The hand of that name: a hand of the server, or an uploaded hand of the team with the SHA-256 of its archive.
pub(super) async fn hand(
    sessions: &Sessions,
    team: &str,
    name: &str,
) -> Result<(Arc<Hand>, Option<String>), Refusal> {
    if let Some(hand) = sessions.competition.hand(name) {
        return Ok((hand.clone(), None));
    }
    let official = sessions.competition.rules.official();
    let own = sessions
        .competition
        .own_hands
        .find(&sessions.store, &sessions.compute.background, team, name, official)
        .await?;
    if let Some((hand, sha256)) = own {
        return Ok((hand, Some(sha256)));
    }
    let known: Vec<&str> = sessions.competition.hands.iter().map(|hand| hand.name.as_str()).collect();
    let what = if official { "approved hands of your own" } else { "hands of your own" };
    let message = format!("no hand `{}`; there are: {} and {what}", shortened(name), known.join(", "));
    Err(Refusal::new(Code::UnknownHand, message))
}

/// Makes the files of an uploaded hand known to the archive, which stores them in the replay.
pub(super) async fn provide(sessions: &Sessions, hand: &Hand, sha256: Option<&str>) -> Result<(), Refusal> {
    let (Some(archive), Some(sha256)) = (&sessions.archive, sha256) else { return Ok(()) };
    let files = sessions.competition.own_hands.archive(sha256).await.map_err(|error| {
        tracing::error!(%error, hand = hand.name, "the archive of a hand cannot be read");
        Refusal::new(Code::Internal, "the hand could not be loaded; try again").retry_after(5.0)
    })?;
    archive.add_hand(hand, Arc::new(files));
    Ok(())
}
