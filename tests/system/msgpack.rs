//! The subprotocol `palmares.v1.msgpack`: the same messages, packed.

use crate::harness::{Client, Server, handshake, reset, step};
use futures_util::{SinkExt, StreamExt};
use serde::de::{Deserializer, Error, MapAccess, SeqAccess, Visitor};
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use std::fmt;
use tokio::net::TcpStream;
use tokio_tungstenite::tungstenite::Message;
use tokio_tungstenite::{MaybeTlsStream, WebSocketStream, connect_async};

struct Packed(WebSocketStream<MaybeTlsStream<TcpStream>>);

impl Packed {
    async fn connect(server: &Server) -> Self {
        Packed(connect_async(handshake(server, Some("palmares.v1.msgpack"))).await.expect("connects").0)
    }

    async fn ask(&mut self, request: &impl Serialize) -> Value {
        let packed = rmp_serde::to_vec_named(request).expect("packs");
        self.frame(Message::binary(packed)).await
    }

    async fn frame(&mut self, frame: Message) -> Value {
        self.0.send(frame).await.expect("sent");
        loop {
            match self.0.next().await {
                Some(Ok(Message::Binary(bytes))) => {
                    let Unpacked(value) = rmp_serde::from_slice(&bytes).expect("MessagePack with names");
                    return value;
                }
                Some(Ok(Message::Ping(_) | Message::Pong(_))) => {}
                other => panic!("expected a message, got {other:?}"),
            }
        }
    }
}

/// A message in which lists of the 64-bit floats replace the byte strings.
struct Unpacked(Value);

impl<'de> Deserialize<'de> for Unpacked {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Anything;
        impl<'de> Visitor<'de> for Anything {
            type Value = Value;
            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a message")
            }
            fn visit_bool<E>(self, x: bool) -> Result<Value, E> {
                Ok(x.into())
            }
            fn visit_u64<E>(self, x: u64) -> Result<Value, E> {
                Ok(x.into())
            }
            fn visit_i64<E>(self, x: i64) -> Result<Value, E> {
                Ok(x.into())
            }
            fn visit_f64<E>(self, x: f64) -> Result<Value, E> {
                Ok(x.into())
            }
            fn visit_str<E>(self, x: &str) -> Result<Value, E> {
                Ok(x.into())
            }
            fn visit_unit<E>(self) -> Result<Value, E> {
                Ok(Value::Null)
            }
            fn visit_bytes<E: Error>(self, x: &[u8]) -> Result<Value, E> {
                let (numbers, rest) = x.as_chunks::<8>();
                if !rest.is_empty() {
                    return Err(E::custom(format!("{} bytes are no 64-bit floats", x.len())));
                }
                Ok(numbers.iter().map(|number| f64::from_le_bytes(*number)).collect())
            }
            fn visit_seq<A: SeqAccess<'de>>(self, mut entries: A) -> Result<Value, A::Error> {
                let mut all = Vec::new();
                while let Some(Unpacked(entry)) = entries.next_element()? {
                    all.push(entry);
                }
                Ok(Value::Array(all))
            }
            fn visit_map<A: MapAccess<'de>>(self, mut fields: A) -> Result<Value, A::Error> {
                let mut all = serde_json::Map::new();
                while let Some((name, Unpacked(value))) = fields.next_entry()? {
                    all.insert(name, value);
                }
                Ok(Value::Object(all))
            }
        }
        deserializer.deserialize_any(Anything).map(Unpacked)
    }
}

/// The numbers of a table one after the other.
fn flatten(table: &mut Value) {
    if let Value::Array(rows) = table
        && rows.iter().all(Value::is_array)
    {
        *table = rows.iter().filter_map(Value::as_array).flatten().cloned().collect();
    }
}

fn with_id(mut request: Value, id: u64) -> Value {
    request["id"] = id.into();
    request
}

/// The reply without the values that differ from run to run.
fn comparable(mut reply: Value) -> Value {
    for field in ["run_id", "session_left_s", "replay"] {
        reply.as_object_mut().map(|fields| fields.remove(field));
    }
    for list in ["objects", "contacts"] {
        if let Some(tables) = reply.pointer_mut(&format!("/truth/{list}")).and_then(Value::as_object_mut) {
            tables.values_mut().for_each(flatten);
        }
    }
    reply
}

#[tokio::test]
async fn both_encodings_say_the_same() {
    let server = Server::start();
    let mut packed = Packed::connect(&server).await;
    let welcome = packed.ask(&json!({"op": "hello", "id": 1, "client": "packed"})).await;
    assert_eq!((&welcome["op"], &welcome["id"]), (&json!("welcome"), &json!(1)), "{welcome}");
    let (mut text, _) = Client::greet(&server, "text").await;

    let move_on = json!({"base": {"linear": [0.1, 0, 0], "angular": [0, 0, 0.5]}, "hand": [0.4]});
    let requests = [
        reset(),
        json!({"op": "step", "tick": 0, "action": move_on, "repeat": 20}),
        step(20),
        step(20),
        json!({"op": "step", "tick": 21, "action": {"hand": [1, 2]}}),
        json!({"op": "jump"}),
        json!({"op": "stop"}),
    ];
    for (k, request) in requests.into_iter().enumerate() {
        let id = k as u64 + 2;
        let unpacked = packed.ask(&with_id(request.clone(), id)).await;
        assert_eq!(unpacked["id"], id, "{unpacked}");
        if unpacked["op"] == "obs" {
            assert_eq!(unpacked["truth"]["objects"]["quat_xyzw"].as_array().map(Vec::len), Some(40));
        }
        assert_eq!(comparable(unpacked), comparable(text.ask(request).await));
    }
}

#[tokio::test]
async fn what_is_no_number_is_refused_and_changes_nothing() {
    let server = Server::start();
    let mut packed = Packed::connect(&server).await;
    packed.ask(&json!({"op": "hello", "id": 1, "client": "packed"})).await;
    packed.ask(&with_id(reset(), 2)).await;
    #[derive(Serialize)]
    struct Raw {
        op: &'static str,
        id: u64,
        tick: u64,
        action: Targets,
    }
    #[derive(Serialize)]
    struct Targets {
        hand: [f64; 1],
    }
    for x in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        let reply = packed.ask(&Raw { op: "step", id: 3, tick: 0, action: Targets { hand: [x] } }).await;
        assert_eq!((&reply["code"], &reply["id"]), (&json!("bad_action"), &json!(3)), "{reply}");
    }
    let obs = packed.ask(&with_id(step(0), 4)).await;
    assert_eq!((&obs["op"], &obs["tick"]), (&json!("obs"), &json!(1)), "{obs}");
}

#[tokio::test]
async fn a_frame_that_is_not_messagepack_is_refused_and_the_connection_goes_on() {
    let server = Server::start();
    let mut packed = Packed::connect(&server).await;
    let text = Message::text(r#"{"op":"hello","id":1,"client":"a"}"#);
    for frame in [text, Message::binary(vec![0xc1]), Message::binary(vec![0x81, 0xa2])] {
        let reply = packed.frame(frame).await;
        assert_eq!((&reply["code"], &reply["fatal"]), (&json!("bad_json"), &json!(false)), "{reply}");
    }
    let welcome = packed.ask(&json!({"op": "hello", "id": 1, "client": "packed"})).await;
    assert_eq!(welcome["op"], "welcome", "{welcome}");
}
