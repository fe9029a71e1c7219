//! A tick of a run as another host needs it to continue the run, and the encoding of consecutive ticks.

use flate2::Compression;
use flate2::read::DeflateDecoder;
use flate2::write::DeflateEncoder;
use palmares_replay::{LoggedTick, StateHash};
use palmares_tasks::{Action, BaseTarget, Event};
use serde::{Deserialize, Serialize};
use std::io::{Read, Write};

/// The first byte: the version of the encoding.
const FORMAT: u8 = 1;
/// The first byte if a tick has an effort: the efforts of all ticks follow the ticks.
const WITH_EFFORT: u8 = 2;
/// Largest size of unpacked ticks: thousands of times that of a usual group.
const MAX_BYTES: u64 = 4 << 20;

/// A tick as another host needs it. An official run has no pushes.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct ShippedTick {
    /// The action as applied: clipped and complete.
    pub(crate) action: Action,
    /// Digest of the state after the tick.
    pub(crate) state: StateHash,
    /// Events of the referee in this tick.
    pub(crate) events: Vec<Event>,
}

impl From<ShippedTick> for LoggedTick {
    fn from(ShippedTick { action, state, events }: ShippedTick) -> Self {
        LoggedTick { action, state, events, pushes: Vec::new() }
    }
}

/// Reason why bytes are no ticks.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub(crate) enum DecodeError {
    /// Another version wrote them.
    #[error("their encoding is {0}, and this program reads {FORMAT} and {WITH_EFFORT}")]
    Format(u8),
    /// They are incomplete, or of something else.
    #[error("they are damaged")]
    Damaged,
}

/// A tick for postcard: numbers of fixed length, and no untagged enum.
#[derive(Serialize, Deserialize)]
struct Packed {
    base: Option<PackedBase>,
    hand: Option<Vec<f64>>,
    state: [u8; 8],
    events: Vec<PackedEvent>,
}

#[derive(Serialize, Deserialize)]
enum PackedBase {
    Pose([f64; 3], [f64; 4]),
    Twist([f64; 3], [f64; 3]),
    Joints(Vec<f64>),
}

#[derive(Serialize, Deserialize)]
struct PackedEvent {
    tick: u64,
    kind: String,
    object: Option<usize>,
}

impl From<&ShippedTick> for Packed {
    fn from(ShippedTick { action, state, events }: &ShippedTick) -> Self {
        let base = action.base.as_ref().map(|base| match base {
            BaseTarget::Pose { position, quat_xyzw } => PackedBase::Pose(*position, *quat_xyzw),
            BaseTarget::Twist { linear, angular } => PackedBase::Twist(*linear, *angular),
            BaseTarget::Joints { joints } => PackedBase::Joints(joints.clone()),
        });
        let event = |Event { tick, kind, object }: &Event| PackedEvent {
            tick: *tick,
            kind: kind.clone(),
            object: *object,
        };
        let (hand, state) = (action.hand.clone(), state.0.to_le_bytes());
        Packed { base, hand, state, events: events.iter().map(event).collect() }
    }
}

impl From<Packed> for ShippedTick {
    fn from(Packed { base, hand, state, events }: Packed) -> Self {
        let base = base.map(|base| match base {
            PackedBase::Pose(position, quat_xyzw) => BaseTarget::Pose { position, quat_xyzw },
            PackedBase::Twist(linear, angular) => BaseTarget::Twist { linear, angular },
            PackedBase::Joints(joints) => BaseTarget::Joints { joints },
        });
        let event = |PackedEvent { tick, kind, object }| Event { tick, kind, object };
        let state = StateHash(u64::from_le_bytes(state));
        let action = Action { base, hand, effort: None };
        ShippedTick { action, state, events: events.into_iter().map(event).collect() }
    }
}

/// Encodes consecutive ticks: a format byte, then postcard in deflate. A tick of a hand with one motor has 77 bytes before; in groups
/// of ten it has 55 when every number changes with every tick, 21 at 20 actions per second, and 14 at rest. zstd saves as much.
pub(crate) fn encode(ticks: &[ShippedTick]) -> Vec<u8> {
    let packed: Vec<Packed> = ticks.iter().map(Packed::from).collect();
    // Numbers, strings and lists with a length, written to memory: neither fails.
    let mut plain = postcard::to_stdvec(&packed).expect("every list has a length");
    let efforts: Vec<&Option<Vec<f64>>> = ticks.iter().map(|tick| &tick.action.effort).collect();
    let has_effort = efforts.iter().any(|effort| effort.is_some());
    if has_effort {
        plain.extend(postcard::to_stdvec(&efforts).expect("every list has a length"));
    }
    let format = if has_effort { WITH_EFFORT } else { FORMAT };
    let mut packer = DeflateEncoder::new(vec![format], Compression::fast());
    packer.write_all(&plain).expect("memory takes it");
    packer.finish().expect("memory takes it")
}

