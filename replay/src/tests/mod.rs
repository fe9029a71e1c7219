//! Replays of short runs, recorded, read, damaged and played again.

mod extremes;
mod forged;
mod hostile;
mod image_export;
mod past;
mod telemetry;

use super::*;
use crate::lower_hex::from_hex;
use palmares_models::hand::Hand;
use palmares_tasks::observation::Wrench;
use palmares_tasks::{Action, BaseTarget, Outcome, Reason, Run, Seed, Task};
use std::sync::Arc;
use tempfile::TempDir;

/// A run to be recorded, and what is to be wrong with it.
struct Scenario {
    ticks: u64,
    header: Header,
    hand: Arc<Hand>,
    signer: Arc<Signer>,
    hand_files: Option<Arc<Vec<u8>>>,
    /// A push before this tick, and whether the recorder hears of it.
    push: Option<(u64, bool)>,
    /// Changes the outcome before it is written.
    forge: fn(&mut Outcome),
}

/// A recorded run.
struct Recorded {
    _folder: TempDir,
    file: ReplayFile,
    bytes: Vec<u8>,
    outcome: Outcome,
}

impl Scenario {
    fn new(hand: &str, ticks: u64) -> Self {
        Scenario::with(Hand::builtin(hand).expect("a hand of the program"), ticks)
    }

    fn with(hand: Arc<Hand>, ticks: u64) -> Self {
        let task = &Task::builtin()[0];
        let header = Header::new("run_1", "crabs", task, &hand, Seed::from_u64(5), 1_700_000_000_000);
        let signer = Arc::new(Signer::random().expect("key"));
        Scenario { ticks, header, hand, signer, hand_files: None, push: None, forge: |_| {} }
    }

    fn record(&self) -> Recorded {
        let folder = tempfile::tempdir().expect("folder");
        let task = Task::builtin().remove(0);
        let mut run = Run::new(task, self.hand.clone(), Seed::from_u64(5)).expect("scene");
        let files = self.hand_files.clone();
        let recorder = Recorder::create(folder.path(), self.header.clone(), &run, &self.signer, files);
        let mut recorder = recorder.expect("recorder");
        for tick in 0..self.ticks {
            if let Some((at, recorded)) = self.push
                && at == tick
            {
                let (link, force) = (run.hand().links[0].name.clone(), [30.0, 0.0, 0.0]);
                let wrench = Wrench { force, torque: [0.0; 3] };
                run.push(&link, wrench, 0.05).expect("pushed");
                if recorded {
                    recorder.push(&link, wrench, 0.05);
                }
            }
            let x = 0.001 * tick as f64;
            let base = BaseTarget::Pose { position: [x, 0.01, 0.8 - x], quat_xyzw: [0.0, 1.0, 0.0, 0.1] };
            let sigma = vec![(0.01 * tick as f64).min(1.0); run.hand().motors.len()];
            run.step(&Action { base: Some(base), hand: Some(sigma), effort: None }).expect("valid");
            recorder.tick(&run);
        }
        let mut outcome = run.finish(Reason::Stopped);
        (self.forge)(&mut outcome);
        let file = recorder.finish(&run, &outcome).expect("written");
        let bytes = std::fs::read(&file.path).expect("file");
        Recorded { _folder: folder, file, bytes, outcome }
    }
}

/// Reads and simulates.
fn check(bytes: &[u8]) -> Result<Verified, VerifyError> {
    verify(&read(bytes)?, &[])
}

#[test]
fn a_recorded_run_replays() {
    let scenario = Scenario::new("softhand", 230);
    let Recorded { file, bytes, outcome, .. } = scenario.record();
    assert_eq!(bytes.len() as u64, file.bytes);
    let replay = read(&bytes).expect("sound");
    assert_eq!(replay.key, scenario.signer.public());
    assert_eq!(replay.sha256, file.sha256);
    assert_eq!(replay.outcome, outcome);
    assert_eq!(replay.header, scenario.header);
    assert_eq!(replay.actions.len(), 230);
    let ticks: Vec<u64> = replay.hashes.iter().map(|(tick, _)| *tick).collect();
    assert_eq!((ticks.as_slice(), replay.states()), ([0, 100, 200].as_slice(), 231));
    let verified = verify(&replay, &[]).expect("the same again");
    assert_eq!((verified.ticks, verified.states, verified.score), (230, 232, outcome.score));
}

#[test]
fn a_push_is_part_of_the_replay() {
    let mut scenario = Scenario::new("pinch", 210);
    scenario.push = Some((150, true));
    assert!(check(&scenario.record().bytes).is_ok());
    scenario.push = Some((150, false));
    let refused = check(&scenario.record().bytes).expect_err("the recorder was not called");
    let VerifyError::StateDiffers { tick, last_equal, .. } = refused else { panic!("{refused}") };
    assert_eq!((tick, last_equal), (151, Some(150)));
}

