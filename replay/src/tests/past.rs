//! Recordings that another process continues.

use super::*;
use crate::format::HASH;
use palmares_tasks::run::Snapshot;
use std::path::Path;

const TICKS: u64 = 340;

/// A run with events in its first tick, and a push.
struct Relay {
    task: Arc<Task>,
    scenario: Scenario,
}

/// One process' part of a run.
struct Leg {
    run: Run,
    recorder: Recorder,
}

impl Relay {
    fn new() -> Self {
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tasks/balls/task.toml");
        let text = std::fs::read_to_string(file).expect("a task of the program");
        // The balls begin in the goal: the first tick has an event for each.
        let text = text.replace("goal = \"box_b\"\nstart = \"box_a\"", "goal = \"box_a\"\nstart = \"box_b\"");
        let task = Arc::new(Task::parse("task.toml", &text).expect("a task"));
        let mut scenario = Scenario::new("pinch", 0);
        let Header { run_id, team, seed, started_unix_ms, .. } = &scenario.header;
        scenario.header = Header::new(run_id, team, &task, &scenario.hand, *seed, *started_unix_ms);
        Relay { task, scenario }
    }

    fn begin(&self, folder: &Path) -> Leg {
        let Scenario { header, hand, signer, .. } = &self.scenario;
        let run = Run::new(self.task.clone(), hand.clone(), header.seed).expect("scene");
        let recorder = Recorder::create(folder, header.clone(), &run, signer, None).expect("recorder");
        Leg { run, recorder }
    }

    /// Continues after the ticks of `log`, from a snapshot of some tick before its end.
    fn take_over(&self, folder: &Path, log: &[LoggedTick], snapshot: &Snapshot) -> Leg {
        let mut leg = self.begin(folder);
        log.iter().cloned().for_each(|tick| leg.recorder.past(tick));
        leg.run.restore(snapshot).expect("of this run");
        for tick in &log[snapshot.tick() as usize..] {
            for PushMessage { link, wrench, duration_s } in &tick.pushes {
                leg.run.push(link, *wrench, *duration_s).expect("pushed");
            }
            leg.run.step(&tick.action).expect("valid");
            assert_eq!((StateHash::of(&leg.run), leg.run.events()), (tick.state, tick.events.as_slice()));
        }
        leg
    }
}

impl Leg {
    /// Plays up to a tick and logs. Returns a snapshot of a tick before the end.
    fn play(&mut self, until: u64, log: &mut Vec<LoggedTick>) -> Snapshot {
        let mut snapshot = self.run.snapshot();
        while self.run.tick() < until {
            let tick = self.run.tick();
            let mut pushes = Vec::new();
            if tick == 150 {
                let (link, force) = (self.run.hand().links[0].name.clone(), [30.0, 0.0, 0.0]);
                let wrench = Wrench { force, torque: [0.0; 3] };
                self.run.push(&link, wrench, 0.05).expect("pushed");
                self.recorder.push(&link, wrench, 0.05);
                pushes.push(PushMessage { link, wrench, duration_s: 0.05 });
            }
            // Into the balls.
            let t = 0.01 * tick as f64;
            let position = [0.15 * t.sin(), 0.1 * t, (0.8 - 0.3 * t).max(0.15)];
            let base = BaseTarget::Pose { position, quat_xyzw: [0.0, 1.0, 0.0, 0.1] };
            let action = Action {
                base: Some(base),
                hand: Some(vec![(0.3 * t).min(1.0); self.run.hand().motors.len()]),
                effort: None,
            };
            self.run.step(&action).expect("valid");
            self.recorder.tick(&self.run);
            let (action, events) = (self.run.applied().clone(), self.run.events().to_vec());
            log.push(LoggedTick { action, state: StateHash::of(&self.run), events, pushes });
            if self.run.tick() + 7 <= until {
                snapshot = self.run.snapshot();
            }
        }
        snapshot
    }

    fn end(mut self) -> Vec<u8> {
        let outcome = self.run.finish(Reason::Stopped);
        let file = self.recorder.finish(&self.run, &outcome).expect("written");
        std::fs::read(&file.path).expect("file")
    }
}

/// The chain of a replay: its values in the file's messages, and the last one.
fn chain(bytes: &[u8]) -> Vec<String> {
    let mut chain = Vec::new();
    for message in mcap::MessageStream::new(bytes).expect("a file") {
        let message = message.expect("a message");
        if message.channel.topic == HASH {
            let value: serde_json::Value = serde_json::from_slice(&message.data).expect("JSON");
            chain.push(value["chain"].as_str().expect("a chain").to_owned());
        }
    }
    let summary = String::from_utf8_lossy(bytes);
    let (_, last) = summary.rsplit_once("chain").expect("the signature");
    chain.push(last.chars().filter(char::is_ascii_hexdigit).take(64).collect());
    chain
}

#[test]
fn a_recording_that_was_handed_over_has_the_chain_of_one_that_was_not() {
    let relay = Relay::new();
    let check = |bytes: &[u8]| verify(&read(bytes)?, std::slice::from_ref(&relay.task));
    let whole = {
        let folder = tempfile::tempdir().expect("folder");
        let mut leg = relay.begin(folder.path());
        let mut log = Vec::new();
        leg.play(TICKS, &mut log);
        assert!(log.iter().any(|tick| !tick.events.is_empty()), "events are part of the chain");
        leg.end()
    };
    let verified = check(&whole).expect("sound");
    for handed_over in [&[1][..], &[99], &[100], &[101], &[200], &[151, 152], &[100, 300], &[37, 338]] {
        let mut log = Vec::new();
        let first = tempfile::tempdir().expect("folder");
        let mut leg = relay.begin(first.path());
        let mut folders = vec![first];
        for &tick in handed_over {
            let snapshot = leg.play(tick, &mut log);
            // The earlier process is gone, with its file.
            drop(leg);
            folders.push(tempfile::tempdir().expect("folder"));
            leg = relay.take_over(folders.last().expect("a folder").path(), &log, &snapshot);
        }
        leg.play(TICKS, &mut log);
        let bytes = leg.end();
        assert_eq!(chain(&bytes), chain(&whole), "handed over at {handed_over:?}");
        assert_eq!(check(&bytes).expect("sound"), verified, "handed over at {handed_over:?}");
        let (own, other) = (read(&bytes).expect("sound"), read(&whole).expect("sound"));
        assert_eq!((own.actions, own.events, own.hashes), (other.actions, other.events, other.hashes));
        assert!(own.pose_messages <= other.pose_messages);
    }
}

#[test]
fn a_header_is_the_same_after_json() {
    let header = Scenario::new("pinch", 0).header;
    let official = Header {
        mode: CompetitionMode::Official,
        pacing: Pacing::Realtime,
        noise: palmares_tasks::Noise::Real,
        k: Some(3),
        tick_s: 0.01,
        team: "crabs \"and\" ünïcode".into(),
        ..header.clone()
    };
    for header in [header, official] {
        assert_eq!(Header::from_json(&header.to_json()).expect("its own text"), header);
    }
    for other in ["", "{}", "[]", "{\"format\":1}", "{\"format\":\"2\"}"] {
        assert_eq!(Header::from_json(other).expect_err("no header").name(), "not_a_replay");
    }
}
