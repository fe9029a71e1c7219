//! Identity of what a case or a grasp asks of an engine: scenes and commands, without anyone's physics. An outcome of a peer
//! stays valid as long as it does not change, whatever happens to our engine.

use crate::engine::{Adapter, Feature, NotPlayed, Surfaces, mujoco};
use crate::trials::family::Trial;
use crate::trials::scene::scene;
use anyhow::{Result, bail};
use palmares_bench::case_report::Figure;
use palmares_bench::cases::{Case, Setup};
use palmares_bench::engine::{Cost, Engine, EngineFactory, RIGID};
use palmares_bench::recorder::Recorder;
use palmares_models::content::ContentHash;
use palmares_sim::{Command, Model, State, StepOutcome};
use std::cell::{Cell, RefCell};
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

/// Step for which it is taken, s; the scenes of a case do not depend on the step.
const STEP_S: f64 = 4e-3;
/// Commands beyond these do not count.
const MOST_STEPS: u64 = 20_000;
/// Stands for the stiffness of all contacts that are not rigid, N/m: how stiff they are is a matter of our engine, and peers
/// have their own.
const SOFT: f64 = 2e5;
/// Number of its digits, and of those of a key.
const DIGITS: usize = 16;

thread_local! {
    static HASH: RefCell<ContentHash> = RefCell::new(ContentHash::default());
    static NEEDS: RefCell<BTreeSet<Feature>> = const { RefCell::new(BTreeSet::new()) };
    static SURFACES: Cell<Surfaces> = const { Cell::new(Surfaces { round: false, flat: false }) };
    static STEPS: Cell<u64> = const { Cell::new(0) };
}

/// What a case asks of an engine.
pub struct Asked {
    /// Identity of its scenes and commands.
    pub identity: String,
    /// The features of its scenes and commands.
    pub needs: BTreeSet<Feature>,
    /// Whether it has a hand.
    pub hand: bool,
    /// What its free bodies meet with.
    pub surfaces: Surfaces,
    /// Engines whose adapters do not play it, and why.
    pub refused: BTreeMap<&'static str, NotPlayed>,
    /// Its figure; none where a case in which nothing moves ends before it.
    pub figure: Option<Figure>,
    /// Simulated time of one run, s; where nothing moves a run may end early.
    pub simulated_s: f64,
}

/// What a case asks of an engine.
pub fn of_case(case: &Case) -> Asked {
    HASH.set(ContentHash::of(case.name));
    NEEDS.take();
    SURFACES.take();
    STEPS.set(0);
    // A case may end with an error, since nothing moves; so it does each time.
    let finding = (case.run)(&Setup::new(&Watcher, STEP_S), &mut Recorder::default());
    let needs = NEEDS.take();
    let refuses = |adapter: Adapter| Some((adapter.engine, adapter.all_of(&needs).err()?));
    Asked {
        identity: digits(HASH.take()),
        hand: needs.contains(&Feature::Hand),
        surfaces: SURFACES.take(),
        refused: Adapter::ALL.into_iter().filter_map(refuses).collect(),
        needs,
        figure: finding.ok().map(|finding| finding.error),
        simulated_s: STEPS.get() as f64 * STEP_S,
    }
}

fn need(features: BTreeSet<Feature>) {
    NEEDS.with_borrow_mut(|all| all.extend(features));
}

/// What a drawn grasp asks of an engine.
pub struct AskedTrial {
    /// Identity of its scene and set points.
    pub identity: String,
    /// The features of its scene.
    pub needs: BTreeSet<Feature>,
}

/// What a drawn grasp asks of an engine.
///
/// # Errors
/// A shape without volume.
pub fn asked_of_trial(trial: &Trial) -> Result<AskedTrial> {
    let mut hash = ContentHash::of(trial.family.name());
    let made = scene(trial, STEP_S)?;
    begin(&mut hash, &made.model, &made.state);
    hash.floats(&[trial.sigma, trial.preshape]);
    Ok(AskedTrial { identity: digits(hash), needs: Feature::of_scene(&made.model) })
}

/// Identity of a drawn grasp.
///
/// # Errors
/// A shape without volume.
pub fn of_trial(trial: &Trial) -> Result<String> {
    Ok(asked_of_trial(trial)?.identity)
}

/// Identity of several.
pub fn of_all(identities: &[String]) -> String {
    let mut hash = ContentHash::default();
    hash.list(identities, |hash, identity| hash.text(identity));
    digits(hash)
}

pub(crate) fn digits(hash: ContentHash) -> String {
    let mut digits = hash.to_hex();
    digits.truncate(DIGITS);
    digits
}

fn begin(hash: &mut ContentHash, model: &Model, state: &State) {
    let config = model.config();
    let stiffness = if config.contact_stiffness >= RIGID { RIGID } else { SOFT };
    hash.floats(&[stiffness, config.step_s]);
    hash.text(&format!("{:?}", config.base));
    // An adapter reads these numbers of the hand, and the document does not have them.
    if let Some(hand) = model.hand() {
        hash.list(&hand.motors, |hash, motor| hash.floats(&[motor.scaling, motor.offset, motor.speed_limit]));
        hash.list(&hand.tendons, |hash, tendon| {
            hash.float(tendon.force_limit);
            hash.list(&tendon.motors, |hash, (motor, weight)| {
                hash.count(*motor);
                hash.float(*weight);
            });
        });
    }
    hash.list(model.objects(), |hash, object| object.digest(hash));
    hash.text(&mujoco::scene_text(model, state).unwrap_or_default());
    hash.floats(&state.q);
    hash.floats(&state.v);
}

