//! One world in the process.

use crate::analysis;
use crate::history::{Entry, History, Push};
use crate::interrupt::{LOOK, ProgressReport, interruptible, interruptible_with_progress, report_progress};
use crate::lookup;
use crate::message;
use crate::parameters;
use crate::pictures;
use crate::snapshot::Snapshot;
use crate::state::{self, Placed};
use crate::training::{Training, TrainingRequest, drawn_of, status};
use palmares_analysis::mechanics::Mechanics;
use palmares_models::hand::Hand;
use palmares_protocol::obs::{Obs, Opened};
use palmares_protocol::reply::{Ack, RunInfo, RunResult};
use palmares_protocol::{Code, Encoding, Mode, Perturb, Refusal, Reply, Request, Step, request};
use palmares_replay::{Header, Recorder, Signer, pack};
use palmares_tasks::observation::Wrench;
use palmares_tasks::run::{PushedPart, Shot, ShotError};
use palmares_tasks::training::{Given, Shaper, open};
use palmares_tasks::{Observation, Outcome, Reason, Run, Seed, Sensing};
use pyo3::exceptions::{PyOSError, PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Instant, SystemTime, UNIX_EPOCH};

/// A world, which answers the requests `step`, `perturb` and `stop` of the protocol as a server's session does, in
/// MessagePack.
#[pyclass(name = "World", module = "palmares._native")]
pub(crate) struct PyWorld {
    run: Run,
    number: u64,
    sensing: Sensing,
    run_id: String,
    /// Unknown after going on from bytes.
    history: Option<History>,
    pushes: Vec<Push>,
    /// Shapes rewards, if they are shaped; the shaped part of the last step's reward.
    shaper: Option<Shaper>,
    shaping: f64,
    /// Drawn numbers of the hand, by name.
    drawn: Vec<(String, f64)>,
    /// Numbers that were given rather than drawn; each uncertain number of the hand, given or drawn; the task's number of objects.
    given: Given,
    hand_numbers: Vec<Option<f64>>,
    objects: usize,
    /// The hand before its numbers were drawn.
    hand: Arc<Hand>,
    /// Set when the run was stopped.
    outcome: Option<Outcome>,
    /// A step that an exception of a signal handler interrupted.
    unfinished: Option<Unfinished>,
    /// The last request as it came, and its reply: an exception may have come before Python had it.
    answered: Option<(Vec<u8>, Py<PyBytes>)>,
}

/// A step of which ticks are missing.
#[derive(Clone)]
struct Unfinished {
    /// The request as it came.
    request: Vec<u8>,
    id: u64,
    step: Step,
    left: u32,
    /// Events of its ticks until now.
    events: Vec<palmares_tasks::Event>,
}

#[pymethods]
impl PyWorld {
    #[new]
    #[pyo3(signature = (task, hand, seed, sensing, noise, training=None, parameters=None))]
    #[allow(clippy::too_many_arguments)]
    fn new(
        py: Python<'_>,
        task: &str,
        hand: &str,
        seed: u64,
        sensing: &str,
        noise: &str,
        training: Option<TrainingRequest>,
        parameters: Option<Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        let (task, hand) = (lookup::task(task)?, lookup::hand(hand)?);
        let (sensing, noise) = (lookup::sensing(sensing)?, lookup::noise(noise)?);
        let number = lookup::seed(seed)?;
        let training = Training::of(training, &task, &hand, noise)?;
        let objects = task.objects.count;
        let given = parameters::given(parameters.as_ref(), &hand, 1, objects)?.pop().unwrap_or_default();
        let options = training.options.clone().give(&hand, given.clone()).map_err(PyValueError::new_err)?;
        let drawn = training.drawn_names(&hand).into_iter();
        let drawn = drawn.zip(drawn_of(&options, &hand, Seed::from_u64(number))).collect();
        let hand_numbers = options.hand_numbers(&hand, Seed::from_u64(number));
        let own = Arc::clone(&hand);
        let build = move || open(&task, &hand, Seed::from_u64(number), noise, &options);
        let run = interruptible(py, build)?.map_err(|error| PyValueError::new_err(error.to_string()))?;
        let mut id = [0; 8];
        getrandom::fill(&mut id).map_err(|error| PyRuntimeError::new_err(error.to_string()))?;
        let run_id = format!("local_{:016x}", u64::from_le_bytes(id));
        let history = Some(History::default());
        let shaper = training.shaper(&run);
        let (pushes, shaping, outcome) = (Vec::new(), 0.0, None);
        Ok(PyWorld {
            run,
            number,
            sensing,
            run_id,
            history,
            pushes,
            shaper,
            shaping,
            drawn,
            given,
            hand_numbers,
            objects,
            hand: own,
            outcome,
            unfinished: None,
            answered: None,
        })
    }

