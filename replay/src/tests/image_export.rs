//! Exported images equal those of the run.

use super::*;
use crate::image_export::{CameraCalibration, ExportError, RawImage, export_images};
use palmares_tasks::{Noise, Sensing};
use prost::Message;
use std::collections::BTreeMap;

/// By topic: time and bytes of every message.
type Messages = BTreeMap<String, Vec<(u64, Vec<u8>)>>;

fn messages(bytes: &[u8]) -> Messages {
    let mut all = Messages::new();
    for message in mcap::MessageStream::new(bytes).expect("a file") {
        let message = message.expect("whole");
        let topic = message.channel.topic.clone();
        assert!(message.channel.schema.is_some(), "{topic}");
        all.entry(topic).or_default().push((message.log_time, message.data.to_vec()));
    }
    all
}

fn exported(noise: Noise, cameras: &[&str], rate_hz: f64) -> Result<Messages, ExportError> {
    let mut scenario = Scenario::new("softhand", 40);
    scenario.header.noise = noise;
    let recorded = scenario.record();
    let replay = read(&recorded.bytes).expect("a replay");
    let folder = tempfile::tempdir().expect("folder");
    let path = folder.path().join("images.mcap");
    let names: Vec<String> = cameras.iter().map(|name| (*name).to_owned()).collect();
    let count = export_images(&replay, &[], &names, rate_hz, std::fs::File::create(&path).expect("a file"))?;
    let all = messages(&std::fs::read(&path).expect("written"));
    let images =
        all.iter().filter(|(topic, _)| topic.starts_with("/camera/") && !topic.ends_with("calibration"));
    assert_eq!(count, images.map(|(_, found)| found.len() as u64).sum::<u64>());
    Ok(all)
}

#[test]
fn exported_images_equal_those_of_the_run() {
    let all = exported(Noise::Real, &["wrist", "box_a", "box_a.rgb"], 30.0).expect("images");
    let topics: Vec<&str> = all.keys().map(String::as_str).collect();
    let expected = ["/camera/box_a/calibration", "/camera/box_a/depth", "/camera/box_a/rgb"];
    assert_eq!(topics[..3], expected);
    assert_eq!(topics[3..], ["/camera/wrist/calibration", "/camera/wrist/depth", "/tf"]);
    // 40 ticks of 10 ms, the newest image of which is 70 ms old: 0 to 0.33 s at 30 Hz.
    assert_eq!(all["/camera/wrist/depth"].len(), 10);

    // The run itself, as its controller played it, with an image at the end.
    let recorded = Scenario::new("softhand", 40).record();
    let replay = read(&recorded.bytes).expect("a replay");
    let hand = Hand::builtin("softhand").expect("built in");
    let mut run = Run::new(Task::builtin().remove(0), hand, Seed::from_u64(5))
        .expect("a scene")
        .with_noise(Noise::Real);
    for tick in &replay.actions {
        run.step(&tick.action).expect("valid");
    }
    let shots = run.shots(&["wrist".to_owned()], Sensing::Sensors).expect("a camera");
    let exposures = run.expose(&shots);
    let live = exposures[0].render();
    let (_, last) = all["/camera/wrist/depth"].last().expect("one");
    let image = RawImage::decode(&last[..]).expect("an image");
    assert_eq!((image.width, image.height, image.step, image.encoding.as_str()), (160, 120, 320, "16UC1"));
    let depths = |bytes: &[u8], unit_mm: f64| -> Vec<f64> {
        let words = bytes.chunks_exact(2).map(|pair| u16::from_le_bytes([pair[0], pair[1]]));
        words.map(|word| f64::from(word) * unit_mm).collect()
    };
    let live_depths = depths(&live.depth.as_ref().expect("it is recorded").0, 1e3 * live.depth_unit);
    let exported = depths(&image.data, 1.0);
    assert!(live_depths.iter().zip(&exported).all(|(a, b)| (a - b).abs() <= 0.5 + 1e-9), "{live:?}");
    assert!(exported.iter().any(|z| *z > 0.0));
    let (_, calibration) = all["/camera/wrist/calibration"].last().expect("one");
    let calibration = CameraCalibration::decode(&calibration[..]).expect("a calibration");
    assert_eq!(calibration.K, [live.fx, 0.0, live.cx, 0.0, live.fy, live.cy, 0.0, 0.0, 1.0]);
}

#[test]
fn cameras_without_noise_have_the_requested_rate() {
    let all = exported(Noise::None, &["box_a"], 10.0).expect("images");
    let times: Vec<u64> = all["/camera/box_a/depth"].iter().map(|(time, _)| *time).collect();
    assert_eq!(times.len(), 5, "0, 0.1, 0.2, 0.3, 0.4 s");
    assert!(times.windows(2).all(|pair| pair[1] - pair[0] == 100_000_000), "{times:?}");
}

#[test]
fn an_unknown_camera_is_refused() {
    let error = exported(Noise::None, &["eye"], 10.0).expect_err("no such camera");
    assert!(error.to_string().contains("box_a"), "{error}");
}
