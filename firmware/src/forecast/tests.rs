//! What a forecast promises.

use std::vec::Vec;

use super::*;

const KNOWN: Known = Known { mass: Kilogram(6.0), stiffness: NewtonPerMetre(50_000.0) };

/// No trees: the half sine alone.
const BARE: Table<'static> = Table { base: 0.0, trees: &[], bounds: [0.1; CLASSES.len() + 1] };

/// A half sine as the sensor would take it, the onset noticed `late_s` after the contact.
fn rise(peak: f32, known: &Known, late_s: f32) -> Rise {
    let omega = (known.stiffness.0 / known.mass.0).sqrt();
    let at = DUE.map(|due| due.0);
    Rise { at, force: at.map(|at| peak * (omega * (at + late_s)).sin()) }
}

#[test]
fn a_half_sine_is_forecast_whatever_its_height_and_however_late_it_was_noticed() {
    for peak in [20.0, 200.0, 500.0] {
        for late in [0.0, 3e-4, 1e-3] {
            let forecast = BARE.forecast(&rise(peak, &KNOWN, late), &KNOWN).unwrap();
            // The line through two points of a sine meets zero a little late.
            assert!((forecast.peak.0 / peak - 1.0).abs() < 0.05, "{forecast:?} for {peak} N, {late} s");
            assert!((forecast.bound.0 / forecast.peak.0 - 0.1).abs() < 1e-6);
        }
    }
}

#[test]
fn what_does_not_rise_or_is_not_known_has_no_forecast() {
    let rising = rise(100.0, &KNOWN, 0.0);
    assert_eq!(BARE.forecast(&Rise { force: [3.0, 2.0, 1.0, 0.5], ..rising }, &KNOWN), None);
    assert_eq!(BARE.forecast(&Rise { force: [10.0; INSTANTS], ..rising }, &KNOWN), None);
    assert_eq!(BARE.forecast(&rising, &Known { mass: Kilogram(0.0), ..KNOWN }), None);
    assert_eq!(BARE.forecast(&Rise { force: [f32::NAN; INSTANTS], ..rising }, &KNOWN), None);
}

#[test]
fn a_tree_is_walked_by_its_thresholds() {
    let mut tree = Tree { input: [0; DECISIONS], threshold: [i16::MAX; DECISIONS], leaf: [0; LEAVES] };
    for (leaf, value) in tree.leaf.iter_mut().zip(0..) {
        *leaf = value;
    }
    assert_eq!(tree.leaf(&[100; INPUTS]), 0, "never above");
    tree.input[0] = 3;
    tree.threshold[0] = 99;
    assert_eq!(tree.leaf(&[100; INPUTS]), 8, "above at the root alone");
    assert_eq!(tree.leaf(&[99; INPUTS]), 0, "equal is not above");
}

#[test]
fn the_rise_is_gathered_from_the_blocks_that_end_at_its_instants() {
    let onset = Onset { impact: 1, noticed_at: 1_003, threshold: Newton(2.0), force: Newton(3.0) };
    let mut watch = Watch::new(&onset, Hertz(20_000.0), 0.5, 2_000.0);
    let rises: Vec<Rise> = (0..40_u64)
        .filter_map(|block| {
            // The code rises by two in every sample.
            let codes: Vec<AdcCode> = (0..8).map(|i| (2_000 + 2 * (8 * block + i)) as AdcCode).collect();
            watch.push(&codes, 1_000 + 8 * block)
        })
        .collect();
    assert_eq!(rises.len(), 1, "once");
    for ((at, force), due) in rises[0].at.iter().zip(rises[0].force).zip(DUE) {
        assert!((at - due.0).abs() < 4.5e-4, "{at} for {due:?}");
        // 0.5 N a code, 2 codes a sample, from sample 1000 on.
        assert!((force - (at * 20_000.0 + 3.0)).abs() < 1e-2, "{force} at {at}");
    }
}

#[test]
fn the_shipped_table_is_small() {
    assert!(TABLE.size() <= 2_048, "{} bytes", TABLE.size());
}
