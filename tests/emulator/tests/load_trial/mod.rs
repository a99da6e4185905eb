//! Impacts on a sensor that was armed while it still had a configuration to store, on a bus that others load to 90 %.
//!
//! ```text
//! master   write, apply, save, start                                     pre-operational, write …
//!                           └ armed ─ 0.05 to 1 ms ─ contact ─ threshold ─▶ alarm
//! flash             w w w w (e) w w w w w w w w w  … held back while the impact is open …  w w w
//! ```
//!
//! An armed sensor takes no configuration, so that what is due at an impact is what it took just before: as from a line that sets
//! the rig up, stores it, arms it and lets the robot move in one go.

#![allow(dead_code, reason = "the test and the bench use their parts")]

use embassy_time::{Duration, Instant};
use thud::client::Nmt;
use thud::client::settings::ITEMS;
use thud_emulator::emulator::Settings;
use thud_emulator::moment::MICROSECOND;
use thud_firmware::board::Frame;
use thud_firmware::dictionary::frame::ALARM_BASE;
use thud_firmware::dictionary::{APPLY, SAVE, index};
use thud_sim::bus::Traffic;
use thud_sim::chain::ChainSettings;

use crate::lab::{Lab, NODE};

const ALARM: u16 = ALARM_BASE + NODE as u16;
const NMT: u16 = 0x000;
/// White noise of the workshop's chain, N rms.
const NOISE_N: f64 = 0.3;
/// From a contact until the next is prepared, s: the impact is over and evaluated.
const PERIOD_S: f64 = 1.3;
/// An impact is open at least so long after its alarm: the transient window is longer.
const OPEN: Duration = Duration::from_millis(400);
/// From the sensor being armed to the contact, s: least and most. What is being stored takes 2 ms and more.
const ARMED_S: (f64, f64) = (0.000_05, 0.001);
/// Frames that the master sends for each impact.
pub const FRAMES: u32 = 5;
/// Speeds of the robot, m/s.
const SPEEDS_M_PER_S: [f64; 4] = [0.1, 0.25, 0.4, 0.6];

/// What came of the impacts.
#[derive(Clone, Debug, Default)]
pub struct Outcome {
    /// From the true force passing six times the noise to the end of the alarm frame on the bus, s, for each impact.
    pub alarms_s: Vec<f64>,
    /// Least load of the bus while a trial lasted, 0 to 1.
    pub load: f64,
    /// Greatest share of its time in which the processor was awake.
    pub awake: f64,
    /// Double words and pages of flash that were written.
    pub written: u64,
    /// Impacts at whose alarm there was still something to be written, and was written after them.
    pub due: u32,
    /// Impacts at which an operation of the flash began after the alarm had gone to the controller.
    pub disturbed: u32,
    /// Samples lost, by the ADC's count and by the sensor's; alarms withheld.
    pub lost: u64,
    /// Frames of others that the controller's filters kept out, and frames that it took.
    pub filtered: u64,
    /// See [`Outcome::filtered`].
    pub accepted: u64,
    /// Configurations that were applied and that a power cycle finds again.
    pub stored: u32,
    /// Bytes of stack used at worst.
    pub stack: u32,
    /// Most handlers under way at once.
    pub nesting: usize,
    /// What the chip does not permit and was done all the same.
    pub violations: usize,
}

impl Outcome {
    /// Both together.
    pub fn and(mut self, other: Self) -> Self {
        self.alarms_s.extend(other.alarms_s);
        Self {
            alarms_s: self.alarms_s,
            load: self.load.min(other.load),
            awake: self.awake.max(other.awake),
            written: self.written + other.written,
            due: self.due + other.due,
            disturbed: self.disturbed + other.disturbed,
            lost: self.lost + other.lost,
            filtered: self.filtered + other.filtered,
            accepted: self.accepted + other.accepted,
            stored: self.stored + other.stored,
            stack: self.stack.max(other.stack),
            nesting: self.nesting.max(other.nesting),
            violations: self.violations + other.violations,
        }
    }
}

