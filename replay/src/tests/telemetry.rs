//! Telemetry of the hand in a replay.

use super::*;
use crate::format::{HAND_RECORD, SCENE_RECORD, TELEMETRY};
use crate::telemetry::TelemetryMessage;
use mcap::records::{Record, op};
use prost::Message;

fn messages(bytes: &[u8]) -> Vec<TelemetryMessage> {
    let mut messages = Vec::new();
    let mut see = |_: u64, data: &[u8]| messages.push(TelemetryMessage::decode(data).expect("protobuf"));
    reader::each_message(bytes, TELEMETRY, &mut see).expect("read");
    messages
}

#[test]
fn it_is_written_at_30_hz_as_the_run_reports_it() {
    let scenario = Scenario::new("softhand", 60);
    let recorded = scenario.record();
    let messages = messages(&recorded.bytes);
    assert_eq!(read(&recorded.bytes).expect("sound").telemetry, messages.len() as u64);
    assert!((18..=20).contains(&messages.len()), "{}", messages.len());
    let first = &messages[0];
    assert_eq!((first.tick, first.score), (0, 0.0));
    let hand = &scenario.hand;
    for message in &messages {
        assert_eq!(message.command.len(), hand.motors.len());
        assert_eq!((message.tension.len(), message.q.len()), (hand.tendons.len(), hand.coordinates.len()));
        assert_eq!(message.predicted.len(), message.q.len());
        let contacts = message.contact_a.len();
        assert_eq!((message.contact_b.len(), message.contact_use.len()), (contacts, contacts));
        assert_eq!(
            (message.contact_position.len(), message.contact_force.len()),
            (3 * contacts, 3 * contacts)
        );
    }
    // Closing: what is commanded, reached and predicted goes up together.
    let last = &messages[messages.len() - 1];
    assert!(last.command[0] > 0.5 && last.position[0] > 0.3, "{last:?}");
    assert!(last.predicted.iter().sum::<f32>() > first.predicted.iter().sum::<f32>() + 0.5, "{last:?}");
}

#[test]
fn a_file_has_its_hand_its_regions_and_the_names_of_its_bodies() {
    let recorded = Scenario::new("pinch", 3).record();
    let mut records = std::collections::BTreeMap::new();
    for frame in records::frames(&recorded.bytes).expect("frames") {
        if frame.opcode == op::METADATA
            && let Ok(Record::Metadata(metadata)) = mcap::parse_record(frame.opcode, frame.body)
        {
            records.insert(metadata.name, metadata.metadata);
        }
    }
    let json = |record: &str, key: &str| -> serde_json::Value {
        serde_json::from_str(&records[record][key]).expect("JSON")
    };
    let hand = json(HAND_RECORD, "description");
    assert_eq!(hand["name"], "pinch");
    let links = hand["links"].as_array().expect("links").len();
    let names = json(SCENE_RECORD, "names");
    let names = names.as_array().expect("names");
    assert_eq!(names[0], "ball_0");
    assert_eq!(names[names.len() - links], hand["links"][0]["name"]);
    assert_eq!(json(SCENE_RECORD, "regions").as_array().map(Vec::len), Some(2));
}

#[test]
fn a_file_without_it_is_read_and_verified_as_before() {
    let scenario = Scenario::new("pinch", 30);
    let recorded = scenario.record();
    let earlier = forge::earlier(&recorded.bytes, &scenario.signer);
    let replay = read(&earlier).expect("sound");
    assert_eq!((replay.telemetry, replay.actions.len()), (0, 30));
    assert!(replay.pose_messages > 0);
    let verified = verify(&replay, &[]).expect("the same run");
    assert_eq!(verified.ticks, 30);
}