/// Decodes what [`encode`] wrote. The bytes are not trusted.
///
/// # Errors
/// They are damaged, or of another version.
pub(crate) fn decode(bytes: &[u8]) -> Result<Vec<ShippedTick>, DecodeError> {
    let (&format, body) = bytes.split_first().ok_or(DecodeError::Damaged)?;
    if format != FORMAT && format != WITH_EFFORT {
        return Err(DecodeError::Format(format));
    }
    let mut plain = Vec::new();
    let mut unpacker = DeflateDecoder::new(body).take(MAX_BYTES);
    unpacker.read_to_end(&mut plain).map_err(|_| DecodeError::Damaged)?;
    let (ticks, rest) = postcard::take_from_bytes::<Vec<Packed>>(&plain).map_err(|_| DecodeError::Damaged)?;
    let mut ticks: Vec<ShippedTick> = ticks.into_iter().map(ShippedTick::from).collect();
    let (efforts, rest) = match format {
        FORMAT => (vec![None; ticks.len()], rest),
        _ => postcard::take_from_bytes::<Vec<Option<Vec<f64>>>>(rest).map_err(|_| DecodeError::Damaged)?,
    };
    if efforts.len() != ticks.len() || !rest.is_empty() {
        return Err(DecodeError::Damaged);
    }
    for (tick, effort) in ticks.iter_mut().zip(efforts) {
        tick.action.effort = effort;
    }
    Ok(ticks)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn action() -> impl Strategy<Value = Action> {
        let number = prop::num::f64::NORMAL | prop::num::f64::SUBNORMAL | prop::num::f64::ZERO;
        let pose = (prop::array::uniform3(number), prop::array::uniform4(number))
            .prop_map(|(position, quat_xyzw)| BaseTarget::Pose { position, quat_xyzw });
        let twist = (prop::array::uniform3(number), prop::array::uniform3(number))
            .prop_map(|(linear, angular)| BaseTarget::Twist { linear, angular });
        let joints = prop::collection::vec(number, 0..8).prop_map(|joints| BaseTarget::Joints { joints });
        let motors = || prop::option::of(prop::collection::vec(number, 0..4));
        (prop::option::of(prop_oneof![pose, twist, joints]), motors(), motors())
            .prop_map(|(base, hand, effort)| Action { base, hand, effort })
    }

    fn tick() -> impl Strategy<Value = ShippedTick> {
        let event = (any::<u64>(), ".{0,12}", prop::option::of(0..40_usize))
            .prop_map(|(tick, kind, object)| Event { tick, kind, object });
        let parts = (action(), any::<u64>(), prop::collection::vec(event, 0..3));
        parts.prop_map(|(action, state, events)| ShippedTick { action, state: StateHash(state), events })
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(48))]
        #[test]
        fn ticks_are_the_same_after_their_encoding(ticks in prop::collection::vec(tick(), 0..20)) {
            let again = decode(&encode(&ticks)).expect("its own bytes");
            // Every bit, so that -0 is not 0.
            prop_assert_eq!(format!("{again:?}"), format!("{ticks:?}"));
        }

        #[test]
        fn other_bytes_are_refused_or_read(bytes in prop::collection::vec(any::<u8>(), 0..200), cut in 0..100_usize) {
            let _ = decode(&bytes);
            let _ = decode(&[&[FORMAT], bytes.as_slice()].concat());
            let tick = ShippedTick { action: Action::default(), state: StateHash(7), events: vec![] };
            let mut whole = encode(&vec![tick; 12]);
            prop_assert!(decode(&whole[..cut.min(whole.len() - 1)]).is_err());
            let place = cut % whole.len();
            whole[place] ^= 1 << (cut % 8);
            let _ = decode(&whole);
        }
    }

    #[test]
    fn a_bomb_and_another_format_are_refused() {
        assert_eq!(decode(&[]), Err(DecodeError::Damaged));
        assert_eq!(decode(&[9, 1, 2]), Err(DecodeError::Format(9)));
        let mut packer = DeflateEncoder::new(vec![FORMAT], Compression::fast());
        packer.write_all(&vec![0xff; (MAX_BYTES + 1) as usize]).expect("memory takes it");
        assert_eq!(decode(&packer.finish().expect("memory takes it")), Err(DecodeError::Damaged));
        // A list that claims to be longer than all memory.
        let mut packer = DeflateEncoder::new(vec![FORMAT], Compression::fast());
        packer
            .write_all(&[0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 1])
            .expect("memory takes it");
        assert_eq!(decode(&packer.finish().expect("memory takes it")), Err(DecodeError::Damaged));
    }
}
