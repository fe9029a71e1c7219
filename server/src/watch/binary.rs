//! The binary frames of `palmares.v1.bin`: bodies that have moved, in single precision, little endian.

use palmares_tasks::run::{Contact, Telemetry};

/// Version of the frames.
const VERSION: u8 = 1;
/// Flag: the frame has every moving body.
const KEY: u8 = 1;
/// Flag: telemetry follows.
const TELEMETRY: u8 = 2;
/// Flag: contacts follow.
const CONTACTS: u8 = 4;
/// Flag: loads on the hand follow: work of the motors, fingers and taxels.
const LOADS: u8 = 8;
/// Flag: readings of sensors follow.
const READINGS: u8 = 16;
/// A body has moved when it is this far from its last sent position, m.
const MOVED_M: f32 = 5e-5;
/// A body has turned when its orientation differs by this angle, a tenth of a degree, rad.
const TURNED_RAD: f32 = 1.745_329_3e-3;

/// Position x, y, z in m and orientation x, y, z, w.
pub(super) type WirePose = [f32; 7];

/// The content of a frame, the same for all viewers.
pub(super) struct FrameContent<'a> {
    /// Ticks since reset.
    pub(super) tick: u64,
    /// Points.
    pub(super) score: f64,
    /// Every moving body.
    pub(super) poses: &'a [WirePose],
    /// Encoded by [`telemetry`], for viewers with that overlay.
    pub(super) telemetry: Option<&'a [u8]>,
    /// Encoded by [`loads`], together with the telemetry.
    pub(super) loads: Option<&'a [u8]>,
    /// Encoded by [`readings`], together with the telemetry.
    pub(super) readings: Option<&'a [u8]>,
    /// Encoded by [`contacts`], for viewers with that overlay.
    pub(super) contacts: Option<&'a [u8]>,
}

/// Encodes a frame with the bodies that have moved since `sent`, or with all if `key`. Updates `sent`.
pub(super) fn encode(content: &FrameContent<'_>, sent: &mut Vec<WirePose>, key: bool) -> Vec<u8> {
    let key = key || sent.len() != content.poses.len();
    sent.resize(content.poses.len(), [0.0; 7]);
    let extra = |bytes: Option<&[u8]>| bytes.map_or(0, <[u8]>::len);
    let parts = [content.telemetry, content.contacts, content.loads, content.readings];
    let size = 12 + 18 * content.poses.len() + parts.into_iter().map(extra).sum::<usize>();
    let mut out = Vec::with_capacity(size);
    let flags = if key { KEY } else { 0 }
        | if content.telemetry.is_some() { TELEMETRY } else { 0 }
        | if content.contacts.is_some() { CONTACTS } else { 0 }
        | if content.loads.is_some() { LOADS } else { 0 }
        | if content.readings.is_some() { READINGS } else { 0 };
    out.extend([VERSION, flags, 0, 0]);
    out.extend((content.tick as u32).to_le_bytes());
    put(&mut out, content.score);
    let mut bodies: u16 = 0;
    for (k, (pose, sent)) in content.poses.iter().zip(sent).enumerate().take(usize::from(u16::MAX)) {
        if key || moved(sent, pose) {
            *sent = *pose;
            bodies += 1;
            out.extend((k as u16).to_le_bytes());
            let [x, y, z, i, j, k, w] = *pose;
            [x, y, z].iter().for_each(|x| out.extend(x.to_le_bytes()));
            out.extend(packed([i, j, k, w]).to_le_bytes());
        }
    }
    out[2..4].copy_from_slice(&bodies.to_le_bytes());
    parts.into_iter().flatten().for_each(|bytes| out.extend(bytes));
    out
}

fn put(out: &mut Vec<u8>, number: f64) {
    out.extend((number as f32).to_le_bytes());
}

/// Writes the number of items in one byte, and returns it; at most 255.
fn counted<T>(out: &mut Vec<u8>, all: &[T]) -> usize {
    let count = u8::try_from(all.len()).unwrap_or(u8::MAX);
    out.push(count);
    usize::from(count)
}

/// Encodes motors, tendons, joints and the predicted equilibrium.
pub(super) fn telemetry(hand: &Telemetry) -> Vec<u8> {
    let mut out = Vec::new();
    let motors = counted(&mut out, &hand.motors);
    for motor in &hand.motors[..motors] {
        [motor.command, motor.position, motor.tension].iter().for_each(|x| put(&mut out, *x));
    }
    let tendons = counted(&mut out, &hand.tension);
    hand.tension[..tendons].iter().for_each(|x| put(&mut out, *x));
    let joints = counted(&mut out, &hand.q);
    hand.q[..joints].iter().for_each(|x| put(&mut out, *x));
    let predicted = hand.predicted.len() == hand.q.len() && !hand.q.is_empty();
    out.push(u8::from(predicted));
    if predicted {
        hand.predicted[..joints].iter().for_each(|x| put(&mut out, *x));
    }
    out
}

