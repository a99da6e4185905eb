//! The measuring chain: from the force at the load cell to the codes of the ADC.
//!
//! ```text
//! force ─▶ piezo discharge ─▶ anti-alias filter ─▶ + hum + drift + noise ─▶ gain, zero ─▶ + spikes ─▶ rails, 16 bits
//!   N         high-pass, τ       low-pass, f_c         as the codes show them        │
//!                                                               cable: sound, open, shorted
//! ```
//!
//! Hum, drift and noise are given as they appear in the codes, so they enter behind the filters: "0.3 N rms" is what a
//! recording of the idle sensor shows. Each stage is a file with its equation; all work on slices of newtons.
//!
//! The anti-alias filter delays the curve by [`AntiAlias::delay`] (28 µs as on the reference front end). The sensor takes its
//! configured [`Chain::delay`] off every instant that it reports; where the filter is off, that is set to zero.

use rand::SeedableRng as _;
use rand_chacha::ChaCha8Rng;
use thud_firmware::board::AdcCode;
use thud_firmware::configuration::Chain;
use thud_firmware::units::{Hertz, Newton, Second, Volt};

mod anti_alias;
mod discharge;
mod drift;
mod hum;
mod noise;
mod quantiser;
mod spikes;

pub use anti_alias::AntiAlias;
pub use drift::Drift;
pub use hum::Hum;
pub use noise::{ColouredNoise, Noise};
pub use quantiser::FrontEnd;
pub use spikes::Spikes;

/// What the chain is made of.
#[derive(Clone, Debug, PartialEq)]
pub struct ChainSettings {
    /// Samples per second.
    pub sample_rate: Hertz,
    /// Cell sensitivity, gain and converter.
    pub front_end: FrontEnd,
    /// Discharge time constant τ_eff of cell and readout; `None` for a chain that holds for ever.
    pub discharge: Option<Second>,
    /// Anti-alias filter; `None` for none.
    pub anti_alias: Option<AntiAlias>,
    /// Noise of the idle signal.
    pub noise: Noise,
    /// Hum from the mains.
    pub hum: Option<Hum>,
    /// Slow wandering of the zero.
    pub drift: Drift,
    /// Single samples that are far off.
    pub spikes: Option<Spikes>,
}

impl ChainSettings {
    /// The chain of [`Chain::REFERENCE`] without noise, hum, drift and spikes: PCB 208C03 on the reference front end.
    #[must_use]
    pub fn quiet() -> Self {
        Self {
            sample_rate: Chain::REFERENCE.sample_rate,
            front_end: FrontEnd::REFERENCE,
            discharge: Some(Chain::REFERENCE.time_constant),
            anti_alias: Some(AntiAlias::REFERENCE),
            noise: Noise::default(),
            hum: None,
            drift: Drift::default(),
            spikes: None,
        }
    }

    /// The same in a workshop: 0.3 N rms of noise, 0.5 N of 50 Hz hum with harmonics, 14 mN/s of drift.
    ///
    /// The drift is the charge drift of a piezo cell's amplifier; hum and noise are what the sensor is specified for.
    #[must_use]
    pub fn workshop() -> Self {
        Self {
            noise: Noise { white: Newton(0.3), coloured: None },
            hum: Some(Hum { fundamental: Hertz(50.0), amplitude: Newton(0.5), harmonics: vec![0.1, 0.3] }),
            drift: Drift { rate_newton_per_second: 0.014, thermal: Newton(0.0), thermal_time: Second(600.0) },
            ..Self::quiet()
        }
    }

    /// Only what cannot be left out: sensitivity, rails and 16 bits. For replaying recordings, which bring their own
    /// noise and filters.
    #[must_use]
    pub fn transparent() -> Self {
        Self { discharge: None, anti_alias: None, ..Self::quiet() }
    }

    /// By how much the codes lag behind the force.
    #[must_use]
    pub fn delay(&self) -> Second {
        self.anti_alias.map_or(Second(0.0), AntiAlias::delay)
    }
}

/// State of the cable between cell and front end.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Cable {
    /// As it should be.
    #[default]
    Sound,
    /// Broken: the current source drives the input to its supply, and the signal sits at the upper rail.
    Open,
    /// Core and shield touch: no bias, and the signal sits at the lower rail.
    Shorted,
}

/// Supply of the IEPE current source, to which an open input rises.
const IEPE_SUPPLY: Volt = Volt(24.0);

/// A chain at work.
pub struct MeasuringChain {
    sample_rate: Hertz,
    discharge: Option<discharge::Discharge>,
    anti_alias: Option<anti_alias::Filter>,
    noise: noise::Source,
    hum: Option<hum::Source>,
    drift: Option<drift::Source>,
    spikes: Option<spikes::Source>,
    quantiser: quantiser::Quantiser,
    bias: Volt,
    cable: Cable,
}

impl MeasuringChain {
    /// A chain at rest. The same seed gives the same noise.
    #[must_use]
    pub fn new(settings: &ChainSettings, seed: u64) -> Self {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let period_s = 1.0 / f64::from(settings.sample_rate.0);
        Self {
            sample_rate: settings.sample_rate,
            discharge: settings.discharge.map(|time_constant| discharge::Discharge::new(time_constant, period_s)),
            anti_alias: settings.anti_alias.map(|filter| anti_alias::Filter::new(filter, period_s)),
            noise: noise::Source::new(&settings.noise, period_s, &mut random),
            hum: settings.hum.as_ref().map(|hum| hum::Source::new(hum, period_s)),
            drift: settings.drift.moves().then(|| drift::Source::new(settings.drift, period_s)),
            spikes: settings.spikes.map(|spikes| spikes::Source::new(spikes, period_s, &mut random)),
            quantiser: quantiser::Quantiser::new(&settings.front_end),
            bias: settings.front_end.bias,
            cable: Cable::Sound,
        }
    }

    /// Samples per second.
    #[must_use]
    pub fn sample_rate(&self) -> Hertz {
        self.sample_rate
    }

    /// Converts the next samples: on entry `newtons` is the force at the cell, on return it is the force as the codes
    /// mean it, before quantisation.
    ///
    /// # Panics
    /// If the slices are not equally long.
    pub fn convert(&mut self, newtons: &mut [f64], codes: &mut [AdcCode]) {
        assert_eq!(newtons.len(), codes.len(), "a code for each sample");
        if let Some(discharge) = &mut self.discharge {
            discharge.apply(newtons);
        }
        if let Some(filter) = &mut self.anti_alias {
            filter.apply(newtons);
        }
        if let Some(hum) = &mut self.hum {
            hum.add(newtons);
        }
        if let Some(drift) = &mut self.drift {
            drift.add(newtons);
        }
        self.noise.add(newtons);
        if let Some(spikes) = &mut self.spikes {
            spikes.add(newtons);
        }
        match self.cable {
            Cable::Sound => self.quantiser.convert(newtons, codes),
            Cable::Open => codes.fill(self.quantiser.upper_rail()),
            Cable::Shorted => codes.fill(self.quantiser.lower_rail()),
        }
    }

    /// Breaks or mends the cable.
    pub fn set_cable(&mut self, cable: Cable) {
        self.cable = cable;
    }

    /// Bias voltage of the cell as the board measures it.
    #[must_use]
    pub fn bias(&self) -> Volt {
        match self.cable {
            Cable::Sound => self.bias,
            Cable::Open => IEPE_SUPPLY,
            Cable::Shorted => Volt(0.0),
        }
    }
}

#[cfg(test)]
mod tests;
