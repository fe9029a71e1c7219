//! The equilibrium of a hand, without a world.

use super::extract::{Path, Query};
use super::hands::{TeamQuery, find};
use crate::http::state::AppState;
use axum::Json;
use axum::body::Body;
use axum::extract::{ConnectInfo, State};
use axum::http::HeaderMap;
use palmares_models::hand::Hand;
use palmares_models::{Pose, Rotation, Vec3};
use palmares_net::transport::Caller;
use palmares_net::transport::problem::Problem;
use palmares_protocol::text::shortened;
use palmares_protocol::{Code, Refusal};
use palmares_sim::dynamics::tree::Kinematics;
use palmares_sim::statics::band::band;
use palmares_sim::statics::constrained::{ConstrainedEquilibrium, solve_constrained};
use palmares_sim::statics::energy::PointConstraint;
use palmares_sim::statics::loads::torques;
use palmares_sim::statics::prediction::solve_loaded;
use palmares_sim::statics::rest::{Method, NoPrediction};
use palmares_sim::{Config, Push};
use palmares_worlds::compute::JobPriority;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::time::Duration;
use tokio::time::timeout;

/// Largest body, bytes.
const MAX_BODY_BYTES: usize = 32 << 10;
/// Most forces, and most contacts.
const MAX_COUNT: usize = 32;
/// Largest force, N, as in `perturb`.
const MAX_FORCE_N: f64 = 200.0;
/// Largest distance from the origin of a link, m.
const MAX_LINK_M: f64 = 1.0;
/// Largest distance from the origin of the world, m.
const MAX_WORLD_M: f64 = 10.0;
/// Longest wait for other requests.
const QUEUE_TIMEOUT: Duration = Duration::from_secs(2);

/// The loads on the hand.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct EquilibriumRequest {
    /// Command σ of every motor, 0 to 1.
    motors: Vec<f64>,
    /// Pose of the base; at the origin if left out.
    #[serde(default)]
    base: Option<Base>,
    /// Forces with constant direction; at most 32.
    #[serde(default)]
    forces: Vec<Force>,
    /// Points that are held in place; at most 32.
    #[serde(default)]
    contacts: Vec<Contact>,
}

/// Pose of the base in the world frame.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "EquilibriumBase")]
struct Base {
    /// m
    position: [f64; 3],
    /// Unit quaternion.
    quat_xyzw: [f64; 4],
}

/// A force on a link.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "EquilibriumForce")]
struct Force {
    /// Name of the link.
    link: String,
    /// Point of action in the link frame, m.
    point: [f64; 3],
    /// The force in the world frame, N; at most 200.
    force: [f64; 3],
}

/// A point of a link that is held in place.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "EquilibriumContact")]
struct Contact {
    /// Name of the link.
    link: String,
    /// The point, in the link frame, m.
    point: [f64; 3],
    /// Its place in the world frame, m.
    position: [f64; 3],
}

/// The equilibrium.
#[derive(Debug, Serialize, JsonSchema)]
pub(super) struct EquilibriumResponse {
    /// Joint coordinates, rad or m.
    q: Vec<f64>,
    /// Tension of every tendon, in its own unit.
    tension: Vec<f64>,
    /// `closed_form` or `newton`.
    law: &'static str,
    /// Reason why the closed form does not hold: joints at limits, slack tendons, varying moment arms, held points. Empty where it holds.
    beyond_closed_form: Vec<String>,
    /// Pose of every link in the world frame.
    links: Vec<LinkPose>,
    /// Reaction at each of `contacts`.
    reactions: Vec<Reaction>,
    /// Torque of forces, contacts and weight on each joint coordinate, N·m or N.
    torque: Vec<f64>,
    /// For a hand that rubs, without contacts: the limits between which it rests. All else in the answer is without friction.
    #[serde(skip_serializing_if = "Option::is_none")]
    band: Option<RestBand>,
}

/// The limits between which a hand that rubs comes to rest.
#[derive(Debug, Serialize, JsonSchema)]
#[schemars(rename = "EquilibriumBand")]
struct RestBand {
    /// Joint coordinates where it comes to rest while it closes, rad or m.
    closing: Vec<f64>,
    /// The same while it opens.
    opening: Vec<f64>,
}

/// Pose of a link.
#[derive(Debug, Serialize, JsonSchema)]
struct LinkPose {
    /// Its name.
    name: String,
    /// m
    position: [f64; 3],
    /// Unit quaternion.
    quat_xyzw: [f64; 4],
}

