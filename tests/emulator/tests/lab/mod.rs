//! An emulated board under a simulated rig, with the host tool's client on its bus; all in guest time.

#![allow(dead_code, reason = "each test uses its part")]

use std::cell::{Ref, RefCell, RefMut};
use std::rc::Rc;

use embassy_time::{Duration, Instant};
use thud::client::Client;
use thud::client::status::Status;
use thud_emulator::emulator::{Emulator, Settings};
use thud_emulator::guest_bus::GuestBus;
use thud_emulator::image::Image;
use thud_firmware::board::Frame;
use thud_firmware::configuration::Configuration;
use thud_firmware::emergency::{Emergency, Fault};
use thud_sim::bus::{Attempt, Outcome};
use thud_sim::chain::ChainSettings;
use thud_sim::force::Blows;
use thud_sim::rig::{Accuracy, Approach, Impact, Rig};

/// The board's node id.
pub const NODE: u8 = Configuration::DEFAULT.node.node_id;
/// Effective mass of the robot, kg.
pub const MASS_KG: f64 = 6.0;
/// Stiffness of the body springs, N/m.
pub const BODY_N_PER_M: f64 = 25_000.0;
/// How long an impact is followed, s.
pub const FOLLOWED_S: f64 = 0.5;

/// Everything on the table.
pub struct Lab {
    emulator: Rc<RefCell<Emulator>>,
    /// The host tool's client.
    pub client: Client,
    /// Orders blows.
    pub blows: Blows,
}

impl Lab {
    /// The firmware, just switched on, with this chain.
    pub fn new(chain: ChainSettings) -> Self {
        Self::with(Settings { chain, ..Settings::default() })
    }

    /// The same with other settings too.
    pub fn with(settings: Settings) -> Self {
        let image = Image::read(&Image::usual_place()).unwrap_or_else(|error| panic!("{error}"));
        let blows = Blows::new();
        let mut emulator = Emulator::new(&image, &settings, blows.clone());
        emulator.chip_mut().front_end.keep_codes();
        emulator.bus().keep_record();
        let emulator = Rc::new(RefCell::new(emulator));
        let client = Client::new(Box::new(GuestBus::new(emulator.clone())));
        Self { emulator, client, blows }
    }

    /// A client that has heard nothing yet.
    pub fn fresh_client(&mut self) {
        self.client = Client::new(Box::new(GuestBus::new(self.emulator.clone())));
    }

    /// The same without noise, after it has settled.
    pub fn quiet() -> Self {
        let mut lab = Self::new(ChainSettings::quiet());
        lab.settle();
        lab
    }

    /// Lets time pass until zero and noise are settled; the codes so far are kept.
    pub fn settle(&mut self) {
        for _ in 0..20 {
            self.run_ms(500);
            if self.status().settled {
                return;
            }
        }
        panic!("not settled after 10 s: {:#?}", self.emulator().log());
    }

    pub fn emulator(&self) -> Ref<'_, Emulator> {
        self.emulator.borrow()
    }

    pub fn emulator_mut(&mut self) -> RefMut<'_, Emulator> {
        self.emulator.borrow_mut()
    }

    pub fn now(&self) -> Instant {
        self.emulator().now()
    }

    pub fn now_s(&self) -> f64 {
        self.now().as_micros() as f64 * 1e-6
    }

    pub fn run_ms(&mut self, milliseconds: u64) {
        self.emulator_mut().run_for(Duration::from_millis(milliseconds));
    }

    pub fn status(&mut self) -> Status {
        let sensor = self.client.the_sensor(Some(NODE)).expect("the sensor answers");
        self.client.status(&sensor).expect("the sensor answers")
    }

    /// How much of this was lost.
    pub fn loss(&mut self, what: &str) -> u32 {
        let status = self.status();
        status.losses.iter().find(|loss| loss.what == what).unwrap_or_else(|| panic!("{what} is not counted")).count
    }

    /// Frames of this identifier that crossed the bus since this was last asked, from the bus's record.
    pub fn crossed(&self, id: u16) -> Vec<Attempt> {
        let attempts = self.emulator().bus().take_record().into_iter();
        attempts.filter(|attempt| attempt.outcome == Outcome::Sent && attempt.frame.id == id).collect()
    }

    /// The same: when each was complete, and what it was.
    pub fn sent(&self, id: u16) -> Vec<(Instant, Frame)> {
        self.crossed(id).into_iter().map(|attempt| (attempt.ended, attempt.frame)).collect()
    }

    /// What the node has told by EMCY since this was last asked.
    pub fn told(&self) -> Vec<Emergency> {
        let frames = self.sent(0x80 + u16::from(NODE));
        frames.iter().map(|(_, frame)| Emergency::decode(frame.bytes()).expect("eight bytes")).collect()
    }

    /// The faults among it.
    pub fn emergencies(&self) -> Vec<Fault> {
        self.told().iter().filter_map(|told| Fault::from_code(told.code)).collect()
    }

    /// Orders an impact at `contact_s`; what truly happens.
    pub fn strike(&self, contact_s: f64, speed_m_per_s: f64) -> Rc<Impact> {
        let approach = Approach::new(speed_m_per_s, MASS_KG);
        let impact = Rig::impact(BODY_N_PER_M)
            .strike(&approach, &[], FOLLOWED_S, Accuracy::default())
            .unwrap_or_else(|error| panic!("{error}"));
        let impact = Rc::new(impact);
        let force = impact.clone();
        self.blows.strike(contact_s, FOLLOWED_S, move |since_s| force.force_n(since_s));
        impact
    }

    /// Nothing that the chip does not permit, no fault, and only this many starts.
    pub fn expect_order(&self, starts: usize) {
        let emulator = self.emulator();
        assert_eq!(emulator.chip().violations(), [] as [String; 0], "{:#?}", emulator.log());
        assert_eq!(emulator.machine().faults(), [] as [String; 0], "{:#?}", emulator.log());
        assert_eq!(emulator.starts().len(), starts, "{:?}\n{:#?}", emulator.starts(), emulator.log());
    }

    /// Whether the program's log has a line with these words.
    pub fn logged(&self, words: &str) -> bool {
        self.emulator().log().iter().any(|line| line.contains(words))
    }
}
