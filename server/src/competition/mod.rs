//! The competition: tasks, hands, rules, and the limits for clients.

pub(crate) mod hands;
pub(crate) mod new_keys;
pub(crate) mod rules;

use crate::competition::hands::OwnHands;
use crate::competition::rules::Rules;
use palmares_models::hand::Hand;
use palmares_net::config::sensing::SensingRules;
use palmares_net::config::settings::{MAX_REPEAT, MESSAGE_BYTES, Settings};
use palmares_protocol::reply::{self, HandInfo, Limits, TaskInfo};
use palmares_protocol::{Code, Refusal};
use palmares_store::Store;
use palmares_tasks::Task;
use palmares_worlds::compute::Background;
use palmares_worlds::compute::pace::HOLD_TICKS;
use palmares_worlds::world::realtime::STREAM_LENGTH;
use std::sync::Arc;

/// Tasks, hands and rules.
#[derive(Debug)]
pub(crate) struct Competition {
    /// The rules.
    pub(crate) rules: Rules,
    /// Tasks that can be played.
    pub(crate) tasks: Vec<Arc<Task>>,
    /// Hands that can be played with.
    pub(crate) hands: Vec<Arc<Hand>>,
    /// Hands that teams uploaded.
    pub(crate) own_hands: Arc<OwnHands>,
    /// Observations that controllers may have.
    pub(crate) sensing: SensingRules,
    /// Whether the seed of a run draws the uncertain numbers of its hand.
    pub(crate) hand_spread: bool,
    /// Settings of the organizer.
    pub(crate) settings: Settings,
}

impl Competition {
    /// The task of that name.
    pub(crate) fn task(&self, name: &str) -> Option<&Arc<Task>> {
        self.tasks.iter().find(|task| task.name == name)
    }

    /// The hand of that name.
    pub(crate) fn hand(&self, name: &str) -> Option<&Arc<Hand>> {
        self.hands.iter().find(|hand| hand.name == name)
    }

    /// The ranges from which the seed of a run draws numbers of its hand, as their hash; none if it draws none.
    ///
    /// # Errors
    /// The hand has no ranges, and the rules want some.
    pub(crate) fn ranges(&self, hand: &Hand) -> Result<Option<String>, Refusal> {
        if self.hand_spread && hand.uncertain.is_empty() {
            let name = &hand.name;
            let message = format!(
                "hand `{name}` has no [uncertain] in its hand.toml, and here the numbers of hands are drawn from it"
            );
            return Err(Refusal::new(Code::BadRequest, message));
        }
        Ok(self.hand_spread.then(|| hand.uncertain_hash()))
    }

    /// The competition, for clients.
    pub(crate) fn info(&self) -> reply::Competition {
        reply::Competition {
            name: self.rules.name.clone(),
            mode: <&str>::from(self.rules.mode).into(),
            session_s: self.rules.session_s,
            reset_cost_s: self.rules.reset_cost_s,
            noise: self.sensing.usual_noise(),
            sensors_only: self.sensing.sensors_only().to_vec(),
            hand_spread: self.hand_spread,
            scenes: self.rules.scenes,
        }
    }

    /// The limits for a client.
    pub(crate) fn limits(&self) -> Limits {
        Limits {
            message_bytes: MESSAGE_BYTES,
            repeat: MAX_REPEAT,
            requests_per_s: self.settings.requests_per_s,
            requests_burst: 2.0 * self.settings.requests_per_s,
            resume_grace_s: self.settings.resume_grace.as_secs_f64(),
            ping_interval_s: self.settings.ping_interval().as_secs_f64(),
            ping_timeout_s: self.settings.ping_timeout.as_secs_f64(),
            hello_timeout_s: self.settings.hello_timeout.as_secs_f64(),
            hold_ticks: HOLD_TICKS,
            outbox_obs: STREAM_LENGTH,
        }
    }

    /// The names of the tasks.
    pub(crate) fn task_names(&self) -> Vec<String> {
        self.tasks.iter().map(|task| task.name.clone()).collect()
    }

    /// Short descriptions of the tasks.
    pub(crate) fn task_infos(&self) -> Vec<TaskInfo> {
        self.tasks.iter().map(|task| TaskInfo::of(task)).collect()
    }

    /// Short descriptions of the hands that a team can play: first the server's, then its own.
    pub(crate) async fn hand_infos(
        &self,
        store: &Store,
        background: &Background,
        team: Option<&str>,
    ) -> Result<Vec<HandInfo>, Refusal> {
        let own = match team {
            Some(team) => self.own_hands.all(store, background, team, self.rules.official()).await?,
            None => Vec::new(),
        };
        // A hand given with --hand comes before a team's own of the same name, as in `reset`.
        let own = own.iter().filter(|own| self.hand(&own.name).is_none());
        Ok(self.hands.iter().chain(own).map(|hand| HandInfo::of(hand)).collect())
    }
}
