//! What is played: tasks, hands, rules, and what a client must keep to.

use crate::compute::Background;
use crate::compute::pace::HOLD_TICKS;
use crate::config::sensing::SensingRules;
use crate::config::settings::{MESSAGE_BYTES, REPEAT, Settings};
use crate::hands::OwnHands;
use crate::rules::Rules;
use crate::store::Store;
use crate::world::live::STREAMED;
use palmares_models::hand::Hand;
use palmares_protocol::Refusal;
use palmares_protocol::reply::{self, HandInfo, Limits, TaskInfo};
use palmares_tasks::Task;
use std::sync::Arc;

/// What is played, and by which rules.
#[derive(Debug)]
pub(crate) struct Competition {
    /// The rules.
    pub(crate) rules: Rules,
    /// Tasks that can be played.
    pub(crate) tasks: Vec<Arc<Task>>,
    /// Hands that can be played with.
    pub(crate) hands: Vec<Arc<Hand>>,
    /// Hands that teams sent in.
    pub(crate) own_hands: OwnHands,
    /// What controllers may see.
    pub(crate) sensing: SensingRules,
    /// What an organizer sets.
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

    /// What is told of it.
    pub(crate) fn info(&self) -> reply::Competition {
        reply::Competition {
            name: self.rules.name.clone(),
            mode: <&str>::from(self.rules.mode).into(),
            session_s: self.rules.session_s,
            reset_cost_s: self.rules.reset_cost_s,
            noise: self.sensing.usual_noise(),
            sensors_only: self.sensing.sensors_only().to_vec(),
        }
    }

    /// What a client must keep to.
    pub(crate) fn limits(&self) -> Limits {
        Limits {
            message_bytes: MESSAGE_BYTES,
            repeat: REPEAT,
            requests_per_s: self.settings.requests_per_s,
            requests_burst: 2.0 * self.settings.requests_per_s,
            resume_grace_s: self.settings.resume_grace.as_secs_f64(),
            ping_interval_s: self.settings.ping_interval().as_secs_f64(),
            ping_timeout_s: self.settings.ping_timeout.as_secs_f64(),
            hello_timeout_s: self.settings.hello_timeout.as_secs_f64(),
            hold_ticks: HOLD_TICKS,
            outbox_obs: STREAMED,
        }
    }

    /// The names of the tasks.
    pub(crate) fn task_names(&self) -> Vec<String> {
        self.tasks.iter().map(|task| task.name.clone()).collect()
    }

    /// The tasks in short.
    pub(crate) fn task_infos(&self) -> Vec<TaskInfo> {
        self.tasks.iter().map(|task| TaskInfo::of(task)).collect()
    }

    /// The hands in short that a team can play: everybody's, then its own.
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
