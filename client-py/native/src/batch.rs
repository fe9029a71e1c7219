//! Many worlds on a pool of threads. Every world is stepped by one thread at a time and knows nothing of the others, so that
//! the number of threads changes no bit.

use crate::aligned::Aligned;
use crate::base::Base;
use crate::batch_step::{BatchStep, How};
use crate::fields::{Field, fields};
use crate::interrupt::{ProgressReport, report_progress};
use crate::lookup;
use crate::parameters;
use crate::pictures;
use crate::pushes;
use crate::slot::{self, Opened, Slot};
use crate::snapshot::Snapshot;
use crate::state::{self, Placed};
use crate::training::{Training, TrainingRequest, status};
use crate::workers::Workers;
use numpy::{PyArray1, PyReadonlyArray2, PyUntypedArrayMethods, ToPyArray};
use palmares_analysis::mechanics::Mechanics;
use palmares_models::hand::Hand;
use palmares_tasks::run::{PushedPart, SnapshotError};
use palmares_tasks::training::{Given, Shaper, Terms};
use palmares_tasks::{Fault, Noise, Reason, Run, Seed, Sensing, Task};
use pyo3::exceptions::{PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::cell::RefCell;
use std::sync::Arc;

thread_local! {
    /// The memory of a thread for the mechanics of a hand.
    static MECHANICS: RefCell<Mechanics> = RefCell::default();
}

/// N worlds of one task and hand.
#[pyclass(module = "palmares._native")]
pub(crate) struct Batch {
    task: Arc<Task>,
    hand: Arc<Hand>,
    sensing: Sensing,
    noise: Noise,
    training: Training,
    base: Base,
    fields: Vec<Field>,
    slots: Vec<Slot>,
    workers: Workers,
    /// Steps begun.
    begun: u64,
    /// A step that an exception of a signal handler interrupted.
    unfinished: Option<BatchStep>,
}

#[pymethods]
impl Batch {
    #[new]
    #[allow(clippy::too_many_arguments)]
    fn new(
        task: &str,
        hand: &str,
        count: usize,
        sensing: &str,
        noise: &str,
        threads: usize,
        base: &str,
        training: Option<TrainingRequest>,
    ) -> PyResult<Self> {
        if !(1..=100_000).contains(&count) {
            return Err(PyValueError::new_err(format!("count: found {count}; wanted 1 to 100000")));
        }
        if threads > 1024 {
            return Err(PyValueError::new_err(format!("threads: found {threads}; wanted at most 1024")));
        }
        let (task, hand) = (lookup::task(task)?, lookup::hand(hand)?);
        let base = Base::of(base, &task)?;
        let (sensing, noise) = (lookup::sensing(sensing)?, lookup::noise(noise)?);
        let training = Training::of(training, &task, &hand, noise)?;
        let workers = Workers::new(threads)?;
        let drawn = training.drawn_names(&hand).len();
        let fields = fields(&task, &hand, sensing, drawn);
        let length = fields.iter().map(|field| field.len).sum();
        let slots = (0..count).map(|_| Slot::empty(length, drawn)).collect();
        let (begun, unfinished) = (0, None);
        Ok(Batch { task, hand, sensing, noise, training, base, fields, slots, workers, begun, unfinished })
    }

    /// Threads that step.
    #[getter]
    fn threads(&self) -> usize {
        self.workers.count()
    }

    /// Length of a tick, s.
    #[getter]
    fn tick_s(&self) -> f64 {
        self.task.tick_s
    }

    /// Objects of the task.
    #[getter]
    fn objects(&self) -> usize {
        self.task.objects.count
    }

    /// Links of the hand.
    #[getter]
    fn links(&self) -> usize {
        self.hand.links.len()
    }

    /// Numbers of the base in an action.
    #[getter]
    fn base_len(&self) -> usize {
        self.base.len()
    }

    /// Numbers of an action: those of the base, σ of each motor.
    #[getter]
    fn action_len(&self) -> usize {
        self.base.len() + self.hand.motors.len()
    }

    /// Name and shape of every field of an observation of one world.
    fn fields(&self) -> Vec<(&'static str, Vec<usize>)> {
        self.fields.iter().map(|field| (field.name, field.shape.clone())).collect()
    }

    /// Opens a run in each world of `mask`, by its place in `seeds`, with its row of `parameters`; calls `report` with the
    /// number of open ones.
    #[pyo3(signature = (seeds, mask, report=None, parameters=None))]
    fn reset(
        &mut self,
        py: Python<'_>,
        seeds: Vec<u64>,
        mask: Vec<bool>,
        report: ProgressReport<'_>,
        parameters: Option<Bound<'_, PyDict>>,
    ) -> PyResult<()> {
        self.fits("seeds", seeds.len())?;
        self.fits("mask", mask.len())?;
        for seed in &seeds {
            lookup::seed(*seed)?;
        }
        let given =
            parameters::given(parameters.as_ref(), &self.hand, self.slots.len(), self.task.objects.count)?;
        self.drop_worlds(&mask);
        let Batch { task, hand, noise, sensing, training, slots, workers, .. } = self;
        let workers = workers.started()?;
        let how = slot::How { task, hand, noise: *noise, sensing: *sensing, training };
        let chosen = slots.iter_mut().zip(seeds).zip(given).zip(mask).filter(|(_, chosen)| *chosen);
        let mut chosen: Vec<(&mut Slot, u64, Given, Result<(), String>)> =
            chosen.map(|(((slot, seed), given), _)| (slot, seed, given, Ok(()))).collect();
        let mut opened = 0;
        // A small portion, so that Ctrl-C is checked in between.
        for some in chosen.chunks_mut(2 * workers.count()) {
            py.detach(|| {
                workers.each(some, |(slot, seed, given, built)| *built = slot.open(&how, *seed, given))
            });
            for (_, _, _, built) in &mut *some {
                std::mem::replace(built, Ok(())).map_err(PyValueError::new_err)?;
            }
            py.check_signals()?;
            opened += some.len() as u64;
            report_progress(&report, opened)?;
        }
        Ok(())
    }

    /// Advances each world of `mask` by up to `ticks` under its row of `actions`, which may end with an effort of
    /// each motor; a finished world does not move. Calls `report` with the number of ticks done.
    #[pyo3(signature = (actions, ticks, mask, report=None))]
    fn step(
        &mut self,
        py: Python<'_>,
        actions: PyReadonlyArray2<'_, f64>,
        ticks: u32,
        mask: Vec<bool>,
        report: ProgressReport<'_>,
    ) -> PyResult<()> {
        self.fits("mask", mask.len())?;
        let (count, motors) = (self.slots.len(), self.hand.motors.len());
        let base = self.base.len();
        let [least, most] = [base + motors, base + 2 * motors];
        let width = actions.shape()[1];
        if actions.shape()[0] != count || (width != least && width != most) {
            let shape = actions.shape();
            let message = format!("actions: found shape {shape:?}; wanted ({count}, {least} or {most})");
            return Err(PyValueError::new_err(message));
        }
        let actions: Vec<f64> = actions.as_array().iter().copied().collect();
        if let Some(place) = actions.iter().position(|number| !number.is_finite()) {
            let (world, entry) = (place / width, place % width);
            let message = format!("actions[{world}, {entry}] is {}; wanted finite numbers", actions[place]);
            return Err(PyValueError::new_err(message));
        }
        if let Some(world) = (0..count).find(|k| mask[*k] && self.slots[*k].run.is_none()) {
            return Err(PyValueError::new_err(format!("world {world} has no run yet: call reset first")));
        }
        let base = self.base;
        let short = |row: &[f64]| base == Base::Pose && row[3..7].iter().map(|x| x * x).sum::<f64>() < 1e-12;
        if let Some(world) = actions.chunks(width).position(short) {
            let message = format!("actions[{world}, 3:7] has zero length; wanted a unit quaternion x y z w");
            return Err(PyValueError::new_err(message));
        }
        if self.unfinished.is_some() {
            return Err(PyRuntimeError::new_err("a step was interrupted: finish it first"));
        }
        self.workers.started()?;
        self.slots.iter_mut().for_each(|slot| (slot.reward, slot.shaping) = (0.0, 0.0));
        self.slots.iter_mut().zip(&mask).filter(|(_, chosen)| **chosen).for_each(|(slot, _)| slot.begin());
        self.begun += 1;
        self.unfinished = Some(BatchStep { actions, width, ticks, left: ticks, mask });
        self.finish(py, report)
    }

    /// Number of steps begun.
    #[getter]
    fn begun(&self) -> u64 {
        self.begun
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

    /// Makes the rest of an interrupted step. Calls `report` with the number of ticks done.
    #[pyo3(signature = (report=None))]
    fn finish(&mut self, py: Python<'_>, report: ProgressReport<'_>) -> PyResult<()> {
        let Batch { slots, workers, hand, task, sensing, base, unfinished, .. } = self;
        let workers = workers.started()?;
        let Some(mut step) = unfinished.take() else { return Ok(()) };
        let how =
            How { motors: hand.motors.len(), base: *base, sensing: *sensing, objects: task.objects.count };
        let made = step.go_on(py, slots, workers, &how, &report);
        *unfinished = Some(step).filter(BatchStep::misses_ticks);
        made
    }

    /// The first action that is clipped under these largest base velocities, m/s and rad/s: its world, and
    /// the number of its field: linear velocity, angular velocity, σ.
    fn clipped(&self, actions: PyReadonlyArray2<'_, f64>, limits: [f64; 2]) -> Option<(usize, usize)> {
        let (actions, base) = (actions.as_array(), self.base.len());
        let length = |world, first: usize| {
            (first..first + 3).map(|k| actions[[world, k]] * actions[[world, k]]).sum::<f64>().sqrt()
        };
        (0..actions.nrows()).find_map(|world| {
            let mut sigmas = (base..actions.ncols()).map(|k| actions[[world, k]]);
            let beyond = [
                self.base == Base::Twist && length(world, 0) > limits[0],
                self.base == Base::Twist && length(world, 3) > limits[1],
                sigmas.any(|sigma| !(0.0..=1.0).contains(&sigma)),
            ];
            beyond.into_iter().position(|is_beyond| is_beyond).map(|field| (world, field))
        })
    }

    /// Time that all threads together have spent in the physics and the referee, s.
    #[getter]
    fn physics_s(&self) -> f64 {
        self.slots.iter().map(|slot| slot.physics.as_secs_f64()).sum()
    }

    /// The observations: of each field an array (N, …).
    fn observe<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let dict = PyDict::new(py);
        let mut begin = 0;
        for Field { name, shape, len } in &self.fields {
            let mut values = Aligned::<f64>::zeros(len * self.slots.len());
            for (part, slot) in values.numbers().chunks_mut(*len).zip(&self.slots) {
                part.copy_from_slice(&slot.row[begin..begin + len]);
            }
            begin += len;
            let whole: Vec<usize> = std::iter::once(self.slots.len()).chain(shape.iter().copied()).collect();
            dict.set_item(*name, values.array(py, &whole)?)?;
        }
        Ok(dict)
    }

    /// Reward of the last step, score until now, whether it is complete, whether it was cut short: arrays
    /// (N,).
    #[allow(clippy::type_complexity)]
    fn progress<'py>(
        &self,
        py: Python<'py>,
    ) -> (
        Bound<'py, PyArray1<f64>>,
        Bound<'py, PyArray1<f64>>,
        Bound<'py, PyArray1<bool>>,
        Bound<'py, PyArray1<bool>>,
    ) {
        let over = |complete: bool| {
            let is = |slot: &Slot| {
                slot.outcome.as_ref().is_some_and(|outcome| (outcome.reason == Reason::Complete) == complete)
            };
            self.slots.iter().map(is).collect::<Vec<bool>>().to_pyarray(py)
        };
        let reward: Vec<f64> = self.slots.iter().map(|slot| slot.reward).collect();
        let score: Vec<f64> = self.slots.iter().map(|slot| slot.score).collect();
        (reward.to_pyarray(py), score.to_pyarray(py), over(true), over(false))
    }

    /// The shaped part of the last step's reward: an array (N,); none where rewards are not shaped.
    fn shaping<'py>(&self, py: Python<'py>) -> Option<Bound<'py, PyArray1<f64>>> {
        self.training.shapes().then(|| {
            let parts: Vec<f64> = self.slots.iter().map(|slot| slot.shaping).collect();
            parts.to_pyarray(py)
        })
    }

    /// The potential now, term by term, each an array (N,); none where rewards are not shaped.
    fn potential<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyDict>>> {
        if !self.training.shapes() {
            return Ok(None);
        }
        let terms = |slot: &Slot| slot.shaper.as_ref().map(Shaper::terms).unwrap_or_default();
        let all: Vec<Terms> = self.slots.iter().map(terms).collect();
        let dict = PyDict::new(py);
        let put = |name: &str, of: fn(&Terms) -> f64| {
            dict.set_item(name, all.iter().map(of).collect::<Vec<f64>>().to_pyarray(py))
        };
        put("distance", |terms| terms.distance)?;
        put("contact", |terms| terms.contact)?;
        put("lift", |terms| terms.lift)?;
        put("transport", |terms| terms.transport)?;
        put("brought", |terms| terms.brought)?;
        Ok(Some(dict))
    }

    /// Names of the hand's numbers that are drawn for each run.
    fn hand_numbers(&self) -> Vec<String> {
        self.training.drawn_names(&self.hand)
    }

    /// These numbers of all worlds, one world after the other; zeros before the first reset.
    fn hand_drawn<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        let all: Vec<f64> = self.slots.iter().flat_map(|slot| slot.drawn.iter().copied()).collect();
        all.to_pyarray(py)
    }

    /// Leaves another part of the objects in the runs of later resets.
    fn set_fraction(&mut self, fraction: f64) -> PyResult<()> {
        self.training.set_fraction(fraction)
    }

    /// Whether every world has a run.
    fn opened(&self) -> bool {
        self.slots.iter().all(|slot| slot.run.is_some())
    }

    /// Seeds of the worlds.
    fn seeds(&self) -> Vec<u64> {
        self.slots.iter().map(|slot| slot.seed).collect()
    }

    /// Ticks since reset.
    fn ticks(&self) -> Vec<u64> {
        self.slots.iter().map(|slot| slot.run.as_ref().map_or(0, Run::tick)).collect()
    }

    /// The numbers in effect in all worlds: arrays (N, objects) and (N,).
    fn parameters<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        self.all_open()?;
        let numbers = |slot: &Slot| {
            let options = self.training.options.clone().give(&self.hand, slot.given.clone());
            let options = options.map_err(PyValueError::new_err)?;
            Ok(options.hand_numbers(&self.hand, Seed::from_u64(slot.seed)))
        };
        let numbers = self.slots.iter().map(numbers).collect::<PyResult<Vec<_>>>()?;
        let runs = self.slots.iter().zip(&numbers);
        let runs: Vec<_> =
            runs.filter_map(|(slot, row)| Some((slot.run.as_ref()?, row.as_slice()))).collect();
        parameters::in_effect(py, &runs, &self.hand, self.task.objects.count)
    }

    /// Digests of the states.
    fn state_hashes(&self) -> Vec<String> {
        let hash = |slot: &Slot| slot.run.as_ref().map_or_else(String::new, Run::state_hash);
        self.slots.iter().map(hash).collect()
    }

    /// The referee's events in the last step of a world: (tick, kind, object).
    fn events(&self, world: usize) -> PyResult<Vec<(u64, String, Option<usize>)>> {
        Ok(self.slot(world)?.events.clone())
    }

    /// The result of a world that is over.
    fn result<'py>(&self, py: Python<'py>, world: usize) -> PyResult<Option<Bound<'py, PyDict>>> {
        let Some(outcome) = &self.slot(world)?.outcome else { return Ok(None) };
        let dict = PyDict::new(py);
        let run = self.slot(world)?.run.as_ref();
        let varied = run.is_some_and(|run| run.task().is_varied() || run.is_altered());
        dict.set_item("status", status(outcome, varied))?;
        dict.set_item("score", outcome.score)?;
        dict.set_item("in_goal", outcome.in_goal)?;
        dict.set_item("outside", outcome.outside)?;
        dict.set_item("reason", outcome.reason.as_str())?;
        dict.set_item("fault", outcome.fault.map(Fault::code))?;
        dict.set_item("note", run.and_then(Run::failure).map(|failure| failure.to_string()))?;
        dict.set_item("ticks", outcome.ticks)?;
        dict.set_item("sim_time_s", outcome.sim_time_s)?;
        dict.set_item("state_hash", &outcome.state_hash)?;
        Ok(Some(dict))
    }

    /// Takes a snapshot of a world.
    fn snapshot(&self, world: usize) -> PyResult<Snapshot> {
        let run = self.slot(world)?.run.as_ref().ok_or_else(|| no_run(world))?;
        let Slot { seed, given, .. } = &self.slots[world];
        Ok(Snapshot { run: run.snapshot(), number: *seed, given: given.clone(), history: None })
    }

    /// Continues a world from a snapshot of the same task, hand and noise. A world of another seed becomes a run of the snapshot's.
    fn restore(&mut self, world: usize, from: &Bound<'_, Snapshot>) -> PyResult<()> {
        self.slot(world)?;
        self.drop_world(world);
        let snapshot = from.get();
        let refused = |error: SnapshotError| PyValueError::new_err(error.to_string());
        let slot = &self.slots[world];
        if slot.is_of(snapshot.number, &snapshot.given) {
            let run = self.slots[world].run.as_mut().ok_or_else(|| no_run(world))?;
            run.restore(&snapshot.run).map_err(refused)?;
        } else {
            let mut opened = self.run_of(snapshot.number, &snapshot.given)?;
            opened.run.restore(&snapshot.run).map_err(refused)?;
            self.slots[world].take(opened, snapshot.number);
        }
        self.slots[world].continued(self.sensing, self.task.objects.count);
        Ok(())
    }

    /// Quantities of all worlds, by their names: arrays (N, …).
    fn arrays<'py>(&mut self, py: Python<'py>, names: Vec<String>) -> PyResult<Bound<'py, PyDict>> {
        let quantities = state::named(&names)?;
        self.all_open()?;
        let Batch { task, hand, slots, workers, .. } = self;
        let (objects, workers) = (task.objects.count, workers.started()?);
        let mut rows: Vec<Vec<f64>> = vec![Vec::new(); slots.len()];
        let mut all: Vec<(&mut Slot, &mut Vec<f64>)> = slots.iter_mut().zip(&mut rows).collect();
        py.detach(|| {
            workers.each(&mut all, |(slot, row)| {
                let Some(run) = &slot.run else { return };
                MECHANICS.with_borrow_mut(|now| state::row(&quantities, run, now, objects, row));
            });
        });
        state::arrays(py, &quantities, hand, objects, &[rows.len()], &rows)
    }

    /// Contacts of the last step of all worlds, in `most` rows each.
    fn contacts<'py>(&self, py: Python<'py>, most: usize) -> PyResult<Bound<'py, PyDict>> {
        self.all_open()?;
        let runs = self.slots.iter().filter_map(|slot| slot.run.as_ref());
        let all: Vec<_> = runs.map(|run| state::contacts(run, most)).collect();
        state::contact_arrays(py, &[all.len()], most, &all)
    }

    /// Pictures of all worlds by one camera: arrays (N, height, width, …) of each kind.
    fn pictures<'py>(
        &mut self,
        py: Python<'py>,
        request: pictures::PictureRequest,
        kinds: Vec<String>,
    ) -> PyResult<Bound<'py, PyDict>> {
        self.all_open()?;
        let Batch { slots, workers, .. } = self;
        let runs: Vec<&mut Run> = slots.iter_mut().filter_map(|slot| slot.run.as_mut()).collect();
        let lead = [runs.len()];
        pictures::pictures(py, runs, Some(workers.started()?), &request, &kinds, &lead)
    }

    /// Pushes a link in the worlds of `mask`: a force and a torque (N, 3) for each, in the world frame.
    fn push(
        &mut self,
        link: &str,
        force: PyReadonlyArray2<'_, f64>,
        torque: PyReadonlyArray2<'_, f64>,
        duration_s: f64,
        mask: Vec<bool>,
    ) -> PyResult<()> {
        self.push_part(PushedPart::Link(link), (&force, &torque), duration_s, &mask)
    }

    /// Pushes an object in the worlds of `mask` at its centre of mass; as [`Batch::push`].
    fn push_object(
        &mut self,
        object: usize,
        force: PyReadonlyArray2<'_, f64>,
        torque: PyReadonlyArray2<'_, f64>,
        duration_s: f64,
        mask: Vec<bool>,
    ) -> PyResult<()> {
        self.push_part(PushedPart::Object(object), (&force, &torque), duration_s, &mask)
    }

    /// Depth of named cameras in all worlds, as in their messages: arrays (N, height, width).
    fn depths<'py>(&mut self, py: Python<'py>, cameras: Vec<String>) -> PyResult<Bound<'py, PyDict>> {
        self.all_open()?;
        let Batch { slots, workers, .. } = self;
        let runs: Vec<&mut Run> = slots.iter_mut().filter_map(|slot| slot.run.as_mut()).collect();
        pictures::depths(py, runs, workers.started()?, &cameras)
    }

    /// Puts hands, motors or objects of the worlds of `mask` elsewhere. After an error nothing has changed.
    fn place(&mut self, given: Placed<'_>, mask: Vec<bool>) -> PyResult<()> {
        self.fits("mask", mask.len())?;
        self.all_open()?;
        let (sensing, objects) = (self.sensing, self.task.objects.count);
        let present: Vec<usize> = self
            .slots
            .iter()
            .map(|slot| slot.run.as_ref().map_or(0, |run| run.object_states().count()))
            .collect();
        let placements = given.placements(&self.hand, objects, &[self.slots.len()], &present)?;
        self.drop_worlds(&mask);
        let mut before = Vec::new();
        for (world, placement) in placements.iter().enumerate().filter(|(world, _)| mask[*world]) {
            let run = self.slots[world].run.as_mut().ok_or_else(|| no_run(world))?;
            before.push((world, run.snapshot()));
            if let Err(error) = run.place(placement) {
                for (world, snapshot) in &before {
                    // It is of this run.
                    let _ = self.slots[*world].run.as_mut().map(|run| run.restore(snapshot));
                }
                return Err(PyValueError::new_err(format!("world {world}: {error}")));
            }
        }
        before.iter().for_each(|(world, _)| self.slots[*world].continued(sensing, objects));
        Ok(())
    }
}

