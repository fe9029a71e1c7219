//! Error codes: the same words in WebSocket errors, close reasons and HTTP problems.

use palmares_tasks::Fault;
use schemars::JsonSchema;
use serde::Serialize;

/// The kind of an error.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, JsonSchema, strum::EnumIter, strum::IntoStaticStr)]
#[serde(rename_all = "snake_case")]
#[strum(serialize_all = "snake_case")]
pub enum Code {
    /// The message is not JSON, or not a text frame.
    BadJson,
    /// No such `op`.
    UnknownOp,
    /// A field of the request is missing, unknown, of the wrong type or out of range.
    BadRequest,
    /// The action has a value that is not a finite number, or a list of the wrong length.
    BadAction,
    /// `tick` is not the current tick of the run.
    StaleTick,
    /// The request does not fit the state of the session: say hello first, open a run first, stop the open run first.
    WrongState,
    /// No such task.
    UnknownTask,
    /// No such hand.
    UnknownHand,
    /// No such camera, or its channel needs sensing `truth`.
    UnknownCamera,
    /// At its start pose, the hand touches something or reaches into a region of the rules.
    HandInTheWay,
    /// The token is missing or wrong.
    NotAuthorized,
    /// The token does not permit this.
    Forbidden,
    /// Another connection uses this session.
    SessionTaken,
    /// The session has ended, or its time is used up.
    SessionOver,
    /// The team has no time slot now; the message says when the next one begins.
    NotScheduled,
    /// The server has no capacity for another world or connection.
    Capacity,
    /// Too many requests per second.
    RateLimited,
    /// The message is larger than the limit. Fatal.
    TooLarge,
    /// A viewer does not read its messages, a controller does not say hello, or a body does not arrive.
    TooSlow,
    /// An error of the server.
    Internal,
    /// No such page or run; only over HTTP.
    NotFound,
}

impl Code {
    /// The word on the wire.
    pub fn name(self) -> &'static str {
        self.into()
    }

    /// The WebSocket close code of a fatal error: 4400 to 4499 for errors of the client, 4500 to 4599 for those of
    /// the server. If an HTTP status means the same, the code has its last two digits.
    pub fn close_code(self) -> u16 {
        match self {
            Code::BadRequest => 4400,
            Code::NotAuthorized => 4401,
            Code::Forbidden => 4414,
            Code::BadJson => 4402,
            Code::UnknownOp => 4403,
            Code::NotFound => 4404,
            Code::BadAction => 4405,
            Code::UnknownTask => 4406,
            Code::UnknownHand => 4407,
            Code::UnknownCamera => 4415,
            Code::NotScheduled => 4416,
            Code::HandInTheWay => 4422,
            Code::TooSlow => 4408,
            Code::SessionTaken => 4409,
            Code::SessionOver => 4410,
            Code::StaleTick => 4411,
            Code::WrongState => 4412,
            Code::TooLarge => 4413,
            Code::RateLimited => 4429,
            Code::Internal => 4500,
            Code::Capacity => 4503,
        }
    }
}

/// Reason why a request is refused.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{}: {message}", code.name())]
pub struct Refusal {
    /// The code.
    pub code: Code,
    /// The problem, and the valid values.
    pub message: String,
    /// The connection closes after this error.
    pub fatal: bool,
    /// Time after which to try again, s.
    pub retry_after_s: Option<f64>,
    /// The fault of the run's world, if it is the reason.
    pub fault: Option<Fault>,
}

impl Refusal {
    /// A refusal after which the connection stays open.
    pub fn new(code: Code, message: impl Into<String>) -> Self {
        Refusal { code, message: message.into(), fatal: false, retry_after_s: None, fault: None }
    }

    /// The same refusal, after which the connection closes.
    pub fn fatal(mut self) -> Self {
        self.fatal = true;
        self
    }

    /// The same refusal, because of a fault of the run's world.
    pub fn by(mut self, fault: Fault) -> Self {
        self.fault = Some(fault);
        self
    }

    /// The same refusal, with the time after which to try again.
    pub fn retry_after(mut self, seconds: f64) -> Self {
        self.retry_after_s = Some(seconds);
        self
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Reply;

    const ALL: [Code; 21] = [
        Code::BadJson,
        Code::UnknownOp,
        Code::BadRequest,
        Code::BadAction,
        Code::StaleTick,
        Code::WrongState,
        Code::UnknownTask,
        Code::UnknownHand,
        Code::UnknownCamera,
        Code::HandInTheWay,
        Code::NotAuthorized,
        Code::Forbidden,
        Code::SessionTaken,
        Code::SessionOver,
        Code::NotScheduled,
        Code::Capacity,
        Code::RateLimited,
        Code::TooLarge,
        Code::TooSlow,
        Code::Internal,
        Code::NotFound,
    ];

    #[test]
    fn every_code_has_its_own_close_code_in_the_documented_range() {
        let mut codes: Vec<u16> = ALL.iter().map(|code| code.close_code()).collect();
        codes.sort_unstable();
        codes.dedup();
        assert_eq!(codes.len(), ALL.len());
        for code in ALL {
            let ours = matches!(code, Code::Internal | Code::Capacity);
            let range = if ours { 4500..4600 } else { 4400..4500 };
            assert!(range.contains(&code.close_code()), "{code:?}");
        }
    }

    #[test]
    fn an_error_has_the_code_of_its_fault() {
        for fault in Fault::ALL {
            assert_eq!(serde_json::to_value(fault).ok(), Some(fault.code().into()));
        }
        let documented = include_str!("../../docs/protocol.md");
        for fault in Fault::ALL {
            assert!(documented.contains(&format!("\n| `{}` | ", fault.code())), "{fault:?}");
        }
        let sent = |refusal: &Refusal| serde_json::to_value(Reply::refused(Some(1), refusal)).expect("JSON");
        let refusal = Refusal::new(Code::Internal, "why");
        assert!(sent(&refusal).get("fault").is_none());
        assert_eq!(sent(&refusal.by(Fault::WorkExhausted))["fault"], "work_exhausted");
    }

    #[test]
    fn the_name_is_what_serde_writes() {
        for code in ALL {
            assert_eq!(serde_json::to_value(code).ok(), Some(code.name().into()));
        }
    }
}
