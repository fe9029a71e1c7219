//! A node of ROS 2 on RustDDS, an implementation of DDS that shares no code with the one of `palmares ros2`.
//!
//! `ros2-peer DOMAIN MOTOR SIGMA` sends `/joint_command` for a motor until `/joint_states` has it there, and prints the
//! last state: a line for each joint, with name, position, velocity and effort.

use rustdds::{
    DomainParticipant, QosPolicyBuilder, TopicKind,
    policy::{History, Reliability},
};
use serde::{Deserialize, Serialize};
use std::time::{Duration, Instant};
use std::{env, process, thread};

/// Time until the peer gives up.
const PATIENCE: Duration = Duration::from_secs(60);

#[derive(Debug, Clone, Default, Serialize, Deserialize)]
struct Time {
    sec: i32,
    nanosec: u32,
}

#[derive(Debug, Clone, Default, Serialize, Deserialize)]
struct Header {
    stamp: Time,
    frame_id: String,
}

#[derive(Debug, Clone, Default, Serialize, Deserialize)]
struct JointState {
    header: Header,
    name: Vec<String>,
    position: Vec<f64>,
    velocity: Vec<f64>,
    effort: Vec<f64>,
}

fn main() {
    let words: Vec<String> = env::args().collect();
    let [_, domain, motor, sigma] = words.as_slice() else {
        eprintln!("usage: ros2-peer DOMAIN MOTOR SIGMA");
        process::exit(2);
    };
    let domain: u16 = domain.parse().expect("a number of a domain");
    let sigma: f64 = sigma.parse().expect("a number between 0 and 1");
    let participant = DomainParticipant::new(domain).expect("a participant");
    let reliable = Reliability::Reliable { max_blocking_time: rustdds::Duration::from_millis(100) };
    let qos = QosPolicyBuilder::new().reliability(reliable).history(History::KeepLast { depth: 10 }).build();
    let kind = "sensor_msgs::msg::dds_::JointState_";
    let topic = |name: &str| {
        participant.create_topic(name.to_owned(), kind.to_owned(), &qos, TopicKind::NoKey).expect("a topic")
    };
    let (states, commands) = (topic("rt/joint_states"), topic("rt/joint_command"));
    let subscriber = participant.create_subscriber(&qos).expect("a subscriber");
    let publisher = participant.create_publisher(&qos).expect("a publisher");
    let mut reader = subscriber
        .create_datareader_no_key::<JointState, rustdds::CDRDeserializerAdapter<JointState>>(&states, None)
        .expect("a reader");
    let writer = publisher
        .create_datawriter_no_key::<JointState, rustdds::CDRSerializerAdapter<JointState>>(&commands, None)
        .expect("a writer");
    let command = JointState { name: vec![motor.clone()], position: vec![sigma], ..JointState::default() };
    let begin = Instant::now();
    while begin.elapsed() < PATIENCE {
        writer.write(command.clone(), None).expect("written");
        while let Ok(Some(sample)) = reader.take_next_sample() {
            let state = sample.into_value();
            let at = state.name.iter().position(|name| name == motor);
            if at.is_some_and(|at| (state.position[at] - sigma).abs() < 0.01) {
                for k in 0..state.name.len() {
                    let (q, v, effort) = (state.position[k], state.velocity[k], state.effort[k]);
                    println!("{} {q} {v} {effort}", state.name[k]);
                }
                return;
            }
        }
        thread::sleep(Duration::from_millis(20));
    }
    eprintln!("{motor} did not reach {sigma} within {} s", PATIENCE.as_secs());
    process::exit(1);
}
