//! Replays: MCAP as it is, or the messages of a short run in order, as text. These replace the messages of a recorded run,
//! whose chain and signature are made anew, so that the reader gets beyond them.

use crate::parts::{self, Seeds};
use palmares_models::hand::Hand;
use palmares_replay::forge::rewritten;
use palmares_replay::{Header, Recorder, Signer, Trajectory, each_pose_message, read};
use palmares_tasks::{Action, Reason, Run, Seed, Task};
use serde_json::Value;
use std::cell::RefCell;
use std::collections::BTreeMap;
use std::rc::Rc;
use std::sync::{Arc, OnceLock};

/// A recorded run and the key that signed it.
struct Recorded {
    bytes: Vec<u8>,
    signer: Arc<Signer>,
}

fn recorded() -> &'static Recorded {
    static RECORDED: OnceLock<Recorded> = OnceLock::new();
    RECORDED.get_or_init(|| {
        let task = Arc::new(Task::parse("task.toml", crate::hand::TASK).expect("a valid task"));
        let hand = Hand::builtin("pinch").expect("a built-in hand");
        let (seed, signer) = (Seed([7; 32]), Arc::new(Signer::random().expect("random numbers")));
        let header = Header::new("run_1", "crabs", &task, &hand, seed, 1_700_000_000_000);
        let folder = tempfile::tempdir().expect("a folder");
        let mut run = Run::new(task, hand, seed).expect("a scene");
        let mut recorder = Recorder::create(folder.path(), header, &run, &signer, None).expect("a recorder");
        for k in 0..3 {
            let hand = Some(vec![0.5 * f64::from(k % 2); run.hand().motors.len()]);
            run.step(&Action { base: None, hand, effort: None }).expect("a valid action");
            recorder.tick(&run);
        }
        let outcome = run.finish(Reason::Stopped);
        let file = recorder.finish(&run, &outcome).expect("a replay");
        let bytes = std::fs::read(file.path).expect("a replay");
        Recorded { bytes, signer }
    })
}

pub(crate) fn run(data: &[u8]) -> bool {
    if data.starts_with(b"\x89MCAP") {
        check(data)
    } else {
        of_messages(data).is_some_and(|bytes| check(&bytes))
    }
}

/// A replay with the messages of an input, in place of those of the recorded run.
fn of_messages(data: &[u8]) -> Option<Vec<u8>> {
    let mut messages: BTreeMap<String, Vec<String>> = BTreeMap::new();
    for (topic, content) in parts::split(data).into_iter().rev() {
        let text = std::str::from_utf8(content).ok()?;
        // The chain of a hash is written into an object.
        if topic != "/hash" || matches!(serde_json::from_str(text), Ok(Value::Object(_))) {
            messages.entry(topic).or_default().push(text.to_owned());
        }
    }
    let messages = RefCell::new(messages);
    let next = move |topic: &str, old: &str| {
        let mut messages = messages.borrow_mut();
        messages.get_mut(topic).and_then(Vec::pop).unwrap_or_else(|| old.to_owned())
    };
    Some(rewritten(&recorded().bytes, &next, true, &recorded().signer))
}

fn check(bytes: &[u8]) -> bool {
    let mut trajectory = Trajectory::default();
    let _ = each_pose_message(bytes, &mut |_, message| {
        if let Ok(moved) = trajectory.next(message) {
            moved.for_each(drop);
        }
    });
    let Ok(replay) = read(bytes) else { return false };
    replay.states();
    let again = Header::from_json(&replay.header.to_json()).expect("a header that was read can be written");
    assert_eq!(again, replay.header);
    true
}

pub(crate) fn seeds() -> Seeds {
    let Recorded { bytes, signer } = recorded();
    let messages = Rc::new(RefCell::new(Vec::new()));
    let kept = messages.clone();
    let keep = move |topic: &str, text: &str| {
        kept.borrow_mut().push((topic.to_owned(), text.to_owned()));
        text.to_owned()
    };
    rewritten(bytes, &keep, true, signer);
    let messages = messages.take();
    let messages: Vec<(&str, &[u8])> =
        messages.iter().map(|(topic, text)| (topic.as_str(), text.as_bytes())).collect();
    vec![("messages.txt".into(), parts::joined(&messages)), ("whole.mcap".into(), bytes.clone())]
}
