//! Flags, verdicts and settings in words that need no manual.

use thud_firmware::configuration::{ContactKind, FilterProfile};
use thud_firmware::event::{Event, Flags, Verdict};
use thud_firmware::limits::Region;

/// What a flag means for a reader; one sentence for each flag that is set, with the flag's name.
#[must_use]
pub fn explain_flags(flags: Flags) -> Vec<(&'static str, &'static str)> {
    Flags::NAMES
        .into_iter()
        .filter(|(flag, _)| flags.contains(*flag))
        .map(|(flag, name)| (name, explain_flag(flag)))
        .collect()
}

fn explain_flag(flag: Flags) -> &'static str {
    match flag {
        Flags::CLIPPED => "The force went beyond what the chain can measure: the true peak is higher. Never passes.",
        Flags::LOST_SAMPLES => {
            "Samples are missing in or shortly before this contact: the true peak may be among them. Never passes."
        }
        Flags::BIAS_FAULT => "The cell's supply voltage was out of range (cable broken or shorted). Never passes.",
        Flags::STALE_MASS => "The robot's effective mass was too old when the contact began. Never passes.",
        Flags::NO_MASS => {
            "No effective mass is known, so the force is not scaled (S = 1, the safe side). Never passes."
        }
        Flags::REBOUND => "A second or later contact of the same impact: the robot bounced.",
        Flags::HELD => "The contact still held when the transient window of 0.5 s ended.",
        Flags::TRUNCATED => {
            "The contact lasted longer than is followed, or the captured curve ends inside it. Never passes."
        }
        Flags::NO_QUASI_STATIC => {
            "The chain's charge leaks away too fast to hold a static force: no quasi-static verdict."
        }
        Flags::NOT_PERMITTED => "Transient contact with this region of the body is not permitted at any force.",
        Flags::UNSETTLED => "The sensor had not yet settled when the contact began. Never passes.",
        Flags::SHORT_PULSE => {
            "The verdict filter took more than 10 % off the raw peak: the pulse is shorter than the filter can follow."
        }
        Flags::REST => {
            "Friction held a rest of some newtons before or after the contact. Peak and impulse count from the true zero."
        }
        _ => "",
    }
}

/// Why the verdict is what it is, in a sentence.
#[must_use]
pub fn explain_verdict(event: &Event) -> String {
    let severity = &event.severity;
    let void = event.flags.intersection(Flags::VOID);
    match severity.verdict {
        Verdict::None => "No body region is configured, so there is nothing to judge by.".to_owned(),
        Verdict::Fail if event.flags.contains(Flags::NOT_PERMITTED) => {
            "Transient contact with this region is not permitted at any force.".to_owned()
        }
        Verdict::Inconclusive if !void.is_empty() => {
            let names: Vec<&str> = void.names().collect();
            format!("The curve or what it is judged by is not to be trusted: {}.", names.join(", "))
        }
        verdict => {
            let Some(limit) = severity.transient_limit else {
                return "There is no transient limit to compare with.".to_owned();
            };
            let guard = severity.expanded_uncertainty.0;
            let transient = format!(
                "The scaled force of {:.1} N is {} the transient limit of {:.0} N (guard band ±{guard:.1} N).",
                severity.scaled.0,
                place(severity.scaled.0, limit.0, guard),
                limit.0,
            );
            let (Some(force), Some(limit)) = (severity.quasi_static, severity.quasi_static_limit) else {
                return if verdict == Verdict::Inconclusive && event.flags.contains(Flags::NO_QUASI_STATIC) {
                    format!("{transient} The held force cannot be told, because the chain's charge leaks away.")
                } else {
                    transient
                };
            };
            // The guard band is proportional to the force, noise apart.
            let guard = guard * force.0 / severity.scaled.0.max(f32::MIN_POSITIVE);
            format!(
                "{transient} The force held after 0.5 s, up to {:.1} N, is {} the quasi-static limit of {:.0} N.",
                force.0,
                place(force.0, limit.0, guard),
                limit.0
            )
        }
    }
}

fn place(force: f32, limit: f32, guard: f32) -> &'static str {
    if force + guard < limit {
        "below"
    } else if force - guard > limit {
        "above"
    } else {
        "within the guard band of"
    }
}

/// A region's name for people.
#[must_use]
pub const fn region_name(region: Region) -> &'static str {
    match region {
        Region::Skull => "skull and forehead",
        Region::Face => "face",
        Region::Neck => "neck",
        Region::Back => "back and shoulders",
        Region::Chest => "chest",
        Region::Abdomen => "abdomen",
        Region::Pelvis => "pelvis",
        Region::UpperArm => "upper arm and elbow",
        Region::LowerArm => "lower arm and wrist",
        Region::Hand => "hand and fingers",
        Region::Thigh => "thigh and knee",
        Region::LowerLeg => "lower leg",
    }
}

/// Whether the body can recoil, for people.
#[must_use]
pub const fn contact_name(contact: ContactKind) -> &'static str {
    match contact {
        ContactKind::Free => "free: the body part can recoil, the transient force is scaled by S",
        ContactKind::Clamped => "clamped: the body part cannot recoil, nothing is scaled",
    }
}

/// A filter profile, for people.
#[must_use]
pub const fn filter_description(filter: FilterProfile) -> &'static str {
    match filter {
        FilterProfile::IsoPas5672 => {
            "zero-phase Butterworth of fourth order, −3 dB at 100 Hz (as publicly described for ISO/PAS 5672; equals CFC 60)"
        }
        FilterProfile::Cfc100 => "CFC 100 of SAE J211, −3 dB at 165 Hz",
        FilterProfile::Cfc180 => "CFC 180 of SAE J211, −3 dB at 300 Hz",
        FilterProfile::None => "none: the judged force is the raw one",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_flag_has_its_sentence() {
        let explained = explain_flags(Flags::all());
        assert_eq!(explained.len(), Flags::NAMES.len());
        for (name, sentence) in explained {
            assert!(sentence.ends_with('.'), "{name}: {sentence}");
        }
    }

    #[test]
    fn what_voids_says_that_it_never_passes() {
        for (flag, name) in Flags::NAMES {
            let says = explain_flag(flag).contains("Never passes");
            assert_eq!(says, Flags::VOID.contains(flag), "{name}");
        }
    }
}
