//! Why a replay is not accepted.

/// Why a replay is not accepted. Every reason has a [name](VerifyError::name).
#[derive(Clone, Debug, PartialEq, thiserror::Error, strum::IntoStaticStr)]
#[strum(serialize_all = "snake_case")]
pub enum VerifyError {
    /// Not a file of ours.
    #[error("{0}")]
    NotAReplay(String),
    /// The file ends too early, or was never finished.
    #[error("{0}")]
    Truncated(String),
    /// A record is damaged, missing, or not the one that was written.
    #[error("{0}")]
    ChainBroken(String),
    /// The signature does not fit the file, or is another's.
    #[error("{0}")]
    BadSignature(String),
    /// The hand is not there, or not the one that was played with.
    #[error("{0}")]
    OtherHand(String),
    /// The task is not there, or not the one that was played.
    #[error("{0}")]
    OtherTask(String),
    /// Recorded by an engine that computes other bits.
    #[error("{0}")]
    OtherEngine(String),
    /// Recorded with other constants of the physics.
    #[error("{0}")]
    OtherPhysics(String),
    /// The simulation comes to another state.
    #[error(
        "the state at tick {tick} is {found}, recorded was {recorded}; {}",
        equal_until(*tick, *last_equal)
    )]
    StateDiffers {
        /// First tick that differs, of those that were recorded.
        tick: u64,
        /// Last one before it.
        last_equal: Option<u64>,
        /// Hash that the simulation comes to.
        found: String,
        /// Hash in the file.
        recorded: String,
    },
    /// The same states, but another score, count or event.
    #[error("{0}")]
    ScoreDiffers(String),
}

/// What is known of the states before the one that differs.
fn equal_until(tick: u64, last_equal: Option<u64>) -> String {
    match last_equal {
        None => "no state was equal".into(),
        Some(last) if last + 1 >= tick => format!("they were equal up to tick {last}"),
        Some(last) => format!("they were equal up to tick {last}, and not recorded between the two"),
    }
}

impl VerifyError {
    /// One word for programs.
    pub fn name(&self) -> &'static str {
        self.into()
    }

    /// The first tick that differs, where there is one.
    pub fn tick(&self) -> Option<u64> {
        match self {
            VerifyError::StateDiffers { tick, .. } => Some(*tick),
            _ => None,
        }
    }
}