/// The reaction at a held point.
#[derive(Debug, Serialize, JsonSchema)]
#[schemars(rename = "EquilibriumReaction")]
struct Reaction {
    /// Force on the link in the world frame, N; at most 100.
    force: [f64; 3],
    /// Distance of the point from its place, m: 0.01 mm for each N, and more where it cannot reach its place.
    gap: f64,
}

/// The loads as inputs of the physics.
#[derive(Debug, PartialEq)]
struct Loads {
    sigma: Vec<f64>,
    base: Pose,
    pushes: Vec<Push>,
    holds: Vec<PointConstraint>,
}

fn bad(field: &str, why: &str) -> Refusal {
    Refusal::new(Code::BadRequest, format!("{field}: {why}"))
}

fn vector(field: &str, [x, y, z]: [f64; 3], most: f64, unit: &str) -> Result<Vec3, Refusal> {
    let vector = Vec3::new(x, y, z);
    if vector.length() <= most {
        Ok(vector)
    } else {
        Err(bad(field, &format!("expected at most {most} {unit}")))
    }
}

impl EquilibriumRequest {
    /// Checks the request.
    fn checked(&self, hand: &Hand) -> Result<Loads, Refusal> {
        let motors = hand.motors.len();
        if self.motors.len() != motors {
            let why = format!("expected one number for each of {motors} motors, got {}", self.motors.len());
            return Err(bad("motors", &why));
        }
        if let Some(i) = self.motors.iter().position(|sigma| !(0.0..=1.0).contains(sigma)) {
            return Err(bad(&format!("motors[{i}]"), "expected 0 to 1"));
        }
        for (field, many) in [("forces", self.forces.len()), ("contacts", self.contacts.len())] {
            if many > MAX_COUNT {
                return Err(bad(field, &format!("expected at most {MAX_COUNT}, got {many}")));
            }
        }
        let link = |field: String, name: &str| {
            let known = || hand.links.iter().map(|link| link.name.as_str()).collect::<Vec<_>>().join(", ");
            hand.link(name)
                .ok_or_else(|| bad(&field, &format!("no link `{}`; there are {}", shortened(name), known())))
        };
        let pushes = self.forces.iter().enumerate().map(|(i, force)| {
            Ok(Push {
                link: link(format!("forces[{i}].link"), &force.link)?,
                point: vector(&format!("forces[{i}].point"), force.point, MAX_LINK_M, "m")?,
                force: vector(&format!("forces[{i}].force"), force.force, MAX_FORCE_N, "N")?,
            })
        });
        let holds = self.contacts.iter().enumerate().map(|(i, contact)| {
            Ok(PointConstraint {
                link: link(format!("contacts[{i}].link"), &contact.link)?,
                point: vector(&format!("contacts[{i}].point"), contact.point, MAX_LINK_M, "m")?,
                place: vector(&format!("contacts[{i}].position"), contact.position, MAX_WORLD_M, "m")?,
            })
        });
        Ok(Loads {
            sigma: self.motors.clone(),
            base: self.base.as_ref().map_or(Ok(Pose::IDENTITY), Base::checked)?,
            pushes: pushes.collect::<Result<_, Refusal>>()?,
            holds: holds.collect::<Result<_, Refusal>>()?,
        })
    }
}

impl Base {
    fn checked(&self) -> Result<Pose, Refusal> {
        let position = vector("base.position", self.position, MAX_WORLD_M, "m")?;
        let [x, y, z, w] = self.quat_xyzw;
        let rotation = Rotation::from_xyzw(x, y, z, w);
        // A quaternion that is rounded to three digits is accepted.
        if (rotation.length() - 1.0).abs() > 1e-2 {
            return Err(bad("base.quat_xyzw", "expected a unit quaternion"));
        }
        Ok(Pose::from_parts(position, rotation.normalize()))
    }
}

