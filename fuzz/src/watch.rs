//! The requests of viewers.

use crate::parts::Seeds;

pub(crate) fn run(data: &[u8]) -> bool {
    std::str::from_utf8(data).is_ok_and(palmares_server::untrusted::watch_request)
}

pub(crate) fn seeds() -> Seeds {
    let texts = [
        r#"{"op":"subscribe","id":1,"session_id":"ses_1","overlays":["telemetry","contacts","verdicts"]}"#,
        r#"{"op":"subscribe","id":2,"run_id":"run_1"}"#,
        r#"{"op":"subscribe","id":3,"featured":true,"overlays":[]}"#,
        r#"{"op":"subscribe","id":4,"leaderboard":true}"#,
        r#"{"op":"list","id":5}"#,
        r#"{"op":"bye","id":6}"#,
    ];
    texts.iter().enumerate().map(|(k, text)| (format!("{k}.json"), text.as_bytes().to_vec())).collect()
}
