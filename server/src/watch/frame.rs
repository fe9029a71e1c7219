//! A frame of a run: encoded once for all viewers, and not on the thread that steps the world.

use super::binary::{self, FrameContent, WirePose};
use super::link::LinkFrame;
use super::messages::{BodyKind, Ended, Final, Poses, Verdicts, WatchBody, WatchReply, WatchRun, WatchScene};
use super::sample::{Overlays, WatchSample};
use axum::extract::ws::Utf8Bytes;
use palmares_models::Pose;
use palmares_senses::ChannelInfo;
use palmares_tasks::referee::ObjectStatus;
use palmares_tasks::run::{Contact, Telemetry, TelemetryModel};
use palmares_tasks::{Fault, Run};
use std::sync::{Arc, OnceLock};

/// Colour of a hand's links, sRGB.
const HAND_COLOR: [f64; 3] = [0.72, 0.74, 0.78];

/// Steps per unit to which values are rounded, so that noise does not make a new message.
const VALUE_STEPS: f64 = 1e3;

/// Telemetry, and its three parts of a binary frame.
#[derive(Debug)]
struct EncodedTelemetry {
    telemetry: Telemetry,
    bytes: Vec<u8>,
    loads: Vec<u8>,
    readings: Vec<u8>,
}

impl EncodedTelemetry {
    fn new(telemetry: Telemetry) -> Self {
        EncodedTelemetry {
            bytes: binary::telemetry(&telemetry),
            loads: binary::loads(&telemetry),
            readings: binary::readings(&telemetry),
            telemetry,
        }
    }
}

fn with_bytes(contacts: Vec<Contact>) -> (Vec<Contact>, Vec<u8>) {
    let bytes = binary::contacts(&contacts);
    (contacts, bytes)
}

/// A frame of a run.
#[derive(Debug)]
pub(super) struct Frame {
    /// The state that it shows; of a run on another host without the world's state.
    pub(super) sample: Arc<WatchSample>,
    run_id: String,
    /// None for a run on another host: the overlays come with the poses.
    telemetry_model: Option<Arc<TelemetryModel>>,
    poses: Vec<WirePose>,
    /// The message `poses` without overlays, with telemetry, with contacts, with both.
    texts: [OnceLock<Utf8Bytes>; 4],
    telemetry: OnceLock<Option<EncodedTelemetry>>,
    contacts: OnceLock<Option<(Vec<Contact>, Vec<u8>)>>,
    verdicts: OnceLock<Option<Vec<ObjectStatus>>>,
}

impl Frame {
    /// The frame of a sample.
    pub(super) fn new(run_id: &str, telemetry_model: &Arc<TelemetryModel>, sample: Arc<WatchSample>) -> Self {
        let WatchSample { base, q, objects, .. } = &*sample;
        Frame {
            run_id: run_id.to_owned(),
            poses: telemetry_model
                .poses(*base, q, objects)
                .into_iter()
                .map(|(_, pose)| wire_pose(pose))
                .collect(),
            telemetry_model: Some(telemetry_model.clone()),
            sample,
            texts: Default::default(),
            telemetry: OnceLock::new(),
            contacts: OnceLock::new(),
            verdicts: OnceLock::new(),
        }
    }

    /// A frame that another host has made.
    pub(super) fn linked(run_id: &str, frame: LinkFrame) -> Self {
        let LinkFrame { tick, sim_time_s, score, late_s, poses, telemetry, contacts, verdicts } = frame;
        Frame {
            sample: Arc::new(WatchSample {
                tick,
                sim_time_s,
                score,
                base: Pose::IDENTITY,
                q: Vec::new(),
                objects: Vec::new(),
                run_sample: None,
                evidence: None,
                late_s,
            }),
            run_id: run_id.to_owned(),
            telemetry_model: None,
            poses,
            texts: Default::default(),
            telemetry: OnceLock::from(telemetry.map(EncodedTelemetry::new)),
            contacts: OnceLock::from(contacts.map(with_bytes)),
            verdicts: OnceLock::from(verdicts),
        }
    }

    /// The frame for another host.
    pub(super) fn link(&self, overlays: Overlays) -> LinkFrame {
        let Overlays { telemetry, contacts, verdicts } = overlays;
        let WatchSample { tick, sim_time_s, score, late_s, .. } = *self.sample;
        LinkFrame {
            tick,
            sim_time_s,
            score,
            late_s,
            poses: self.poses.clone(),
            telemetry: if telemetry {
                self.telemetry().map(|encoded| encoded.telemetry.clone())
            } else {
                None
            },
            contacts: if contacts { self.contacts().map(|(contacts, _)| contacts.clone()) } else { None },
            verdicts: if verdicts { self.verdicts().cloned() } else { None },
        }
    }

