//! A moment of a run as it is shown: computed and written once for all who watch, and not where the world is stepped.

use super::binary::{self, Seven, Whole};
use super::messages::{BodyKind, Poses, Verdicts, WatchBody, WatchReply, WatchRun, WatchScene};
use super::snapshot::{Overlays, Snapshot};
use axum::extract::ws::Utf8Bytes;
use palmares_models::Pose;
use palmares_senses::ChannelInfo;
use palmares_tasks::Run;
use palmares_tasks::referee::ObjectStatus;
use palmares_tasks::run::{Contact, Telemetry, TelemetryModel};
use std::sync::{Arc, OnceLock};

/// Colour of a hand's links, sRGB.
const HAND_COLOR: [f64; 3] = [0.72, 0.74, 0.78];

/// Steps of a verdict's values: finer ones change all the time.
const VERDICT_STEPS: f64 = 1e3;

/// Telemetry, and its three parts of a binary frame.
#[derive(Debug)]
struct Told {
    seen: Telemetry,
    bytes: Vec<u8>,
    loads: Vec<u8>,
    readings: Vec<u8>,
}

/// A moment of a run.
#[derive(Debug)]
pub(super) struct Frame {
    /// What it shows.
    pub(super) snapshot: Arc<Snapshot>,
    run_id: String,
    telemetry_model: Arc<TelemetryModel>,
    poses: Vec<Seven>,
    /// The message `poses` without overlays, with telemetry, with contacts, with both.
    texts: [OnceLock<Utf8Bytes>; 4],
    telemetry: OnceLock<Option<Told>>,
    contacts: OnceLock<Option<(Vec<Contact>, Vec<u8>)>>,
    verdicts: OnceLock<Option<Vec<ObjectStatus>>>,
}

impl Frame {
    /// The run as it stood.
    pub(super) fn new(run_id: &str, telemetry_model: &Arc<TelemetryModel>, snapshot: Arc<Snapshot>) -> Self {
        let Snapshot { base, q, objects, .. } = &*snapshot;
        Frame {
            run_id: run_id.to_owned(),
            poses: telemetry_model
                .poses(*base, q, objects)
                .into_iter()
                .map(|(_, pose)| seven(pose))
                .collect(),
            telemetry_model: telemetry_model.clone(),
            snapshot,
            texts: Default::default(),
            telemetry: OnceLock::new(),
            contacts: OnceLock::new(),
            verdicts: OnceLock::new(),
        }
    }

    fn telemetry(&self) -> Option<&Told> {
        let seen = || self.snapshot.sample.as_ref().map(|sample| self.telemetry_model.telemetry(sample));
        let told = || {
            seen().map(|seen| Told {
                bytes: binary::telemetry(&seen),
                loads: binary::loads(&seen),
                readings: binary::readings(&seen),
                seen,
            })
        };
        self.telemetry.get_or_init(told).as_ref()
    }

    fn contacts(&self) -> Option<&(Vec<Contact>, Vec<u8>)> {
        let seen = || self.snapshot.sample.as_ref().map(|sample| self.telemetry_model.contacts(sample));
        let both = || seen().map(|seen| (binary::contacts(&seen), seen)).map(|(bytes, seen)| (seen, bytes));
        self.contacts.get_or_init(both).as_ref()
    }

    /// The message `poses`.
    pub(super) fn text(&self, overlays: Overlays) -> Utf8Bytes {
        let Overlays { telemetry, contacts, .. } = overlays;
        let written = || {
            // What nobody asks for is not computed.
            let telemetry = if telemetry { self.telemetry() } else { None };
            let contacts = if contacts { self.contacts() } else { None };
            text(&WatchReply::Poses(Poses {
                run_id: self.run_id.clone(),
                tick: self.snapshot.tick,
                sim_time_s: self.snapshot.sim_time_s,
                poses: self.poses.clone(),
                telemetry: telemetry.map(|told| told.seen.clone()),
                contacts: contacts.map(|(seen, _)| seen.clone()),
            }))
        };
        self.texts[usize::from(telemetry) + 2 * usize::from(contacts)].get_or_init(written).clone()
    }