#[test]
fn a_run_that_is_stopped_at_once_replays() {
    let verified = check(&Scenario::new("reflex", 0).record().bytes).expect("accepted");
    assert_eq!((verified.ticks, verified.states), (0, 2));
}

#[test]
fn an_attached_hand_replays_anywhere() {
    let files = hand_archive("pinch_of_ours", "");
    let mut scenario = Scenario::with(hand_of(&files), 20);
    scenario.hand_files = Some(Arc::new(files));
    let recorded = scenario.record();
    assert!(check(&recorded.bytes).is_ok());
    assert!(read(&recorded.bytes).expect("sound").header.hand_attached);
    // The same name, but softer.
    scenario.hand_files =
        Some(Arc::new(hand_archive("pinch_of_ours", "[every_coordinate]\nstiffness = 0.1\n")));
    assert_eq!(check(&scenario.record().bytes).expect_err("another hand").name(), "other_hand");
    scenario.hand_files = Some(Arc::new(b"no archive".to_vec()));
    assert_eq!(check(&scenario.record().bytes).expect_err("no hand").name(), "other_hand");
    scenario.hand_files = None;
    assert_eq!(check(&scenario.record().bytes).expect_err("no files").name(), "other_hand");
}

/// The seed draws the hand of a run, and again when it is verified.
#[test]
fn a_drawn_hand_is_drawn_again() {
    let own = Hand::builtin("softhand").expect("built in");
    let mut scenario = Scenario::with(own.clone(), 60);
    let plain = scenario.record().outcome.state_hash;
    scenario.header.hand_drawn = Some(own.uncertain_hash());
    scenario.hand = scenario.header.hand_of_run(own.clone()).expect("its ranges");
    let recorded = scenario.record();
    let header = read(&recorded.bytes).expect("sound").header;
    assert_eq!((&header.hand_drawn, header.hand_hash), (&scenario.header.hand_drawn, own.content_hash()));
    assert_ne!(recorded.outcome.state_hash, plain);
    assert!(check(&recorded.bytes).is_ok());
    // Without its mark it would be a run of the hand itself.
    scenario.header.hand_drawn = None;
    let refused = check(&scenario.record().bytes).expect_err("another hand moved");
    assert!(matches!(refused, VerifyError::StateDiffers { .. }), "{refused}");
    scenario.header.hand_drawn = Some("of other ranges".into());
    let refused = check(&scenario.record().bytes).expect_err("other ranges");
    assert_eq!(refused.name(), "other_hand", "{refused}");
}

/// The archive of a hand like the pinch hand, with another name.
fn hand_archive(name: &str, more: &str) -> Vec<u8> {
    use std::io::Write;
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../models/hands/pinch");
    let text = |file: &str| std::fs::read_to_string(folder.join(file)).expect("a file of the hand");
    let settings: String =
        text("hand.toml").lines().filter(|l| !l.starts_with("name =")).map(|l| format!("{l}\n")).collect();
    let mut zip = zip::ZipWriter::new(std::io::Cursor::new(Vec::new()));
    let options = zip::write::SimpleFileOptions::default();
    for (file, text) in
        [("hand.urdf", text("hand.urdf")), ("hand.toml", format!("name = \"{name}\"\n{settings}{more}"))]
    {
        zip.start_file(file, options).expect("entry");
        zip.write_all(text.as_bytes()).expect("bytes");
    }
    zip.finish().expect("archive").into_inner()
}

fn hand_of(files: &[u8]) -> Arc<Hand> {
    use palmares_models::read::{self, Files, LoadOptions};
    let options = LoadOptions::default();
    let files = Files::archive("hand.zip".as_ref(), files, &options.limits).expect("archive");
    Arc::new(read::from_files(files, None, &options).expect("a hand").hand)
}

#[test]
fn a_recording_that_is_dropped_has_no_end() {
    let folder = tempfile::tempdir().expect("folder");
    let scenario = Scenario::new("pinch", 0);
    let task = Task::builtin().remove(0);
    let mut run = Run::new(task, scenario.hand.clone(), Seed::from_u64(5)).expect("scene");
    let recorder = Recorder::create(folder.path(), scenario.header, &run, &scenario.signer, None);
    let mut recorder = recorder.expect("recorder");
    for _ in 0..110 {
        run.step(&Action::default()).expect("valid");
        recorder.tick(&run);
    }
    drop(recorder);
    let path = folder.path().join("run_1.mcap");
    // The thread ends by itself; nobody waits for it.
    for _ in 0..500 {
        let bytes = std::fs::read(&path).expect("file");
        if bytes.ends_with(mcap::MAGIC) && bytes.len() > 100 {
            break;
        }
        std::thread::sleep(std::time::Duration::from_millis(10));
    }
    let refused = read(&std::fs::read(&path).expect("file")).expect_err("not finished");
    assert_eq!(refused.name(), "truncated", "{refused}");
}