    fn telemetry(&self) -> Option<&EncodedTelemetry> {
        let telemetry = || {
            let telemetry = self.telemetry_model.as_ref()?.telemetry(self.sample.run_sample.as_ref()?);
            Some(EncodedTelemetry::new(telemetry))
        };
        self.telemetry.get_or_init(telemetry).as_ref()
    }

    fn contacts(&self) -> Option<&(Vec<Contact>, Vec<u8>)> {
        let contacts = || {
            let contacts = self.telemetry_model.as_ref()?.contacts(self.sample.run_sample.as_ref()?);
            Some(with_bytes(contacts))
        };
        self.contacts.get_or_init(contacts).as_ref()
    }

    /// The message `poses`.
    pub(super) fn text(&self, overlays: Overlays) -> Utf8Bytes {
        let Overlays { telemetry, contacts, .. } = overlays;
        let written = || {
            // Only the overlays of the viewer are computed.
            let telemetry = if telemetry { self.telemetry() } else { None };
            let contacts = if contacts { self.contacts() } else { None };
            text(&WatchReply::Poses(Poses {
                run_id: self.run_id.clone(),
                tick: self.sample.tick,
                sim_time_s: self.sample.sim_time_s,
                poses: self.poses.clone(),
                telemetry: telemetry.map(|encoded| encoded.telemetry.clone()),
                contacts: contacts.map(|(contacts, _)| contacts.clone()),
            }))
        };
        self.texts[usize::from(telemetry) + 2 * usize::from(contacts)].get_or_init(written).clone()
    }

    /// The binary frame for a viewer whose last sent poses are `sent`.
    pub(super) fn bytes(&self, overlays: Overlays, sent: &mut Vec<WirePose>, key: bool) -> Vec<u8> {
        let telemetry = if overlays.telemetry { self.telemetry() } else { None };
        let contacts = if overlays.contacts { self.contacts() } else { None };
        let content = FrameContent {
            tick: self.sample.tick,
            score: self.sample.score,
            poses: &self.poses,
            telemetry: telemetry.map(|encoded| encoded.bytes.as_slice()),
            loads: telemetry.map(|encoded| encoded.loads.as_slice()),
            readings: telemetry.map(|encoded| encoded.readings.as_slice()),
            contacts: contacts.map(|(_, bytes)| bytes.as_slice()),
        };
        binary::encode(&content, sent, key)
    }

    /// The referee's judgement of each object, if the sample has it.
    pub(super) fn verdicts(&self) -> Option<&Vec<ObjectStatus>> {
        let explained = || {
            let mut verdicts = self.sample.evidence.as_ref()?.explain();
            for rule in verdicts.iter_mut().flat_map(|verdict| &mut verdict.reasons) {
                rule.value = rule.value.map(|value| (value * VALUE_STEPS).round() / VALUE_STEPS);
            }
            Some(verdicts)
        };
        self.verdicts.get_or_init(explained).as_ref()
    }

    /// The message `verdicts`.
    pub(super) fn verdicts_text(&self, objects: &[ObjectStatus]) -> Utf8Bytes {
        let (run_id, tick) = (self.run_id.clone(), self.sample.tick);
        text(&WatchReply::Verdicts(Verdicts { run_id, tick, objects: objects.to_vec() }))
    }
}

/// A pose in single precision: a resolution of 0.1 µm in half the bytes.
fn wire_pose(pose: Pose) -> WirePose {
    let ([x, y, z], [i, j, k, w]) = (pose.translation.to_array(), pose.rotation.to_array());
    [x, y, z, i, j, k, w].map(|number| number as f32)
}

/// A message as JSON.
pub(super) fn text(message: &WatchReply) -> Utf8Bytes {
    // Structs of numbers and strings: encoding cannot fail.
    serde_json::to_string(message).unwrap_or_default().into()
}

/// The message `ended`.
pub(super) fn ended(run_id: String, outcome: Option<Final>, fault: Option<Fault>) -> Utf8Bytes {
    text(&WatchReply::Ended(Ended { run_id, outcome, fault }))
}

/// The message `scene` of a run at tick 0: with the hand's full description, and without.
pub(super) fn scene(info: WatchRun, run: &Run) -> [Utf8Bytes; 2] {
    let scene = run.scene();
    let mut bodies: Vec<WatchBody> = scene
        .bodies
        .iter()
        .map(|body| WatchBody {
            id: body.id,
            name: body.name.clone(),
            kind: if body.free { BodyKind::Object } else { BodyKind::Furniture },
            // The run itself knows all poses.
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
    let goals = scene.goal_names();
    let mut scene =
        WatchScene { run: info, bodies, moving, regions, goals, hand: None, readings: Vec::new() };
    let bare = text(&WatchReply::Scene(Box::new(scene.clone())));
    scene.hand = Some(Box::new(run.hand().describe()));
    scene.readings = ChannelInfo::in_readings(run.hand());
    [text(&WatchReply::Scene(Box::new(scene))), bare]
}
