//! Impacts on a sensor whose bus is loaded to 90 % by others and which has configurations to store.
//!
//! ```text
//!  … stage ──── apply ─────▶ flash is written, a page erased now and then
//!                 └─ 0 to 4 ms ─▶ contact ─▶ threshold ─▶ alarm frame complete on the bus
//! ```

#![allow(dead_code, reason = "the test and the bench use their parts")]

use embassy_time::{Duration, Instant};
use thud::client::Nmt;
use thud::client::settings::ITEMS;
use thud_firmware::board::Frame;
use thud_firmware::dictionary::frame::ALARM_BASE;
use thud_firmware::dictionary::{APPLY, index};
use thud_sim::bus::Traffic;
use thud_sim::chain::ChainSettings;

use crate::lab::{Lab, NODE};

/// White noise of the workshop's chain, N rms.
const NOISE_N: f64 = 0.3;
/// From a contact until all is quiet again, s.
const PERIOD_S: f64 = 1.3;
/// Speeds of the robot, m/s.
const SPEEDS_M_PER_S: [f64; 4] = [0.1, 0.25, 0.4, 0.6];

/// What came of the impacts.
#[derive(Debug)]
pub struct Outcome {
    /// From the true force passing six times the noise to the end of the alarm frame on the bus, s, for each impact.
    pub alarms_s: Vec<f64>,
    /// Load of the bus while the trial lasted, 0 to 1.
    pub load: f64,
    /// Share of its time in which the processor was awake.
    pub awake: f64,
    /// Double words and pages of flash that were written.
    pub written: u64,
    /// Contacts at which there was still something to be written.
    pub due_contacts: u32,
    /// Samples lost, by the ADC's count and by the sensor's.
    pub lost_samples: u64,
    /// Configurations that were applied and are stored.
    pub revision: u32,
    /// Bytes of stack used at worst.
    pub stack: u32,
    /// Most handlers under way at once.
    pub nesting: usize,
}

/// Settles, loads the bus, and strikes so often; `progress` hears the number of each impact.
pub fn run(impacts: u32, mut progress: impl FnMut(u32)) -> (Outcome, Lab) {
    let mut lab = Lab::new(ChainSettings::workshop());
    lab.settle();
    lab.client.nmt(Nmt::Start, NODE).unwrap();
    lab.run_ms(20);
    let bus = lab.emulator().bus().clone();
    // Identifiers less urgent than alarm and emergency, more urgent than the sensor's answers, and none that it uses: two
    // nodes that send under one identifier drive each other off the bus.
    bus.attach_traffic("others", Traffic { identifiers: 0x421..=0x47F, ..Traffic::with_load(0.9) });
    lab.run_ms(50);
    let (began, statistics) = (lab.now(), bus.statistics());
    let (busy, wear) = (lab.emulator().machine().busy(), lab.emulator().chip().flash.wear());
    // A master that does not wait: the sensor may have other things to do when it applies a configuration.
    let master = bus.attach_host("master");
    let download = |index: u16, sub: u8, head: u8, data: [u8; 4]| {
        let [low, high] = index.to_le_bytes();
        let [a, b, c, d] = data;
        let request = Frame::new(0x600 + u16::from(NODE), &[head, low, high, sub, a, b, c, d]);
        master.send(&request.expect("eight bytes"));
    };
    let stiffness = ITEMS.iter().find(|item| item.name == "body stiffness").expect("a setting");
    let mut alarms_s = Vec::new();
    let mut due_contacts = 0;
    for number in 0..impacts {
        progress(number);
        // The golden section spreads the phases of sample clock, bus and flash evenly.
        let phase = (f64::from(number) * 0.618_033_988_7).fract();
        let contact_s = lab.now_s() + 0.15 + phase * 0.01;
        let impact = lab.strike(contact_s, SPEEDS_M_PER_S[number as usize % SPEEDS_M_PER_S.len()]);
        download(stiffness.index, stiffness.sub, 0x23, (20_000.0 + number as f32).to_le_bytes());
        let apply_s = contact_s - 0.004 * (f64::from(number) * 0.324_717_957_2).fract();
        lab.emulator_mut().run_until(Instant::from_micros((apply_s * 1e6) as u64));
        download(index::TRANSACTION, 1, 0x2F, [APPLY, 0, 0, 0]);
        let _ = lab.sent(ALARM);
        let contact = Instant::from_micros((contact_s * 1e6) as u64);
        if lab.now() < contact {
            lab.emulator_mut().run_until(contact);
        }
        let at_contact = lab.emulator().chip().flash.wear();
        let passes_s = (0..)
            .map(|step| f64::from(step) * 1e-6)
            .find(|at_s| impact.force_n(*at_s) > 6.0 * NOISE_N)
            .expect("the force passes six times the noise");
        lab.emulator_mut().run_for(Duration::from_micros((PERIOD_S * 1e6) as u64));
        due_contacts += u32::from(lab.emulator().chip().flash.wear() != at_contact);
        let alarms = lab.sent(ALARM);
        assert_eq!(alarms.len(), 1, "impact {number}: {alarms:?}");
        alarms_s.push(alarms[0].0.as_micros() as f64 * 1e-6 - contact_s - passes_s);
    }
    let elapsed = lab.now() - began;
    lab.fresh_client();
    let status = lab.status();
    let count =
        |what: &str| u64::from(status.losses.iter().find(|loss| loss.what == what).expect("it is counted").count);
    let emulator = lab.emulator();
    let now = emulator.chip().flash.wear();
    let outcome = Outcome {
        alarms_s,
        load: bus.statistics().load_since(&statistics, elapsed),
        awake: (emulator.machine().busy() - busy) as f64 * 1e-6 / elapsed.as_micros() as f64,
        written: now.programmed + now.erased - wear.programmed - wear.erased,
        due_contacts,
        lost_samples: emulator.chip().lost_samples() + count("lost samples") + count("overruns"),
        revision: status.configuration_revision,
        stack: emulator.machine().stack_used(),
        nesting: emulator.machine().deepest_nesting(),
    };
    drop(emulator);
    (outcome, lab)
}

const ALARM: u16 = ALARM_BASE + NODE as u16;

/// The largest.
pub fn worst(values: &[f64]) -> f64 {
    values.iter().copied().fold(0.0, f64::max)
}
