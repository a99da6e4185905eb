use super::*;

const RATE: f64 = 20_000.0;

/// Force as the codes mean it.
fn sensed(settings: &ChainSettings, seed: u64, force: impl Fn(f64) -> f64, samples: usize) -> Vec<f64> {
    let mut chain = MeasuringChain::new(settings, seed);
    let mut newtons: Vec<_> = (0..samples).map(|index| force(index as f64 / RATE)).collect();
    let mut codes = vec![0; samples];
    // In pieces, as the board asks for them.
    for (newtons, codes) in newtons.chunks_mut(8).zip(codes.chunks_mut(8)) {
        chain.convert(newtons, codes);
    }
    let front_end = &settings.front_end;
    codes.iter().map(|code| (f64::from(*code) - f64::from(front_end.zero_code)) * front_end.newton_per_code()).collect()
}

fn exact(settings: &ChainSettings, seed: u64, force: impl Fn(f64) -> f64, samples: usize) -> Vec<f64> {
    let mut chain = MeasuringChain::new(settings, seed);
    let mut newtons: Vec<_> = (0..samples).map(|index| force(index as f64 / RATE)).collect();
    let mut codes = vec![0; samples];
    chain.convert(&mut newtons, &mut codes);
    newtons
}

fn rms(values: &[f64]) -> f64 {
    (values.iter().map(|value| value * value).sum::<f64>() / values.len() as f64).sqrt()
}

#[test]
fn a_code_means_what_the_firmware_takes_it_for() {
    let reference = f64::from(Chain::REFERENCE.newton_per_code);
    assert!((FrontEnd::REFERENCE.newton_per_code() / reference - 1.0).abs() < 1e-6);
    let settings = ChainSettings::transparent();
    for force in [-2000.0, -0.04, 0.0, 0.03, 65.0, 439.9, 2000.0] {
        let read = sensed(&settings, 0, |_| force, 1)[0];
        assert!((read - force).abs() <= 0.5 * settings.front_end.newton_per_code() + 1e-9, "{force} read as {read}");
    }
}

#[test]
fn beyond_the_rails_it_clips() {
    let settings = ChainSettings::transparent();
    let mut chain = MeasuringChain::new(&settings, 0);
    let mut codes = [0; 3];
    chain.convert(&mut [1e5, -1e5, 2293.0], &mut codes);
    assert_eq!(codes, [Chain::REFERENCE.clip_high, Chain::REFERENCE.clip_low, Chain::REFERENCE.clip_high]);
}

/// A held step decays as e^(−t/τ). With τ = 1.59 s it reads −27 % at 0.5 s and −47 % at 1 s.
#[test]
fn a_held_load_leaks_away() {
    let settings = ChainSettings { discharge: Some(Second(1.59)), anti_alias: None, ..ChainSettings::quiet() };
    let read = exact(&settings, 0, |_| 100.0, 20_001);
    for time in [0.0, 0.1, 0.5, 1.0] {
        let expected = 100.0 * (-time / 1.59_f64).exp();
        assert!((read[(time * RATE) as usize] - expected).abs() < 0.01, "at {time} s");
    }
    assert!((read[10_000] - 73.0).abs() < 0.5 && (read[20_000] - 53.3).abs() < 0.5);
    // The undershoot after the load is gone.
    let read = exact(&settings, 0, |t| if t < 0.5 { 100.0 } else { 0.0 }, 11_000);
    assert!((read[10_000] + 27.0).abs() < 0.5);
}

/// The closed form for a slow ramp: y(t) = τ(1 − e^(−t/τ))·slope, at every sample.
#[test]
fn discharge_of_a_ramp_is_exact() {
    let settings = ChainSettings { discharge: Some(Second(0.05)), anti_alias: None, ..ChainSettings::quiet() };
    let read = exact(&settings, 0, |t| 1000.0 * t, 2_000);
    for (index, value) in read.iter().enumerate() {
        let time = index as f64 / RATE;
        let expected = 1000.0 * 0.05 * -(-time / 0.05).exp_m1();
        assert!((value - expected).abs() < 1e-6, "at {time} s: {value}, not {expected}");
    }
}

#[test]
fn the_filter_delays_slow_signals_as_documented_and_is_down_3_db_at_its_corner() {
    let settings = ChainSettings { discharge: None, ..ChainSettings::quiet() };
    let delay = f64::from(settings.delay().0);
    assert!((settings.delay().0 - Chain::REFERENCE.delay.0).abs() < 1e-9, "the sensor's own idea of its chain");
    assert!((delay - 28.1e-6).abs() < 0.1e-6);
    let ramp = exact(&settings, 0, |t| 5000.0 * t, 1_000);
    let last = 999.0 / RATE;
    assert!((ramp[999] - 5000.0 * (last - delay)).abs() < 1e-6);

    let slow = ChainSettings { anti_alias: Some(AntiAlias { corner: Hertz(500.0) }), ..settings.clone() };
    let sine = exact(&slow, 0, |t| (std::f64::consts::TAU * 500.0 * t).sin(), 8_000);
    let gain = rms(&sine[4_000..]) * std::f64::consts::SQRT_2;
    // −3 dB, and within 1 % for the straight lines between samples.
    assert!((gain - std::f64::consts::FRAC_1_SQRT_2).abs() < 0.01, "{gain}");
}