/// Encodes work of the motors, wrenches of the fingers and forces of the taxels.
pub(super) fn loads(hand: &Telemetry) -> Vec<u8> {
    let mut out = Vec::new();
    let motors = counted(&mut out, &hand.motors);
    hand.motors[..motors].iter().for_each(|motor| put(&mut out, motor.motor_work_j));
    let fingers = counted(&mut out, &hand.fingers);
    for finger in &hand.fingers[..fingers] {
        finger.force.iter().chain(&finger.torque).for_each(|x| put(&mut out, *x));
    }
    let taxels = u16::try_from(hand.touch.len()).unwrap_or(u16::MAX);
    out.extend(taxels.to_le_bytes());
    hand.touch[..usize::from(taxels)].as_flattened().iter().for_each(|x| put(&mut out, *x));
    out
}

/// Encodes readings of sensors.
pub(super) fn readings(hand: &Telemetry) -> Vec<u8> {
    let count = u16::try_from(hand.readings.len()).unwrap_or(u16::MAX);
    let mut out = Vec::with_capacity(2 + 4 * usize::from(count));
    out.extend(count.to_le_bytes());
    hand.readings[..usize::from(count)].iter().for_each(|x| put(&mut out, *x));
    out
}

/// Encodes contacts.
pub(super) fn contacts(all: &[Contact]) -> Vec<u8> {
    let count = u16::try_from(all.len()).unwrap_or(u16::MAX);
    let mut out = Vec::with_capacity(2 + 29 * usize::from(count));
    out.extend(count.to_le_bytes());
    for contact in &all[..usize::from(count)] {
        out.extend((contact.a as u16).to_le_bytes());
        out.extend((contact.b as u16).to_le_bytes());
        contact.position.iter().chain(&contact.force).for_each(|x| put(&mut out, *x));
        // The conversion from float to integer saturates.
        out.push((255.0 * contact.friction_use).round() as u8);
    }
    out
}

fn moved(a: &WirePose, b: &WirePose) -> bool {
    let square = |x: f32| x * x;
    let away = (0..3).map(|k| square(a[k] - b[k])).sum::<f32>();
    // The chord between unit quaternions is half of the angle; q and -q are the same orientation.
    let [same, opposite] = [1.0, -1.0].map(|sign| (3..7).map(|k| square(a[k] - sign * b[k])).sum::<f32>());
    away > square(MOVED_M) || same.min(opposite) > square(0.5 * TURNED_RAD)
}

/// A unit quaternion x, y, z, w in 32 bits: the index of its largest part, which is made positive, then the other three parts
/// in order, 10 bits each from high to low.
fn packed(q: [f32; 4]) -> u32 {
    let mut largest = 0;
    for k in 1..4 {
        if q[k].abs() > q[largest].abs() {
            largest = k;
        }
    }
    let sign = if q[largest] < 0.0 { -1.0 } else { 1.0 };
    let bits = |x: f32| ((sign * x * std::f32::consts::SQRT_2 + 1.0) * 0.5 * 1023.0).round() as u32;
    let others = (0..4).filter(|k| *k != largest).map(|k| bits(q[k]).min(1023));
    others.fold(largest as u32, |packed, bits| (packed << 10) | bits)
}

#[cfg(test)]
mod tests {
    use super::*;
    use palmares_tasks::run::{FingerWrench, Motor};

    const REST: WirePose = [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0];

    fn unpacked(packed: u32) -> [f32; 4] {
        let largest = (packed >> 30) as usize;
        let part = |shift: u32| {
            (((packed >> shift) & 1023) as f32 / 1023.0 * 2.0 - 1.0) * std::f32::consts::FRAC_1_SQRT_2
        };
        let mut others = [part(20), part(10), part(0)].into_iter();
        let rest: f32 = [part(20), part(10), part(0)].iter().map(|x| x * x).sum();
        std::array::from_fn(|k| {
            if k == largest { (1.0 - rest).max(0.0).sqrt() } else { others.next().unwrap_or_default() }
        })
    }

