//! Error codes: the same words in WebSocket errors, close reasons and HTTP problems.

use palmares_tasks::Fault;
use schemars::JsonSchema;
use serde::Serialize;

/// What went wrong.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, JsonSchema, strum::IntoStaticStr)]
#[serde(rename_all = "snake_case")]
#[strum(serialize_all = "snake_case")]
pub enum Code {
    /// The message is not JSON, or not a text frame.
    BadJson,
    /// No such `op`.
    UnknownOp,
    /// The request's shape is wrong: a field is missing, unknown, of the wrong type or out of range.
    BadRequest,
    /// The action's content is wrong: not numbers, not finite, wrong length.
    BadAction,
    /// `tick` is not the current tick of the run.
    StaleTick,
    /// The request does not fit the present state: greet first, open a run first, stop the open one first.
    WrongState,
    /// No such task.
    UnknownTask,
    /// No such hand.
    UnknownHand,
    /// No such camera, or not with this sensing.
    UnknownCamera,
    /// The hand touches something, or reaches into a region of the rules, where it starts.
    HandInTheWay,
    /// The token is missing or wrong.
    NotAuthorized,
    /// The token is valid, but not for this.
    Forbidden,
    /// Another socket holds this session.
    SessionTaken,
    /// The session's time is spent, or the session has ended.
    SessionOver,
    /// The host has no room for another world, or another connection.
    Capacity,
    /// Too many requests per second.
    RateLimited,
    /// The message is larger than the limit. Fatal.
    TooLarge,
    /// A viewer does not take what it is sent, a controller does not say hello, a body does not come.
    TooSlow,
    /// A fault of the server.
    Internal,
    /// No such page or run. REST only.
    NotFound,
}

impl Code {
    /// The word on the wire.
    pub fn name(self) -> &'static str {
        self.into()
    }

    /// The WebSocket close code of a fatal error: 4400–4499 the client's fault, 4500–4599 the server's.
    /// Where HTTP has a status that means the same, its last two digits are used.
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

/// Why a request was refused, in words for the client.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{}: {message}", code.name())]
pub struct Refusal {
    /// The code.
    pub code: Code,
    /// What is wrong and what would be right.
    pub message: String,
    /// The connection closes after this error.
    pub fatal: bool,
    /// When asking again makes sense, s.
    pub retry_after_s: Option<f64>,
    /// What the world of the run failed of, when that is why.
    pub fault: Option<Fault>,
}

impl Refusal {
    /// A refusal after which the connection goes on.
    pub fn new(code: Code, message: impl Into<String>) -> Self {
        Refusal { code, message: message.into(), fatal: false, retry_after_s: None, fault: None }
    }

    /// The same, and the connection closes.
    pub fn fatal(mut self) -> Self {
        self.fatal = true;
        self
    }

    /// The same, because the world of the run failed.
    pub fn by(mut self, fault: Fault) -> Self {
        self.fault = Some(fault);
        self
    }

    /// The same, and asking again makes sense after `seconds`.
    pub fn retry_after(mut self, seconds: f64) -> Self {
        self.retry_after_s = Some(seconds);
        self
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Reply;

    const ALL: [Code; 19] = [
        Code::BadJson,
        Code::UnknownOp,
        Code::BadRequest,
        Code::BadAction,
        Code::StaleTick,
        Code::WrongState,
        Code::UnknownTask,
        Code::UnknownHand,
        Code::HandInTheWay,
        Code::NotAuthorized,
        Code::Forbidden,
        Code::SessionTaken,
        Code::SessionOver,
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
    fn a_fault_is_told_by_its_code_and_only_when_there_is_one() {
        for fault in Fault::ALL {
            assert_eq!(serde_json::to_value(fault).ok(), Some(fault.code().into()));
        }
        let documented = include_str!("../../docs/protocol.md");
        for fault in Fault::ALL {
            assert!(documented.contains(&format!("\n| `{}` | ", fault.code())), "{fault:?}");
        }
        let told = |refusal: &Refusal| serde_json::to_value(Reply::refused(Some(1), refusal)).expect("JSON");
        let refusal = Refusal::new(Code::Internal, "why");
        assert!(told(&refusal).get("fault").is_none());
        assert_eq!(told(&refusal.by(Fault::WorkExhausted))["fault"], "work_exhausted");
    }

    #[test]
    fn the_name_is_what_serde_writes() {
        for code in ALL {
            assert_eq!(serde_json::to_value(code).ok(), Some(code.name().into()));
        }
    }
}