/// Computes the equilibrium, in bounded time, usually milliseconds.
fn solve(hand: &Hand, loads: &Loads) -> Result<EquilibriumResponse, Refusal> {
    let config = Config::default();
    let Loads { sigma, base, pushes, holds } = loads;
    let refused = |why: NoPrediction| {
        Refusal::new(Code::WrongState, format!("the hand has no such equilibrium: {why}"))
    };
    let found = if holds.is_empty() {
        let free = solve_loaded(&config, hand, *base, sigma, pushes);
        free.map(|equilibrium| ConstrainedEquilibrium { equilibrium, reactions: Vec::new() })
    } else {
        solve_constrained(&config, hand, *base, sigma, pushes, holds)
    };
    let ConstrainedEquilibrium { equilibrium, reactions } = found.map_err(refused)?;
    let rubs = hand.friction_places() > 0 && holds.is_empty();
    let limits = rubs.then(|| band(&config, hand, *base, sigma, pushes)).transpose().map_err(refused)?;
    let mut kin = Kinematics::default();
    kin.update(hand, *base, &equilibrium.q);
    let links = hand.links.iter().zip(&kin.pose).map(|(link, pose)| LinkPose {
        name: link.name.clone(),
        position: pose.translation.to_array(),
        quat_xyzw: pose.rotation.to_array(),
    });
    let holding = holds.iter().zip(&reactions).map(|(hold, reaction)| hold.as_push(reaction));
    let all: Vec<Push> = pushes.iter().copied().chain(holding).collect();
    Ok(EquilibriumResponse {
        links: links.collect(),
        torque: torques(&config, hand, *base, &equilibrium.q, &all),
        law: match equilibrium.method {
            Method::ClosedForm => "closed_form",
            Method::Newton => "newton",
        },
        reactions: reactions
            .iter()
            .map(|reaction| Reaction { force: reaction.force.to_array(), gap: reaction.gap })
            .collect(),
        band: limits.map(|limits| RestBand { closing: limits.closing.q, opening: limits.opening.q }),
        q: equilibrium.q,
        tension: equilibrium.tension,
        beyond_closed_form: equilibrium.beyond_closed_form,
    })
}

/// The equilibrium of a hand.
pub(super) async fn equilibrium(
    State(app): State<AppState>,
    Path(name): Path,
    Query(query): Query<TeamQuery>,
    ConnectInfo(caller): ConnectInfo<Caller>,
    headers: HeaderMap,
    body: Body,
) -> Result<Json<EquilibriumResponse>, Problem> {
    let hand = find(&app, &headers, query, &name).await?;
    let received = app.inbound.bodies.read(caller.address, &headers, body, MAX_BODY_BYTES).await?;
    let mut json = serde_json::Deserializer::from_slice(&received.bytes);
    let request: EquilibriumRequest = serde_path_to_error::deserialize(&mut json)
        .map_err(|error| Problem(bad("body", &error.to_string())))?;
    let loads = request.checked(&hand)?;
    let busy = || Refusal::new(Code::Capacity, "busy with another request; try again").retry_after(1.0);
    let Ok(Ok(turn)) = timeout(QUEUE_TIMEOUT, app.compute.statics.clone().acquire_owned()).await else {
        return Err(Problem(busy()));
    };
    let job = move || {
        // Even if this request is dropped, the next one starts after this job.
        let _turn = turn;
        solve(&hand, &loads)
    };
    let solved = app.compute.background.run(JobPriority::Awaited, job).await;
    let solved = solved.map_err(|error| {
        tracing::error!(%error, "an equilibrium could not be computed");
        Problem::new(Code::Internal, "the equilibrium could not be computed")
    })?;
    Ok(Json(solved?))
}

#[cfg(test)]
mod tests {
    use super::*;
    use palmares_models::hand::Guide;
    use palmares_sim::statics::drives::wound_lengths;
    use palmares_sim::statics::equilibrium::ClosedForm;
    use serde_json::{Value, json};
    use std::sync::Arc;

    fn softhand() -> Arc<Hand> {
        Hand::builtin("softhand").expect("it is built in")
    }

    fn solved(body: Value) -> Result<EquilibriumResponse, String> {
        solved_of(&softhand(), body)
    }

    fn solved_of(hand: &Hand, body: Value) -> Result<EquilibriumResponse, String> {
        let request: EquilibriumRequest = serde_json::from_value(body).map_err(|error| error.to_string())?;
        let loads = request.checked(hand).map_err(|refusal| refusal.message)?;
        solve(hand, &loads).map_err(|refusal| refusal.message)
    }

    fn close(a: &[f64], b: &[f64], by: f64) -> bool {
        a.len() == b.len() && a.iter().zip(b).all(|(a, b)| (a - b).abs() < by)
    }