    fn content(poses: &[WirePose]) -> FrameContent<'_> {
        FrameContent {
            tick: 0x0102_0304,
            score: 1.5,
            poses,
            telemetry: None,
            loads: None,
            readings: None,
            contacts: None,
        }
    }

    #[test]
    fn a_key_frame_byte_by_byte() {
        let poses = [[1.0, -2.0, 0.5, 0.0, 0.0, 0.0, 1.0], REST];
        let frame = encode(&content(&poses), &mut Vec::new(), true);
        let mut expected = vec![VERSION, 1, 2, 0, 4, 3, 2, 1, 0, 0, 0xc0, 0x3f];
        expected.extend([0, 0, 0, 0, 0x80, 0x3f, 0, 0, 0, 0xc0, 0, 0, 0, 0x3f]);
        // w is the largest (3), the others are 0: 511.5 is rounded up.
        let identity = (3 << 30) | (512 << 20) | (512 << 10) | 512_u32;
        expected.extend(identity.to_le_bytes());
        expected.extend([1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0]);
        expected.extend(identity.to_le_bytes());
        assert_eq!(frame, expected);
    }

    #[test]
    fn telemetry_and_contacts_byte_by_byte() {
        let finger = FingerWrench { name: "thumb".into(), force: [1.0, 0.0, 0.0], torque: [0.0, 0.5, 0.0] };
        let hand = Telemetry {
            motors: vec![Motor { command: 1.0, position: 0.5, tension: 2.0, motor_work_j: 1.0 }],
            tension: vec![-1.0],
            q: vec![0.25, 0.0],
            predicted: vec![],
            fingers: vec![finger],
            touch: vec![[0.0, 0.0, 2.0]],
            readings: vec![0.5, 2.0],
        };
        let (one, half, two) = ([0, 0, 0x80, 0x3f], [0, 0, 0, 0x3f], [0, 0, 0, 0x40]);
        let mut expected = vec![1];
        expected.extend([one, half, two].concat());
        expected.extend([1, 0, 0, 0x80, 0xbf, 2, 0, 0, 0x80, 0x3e, 0, 0, 0, 0]);
        assert_eq!(telemetry(&hand), [&expected[..], &[0]].concat());
        let finger = [&one[..], &[0; 12], &half, &[0; 4]].concat();
        assert_eq!(readings(&hand), [&[2, 0][..], &half, &two].concat());
        assert_eq!(loads(&hand), [&[1][..], &one, &[1], &finger, &[1, 0], &[0; 8], &two].concat());
        let predicted = telemetry(&Telemetry { predicted: vec![1.0, 1.0], ..hand });
        assert_eq!(predicted, [&expected[..], &[1], &one, &one].concat());

        let contact =
            Contact { a: 258, b: 3, position: [1.0, 0.0, 0.0], force: [0.0, 0.0, -1.0], friction_use: 0.5 };
        let slipping = Contact { friction_use: 7.0, ..contact };
        let bytes = contacts(&[contact, slipping]);
        assert_eq!(bytes[..6], [2, 0, 2, 1, 3, 0]);
        assert_eq!(bytes[6..10], one);
        assert_eq!(bytes[10..30], [&[0; 16][..], &[0, 0, 0x80, 0xbf]].concat());
        assert_eq!((bytes[30], bytes.len(), bytes[bytes.len() - 1]), (128, 2 + 2 * 29, 255));
        let poses = [REST];
        let with = FrameContent {
            telemetry: Some(&[7]),
            contacts: Some(&[8, 9]),
            loads: Some(&[10]),
            readings: Some(&[11]),
            ..content(&poses)
        };
        let frame = encode(&with, &mut vec![REST], false);
        assert_eq!((frame[1], &frame[12..]), (30, &[7, 8, 9, 10, 11][..]));
    }

    #[test]
    fn only_bodies_that_moved_since_they_were_sent_are_sent() {
        let turned = |angle: f32| [0.0, 0.0, 0.0, (angle / 2.0).sin(), 0.0, 0.0, (angle / 2.0).cos()];
        let at = |x: f32| [x, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0];
        let (mut sent, degree) = (Vec::new(), 1.0_f32.to_radians());
        let count = |frame: Vec<u8>| (frame[1], u16::from_le_bytes([frame[2], frame[3]]));
        assert_eq!(
            count(encode(&content(&[REST, REST]), &mut sent, false)),
            (1, 2),
            "the first is a key frame"
        );
        assert_eq!(count(encode(&content(&[at(4e-5), turned(0.08 * degree)]), &mut sent, false)), (0, 0));
        // Compared with the last sent pose: slow drift is sent too.
        assert_eq!(count(encode(&content(&[at(8e-5), turned(0.16 * degree)]), &mut sent, false)), (0, 2));
        assert_eq!(count(encode(&content(&[at(8e-5), turned(0.16 * degree)]), &mut sent, false)), (0, 0));
        let opposite = turned(0.16 * degree).map(|x| -x);
        assert_eq!(count(encode(&content(&[at(8e-5), opposite]), &mut sent, false)), (0, 0));
        assert_eq!(count(encode(&content(&[at(8e-5), opposite]), &mut sent, true)), (1, 2));
    }

    #[test]
    fn an_orientation_survives_its_packing_to_three_tenths_of_a_degree() {
        let mut worst: f32 = 0.0;
        for seed in 0..2000_u32 {
            let part = |k: u32| ((seed * 4 + k) as f32 * 12.9898).sin();
            let q = [part(0), part(1), part(2), part(3)];
            let length = q.iter().map(|x| x * x).sum::<f32>().sqrt();
            let q = q.map(|x| x / length);
            let back = unpacked(packed(q));
            let dot: f32 = q.iter().zip(&back).map(|(a, b)| a * b).sum();
            let sign = dot.signum();
            let chord = q.iter().zip(&back).map(|(a, b)| (a - sign * b).powi(2)).sum::<f32>().sqrt();
            worst = worst.max(2.0 * chord);
        }
        // Each of the three parts errs by at most √2 / 1023 / 2; where all four are equal, the fourth errs by their sum.
        assert!(worst < 0.28_f32.to_radians(), "{} degrees", worst.to_degrees());
    }

    #[test]
    fn fifty_moving_bodies_take_less_than_a_kilobyte() {
        let poses = [REST; 50];
        assert_eq!(encode(&content(&poses), &mut Vec::new(), true).len(), 12 + 50 * 18);
    }
}