/// Settles, loads the bus, and strikes so often; `progress` hears the number of each impact. The seed tells boards apart.
pub fn run(seed: u64, impacts: u32, mut progress: impl FnMut(u32)) -> (Outcome, Lab) {
    let mut lab = Lab::with(Settings { chain: ChainSettings::workshop(), seed, ..Settings::default() });
    lab.settle();
    let bus = lab.emulator().bus().clone();
    // Identifiers less urgent than alarm and emergency, more urgent than the sensor's answers, and none that it uses: two
    // nodes that send under one identifier drive each other off the bus.
    bus.attach_traffic("others", Traffic { identifiers: 0x421..=0x47F, ..Traffic::with_load(0.9) });
    lab.run_ms(50);
    let (began, statistics) = (lab.now(), bus.statistics());
    let busy = lab.emulator().machine().busy();
    let (filtered, accepted) = (lab.emulator().chip().can.filtered(), lab.emulator().chip().can.accepted());
    let first_operations = operations(&lab);
    // A master that waits for no answer; its adapter keeps the order.
    let master = bus.attach_host("master");
    let send = |id: u16, bytes: &[u8]| master.send(&Frame::new(id, bytes).expect("at most eight bytes"));
    let download = |index: u16, sub: u8, head: u8, data: [u8; 4]| {
        let ([low, high], [a, b, c, d]) = (index.to_le_bytes(), data);
        send(0x600 + u16::from(NODE), &[head, low, high, sub, a, b, c, d]);
    };
    let stiffness = ITEMS.iter().find(|item| item.name == "body stiffness").expect("a setting");
    let mut outcome = Outcome::default();
    for number in 0..impacts {
        progress(number);
        send(NMT, &[Nmt::PreOperational as u8, NODE]);
        download(stiffness.index, stiffness.sub, 0x23, (20_000.0 + number as f32).to_le_bytes());
        // The golden section and its like spread the phases of sample clock, bus and flash evenly.
        let phase = |step: f64| (f64::from(number) * step + seed as f64 * 0.5).fract();
        lab.emulator_mut().run_for(Duration::from_micros(60_000 + (phase(0.618_033_988_7) * 1e3) as u64));
        download(index::TRANSACTION, 1, 0x2F, [APPLY, 0, 0, 0]);
        download(index::STORE, 1, 0x23, SAVE.to_le_bytes());
        send(NMT, &[Nmt::Start as u8, NODE]);
        let armed_by = lab.now() + Duration::from_millis(100);
        while lab.sent(NMT).iter().all(|(_, frame)| frame.bytes() != [Nmt::Start as u8, NODE]) {
            assert!(lab.now() < armed_by, "impact {number}: the sensor was not armed");
            lab.emulator_mut().run_for(Duration::from_micros(20));
        }
        // The node has its turn between two operations of the flash, of which erasing a page takes 22 ms; a master would see the
        // heartbeat say operational.
        lab.emulator_mut().run_for(Duration::from_micros(100));
        while let Some(until) = erasing(&lab) {
            lab.emulator_mut().run_until(until + Duration::from_micros(100));
        }
        let contact_s = lab.now_s() + ARMED_S.0 + phase(0.324_717_957_2) * (ARMED_S.1 - ARMED_S.0);
        let impact = lab.strike(contact_s, SPEEDS_M_PER_S[number as usize % SPEEDS_M_PER_S.len()]);
        let passes_s = (0..)
            .map(|step| f64::from(step) * 1e-6)
            .find(|at_s| impact.force_n(*at_s) > 6.0 * NOISE_N)
            .expect("the force passes six times the noise");
        let contact = Instant::from_micros((contact_s * 1e6) as u64);
        lab.emulator_mut().run_until(contact + OPEN);
        let alarms = lab.crossed(ALARM);
        assert_eq!(alarms.len(), 1, "impact {number}: {alarms:?}");
        assert!(alarms[0].loaded > contact, "impact {number}: an alarm before the contact");
        outcome.alarms_s.push(alarms[0].ended.as_micros() as f64 * 1e-6 - contact_s - passes_s);
        // The impact is open before its alarm goes to the controller, and still: nothing may begin from then on, not even what had
        // waited for its turn just before.
        let begun = lab.emulator().chip().flash.last_begun();
        let alarmed = alarms[0].loaded.as_micros();
        outcome.disturbed += u32::from(begun.is_some_and(|at| at / MICROSECOND > alarmed));
        let held = operations(&lab);
        lab.emulator_mut().run_until(contact + Duration::from_micros((PERIOD_S * 1e6) as u64));
        outcome.due += u32::from(operations(&lab) > held);
        lab.expect_order(1);
    }
    let elapsed = lab.now() - began;
    outcome.load = bus.statistics().load_since(&statistics, elapsed);
    outcome.written = operations(&lab) - first_operations;
    outcome.filtered = lab.emulator().chip().can.filtered() - filtered;
    outcome.accepted = lab.emulator().chip().can.accepted() - accepted;
    lab.fresh_client();
    let status = lab.status();
    let count =
        |what: &str| u64::from(status.losses.iter().find(|loss| loss.what == what).expect("it is counted").count);
    outcome.lost = lab.emulator().chip().lost_samples()
        + ["lost samples", "overruns", "alarms withheld"].into_iter().map(count).sum::<u64>();
    {
        let emulator = lab.emulator();
        outcome.awake = (emulator.machine().busy() - busy) as f64 * 1e-6 / elapsed.as_micros() as f64;
        outcome.stack = emulator.machine().stack_used();
        outcome.nesting = emulator.machine().deepest_nesting();
        outcome.violations = emulator.chip().violations().len();
    }
    (outcome, lab)
}

/// Configurations that the board finds in its flash after a power cycle: each has a revision of its own.
pub fn stored(lab: &mut Lab) -> u32 {
    lab.emulator_mut().power_off();
    lab.run_ms(50);
    lab.emulator_mut().power_on();
    lab.run_ms(200);
    lab.fresh_client();
    lab.status().configuration_revision
}

/// Until when a page is being erased.
fn erasing(lab: &Lab) -> Option<Instant> {
    let until = lab.emulator().chip().flash.busy_until().map(|at| Instant::from_micros(at / MICROSECOND));
    until.filter(|until| *until > lab.now() + Duration::from_micros(100))
}

/// Operations of the flash so far.
fn operations(lab: &Lab) -> u64 {
    let wear = lab.emulator().chip().flash.wear();
    wear.programmed + wear.erased
}

/// The largest.
pub fn worst(values: &[f64]) -> f64 {
    values.iter().copied().fold(f64::NEG_INFINITY, f64::max)
}