    /// The same as a binary frame, for a viewer that was `sent` this.
    pub(super) fn bytes(&self, overlays: Overlays, sent: &mut Vec<Seven>, key: bool) -> Vec<u8> {
        let telemetry = if overlays.telemetry { self.telemetry() } else { None };
        let contacts = if overlays.contacts { self.contacts() } else { None };
        let whole = Whole {
            tick: self.snapshot.tick,
            score: self.snapshot.score,
            poses: &self.poses,
            telemetry: telemetry.map(|told| told.bytes.as_slice()),
            loads: telemetry.map(|told| told.loads.as_slice()),
            readings: telemetry.map(|told| told.readings.as_slice()),
            contacts: contacts.map(|(_, bytes)| bytes.as_slice()),
        };
        binary::encode(&whole, sent, key)
    }

    /// The referee's verdicts, if somebody wanted them in time.
    pub(super) fn verdicts(&self) -> Option<&Vec<ObjectStatus>> {
        let explained = || {
            let mut told = self.snapshot.evidence.as_ref()?.explain();
            for rule in told.iter_mut().flat_map(|verdict| &mut verdict.reasons) {
                rule.value = rule.value.map(|value| (value * VERDICT_STEPS).round() / VERDICT_STEPS);
            }
            Some(told)
        };
        self.verdicts.get_or_init(explained).as_ref()
    }

    /// The message `verdicts`.
    pub(super) fn verdicts_text(&self, objects: &[ObjectStatus]) -> Utf8Bytes {
        let (run_id, tick) = (self.run_id.clone(), self.snapshot.tick);
        text(&WatchReply::Verdicts(Verdicts { run_id, tick, objects: objects.to_vec() }))
    }
}

/// Single precision: a tenth of a micrometre, and half the bytes.
fn seven(pose: Pose) -> Seven {
    let ([x, y, z], [i, j, k, w]) = (pose.translation.to_array(), pose.rotation.to_array());
    [x, y, z, i, j, k, w].map(|number| number as f32)
}

/// A message as JSON.
pub(super) fn text(message: &WatchReply) -> Utf8Bytes {
    // Plain structs of numbers and strings: writing them cannot fail.
    serde_json::to_string(message).unwrap_or_default().into()
}

/// The message `scene` of a run at tick 0: for those who may know all of the hand, and for the others.
pub(super) fn scene(info: WatchRun, run: &Run) -> [Utf8Bytes; 2] {
    let scene = run.scene();
    let mut bodies: Vec<WatchBody> = scene
        .bodies
        .iter()
        .map(|body| WatchBody {
            id: body.id,
            name: body.name.clone(),
            kind: if body.free { BodyKind::Object } else { BodyKind::Furniture },
            // The run itself tells all poses.
            position: body.position.unwrap_or_default(),
            quat_xyzw: body.quat_xyzw.unwrap_or([0.0, 0.0, 0.0, 1.0]),
            parts: body.parts.clone(),
            color: body.color,
        })
        .collect();
    let poses: Vec<(usize, Pose)> = run.poses().collect();
    for link in run.hand_bodies() {
        let pose = poses.iter().find(|(id, _)| *id == link.id).map_or(Pose::IDENTITY, |(_, pose)| *pose);
        bodies.push(WatchBody {
            id: link.id,
            name: link.name,
            kind: BodyKind::Hand,
            position: pose.translation.to_array(),
            quat_xyzw: pose.rotation.to_array(),
            parts: link.parts,
            color: HAND_COLOR,
        });
    }
    let moving = poses.iter().map(|(id, _)| *id).collect();
    let regions = scene.regions.clone();
    let mut scene = WatchScene { run: info, bodies, moving, regions, hand: None, readings: Vec::new() };
    let bare = text(&WatchReply::Scene(Box::new(scene.clone())));
    scene.hand = Some(Box::new(run.hand().describe()));
    scene.readings = ChannelInfo::in_readings(run.hand());
    [text(&WatchReply::Scene(Box::new(scene))), bare]
}