/// An engine in which nothing moves.
#[derive(Debug)]
struct Watcher;

struct Watched {
    model: Arc<Model>,
    state: State,
    said: String,
}

impl EngineFactory for Watcher {
    fn name(&self) -> &'static str {
        "none"
    }

    fn settings(&self) -> &'static str {
        "none"
    }

    fn start(&self, model: Arc<Model>, state: State) -> Result<Box<dyn Engine>> {
        HASH.with_borrow_mut(|hash| begin(hash, &model, &state));
        need(Feature::of_scene(&model));
        let (of, all) = (Surfaces::of(&model), SURFACES.get());
        SURFACES.set(Surfaces { round: of.round || all.round, flat: of.flat || all.flat });
        Ok(Box::new(Watched { model, state, said: String::new() }))
    }
}

impl Engine for Watched {
    fn model(&self) -> &Arc<Model> {
        &self.model
    }

    fn step(&mut self, command: &Command) -> Result<Cost> {
        self.state.step += 1;
        STEPS.set(STEPS.get() + 1);
        if self.state.step > MOST_STEPS {
            bail!("that is enough");
        }
        let said = format!("{command:?}");
        if said != self.said {
            HASH.with_borrow_mut(|hash| hash.text(&said));
            need(Feature::of_command(&self.model, command));
            self.said = said;
        }
        Ok(Cost::default())
    }

    fn state(&self) -> &State {
        &self.state
    }

    fn state_mut(&mut self) -> &mut State {
        &mut self.state
    }

    fn outcome(&self) -> StepOutcome {
        StepOutcome { converged: true, ..StepOutcome::default() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::trials::family::{Family, HandKind};
    use palmares_bench::cases;
    use palmares_bench::rigs::softhand;
    use palmares_models::Pose;
    use palmares_sim::Config;

    fn asked(name: &str) -> Asked {
        of_case(cases::all().find(|case| case.name == name).expect("there is such a case"))
    }

    fn named(name: &str) -> String {
        asked(name).identity
    }

    #[test]
    fn a_case_has_one_identity_and_another_case_another() {
        assert_eq!(named("softhand_cylinder"), named("softhand_cylinder"));
        assert_ne!(named("softhand_cylinder"), named("softhand_box"));
        assert_ne!(
            named("softhand_cylinder"),
            named("softhand_cylinder_60s"),
            "the same scene, other commands"
        );
    }

    #[test]
    fn a_case_has_round_bodies_flat_ones_both_or_nothing_that_they_meet() {
        let of = |name| (asked(name).surfaces.round, asked(name).surfaces.flat);
        assert_eq!(of("bowling"), (true, false));
        assert_eq!(of("slide_stop"), (false, true));
        assert_eq!(of("rolling_box_balls"), (true, true));
        assert_eq!(of("free_flight"), (false, false));
    }

    #[test]
    fn a_case_has_a_hand_or_none() {
        assert!(asked("softhand_cylinder").hand);
        assert!(!asked("slide_stop").hand);
    }

    #[test]
    fn a_case_is_refused_by_the_adapters_that_do_not_pass_it_on() {
        let refused = |case: &str| -> Vec<(&str, String)> {
            asked(case).refused.into_iter().map(|(engine, NotPlayed(why))| (engine, why)).collect()
        };
        let not = |what: &str| format!("its adapter does not pass on {what}");
        for (case, engines, what) in [
            ("softhand_balls", &["rapier"][..], "friction against spin and rolling resistance"),
            ("dry_joint", &["rapier"], "dry friction of joints"),
            ("capstan_loop", &["mujoco", "rapier"], "friction of cables at guides"),
            ("round_tips", &["mujoco", "rapier"], "soft pads"),
            ("softhand_cylinder", &[], ""),
            ("momentum_inelastic_hit", &[], ""),
        ] {
            let of_hands = engines.iter().map(|engine| (*engine, not(what)));
            let all: Vec<_> = [("drake", not("hands"))].into_iter().chain(of_hands).collect();
            assert_eq!(refused(case), all, "{case}");
        }
        assert_eq!(refused("bounce_zeno"), [("drake", not("restitution"))]);
        assert_eq!(refused("slide_stop"), []);
    }

    /// Peers have contacts of their own, which are stiff between rigid bodies.
    #[test]
    fn the_stiffness_of_our_contacts_is_no_part_of_a_scene() {
        let identity = |contact_stiffness: f64| {
            let config = Config { contact_stiffness, ..Config::default() };
            let model = Model::new(config, Some(softhand().expect("built in"))).expect("a sound hand");
            let state = State::at_rest(&model, Pose::IDENTITY, &[]);
            let mut hash = ContentHash::default();
            begin(&mut hash, &model, &state);
            digits(hash)
        };
        let ours = Config::default().contact_stiffness;
        assert_eq!(identity(ours), identity(10.0 * ours));
        assert_ne!(identity(ours), identity(RIGID));
    }

    #[test]
    fn a_grasp_with_another_set_point_is_another() {
        let trial = &Trial::of(HandKind::SoftHand, Family::Ball, 1).expect("drawn")[0];
        let tighter = Trial { sigma: trial.sigma + 0.1, ..trial.clone() };
        let [one, same, other] = [trial, trial, &tighter].map(|it| of_trial(it).expect("a sound scene"));
        assert_eq!(one, same);
        assert_ne!(one, other);
    }
}
