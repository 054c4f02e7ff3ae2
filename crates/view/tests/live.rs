//! A client of the live channels: it gets the channels and the messages of a recording.
#![cfg(feature = "live")]

use std::collections::BTreeMap;
use std::io::{Read, Write};
use std::net::TcpStream;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

use orchard_play::Sight;
use orchard_recording::live::Live;
use orchard_recording::{Channel, Message, Recorder, RecordingConfig};
use orchard_scenario::{Options, Scenario};
use orchard_tasks::harvest::adapter::LogReader;
use orchard_tasks::harvest::observe::{FrameInput, Observer};
use orchard_view::live::{LiveAudience, run};
use orchard_view::{Setup, Stage};
use orchard_world::World;
use serde_json::{Value, json};

const FRAMES: u32 = 40;
/// Opcodes of websocket frames (RFC 6455, 5.2), and of Foxglove's message data.
const TEXT: u8 = 1;
const BINARY: u8 = 2;
const MESSAGE_DATA: u8 = 1;

/// A client that speaks just enough of both protocols.
struct Client(TcpStream);

impl Client {
    fn connect(port: u16) -> Self {
        let mut stream = TcpStream::connect(("127.0.0.1", port)).unwrap();
        stream.set_read_timeout(Some(Duration::from_secs(20))).unwrap();
        let request = "GET / HTTP/1.1\r\nHost: localhost\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n\
            Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\nSec-WebSocket-Version: 13\r\n\
            Sec-WebSocket-Protocol: foxglove.sdk.v1\r\n\r\n";
        stream.write_all(request.as_bytes()).unwrap();
        let mut head = Vec::new();
        while !head.ends_with(b"\r\n\r\n") {
            let mut byte = [0];
            stream.read_exact(&mut byte).unwrap();
            head.push(byte[0]);
        }
        let head = String::from_utf8(head).unwrap();
        assert!(head.starts_with("HTTP/1.1 101") && head.contains("foxglove.sdk.v1"), "{head}");
        Self(stream)
    }

    /// The next frame: its opcode and content.
    fn next(&mut self) -> (u8, Vec<u8>) {
        let mut take = |count: usize| {
            let mut bytes = vec![0; count];
            self.0.read_exact(&mut bytes).unwrap();
            bytes
        };
        let head = take(2);
        let length = match head[1] {
            126 => usize::from(u16::from_be_bytes(take(2).try_into().unwrap())),
            127 => u64::from_be_bytes(take(8).try_into().unwrap()) as usize,
            short => usize::from(short),
        };
        assert!(head[0] & 0x80 != 0, "whole frames only");
        (head[0] & 0x0f, take(length))
    }

    /// The next text with this `op`.
    fn told(&mut self, op: &str) -> Value {
        loop {
            let (opcode, content) = self.next();
            if opcode == TEXT {
                let value: Value = serde_json::from_slice(&content).unwrap();
                if value["op"] == op {
                    return value;
                }
            }
        }
    }

    fn tell(&mut self, value: &Value) {
        let text = value.to_string();
        // A client masks what it sends; a mask of zeros changes nothing.
        let mut frame = vec![0x80 | TEXT, 0x80 | 126];
        frame.extend((text.len() as u16).to_be_bytes());
        frame.extend([0; 4]);
        frame.extend(text.as_bytes());
        self.0.write_all(&frame).unwrap();
    }

    /// The next message: subscription, log time, content.
    fn message(&mut self) -> (u32, u64, Vec<u8>) {
        loop {
            let (opcode, content) = self.next();
            if opcode == BINARY && content[0] == MESSAGE_DATA {
                let id = u32::from_le_bytes(content[1..5].try_into().unwrap());
                let time = u64::from_le_bytes(content[5..13].try_into().unwrap());
                return (id, time, content[13..].to_vec());
            }
        }
    }
}

