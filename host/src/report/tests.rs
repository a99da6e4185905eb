//! What every page promises: it needs nothing else, it can be read without colour, and what it shows is there.

use thud_firmware::configuration::Configuration;
use thud_firmware::limits::Region;
use thud_firmware::units::Kilogram;

use super::page;
use crate::recording::{Channel, FORCE, Recording};
use crate::replay::{Replayed, replay, report};

fn configuration() -> Configuration {
    Configuration { region: Some(Region::Chest), effective_mass: Some(Kilogram(6.0)), ..Configuration::DEFAULT }
}

/// A half sine of 30 ms, with some noise so that there is an onset threshold.
fn replayed(peak_n: f64) -> Replayed {
    let times: Vec<f64> = (0..30_000).map(|index| f64::from(index) / 20_000.0).collect();
    let force = |time: &f64| {
        let since = time - 1.2;
        let noise = 0.2 * (1e4 * time * time).sin();
        let pulse = if (0.0..0.03).contains(&since) { (std::f64::consts::PI * since / 0.03).sin() } else { 0.0 };
        peak_n * pulse + noise
    };
    let values = times.iter().map(force).collect();
    let recording = Recording::new(times, vec![Channel { name: FORCE.to_owned(), values }]).unwrap();
    replay("a.csv", &recording, &configuration(), None).unwrap()
}

fn page_of(peak_n: f64) -> String {
    page(&report(&[("a <b>.csv".to_owned(), replayed(peak_n))], &configuration()))
}

#[test]
fn a_page_needs_nothing_outside_itself() {
    let page = page_of(200.0);
    for outside in ["http://", "https://", "src=", "href=", "@import", "url(", "<script"] {
        let found = page.replace("http://www.w3.org/2000/svg", "");
        assert!(!found.contains(outside), "{outside}");
    }
    assert!(page.contains("a &lt;b&gt;.csv"), "names are not markup");
}

#[test]
fn a_page_has_no_colour() {
    let page = page_of(200.0);
    let mut grey = 0;
    for (at, _) in page.match_indices('#') {
        let digits: String = page[at + 1..].chars().take_while(char::is_ascii_hexdigit).collect();
        if digits.len() == 6 {
            let (red, green, blue) = (&digits[0..2], &digits[2..4], &digits[4..6]);
            let level = |text| i32::from_str_radix(text, 16).unwrap();
            let spread = (level(red) - level(green)).abs().max((level(green) - level(blue)).abs());
            assert!(spread <= 4, "#{digits}");
            grey += 1;
        }
    }
    assert!(grey > 50, "{grey} colours looked at");
}

#[test]
fn a_page_says_what_was_found_and_by_what_it_was_judged() {
    let pass = page_of(200.0);
    for says in
        ["Pass.", "ISO/TS 15066:2016", "not checked against the printed standard", "chest", "separation", "÷ S 0.933"]
    {
        assert!(pass.contains(says), "{says}");
    }
    assert_eq!(pass.matches("<svg").count(), 3 + 3, "three figures and the swatches of the legend");
    assert!(page_of(400.0).contains("Fail."));
    assert!(page_of(305.0).contains("Inconclusive."));
}

#[test]
fn a_page_without_a_contact_says_so() {
    assert!(page_of(0.0).contains("No contact was found"));
}
