//! Reason why a replay is not accepted.

/// Reason why a replay is not accepted. Every reason has a [name](VerifyError::name).
#[derive(Clone, Debug, PartialEq, thiserror::Error, strum::IntoStaticStr)]
#[strum(serialize_all = "snake_case")]
pub enum VerifyError {
    /// The file is not a replay.
    #[error("{0}")]
    NotAReplay(String),
    /// The file ends too early, or was never finished.
    #[error("{0}")]
    Truncated(String),
    /// A record is damaged, missing or changed.
    #[error("{0}")]
    ChainBroken(String),
    /// The signature does not fit the file, or has another key.
    #[error("{0}")]
    BadSignature(String),
    /// The hand is missing, or differs from that of the run.
    #[error("{0}")]
    OtherHand(String),
    /// The task is missing, or differs from that of the run.
    #[error("{0}")]
    OtherTask(String),
    /// The engine of the recording computes other bits.
    #[error("{0}")]
    OtherEngine(String),
    /// The recording has other constants of the physics.
    #[error("{0}")]
    OtherPhysics(String),
    /// The simulation gives another state.
    #[error(
        "the state at tick {tick} is {found}, recorded was {recorded}; {}",
        equal_until(*tick, *last_equal)
    )]
    StateDiffers {
        /// First recorded tick whose state differs.
        tick: u64,
        /// Last recorded tick before it.
        last_equal: Option<u64>,
        /// Hash of the simulation.
        found: String,
        /// Hash in the file.
        recorded: String,
    },
    /// The states are the same, but score, a count or an event differs.
    #[error("{0}")]
    ScoreDiffers(String),
}

/// Up to which tick the states were equal.
fn equal_until(tick: u64, last_equal: Option<u64>) -> String {
    match last_equal {
        None => "no state was equal".into(),
        Some(last) if last + 1 >= tick => format!("they were equal up to tick {last}"),
        Some(last) => format!("they were equal up to tick {last}, and not recorded between the two"),
    }
}

impl VerifyError {
    /// The error as a word, for programs.
    pub fn name(&self) -> &'static str {
        self.into()
    }

    /// The first tick whose state differs, if the states differ.
    pub fn tick(&self) -> Option<u64> {
        match self {
            VerifyError::StateDiffers { tick, .. } => Some(*tick),
            _ => None,
        }
    }
}