    /// The message `obs` as in the reply to `reset`, with the scene; pictures of `cameras`.
    fn opened<'py>(&mut self, py: Python<'py>, cameras: Vec<String>) -> PyResult<Bound<'py, PyBytes>> {
        let reply = self.observation(&cameras).map(|observation| {
            let task = self.run.task();
            let run = Some(Opened {
                task: task.name.clone(),
                hand: self.run.hand().name.clone(),
                mode: Mode::Lockstep,
                sensing: self.sensing,
                noise: self.run.noise(),
                seed: Some(self.number),
                tick_s: task.tick_s,
                time_limit_s: task.time_limit_s,
            });
            let scene = Some(self.run.scene().clone().redacted_for(self.sensing));
            Obs { run, scene, ..self.obs(0, observation) }
        });
        message::of(py, 0, reply.map(|obs| Reply::Obs(Box::new(obs))))
    }

    /// Answers a request; calls `report` with the number of ticks of a step that are done. The last request, sent again, gets the same
    /// reply; an interrupted step, sent again, is made to its end.
    #[pyo3(signature = (request, report=None))]
    fn answer<'py>(
        &mut self,
        py: Python<'py>,
        request: &[u8],
        report: ProgressReport<'py>,
    ) -> PyResult<Bound<'py, PyBytes>> {
        if let Some((last, reply)) = &self.answered
            && last == request
        {
            return Ok(reply.bind(py).clone());
        }
        if let Some(unfinished) = self.unfinished.take_if(|unfinished| unfinished.request == request) {
            let id = unfinished.id;
            let reply = self.go_on(py, unfinished, &report)?;
            return self.answered(py, id, request, reply);
        }
        let parsed = Encoding::MsgPack.read_binary(request);
        let id = parsed.id.unwrap_or(0);
        let reply = match parsed.request {
            Ok(_) if self.unfinished.is_some() => {
                Err(Refusal::new(Code::WrongState, "a step was interrupted: finish it first"))
            }
            Ok(Request::Step(step)) => self.begin_step(py, id, step, request, &report)?,
            Ok(Request::Perturb(push)) => self.perturb(id, push),
            Ok(Request::Stop(request::Stop {})) => Ok(self.stop(py, id)?),
            Ok(other) => Err(Refusal::new(
                Code::WrongState,
                format!("`{}`: a world in the process answers step, perturb and stop", other.op()),
            )),
            Err(refusal) => Err(refusal),
        };
        self.answered(py, id, request, reply)
    }

    /// Ticks that an interrupted step still has to make.
    #[getter]
    fn unfinished(&self) -> Option<u32> {
        self.unfinished.as_ref().map(|unfinished| unfinished.left)
    }

    /// Drops the rest of an interrupted step.
    fn drop_step(&mut self) {
        self.unfinished = None;
    }

    /// The observation now, as the message `obs`.
    fn observe<'py>(
        &mut self,
        py: Python<'py>,
        sensing: &str,
        cameras: Vec<String>,
    ) -> PyResult<Bound<'py, PyBytes>> {
        let own = std::mem::replace(&mut self.sensing, lookup::sensing(sensing)?);
        let reply = self.observation(&cameras).map(|observation| self.obs(0, observation));
        self.sensing = own;
        message::of(py, 0, reply.map(|obs| Reply::Obs(Box::new(obs))))
    }

    /// Takes a snapshot.
    fn snapshot(&self) -> Snapshot {
        let (run, given, history) = (self.run.snapshot(), self.given.clone(), self.history.clone());
        Snapshot { run, number: self.number, given, history }
    }

    /// Continues from a snapshot of this world, or of another of the same task, hand, seed and noise.
    fn restore(&mut self, from: &Bound<'_, Snapshot>) -> PyResult<()> {
        let from = from.get();
        self.run.restore(&from.run).map_err(|error| PyValueError::new_err(error.to_string()))?;
        self.history.clone_from(&from.history);
        (self.unfinished, self.answered) = (None, None);
        self.pushes.clear();
        self.outcome = None;
        self.shaping = 0.0;
        self.shaper.iter_mut().for_each(|shaper| shaper.restart(&self.run));
        Ok(())
    }

    /// Another world that continues from here on its own.
    fn fork(&self, py: Python<'_>) -> PyWorld {
        PyWorld {
            run: self.run.fork(),
            number: self.number,
            sensing: self.sensing,
            run_id: self.run_id.clone(),
            history: self.history.clone(),
            pushes: self.pushes.clone(),
            shaper: self.shaper.clone(),
            shaping: self.shaping,
            drawn: self.drawn.clone(),
            given: self.given.clone(),
            hand_numbers: self.hand_numbers.clone(),
            objects: self.objects,
            hand: Arc::clone(&self.hand),
            outcome: self.outcome.clone(),
            unfinished: self.unfinished.clone(),
            answered: self.answered.as_ref().map(|(request, reply)| (request.clone(), reply.clone_ref(py))),
        }
    }

    /// The contacts of the hand with an object in the last step, and the hand's posture.
    fn held<'py>(&self, py: Python<'py>, object: usize) -> analysis::arrays::Answer<'py> {
        analysis::held(py, self.run.world(), object)
    }

    /// Quantities by their names.
    fn arrays<'py>(&self, py: Python<'py>, names: Vec<String>) -> PyResult<Bound<'py, PyDict>> {
        let quantities = state::named(&names)?;
        let (hand, objects) = (self.run.hand(), self.run.object_states().count());
        let mut row = Vec::new();
        state::row(&quantities, &self.run, &mut Mechanics::default(), objects, &mut row);
        state::arrays(py, &quantities, hand, objects, &[], &[row])
    }

    /// Contacts of the last step, in `most` rows.
    fn contacts<'py>(&self, py: Python<'py>, most: usize) -> PyResult<Bound<'py, PyDict>> {
        state::contact_arrays(py, &[], most, &[state::contacts(&self.run, most)])
    }

    /// A picture: arrays (height, width, …) of each kind.
    fn pictures<'py>(
        &mut self,
        py: Python<'py>,
        request: pictures::PictureRequest,
        kinds: Vec<String>,
    ) -> PyResult<Bound<'py, PyDict>> {
        pictures::pictures(py, vec![&mut self.run], None, &request, &kinds, &[])
    }

    /// Puts the hand, its motors or the objects elsewhere. After an error nothing has changed.
    fn place(&mut self, given: Placed<'_>) -> PyResult<()> {
        let objects = self.run.object_states().count();
        let placements = given.placements(self.run.hand(), objects, &[], &[objects])?;
        for placement in &placements {
            self.run.place(placement).map_err(|error| PyValueError::new_err(error.to_string()))?;
        }
        (self.outcome, self.unfinished, self.answered) = (None, None, None);
        self.shaping = 0.0;
        self.shaper.iter_mut().for_each(|shaper| shaper.restart(&self.run));
        Ok(())
    }

    /// Pushes an object at its centre of mass from the next tick on. The run has no replay from then on.
    fn push_object(
        &mut self,
        object: usize,
        force: [f64; 3],
        torque: [f64; 3],
        duration_s: f64,
    ) -> PyResult<()> {
        if self.outcome.is_some() {
            return Err(PyValueError::new_err("the run is over; reset() opens another"));
        }
        let pushed = self.run.push_part(PushedPart::Object(object), Wrench { force, torque }, duration_s);
        pushed.map_err(|error| PyValueError::new_err(error.to_string()))?;
        self.answered = None;
        Ok(())
    }

    /// Digest of the state, 16 hexadecimal digits.
    fn state_hash(&self) -> String {
        self.run.state_hash()
    }

    /// The shaped part of the last step's reward; none where rewards are not shaped.
    #[getter]
    fn shaping(&self) -> Option<f64> {
        self.shaper.as_ref().map(|_| self.shaping)
    }

    /// The potential now, term by term; none where rewards are not shaped.
    #[getter]
    fn potential<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyDict>>> {
        let Some(terms) = self.shaper.as_ref().map(Shaper::terms) else { return Ok(None) };
        let dict = PyDict::new(py);
        dict.set_item("distance", terms.distance)?;
        dict.set_item("contact", terms.contact)?;
        dict.set_item("lift", terms.lift)?;
        dict.set_item("transport", terms.transport)?;
        dict.set_item("brought", terms.brought)?;
        Ok(Some(dict))
    }

    /// Drawn numbers of the hand, by name.
    #[getter]
    fn hand_drawn(&self) -> Vec<(String, f64)> {
        self.drawn.clone()
    }

    /// Objects of the task.
    #[getter]
    fn objects(&self) -> usize {
        self.objects
    }

    /// Links of the hand.
    #[getter]
    fn links(&self) -> usize {
        self.hand.links.len()
    }

    /// The numbers in effect, as arrays of one run.
    fn parameters<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        parameters::in_effect(py, &[(&self.run, &self.hand_numbers)], &self.hand, self.objects)
    }

    /// Whether it differs from the runs of its task.
    #[getter]
    fn varied(&self) -> bool {
        self.run.task().is_varied() || self.run.is_altered()
    }

    #[getter]
    fn tick(&self) -> u64 {
        self.run.tick()
    }

    #[getter]
    fn score(&self) -> f64 {
        self.outcome.as_ref().map_or_else(|| self.run.score(), |outcome| outcome.score)
    }

    /// Plays the run again and writes it as a replay, signed by a key that is made for it and forgotten.
    /// Calls `report` with the number of ticks played.
    /// The files of a hand of one's own are at `hand_path` and go into the replay.
    #[pyo3(signature = (path, team, hand_path, report=None))]
    fn save_replay(
        &self,
        py: Python<'_>,
        path: PathBuf,
        team: String,
        hand_path: &str,
        report: ProgressReport<'_>,
    ) -> PyResult<()> {
        let Some(history) = &self.history else {
            let message =
                "this world went on from the bytes of a snapshot, which do not hold the ticks before";
            return Err(PyValueError::new_err(message));
        };
        let (task, hand) = (Arc::clone(self.run.task()), Arc::clone(self.run.hand()));
        if self.run.is_altered() {
            let message =
                "something was put elsewhere or pushed in this run: its actions alone do not play it again";
            return Err(PyValueError::new_err(message));
        }
        if task.is_varied() {
            let message =
                "a randomised run, or one with some of the objects, is none of the task's: it has no replay";
            return Err(PyValueError::new_err(message));
        }
        let hand_files = match Hand::builtin(hand_path) {
            Some(_) => None,
            None => {
                let files = pack(Path::new(hand_path), &hand);
                let refused = |error| PyValueError::new_err(format!("hand: {hand_path}: {error}"));
                Some(Arc::new(files.map_err(refused)?))
            }
        };
        let (seed, noise) = (self.run.seed(), self.run.noise());
        let started =
            SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |since| since.as_millis() as u64);
        let header = Header {
            sensing: self.sensing,
            noise,
            seed_number: Some(self.number),
            ..Header::new(&self.run_id, &team, &task, &hand, seed, started)
        };
        let (history, reason) = (history.clone(), self.outcome.as_ref().map(|outcome| outcome.reason));
        let work = move |ticks: &AtomicU64| -> Result<(), String> {
            let failed = |error: &dyn ToString| error.to_string();
            let mut run = Run::new(task, hand, seed).map_err(|error| failed(&error))?.with_noise(noise);
            let signer = Arc::new(Signer::random().map_err(|error| failed(&error))?);
            let folder = path.parent().map_or_else(PathBuf::new, |parent| parent.join(".palmares-replay"));
            let recorder = Recorder::create(&folder, header, &run, &signer, hand_files);
            let mut recorder = recorder.map_err(|error| failed(&error))?;
            for Entry { pushes, action } in history.entries() {
                for Push { link, wrench, duration_s } in pushes {
                    run.push(&link, wrench, duration_s).map_err(|error| failed(&error))?;
                    recorder.push(&link, wrench, duration_s);
                }
                run.step(&action).map_err(|error| failed(&error))?;
                recorder.tick(&run);
                ticks.store(run.tick(), Ordering::Relaxed);
            }
            let reason = reason.or_else(|| run.over()).unwrap_or(Reason::Stopped);
            let outcome = run.finish(reason);
            let written = recorder.finish(&run, &outcome).map_err(|error| failed(&error))?;
            std::fs::rename(&written.path, &path).map_err(|error| failed(&error))?;
            // Another replay may be on its way.
            let _ = std::fs::remove_dir(&folder);
            Ok(())
        };
        interruptible_with_progress(py, &report, work)?.map_err(PyOSError::new_err)
    }
}