/// The messages that a recording of the same frames has, by channel, without the camera's first moments.
fn recorded() -> BTreeMap<Channel, Vec<(u64, Vec<u8>)>> {
    let mut stage = stage();
    let mut log = LogReader::default();
    let world = stage.session().world();
    let frame = world.spec().sim.frame();
    let mut recorder = Recorder::begin(Vec::<Message>::new(), RecordingConfig::paper(), frame, world);
    for _ in 0..FRAMES {
        let mut before = |world: &World, sight: &Sight<'_>| {
            let events = log.read(sight.controller.unwrap().record());
            let (observation, command) = (sight.observation, sight.command);
            recorder.before_step(world, &FrameInput { observation, controller_events: &events, command });
        };
        stage.session_mut().step_seen(&mut before);
        let session = stage.session();
        recorder.after_step(session.world(), session.news());
    }
    let mut messages: BTreeMap<Channel, Vec<(u64, Vec<u8>)>> = BTreeMap::new();
    for Message { channel, log_time, data } in recorder.into_sink() {
        messages.entry(channel).or_default().push((log_time, data));
    }
    messages
}

fn stage() -> Stage {
    let options = Some(Options::of(&[("controller", "expert")]).unwrap());
    let controllers = orchard_scenario::controllers();
    Stage::new(Setup { options, controllers, seed: 20250704, index: 0 }).unwrap()
}

/// A client is offered the channels of a recording, with their schemas, and gets its messages, byte for byte; who comes late gets the scene.
#[test]
fn a_client_gets_what_a_recording_has() {
    let mut stage = stage();
    let live = Live::open("127.0.0.1", 0).unwrap();
    let port = live.port();
    let taken = Live::open("127.0.0.1", port).map(drop).unwrap_err().to_string();
    assert!(taken.starts_with(&format!("127.0.0.1:{port}: cannot serve there")), "{taken}");
    stage.show_to(Box::new(LiveAudience::new(live)));
    let mut client = Client::connect(port);
    // They are offered in one list or in several.
    let mut offered = BTreeMap::new();
    while offered.len() < Channel::ALL.len() {
        for channel in client.told("advertise")["channels"].as_array().unwrap() {
            let known = Channel::of(channel["topic"].as_str().unwrap()).unwrap();
            let schema = known.schema();
            assert_eq!(channel["encoding"], known.encoding());
            assert_eq!(channel["schemaName"], schema.name.as_str());
            assert_eq!(channel["schemaEncoding"], schema.encoding.as_str());
            if known.encoding() == "json" {
                assert_eq!(channel["schema"].as_str().unwrap().as_bytes(), &*schema.data);
            }
            offered.insert(known, channel["id"].as_u64().unwrap());
        }
    }
    // A subscription has the number of its channel in the list of all.
    let numbers = Channel::ALL.iter().enumerate();
    let subscriptions: Vec<Value> =
        numbers.map(|(id, channel)| json!({"id": id, "channelId": offered[channel]})).collect();
    client.tell(&json!({"op": "subscribe", "subscriptions": subscriptions}));
    // The scene was sent before the client came.
    let mut got: BTreeMap<Channel, Vec<(u64, Vec<u8>)>> = BTreeMap::new();
    let mut take = |client: &mut Client| {
        let (id, time, data) = client.message();
        let channel = Channel::ALL[id as usize];
        got.entry(channel).or_default().push((time, data));
        channel
    };
    let mut scene = vec![take(&mut client), take(&mut client), take(&mut client)];
    scene.sort_unstable();
    assert_eq!(scene, [Channel::Ground, Channel::Leaves, Channel::Robot]);
    run(&mut stage, Some(FRAMES), &AtomicBool::new(false));
    let expected = recorded();
    let count: usize = expected.values().map(Vec::len).sum();
    assert!(count > 4 * FRAMES as usize, "{count}");
    for _ in 3..count {
        take(&mut client);
    }
    assert_eq!(got.keys().collect::<Vec<_>>(), expected.keys().collect::<Vec<_>>());
    for (channel, messages) in &expected {
        assert!(got[channel] == *messages, "{}", channel.topic());
    }
    // The scenario of the stage is the recording's.
    assert_eq!(stage.scenario().hash(), Scenario::of(&[("controller", "expert")]).unwrap().hash());
}