impl Batch {
    /// Pushes a link or an object in each world of `mask` that is not over. After an error nothing has changed.
    fn push_part(
        &mut self,
        part: PushedPart<'_>,
        (force, torque): (&PyReadonlyArray2<'_, f64>, &PyReadonlyArray2<'_, f64>),
        duration_s: f64,
        mask: &[bool],
    ) -> PyResult<()> {
        self.fits("mask", mask.len())?;
        self.all_open()?;
        let wrenches = pushes::wrenches(force, torque, self.slots.len())?;
        let worlds = self.slots.iter_mut().zip(wrenches).enumerate();
        let worlds = worlds.filter(|(world, (slot, _))| mask[*world] && slot.outcome.is_none());
        let runs = worlds.filter_map(|(world, (slot, wrench))| Some((world, slot.run.as_mut()?, wrench)));
        pushes::push(runs.collect(), part, duration_s)
    }

    fn slot(&self, world: usize) -> PyResult<&Slot> {
        let missing = || PyValueError::new_err(format!("no world {world}; there are {}", self.slots.len()));
        self.slots.get(world).ok_or_else(missing)
    }

    /// An interrupted step does not go on in a world whose state is set.
    fn drop_world(&mut self, world: usize) {
        self.unfinished.iter_mut().for_each(|step| step.drop_world(world));
    }