#[test]
fn a_replay_is_not_overwritten() {
    let folder = tempfile::tempdir().expect("folder");
    let scenario = Scenario::new("pinch", 0);
    std::fs::write(folder.path().join("run_1.mcap"), b"evidence").expect("file");
    let run = Run::new(Task::builtin().remove(0), scenario.hand.clone(), Seed::from_u64(5)).expect("scene");
    let refused = Recorder::create(folder.path(), scenario.header, &run, &scenario.signer, None);
    assert!(refused.expect_err("taken").to_string().contains("run_1.mcap"));
}

#[test]
fn the_key_is_made_once_and_is_for_its_owner_alone() {
    use std::os::unix::fs::PermissionsExt;
    let folder = tempfile::tempdir().expect("folder");
    let path = folder.path().join("signing.key");
    let first = Signer::create(&path).expect("made");
    assert!(Signer::create(&path).is_err(), "a key is not written over");
    assert_eq!(std::fs::metadata(&path).expect("file").permissions().mode() & 0o777, 0o600);
    let secret = std::fs::read_to_string(&path).expect("file");
    assert_eq!(secret.parse::<Signer>().expect("a key").public(), first.public());
    assert!(!format!("{first:?}").contains(secret.trim()));
    assert!("not a key".parse::<Signer>().expect_err("no key").to_string().contains("64"));
}

#[test]
fn hexadecimal_has_one_spelling() {
    assert_eq!(from_hex::<2>("0aff"), Some([0x0a, 0xff]));
    for wrong in ["0AFF", "0af", "0afff", "0agf", "+aff"] {
        assert_eq!(from_hex::<2>(wrong), None, "{wrong}");
    }
}

/// The cost of recording where the world is stepped, and on the disk. Run with
/// `cargo test --release -p palmares-replay what_recording_costs -- --ignored --nocapture`.
#[test]
#[ignore = "measures; asserts nothing"]
fn what_recording_costs() {
    use std::time::Instant;
    for name in ["softhand", "reflex"] {
        let folder = tempfile::tempdir().expect("folder");
        let mut scenario = Scenario::new(name, 0);
        scenario.header.run_id = format!("run_{name}");
        let task = Task::builtin().remove(0);
        let mut run = Run::new(task, scenario.hand.clone(), Seed::from_u64(5)).expect("scene");
        let recorder = Recorder::create(folder.path(), scenario.header, &run, &scenario.signer, None);
        let mut recorder = recorder.expect("recorder");
        let (mut recording, mut stepping, mut hashing) = (Vec::new(), Vec::new(), Vec::new());
        const TICKS: u32 = 6000;
        for tick in 0..TICKS {
            // Down into the balls, stirring, grasping and letting go: everything moves all the time.
            let t = f64::from(tick) * 0.01;
            let position = [0.15 * (0.9 * t).sin(), 0.15 * (0.7 * t).cos(), 0.25 + 0.1 * (0.5 * t).sin()];
            let base = BaseTarget::Pose { position, quat_xyzw: [0.0, 1.0, 0.0, 0.1 * t.sin()] };
            let sigma = vec![0.5 + 0.5 * (1.3 * t).sin(); run.hand().motors.len()];
            let start = Instant::now();
            run.step(&Action { base: Some(base), hand: Some(sigma), effort: None }).expect("valid");
            let stepped = Instant::now();
            recorder.tick(&run);
            recording.push(stepped.elapsed());
            stepping.push(stepped - start);
            let start = Instant::now();
            std::hint::black_box(run.world().state().hash());
            hashing.push(start.elapsed());
        }
        let (recording, stepping, hashing) = (micros(recording), micros(stepping), micros(hashing));
        let outcome = run.finish(Reason::Stopped);
        let start = Instant::now();
        let file = recorder.finish(&run, &outcome).expect("written");
        // Others who compute on this machine take the core away for milliseconds now and then: not the mean.
        println!(
            "{name}: {recording} of recording, of which {hashing} of hashing, beside {stepping} of stepping; {} bytes for a minute of run; \
             end {:.1} ms",
            file.bytes,
            start.elapsed().as_secs_f64() * 1e3,
        );
        if let Ok(keep) = std::env::var("PALMARES_KEEP_REPLAYS") {
            std::fs::copy(&file.path, std::path::Path::new(&keep).join(format!("{name}.mcap")))
                .expect("kept");
        }
    }
}

/// Quantiles of times, and the mean of the lower 99 %.
fn micros(mut times: Vec<std::time::Duration>) -> String {
    times.sort();
    let at = |part: usize| times[times.len() * part / 100].as_secs_f64() * 1e6;
    let most = &times[..times.len() * 99 / 100];
    let mean = most.iter().map(std::time::Duration::as_secs_f64).sum::<f64>() * 1e6 / most.len() as f64;
    format!(
        "{:.2} µs (median; 90 % {:.2}, 99 % {:.2}, mean of the lower 99 % {mean:.2})",
        at(50),
        at(90),
        at(99)
    )
}