impl PyWorld {
    fn obs(&self, id: u64, observation: Observation) -> Obs {
        let run_id = self.run_id.clone();
        Obs {
            id: Some(id),
            run_id,
            session_left_s: None,
            observation,
            late_s: None,
            resumed: false,
            run: None,
            scene: None,
        }
    }

    /// The observation now.
    fn observation(&mut self, cameras: &[String]) -> Result<Observation, Refusal> {
        let shots = self.shots(cameras)?;
        Ok(self.looked(&shots))
    }

    fn shots(&self, cameras: &[String]) -> Result<Vec<Shot>, Refusal> {
        self.run
            .shots(cameras, self.sensing)
            .map_err(|error: ShotError| Refusal::new(Code::UnknownCamera, error.to_string()))
    }

    fn looked(&mut self, shots: &[Shot]) -> Observation {
        let mut observation = self.run.observe(self.sensing);
        observation.cameras = self.run.expose(shots).iter().map(|taken| taken.render().clone()).collect();
        observation
    }

    /// Encodes a reply, and keeps it with its request.
    fn answered<'py>(
        &mut self,
        py: Python<'py>,
        id: u64,
        request: &[u8],
        reply: Result<Reply, Refusal>,
    ) -> PyResult<Bound<'py, PyBytes>> {
        let reply = message::of(py, id, reply)?;
        self.answered = Some((request.to_vec(), reply.clone().unbind()));
        Ok(reply)
    }

    fn begin_step(
        &mut self,
        py: Python<'_>,
        id: u64,
        step: Step,
        request: &[u8],
        report: &ProgressReport<'_>,
    ) -> PyResult<Result<Reply, Refusal>> {
        if let Err(refusal) = self.may_step(&step) {
            return Ok(Err(refusal));
        }
        let (left, request, events) = (step.repeat, request.to_vec(), Vec::new());
        self.go_on(py, Unfinished { request, id, step, left, events }, report)
    }

    /// Steps without the interpreter's lock. An exception of a signal handler or of `report` leaves the rest in `unfinished`.
    fn go_on(
        &mut self,
        py: Python<'_>,
        mut unfinished: Unfinished,
        report: &ProgressReport<'_>,
    ) -> PyResult<Result<Reply, Refusal>> {
        let shots = match self.shots(&unfinished.step.cameras) {
            Ok(shots) => shots,
            Err(refusal) => return Ok(Err(refusal)),
        };
        while unfinished.left > 0 && self.run.over().is_none() {
            py.detach(|| self.ticks(&mut unfinished));
            if let Some(failure) = self.run.failure() {
                self.outcome = Some(self.run.finish(Reason::WorldFault));
                let message = format!("{failure}. The run is void; reset opens another");
                return Ok(Err(Refusal::new(Code::Internal, message).by(failure.fault)));
            }
            let done = u64::from(unfinished.step.repeat - unfinished.left);
            if let Err(interrupted) = py.check_signals().and_then(|()| report_progress(report, done)) {
                self.unfinished = Some(unfinished);
                return Err(interrupted);
            }
        }
        let Unfinished { id, events, .. } = unfinished;
        self.shaping = self.shaper.as_mut().map_or(0.0, |shaper| shaper.step(&self.run));
        let mut observation = py.detach(|| self.looked(&shots));
        observation.events = events;
        Ok(Ok(Reply::Obs(Box::new(self.obs(id, observation)))))
    }

    fn may_step(&self, step: &Step) -> Result<(), Refusal> {
        if self.outcome.is_some() || self.run.over().is_some() {
            return Err(Refusal::new(Code::WrongState, "the run is over"));
        }
        if step.tick != self.run.tick() {
            let message = format!("tick {} is not the current tick {}", step.tick, self.run.tick());
            return Err(Refusal::new(Code::StaleTick, message));
        }
        if step.repeat == 0 {
            return Err(Refusal::new(Code::BadRequest, "repeat must be at least 1"));
        }
        self.run.check(&step.action).map_err(|error| Refusal::new(Code::BadAction, error.to_string()))
    }

    /// Steps until it is time to look for signals.
    fn ticks(&mut self, Unfinished { step, left, events, .. }: &mut Unfinished) {
        let begun = Instant::now();
        while *left > 0 && self.run.over().is_none() && self.run.fault().is_none() && begun.elapsed() < LOOK {
            // It has been checked.
            if self.run.step(&step.action).is_err() {
                return;
            }
            *left -= 1;
            events.extend(self.run.events().iter().map(|event| event.redacted_for(self.sensing)));
            if let Some(history) = &mut self.history {
                let pushes = std::mem::take(&mut self.pushes);
                history.push(Entry { pushes, action: self.run.applied().clone() });
            }
        }
    }

    fn perturb(&mut self, id: u64, push: Perturb) -> Result<Reply, Refusal> {
        let wrench = Wrench { force: push.wrench.force, torque: push.wrench.torque };
        let pushed = self.run.push(&push.link, wrench, push.duration_s);
        pushed.map_err(|error| Refusal::new(Code::BadRequest, error.to_string()))?;
        self.pushes.push(Push { link: push.link, wrench, duration_s: push.duration_s });
        Ok(Reply::Ack(Ack { id, tick: self.run.tick() + 1 }))
    }

    /// Lets the objects settle and counts; another time the same result.
    fn stop(&mut self, py: Python<'_>, id: u64) -> PyResult<Reply> {
        if self.outcome.is_none() {
            let reason = self.run.over().unwrap_or(Reason::Stopped);
            self.outcome = Some(py.detach(|| self.run.finish(reason)));
            py.check_signals()?;
        }
        let Some(outcome) = self.outcome.clone() else {
            return Err(PyRuntimeError::new_err("the run was not counted"));
        };
        let status = status(&outcome, self.varied());
        let run = RunInfo {
            run_id: self.run_id.clone(),
            task: self.run.task().name.clone(),
            hand: self.run.hand().name.clone(),
            mode: Mode::Lockstep,
            tick: self.run.tick(),
            open: false,
        };
        let hash = self.run.task().content_hash();
        let note = self.run.failure().map(|failure| failure.to_string());
        let result = RunResult { id: Some(id), note, ..RunResult::new(run, hash, status, outcome) };
        Ok(Reply::Result(Box::new(result)))
    }
}
