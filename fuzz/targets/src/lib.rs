//! What is fuzzed: one function for each thing that takes bytes from outside. No bytes make it panic, hang, or ask for
//! memory without bound; where there is more to promise (what is written is read again, a node answers afterwards), that is asserted.
//!
//! `cargo fuzz` runs them for hours (`fuzz/fuzz_targets`), the ordinary tests for a moment (`tests/short_run.rs`), both from the same
//! seeds (`fuzz/corpus`).

use std::cell::RefCell;
use std::time::Duration;

use thud_firmware::board::{Frame, Identity, ResetCause};
use thud_firmware::capture::Captures;
use thud_firmware::dictionary::event_record;
use thud_firmware::dictionary::frame::{self, Alarm, Assembly, ForecastFrame, MassFrame, Part};
use thud_firmware::emergency::Emergency;
use thud_firmware::node::CanOpenNode;
use thud_firmware::sdo::{Entries, Opened, SdoServer, Stream, TIMEOUT_MS, VALUE};
use thud_firmware::shared::Shared;
use thud_firmware::storage::Loaded;
use thud_firmware::stream::Samples;
use thud_firmware::units::Hertz;
use zencan_common::sdo::AbortCode;

mod playback;

use playback::Playback;
use thud::bus::log::Lines;
use thud::bus::slcan::codec::{self, Decoder};
use thud::bus::{Heard, candump, packet};
use thud::client::Client;
use thud::client::samples::SampleStream;
use thud::client::watch::Watch;

