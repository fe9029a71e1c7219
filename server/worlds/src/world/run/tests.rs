//! A world whose run ends, refuses or breaks.

use super::*;
use crate::compute::admission::Admission;
use crate::world::stub::{REQUEST, Stub, stub_world};

struct Fixture {
    world: World,
    admission: Admission,
    scheduler: Scheduler,
    background: Background,
}

impl Fixture {
    async fn open(stub: Stub) -> Self {
        let (world, admission) = stub_world(stub);
        Fixture { world, admission, scheduler: Scheduler::new(1), background: Background::new(1) }
    }

    async fn step(&mut self, action: Action, repeat: u32) -> Result<Observation, StepError> {
        let missing = Missing { ticks: repeat, since: self.world.next_tick() - 1 };
        let stepped = self.world.step(&self.scheduler, false, &action, missing).await;
        stepped.map(|stepped| stepped.observation)
    }

    async fn finish(self) -> Result<Outcome, Failure> {
        self.world.finish(&self.background, Reason::Stopped).await
    }
}

#[tokio::test]
async fn repeated_ticks_keep_all_events_and_end_with_the_run() {
    let mut fixture = Fixture::open(Stub { over_at: 5, ..Stub::default() }).await;
    let three = fixture.step(Action::default(), 3).await.expect("steps");
    assert_eq!(three.events.iter().map(|event| event.tick).collect::<Vec<_>>(), [1, 2, 3]);
    let rest = fixture.step(Action::default(), 9).await.expect("steps");
    assert_eq!((rest.tick, rest.events.len()), (5, 2));
    assert_eq!(fixture.finish().await.map(|outcome| outcome.ticks), Ok(5));
}

#[tokio::test]
async fn a_refused_action_changes_nothing() {
    let mut fixture = Fixture::open(Stub::default()).await;
    let wrong = Action { hand: Some(vec![0.5]), base: None, effort: None };
    assert!(matches!(fixture.step(wrong, 1).await, Err(StepError::Action(_))));
    assert_eq!(fixture.step(Action::default(), 1).await.expect("steps").tick, 1);
}

/// Notes every call.
struct CallLog(std::sync::mpsc::Sender<String>);

impl RunObserver for CallLog {
    fn opened(&mut self, run: &Run) {
        self.0.send(format!("open {}", run.tick())).expect("the test reads");
    }
    fn ticked(&mut self, tick: &Ticked<'_>) {
        self.0.send(format!("tick {}", tick.run.tick())).expect("the test reads");
    }
    fn pushed(&mut self, link: &str, _: Wrench, _: f64) {
        self.0.send(format!("push {link}")).expect("the test reads");
    }
    fn finished(&mut self, _: &Run, outcome: &Outcome) {
        self.0.send(format!("end {}", outcome.ticks)).expect("the test reads");
    }
}

#[tokio::test]
async fn observers_see_every_tick_once_and_in_order() {
    let task = Task::builtin().into_iter().find(|task| task.name == "grasp").expect("built in");
    let hand = Hand::builtin("pinch").expect("built in");
    let link = hand.links[0].name.clone();
    let admission = Admission::default();
    let admitted = admission.take(REQUEST, Instant::now(), |_| Ok(())).expect("free");
    let (log, calls) = std::sync::mpsc::channel();
    let observers: Vec<Box<dyn RunObserver>> = vec![Box::new(CallLog(log))];
    let (scheduler, background) = (Scheduler::new(1), Background::new(1));
    let setup = WorldSetup {
        task,
        hand,
        seed: Seed::from_u64(1),
        sensing: Sensing::Sensors,
        noise: Noise::Real,
        shots: vec![],
    };
    let opened = World::open(setup, admitted, &background, observers).await.expect("the scene builds");
    let mut fixture = Fixture { world: opened.world, admission, scheduler, background };
    let news = || calls.try_iter().collect::<Vec<_>>();
    assert_eq!(news(), ["open 0"]);
    fixture.step(Action::default(), 2).await.expect("steps");
    assert_eq!(news(), ["tick 1"], "the controller does not wait for the last");
    fixture.world.notify_observers();
    fixture.world.prepare(&fixture.scheduler.spare().expect("idle"));
    fixture.world.notify_observers();
    assert_eq!(news(), ["tick 2"]);
    fixture.step(Action::default(), 1).await.expect("steps");
    fixture
        .world
        .push(&link, Wrench { force: [1.0, 0.0, 0.0], torque: [0.0; 3] }, 0.1)
        .expect("a valid push");
    fixture.step(Action::default(), 1).await.expect("steps");
    fixture.finish().await.expect("it is counted");
    assert_eq!(news(), ["tick 3".to_owned(), format!("push {link}"), "tick 4".into(), "end 4".into()]);
}

#[test]
fn endless_ticks_do_not_stop_other_worlds() {
    use crate::compute::scheduler::OVERRUN;
    let scheduler = Scheduler::new(2);
    let runtime = tokio::runtime::Runtime::new().expect("starts");
    let step = |stub: Stub| {
        let (mut world, scheduler, runtime) =
            (stub_world(stub).0, scheduler.clone(), runtime.handle().clone());
        let (done, result) = std::sync::mpsc::channel();
        let thread = std::thread::spawn(move || {
            let one = Missing { ticks: 1, since: 0 };
            let stepped = runtime.block_on(world.step(&scheduler, false, &Action::default(), one));
            // The receivers of the endless ones are dropped.
            let _ = done.send(stepped.map(|stepped| stepped.observation.tick).ok());
        });
        (thread, result)
    };
    let (ends, endless): (Vec<_>, Vec<_>) = (0..4)
        .map(|_| {
            let (end, stuck) = std::sync::mpsc::channel();
            (end, step(Stub { endless: Some(stuck), ..Stub::default() }).0)
        })
        .unzip();
    while !scheduler.is_exhausted() {
        std::thread::sleep(Duration::from_millis(1));
    }
    let (innocent, stepped) = step(Stub::default());
    let patience = Instant::now() + Duration::from_secs(60);
    let mut seen = None;
    while seen.is_none() && Instant::now() < patience {
        scheduler.replace_overrun(Instant::now() + OVERRUN);
        seen = stepped.recv_timeout(Duration::from_millis(5)).ok();
    }
    // Before the assertions: a thread that never ends would hang the tests.
    drop(ends);
    for thread in endless.into_iter().chain([innocent]) {
        thread.join().expect("no panic");
    }
    assert_eq!(seen, Some(Some(1)));
}

#[tokio::test]
async fn an_unsound_or_panicking_world_is_a_fault_and_frees_its_place() {
    let exhausted = Stub { unsound_at: 2, breaks: Fault::WorkExhausted, ..Stub::default() };
    for (stub, fault) in [
        (Stub { unsound_at: 2, ..Stub::default() }, Fault::Unsolvable),
        (Stub { panic_at: 2, ..Stub::default() }, Fault::Crashed),
        (exhausted, Fault::WorkExhausted),
    ] {
        let failure = Failure { fault, tick: 2, step: Some(20) };
        let mut fixture = Fixture::open(stub).await;
        assert!(fixture.step(Action::default(), 1).await.is_ok());
        for _ in 0..2 {
            let failed = fixture.step(Action::default(), 1).await;
            assert!(matches!(failed, Err(StepError::Failed(of)) if of == failure), "{failed:?}");
        }
        let admission = fixture.admission.clone();
        assert_eq!(fixture.finish().await.err(), Some(failure));
        assert_eq!(admission.open().all(), 0);
    }
}
