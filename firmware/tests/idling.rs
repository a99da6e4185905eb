//! While nothing touches: nothing is noticed, and what there is is known.

mod synthetic;

use synthetic::{Bench, Disturbance, RATE, configuration};
use thud_firmware::capture::CAPTURE;

#[test]
fn two_minutes_of_hum_drift_and_spikes_are_no_onset() {
    for (hum_hertz, drift) in [(50.0, 0.014), (49.8, -0.05), (60.2, 0.05)] {
        let disturbance = Disturbance { hum_hertz, drift, spikes: 2.0, ..Disturbance::USUAL };
        let mut bench = Bench::<CAPTURE>::new(configuration(RATE), 1);
        bench.run(40.0, &disturbance, |_| 0.0);
        assert_eq!(bench.signals, [], "{hum_hertz} Hz, {drift} N/s");
        let noise = bench.sensor.noise().0;
        assert!((noise - 0.3).abs() < 0.03, "{noise} N at {hum_hertz} Hz");
    }
}

/// `cargo test -p thud-firmware --release --test idling -- --ignored`: ten hours, some minutes on one core.
#[test]
#[ignore = "ten hours of virtual time"]
fn ten_hours_of_hum_drift_and_spikes_are_no_onset() {
    let mut bench = Bench::<CAPTURE>::new(configuration(RATE), 2);
    let wander = |t: f64| 200.0 * (std::f64::consts::TAU * t / 36_000.0).sin();
    bench.run(36_000.0, &Disturbance { spikes: 1.0, hum_hertz: 50.1, ..Disturbance::USUAL }, wander);
    assert_eq!(bench.signals, []);
}