#[test]
fn noise_has_the_strength_and_the_colour_asked_for() {
    let white = ChainSettings { noise: Noise { white: Newton(0.3), coloured: None }, ..ChainSettings::transparent() };
    let read = exact(&white, 5, |_| 0.0, 200_000);
    assert!((rms(&read) - 0.3).abs() < 0.003);
    let neighbours: f64 = read.windows(2).map(|pair| pair[0] * pair[1]).sum::<f64>() / 200_000.0 / 0.09;
    assert!(neighbours.abs() < 0.01, "white noise does not know its neighbour: {neighbours}");

    let coloured = ColouredNoise { rms: Newton(0.5), corner: Hertz(200.0) };
    let settings =
        ChainSettings { noise: Noise { white: Newton(0.0), coloured: Some(coloured) }, ..ChainSettings::transparent() };
    let read = exact(&settings, 5, |_| 0.0, 2_000_000);
    assert!((rms(&read) - 0.5).abs() < 0.02);
    let neighbours: f64 = read.windows(2).map(|pair| pair[0] * pair[1]).sum::<f64>() / 2e6 / 0.25;
    let expected = (-std::f64::consts::TAU * 200.0 / RATE).exp();
    assert!((neighbours - expected).abs() < 0.1 * expected, "{neighbours}, not {expected}");
}

#[test]
fn hum_keeps_its_phase_for_hours() {
    let hum = Hum { fundamental: Hertz(50.0), amplitude: Newton(0.5), harmonics: vec![0.0, 0.3] };
    let settings = ChainSettings { hum: Some(hum), ..ChainSettings::transparent() };
    let mut chain = MeasuringChain::new(&settings, 0);
    let mut codes = [0; 800];
    // 10 minutes in pieces of two periods; the last of them is compared with the formula.
    let mut newtons = [0.0; 800];
    for _ in 0..15_000 {
        newtons = [0.0; 800];
        chain.convert(&mut newtons, &mut codes);
    }
    for (index, value) in newtons.iter().enumerate() {
        let angle = std::f64::consts::TAU * 50.0 * index as f64 / RATE;
        let expected = 0.5 * angle.sin() + 0.15 * (3.0 * angle).sin();
        assert!((value - expected).abs() < 1e-6, "sample {index}: {value}, not {expected}");
    }
}

#[test]
fn drift_follows_its_formula() {
    let drift = Drift { rate_newton_per_second: 0.014, thermal: Newton(2.0), thermal_time: Second(5.0) };
    let settings = ChainSettings { drift, ..ChainSettings::transparent() };
    let read = sensed(&settings, 0, |_| 0.0, 400_000);
    let quantum = settings.front_end.newton_per_code();
    for time in [0.0_f64, 1.0, 5.0, 19.9] {
        let expected = 0.014 * time + 2.0 * -(-time / 5.0).exp_m1();
        assert!((read[(time * RATE) as usize] - expected).abs() < quantum, "at {time} s");
    }
}

#[test]
fn spikes_are_single_samples_at_the_rate_asked_for() {
    let spikes = Spikes { rate: Hertz(5.0), height: Newton(50.0) };
    let settings = ChainSettings { spikes: Some(spikes), ..ChainSettings::transparent() };
    let read = exact(&settings, 9, |_| 0.0, 2_000_000);
    let hit: Vec<_> = read.iter().enumerate().filter(|(_, value)| **value != 0.0).collect();
    // 100 s at 5 a second: 500, standard deviation 22.
    assert!((400..=600).contains(&hit.len()), "{}", hit.len());
    assert!(hit.iter().all(|(_, value)| (25.0..=50.0).contains(&value.abs())));
    assert!(hit.iter().any(|(_, value)| **value > 0.0) && hit.iter().any(|(_, value)| **value < 0.0));
}

#[test]
fn a_cable_fault_shows_in_bias_and_signal() {
    let mut chain = MeasuringChain::new(&ChainSettings::quiet(), 0);
    let mut codes = [0; 1];
    let healthy = Chain::REFERENCE.bias_low..=Chain::REFERENCE.bias_high;
    assert!(healthy.contains(&chain.bias()));
    for (cable, rail) in [(Cable::Open, Chain::REFERENCE.clip_high), (Cable::Shorted, Chain::REFERENCE.clip_low)] {
        chain.set_cable(cable);
        chain.convert(&mut [0.0], &mut codes);
        assert_eq!(codes, [rail]);
        assert!(!healthy.contains(&chain.bias()));
    }
}

#[test]
fn the_same_seed_gives_the_same_codes_in_whatever_pieces() {
    let settings = ChainSettings {
        spikes: Some(Spikes { rate: Hertz(50.0), height: Newton(20.0) }),
        noise: Noise { white: Newton(0.3), coloured: None },
        ..ChainSettings::workshop()
    };
    let codes = |seed, piece| {
        let mut chain = MeasuringChain::new(&settings, seed);
        let mut codes = vec![0; 20_000];
        for codes in codes.chunks_mut(piece) {
            chain.convert(&mut vec![0.0; codes.len()], codes);
        }
        codes
    };
    assert_eq!(codes(3, 8), codes(3, 8));
    assert_ne!(codes(3, 8), codes(4, 8));
    assert_eq!(codes(3, 8), codes(3, 1000));
}