    #[test]
    fn a_free_hand_rests_where_the_closed_form_says() {
        let hand = softhand();
        let found = solved(json!({"motors": [0.4]})).expect("a rest");
        let form = ClosedForm::new(&hand).expect("it has one");
        let (q, tension) = form.solve(&wound_lengths(&hand, &[0.4]), &vec![0.0; hand.coordinates.len()]);
        assert!(close(&found.q, &q, 1e-12) && close(&found.tension, &tension, 1e-12));
        assert_eq!((found.law, found.beyond_closed_form.len(), found.reactions.len()), ("closed_form", 0, 0));
        assert_eq!(found.links.len(), hand.links.len());
    }

    #[test]
    fn under_a_force_it_rests_where_the_closed_form_says_of_its_torques() {
        let hand = softhand();
        let link = hand.links.last().expect("links").name.clone();
        let force = json!({"link": link, "point": [0.0, 0.0, 0.01], "force": [0.02, 0.03, -0.01]});
        let found = solved(json!({"motors": [0.4], "forces": [force]})).expect("a rest");
        assert_eq!(found.law, "closed_form");
        let form = ClosedForm::new(&hand).expect("it has one");
        let (q, tension) = form.solve(&wound_lengths(&hand, &[0.4]), &found.torque);
        assert!(found.torque.iter().any(|torque| torque.abs() > 1e-5), "{:?}", found.torque);
        assert!(close(&found.q, &q, 1e-8) && close(&found.tension, &tension, 1e-8));
    }

    #[test]
    fn a_held_point_stays_where_it_was_while_the_hand_closes() {
        let before = solved(json!({"motors": [0.2]})).expect("a rest");
        let tip = before.links.last().expect("links");
        let contact = json!({"link": tip.name, "point": [0, 0, 0], "position": tip.position});
        let found = solved(json!({"motors": [0.4], "contacts": [contact]})).expect("a rest");
        let there = &found.links.last().expect("links").position;
        assert!(close(there, &tip.position, 1e-3), "{there:?} {:?}", tip.position);
        let pushed = found.reactions[0].force.iter().map(|x| x * x).sum::<f64>().sqrt();
        assert!(pushed > 1e-3 && found.law == "newton", "{pushed}");
    }

    #[test]
    fn a_hand_that_rubs_rests_between_two_limits() {
        let mut hand = Hand::clone(&softhand());
        let all = 0..hand.coordinates.len();
        hand.tendons[0].guides = all.map(|coordinate| Guide::new(coordinate, 0.1, 0.2)).collect();
        let found = solved_of(&hand, json!({"motors": [0.4]})).expect("a rest");
        let band = found.band.expect("it rubs");
        // Of what the motor winds in, the first joints get more while the hand closes, the last ones less.
        let (first, last) = (0, hand.coordinates.len() - 1);
        let at = |c: usize| [band.opening[c], found.q[c], band.closing[c]];
        assert!(at(first).is_sorted_by(|a, b| a < b), "{:?}", at(first));
        assert!(at(last).is_sorted_by(|a, b| a > b), "{:?}", at(last));
        assert!(solved(json!({"motors": [0.4]})).expect("a rest").band.is_none());
    }

    #[test]
    fn what_is_wrong_is_named() {
        let contact = json!({"link": "palm", "point": [0, 0, 0], "position": [0, 0, 11]});
        let force = json!({"link": "paw", "point": [0, 0, 0], "force": [0, 0, 1]});
        let cases = [
            (json!({"motors": [0.1, 0.2]}), "motors: expected one number for each of 1 motors, got 2"),
            (json!({"motors": [1.5]}), "motors[0]: expected 0 to 1"),
            (json!({"motors": [0.5], "forces": [force]}), "forces[0].link: no link `paw`; there are "),
            (
                json!({"motors": [0.5], "base": {"position": [0, 0, 0], "quat_xyzw": [0, 0, 0, 0]}}),
                "base.quat_xyzw: ",
            ),
            (json!({"motors": [0.5], "speed": 1}), "unknown field `speed`"),
            (json!({"motors": [0.5], "forces": vec![force; 33]}), "forces: expected at most 32, got 33"),
        ];
        for (body, why) in cases {
            let error = solved(body).expect_err(why);
            assert!(error.contains(why), "{error}");
        }
        let hand = softhand();
        let name = hand.links[0].name.clone();
        let far = json!({"motors": [0.5], "contacts": [{"link": name, "point": contact["point"], "position": contact["position"]}]});
        assert!(solved(far).expect_err("far").contains("contacts[0].position: expected at most 10 m"));
    }
}
