//! Surfaces of shapes as MuJoCo takes them: friction, resistance to spin and to rolling, rebounds.
//!
//! MuJoCo has no coefficient of restitution e. Its documentation (Modeling, solver parameters) makes a contact a spring and damper
//! per unit of mass through `solref` of two negative numbers, −k and −b: `a = −k r − b v`. A body that meets it leaves it after
//! half an oscillation of duration T with e times its speed if `b = −2 ln e/T` and `k = (π² + ln² e)/T²`. T is [`REBOUND_STEPS`]
//! steps.

use super::settings::Settings;
use palmares_models::mjcf::Element;
use palmares_models::object::Object;
use std::f64::consts::PI;
use std::sync::Arc;

/// Steps of a rebound. Fewer are integrated badly; with more a body sinks in deeper, `v T/π` at speed v: in `bounce_zeno` at 4 ms
/// 45 mm, where half of the ball is 50 mm.
const REBOUND_STEPS: f64 = 8.0;

/// Impedance of a rebound: a constant, so that the spring is one.
const REBOUND_SOLIMP: &str = "0.99 0.99 0.001";

/// A surface.
#[derive(Clone, Copy, Default)]
pub(super) struct Surface {
    pub friction: f64,
    pub levers: Levers,
    /// e
    pub restitution: f64,
}

impl Surface {
    /// The surface of what has friction against sliding alone.
    pub(super) fn hard(friction: f64) -> Self {
        Surface { friction, ..Surface::default() }
    }

    /// The surface of an object.
    pub(super) fn of(object: &Object) -> Self {
        Surface { friction: object.friction, levers: Levers::of(object), restitution: object.restitution }
    }

    /// That of a pair: of friction the geometric mean, of the others the larger, as ours.
    pub(super) fn with(self, other: Self) -> Self {
        Surface {
            friction: (self.friction * other.friction).sqrt(),
            levers: self.levers.larger(other.levers),
            restitution: self.restitution.max(other.restitution),
        }
    }

    /// Of each number the one that most objects have, of several the first; the largest levers. None without objects.
    pub(super) fn common(objects: &[Arc<Object>]) -> Option<Self> {
        let most = |number: fn(&Object) -> f64| {
            let as_many = |it: &&Arc<Object>| objects.iter().filter(|o| number(o) == number(it)).count();
            objects.iter().rev().max_by_key(as_many).map(|it| number(it))
        };
        let levers = objects.iter().fold(Levers::default(), |most, object| most.larger(Levers::of(object)));
        let (friction, restitution) = (most(|it| it.friction)?, most(|it| it.restitution)?);
        Some(Surface { friction, levers, restitution })
    }

    /// Whether a pair of it needs its own `solreffriction`: MuJoCo damps sliding as it damps the rebound.
    pub(super) fn rubs_and_rebounds(self) -> bool {
        self.restitution > 0.0 && self.friction > 0.0
    }
}

/// How a document writes surfaces.
#[derive(Clone, Copy)]
pub(super) struct Writing<'a> {
    pub settings: &'a Settings,
    /// Least `condim` of a contact.
    pub condim: u32,
    /// Step, s.
    pub step_s: f64,
}

impl Writing<'_> {
    /// The attributes of a geom.
    pub(super) fn geom(&self, geom: Element, surface: Surface) -> Element {
        self.written(geom, surface, 1)
    }

    /// The attributes of a pair. Friction and rolling are those of two directions.
    pub(super) fn pair(&self, pair: Element, surface: Surface) -> Element {
        let pair = self.written(pair, surface, 2);
        match self.settings.get("solref").filter(|_| surface.rubs_and_rebounds()) {
            Some(solref) => pair.text("solreffriction", solref),
            None => pair,
        }
    }

    /// `condim` and `friction`: sliding, then spin, then rolling once for each of sliding; `solref` and `solimp` of a rebound.
    fn written(&self, element: Element, surface: Surface, directions: usize) -> Element {
        let Surface { friction, levers, restitution } = surface;
        let condim = levers.condim().max(self.condim);
        let Levers { torsional, rolling } = levers.at_least(self.condim);
        let (sliding, rolling) = (vec![friction; directions], vec![rolling; directions]);
        let element = element
            .text("condim", &condim.to_string())
            .numbers("friction", [sliding, vec![torsional], rolling].concat());
        if restitution == 0.0 {
            return element;
        }
        let (lasts_s, ln) = (REBOUND_STEPS * self.step_s, libm::log(restitution));
        let stiffness = (PI * PI + ln * ln) / (lasts_s * lasts_s);
        element.numbers("solref", [-stiffness, 2.0 * ln / lasts_s]).text("solimp", REBOUND_SOLIMP)
    }
}

/// Levers of friction against spin and of rolling resistance, m.
#[derive(Clone, Copy, Default)]
pub(super) struct Levers {
    torsional: f64,
    rolling: f64,
}

impl Levers {
    fn of(object: &Object) -> Self {
        Levers { torsional: object.torsional_friction, rolling: object.rolling_friction }
    }

    fn larger(self, other: Self) -> Self {
        Levers { torsional: self.torsional.max(other.torsional), rolling: self.rolling.max(other.rolling) }
    }

    /// MuJoCo's own levers, 5 mm and 0.1 mm, where settings ask for friction that the model has not.
    fn at_least(self, condim: u32) -> Self {
        let or = |lever: f64, own: f64, needs: u32| if lever == 0.0 && condim >= needs { own } else { lever };
        Levers { torsional: or(self.torsional, 5e-3, 4), rolling: or(self.rolling, 1e-4, 6) }
    }

    /// Number of directions that MuJoCo's contact resists.
    fn condim(self) -> u32 {
        match self {
            Levers { rolling, .. } if rolling > 0.0 => 6,
            Levers { torsional, .. } if torsional > 0.0 => 4,
            _ => 3,
        }
    }
}