/// A target by its name, which is also that of its corpus.
pub type Target = (&'static str, fn(&[u8]));

/// All targets.
pub const TARGETS: [Target; 11] = [
    ("sdo_server", sdo_server),
    ("node", node),
    ("pdos", pdos),
    ("host_decoding", host_decoding),
    ("sdo_client", sdo_client),
    ("slcan", slcan),
    ("udp", udp),
    ("log", log),
    ("campaign_toml", campaign_toml),
    ("model_toml", model_toml),
    ("recording_csv", recording_csv),
];

/// Objects of every length that matters: expedited, segmented, a stream of pieces; one can be written.
struct Objects {
    written: Vec<u8>,
}

/// Bytes of the stream: several blocks of 889 and a rest.
const STREAMED: u32 = 2_000;

impl Entries for Objects {
    fn open(&mut self, index: u16, sub: u8, value: &mut [u8; VALUE]) -> Result<Opened, AbortCode> {
        match index % 4 {
            0 => Ok(Opened::Value(usize::from(sub).min(VALUE))),
            1 => {
                let length = self.written.len().min(VALUE);
                value[..length].copy_from_slice(&self.written[..length]);
                Ok(Opened::Value(length))
            }
            2 => Ok(Opened::Stream(Stream { slot: sub, generation: 1, length: STREAMED })),
            _ => Err(AbortCode::NoSuchObject),
        }
    }

    fn read(&mut self, stream: Stream, offset: u32, into: &mut [u8]) -> Result<(), AbortCode> {
        assert!(offset as usize + into.len() <= stream.length as usize, "a piece beyond the end was asked for");
        // One slot is overwritten under the reader.
        if stream.slot == 7 && offset > 500 {
            return Err(AbortCode::CantStoreDeviceState);
        }
        into.fill(offset as u8);
        Ok(())
    }

    fn write(&mut self, _: u16, sub: u8, data: &[u8]) -> Result<(), AbortCode> {
        assert!(data.len() <= 256, "more was taken than the buffer holds");
        if sub == 1 {
            return Err(AbortCode::InvalidValue);
        }
        self.written = data.to_vec();
        Ok(())
    }

    fn writable(&self, index: u16, _: u8) -> Result<(), AbortCode> {
        if index % 4 == 1 { Ok(()) } else { Err(AbortCode::ReadOnly) }
    }
}

/// The SDO server: nine bytes a step, of which the first says what happens beside the eight of a request.
pub fn sdo_server(data: &[u8]) {
    let mut server = SdoServer::new();
    let mut objects = Objects { written: Vec::new() };
    let mut now_ms = 0;
    for step in data.chunks(9) {
        let (how, request) = step.split_first().expect("chunks are not empty");
        now_ms += u64::from(*how) * 30;
        let _ = server.expire(now_ms);
        let _ = server.receive(request, now_ms, &mut objects);
        for _ in 0..how % 160 {
            if server.segment(&mut objects).is_none() {
                break;
            }
        }
    }
    server.expire(now_ms + TIMEOUT_MS);
    server.expire(now_ms + 2 * TIMEOUT_MS);
    assert!(server.is_idle(), "a transfer outlived its timeout");
    let read = server.receive(&[0x40, 0, 0, 4, 0, 0, 0, 0], now_ms + 2 * TIMEOUT_MS, &mut objects);
    assert_eq!(read.map(|answer| answer[0]), Some(0x43), "the next master is served");
}

struct Lab {
    node: CanOpenNode<64>,
    shared: &'static Shared<64>,
    now_ms: u64,
}

thread_local! {
    /// One node for all inputs, because its memory is borrowed for ever; it is reset before each.
    static LAB: RefCell<Lab> = RefCell::new(Lab::new());
}

impl Lab {
    fn new() -> Self {
        let identity =
            Identity { serial: 7, hardware_revision: 0, build: 0, reset_cause: ResetCause::PowerOn, ended_at: 0 };
        let captures: &'static Captures<64> = Box::leak(Box::new(Captures::new()));
        let shared: &'static Shared<64> = Box::leak(Box::new(Shared::new(identity, Loaded::Nothing, captures)));
        Self { node: CanOpenNode::new(shared), shared, now_ms: 0 }
    }

    fn hear(&mut self, id: u16, bytes: &[u8]) {
        if let Some(frame) = Frame::new(id, bytes) {
            self.node.receive(&frame, self.now_ms);
            self.node.poll(self.now_ms);
        }
    }
}

/// The whole node: NMT, LSS, SDO, RPDO, TIME. Ten bytes a step: identifier, length and pause, data.
pub fn node(data: &[u8]) {
    LAB.with_borrow_mut(|lab| {
        lab.hear(0x000, &[129, 0]);
        for step in data.chunks(10) {
            let [which, how, bytes @ ..] = step else { continue };
            lab.now_ms += u64::from(how >> 4) * 50;
            let own = lab.node.node_id().map_or(0, u16::from);
            let id = match which % 8 {
                0 => 0x000,
                1 | 2 => 0x7E5,
                3 => 0x200 + own,
                4 => 0x100,
                5 => u16::from(*which) * 8,
                _ => 0x600 + own,
            };
            lab.hear(id, &bytes[..bytes.len().min(usize::from(how & 0xF)).min(8)]);
        }
        lab.now_ms += 2 * TIMEOUT_MS;
        lab.node.poll(lab.now_ms);
        // LSS waits again, and the node is Pre-operational: then it answers, if LSS left it an id.
        lab.hear(0x7E5, &[0x04, 0, 0, 0, 0, 0, 0, 0]);
        lab.hear(0x000, &[128, 0]);
        if let Some(id) = lab.node.node_id() {
            lab.shared.forget_frames();
            lab.hear(0x600 + u16::from(id), &[0x40, 0x18, 0x10, 4, 0, 0, 0, 0]);
            assert!(lab.shared.forget_frames() > 0, "the node has fallen silent");
        }
    });
}

/// What PDOs carry, decoded; what can be encoded again is.
pub fn pdos(data: &[u8]) {
    let mut assembly = Assembly::new();
    let mut stream = SampleStream::default();
    for bytes in data.chunks(9) {
        let (which, bytes) = bytes.split_first().expect("chunks are not empty");
        let _ = Alarm::decode(bytes);
        let _ = ForecastFrame::decode(bytes);
        let _ = Emergency::decode(bytes);
        let part = Part::ALL[usize::from(which % 5)];
        let _ = assembly.push(part, bytes);
        if let Ok(mass) = MassFrame::decode(bytes) {
            assert_eq!(mass.encode()[..], bytes[..MassFrame::LENGTH]);
        }
        if let Some(samples) = Samples::decode(bytes) {
            stream.push(&samples);
        }
    }
    if let Some(parts) = data.get(..frame::PARTS * 8) {
        let mut frames = [[0; 8]; frame::PARTS];
        for (frame, bytes) in frames.iter_mut().zip(parts.chunks_exact(8)) {
            frame.copy_from_slice(bytes);
        }
        let _ = frame::decode(&frames);
    }
    if let Ok(event) = event_record::decode(data) {
        let start = u32::from(u16::from_le_bytes([data[14], data[15]]));
        let again = event_record::encode(&event, start);
        assert!(event_record::decode(&again).is_ok());
    }
}

/// Frames as whoever follows a bus or a log hears them: twelve bytes a frame.
pub fn host_decoding(data: &[u8]) {
    let mut client = Client::new(Box::new(Playback::new(data, true)));
    let mut watch = Watch::listening(Hertz(20_000.0));
    while !client.line().ended() {
        watch.next(&mut client, Duration::from_millis(50)).expect("a playback does not fail");
    }
}

/// A master whose sensor answers with whatever comes: it finds it, reads its configuration, its events and a curve.
pub fn sdo_client(data: &[u8]) {
    let mut client = Client::new(Box::new(Playback::new(data, false)));
    let _ = client.find(Some(1));
    let _ = client.read_configuration(1);
    let _ = client.logged_event(1, 3);
    let _ = client.sdo(1).upload_blocks(0x2300, 12, &mut |_| {});
    let _ = client.sdo(1).download(0x2012, 3, &[7; 60]);
}

/// The lines of an SLCAN adapter.
pub fn slcan(data: &[u8]) {
    let mut decoder = Decoder::new();
    for byte in data {
        if let Some(Ok(codec::Line::Heard(Heard::Frame(frame)))) = decoder.push(*byte) {
            let line = codec::encode(&frame);
            let again = codec::decode(line.strip_suffix(b"\r").expect("a line ends"));
            assert_eq!(again, Ok(codec::Line::Heard(Heard::Frame(frame))));
        }
    }
}

/// Packets of python-can's `udp_multicast`.
pub fn udp(data: &[u8]) {
    if let Ok(Heard::Frame(frame)) = packet::decode(data) {
        assert_eq!(packet::decode(&packet::encode(&frame, 0.0)), Ok(Heard::Frame(frame)));
    }
}

/// candump logs.
pub fn log(data: &[u8]) {
    let mut lines = Lines::new(data);
    while let Some(line) = lines.read().expect("memory can be read") {
        if let Ok(entry) = line
            && let Heard::Frame(frame) = entry.heard
            && let Ok(interface) = std::str::from_utf8(entry.interface)
        {
            let mut written = Vec::new();
            candump::write(&mut written, entry.at, interface, &frame, entry.sent);
            let again = candump::read(written.trim_ascii_end()).expect("what is written is read again");
            assert_eq!((again.heard, again.sent, again.interface), (entry.heard, entry.sent, entry.interface));
        }
    }
}

/// `campaign.toml`.
pub fn campaign_toml(data: &[u8]) {
    if let Ok(text) = std::str::from_utf8(data) {
        told(thud::campaign::Campaign::parse("campaign.toml", text));
    }
}

/// `model.toml`.
pub fn model_toml(data: &[u8]) {
    if let Ok(text) = std::str::from_utf8(data) {
        told(thud::model::Model::parse("model.toml", text));
    }
}

/// Recordings.
pub fn recording_csv(data: &[u8]) {
    told(thud::recording::parse("recording.csv", data));
}

/// A refusal can be shown: its place lies within the text.
fn told<T>(result: Result<T, thud::input::InputError>) {
    if let Err(error) = result {
        let shown = format!("{error} {error:?}");
        assert!(!shown.is_empty());
    }
}