    fn drop_worlds(&mut self, mask: &[bool]) {
        mask.iter().enumerate().filter(|(_, set)| **set).for_each(|(world, _)| self.drop_world(world));
    }

    fn all_open(&self) -> PyResult<()> {
        self.slots.iter().position(|slot| slot.run.is_none()).map_or(Ok(()), |world| Err(no_run(world)))
    }

    /// The run of a seed: a copy of a world that has it, if there is one.
    fn run_of(&self, seed: u64, given: &Given) -> PyResult<Opened> {
        let Batch { task, hand, noise, sensing, training, slots, .. } = self;
        let of_seed = slots.iter().filter(|slot| slot.is_of(seed, given));
        if let Some((run, slot)) = of_seed.filter_map(|slot| Some((slot.run.as_ref()?, slot))).next() {
            let (constant, drawn) = (slot.constant.clone(), slot.drawn.clone());
            let shaper = training.shaper(run);
            return Ok(Opened { run: run.fork(), constant, drawn, given: given.clone(), shaper });
        }
        let how = slot::How { task, hand, noise: *noise, sensing: *sensing, training };
        Opened::of(&how, seed, given).map_err(PyValueError::new_err)
    }

    fn fits(&self, name: &str, found: usize) -> PyResult<()> {
        let wanted = self.slots.len();
        if found == wanted {
            return Ok(());
        }
        Err(PyValueError::new_err(format!("{name}: found {found}; wanted one for each of {wanted} worlds")))
    }
}

fn no_run(world: usize) -> PyErr {
    PyValueError::new_err(format!("world {world} has no run yet: call reset first"))
}
