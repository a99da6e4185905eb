//! Telling cases of a run, for people who would rather look at five than at a thousand: what was hidden, and the page of its diagnosis.
//!
//! They are chosen by rule, not by hand, and one of them is a case that the tool got wrong.

use serde::Serialize;

use super::hidden::Hidden;
use super::judged::Judged;

/// A telling case.
#[derive(Clone, Debug, Serialize)]
pub struct Story {
    /// Why it is told; also the name of its page.
    pub name: &'static str,
    /// The case.
    pub case: String,
    /// What was hidden and what was said, in a sentence or two.
    pub about: String,
}

/// Chooses the telling cases of a run: fewer where it has none of a kind.
#[must_use]
pub fn choose(cases: &[(Hidden, Judged)]) -> Vec<Story> {
    let right = |way: &'static str| cases.iter().filter(move |(_, judged)| judged.way == way && judged.right);
    let touched = |hidden: &Hidden| hidden.effects.iter().map(|effect| effect.recordings.len()).min().unwrap_or(0);
    let absorbed = right("absorbed")
        .filter(|(_, judged)| judged.stated_r_squared > 0.98 && judged.first)
        .max_by(|a, b| a.1.d.total_cmp(&b.1.d));
    let few = right("conditional")
        .filter(|(_, judged)| judged.first)
        .min_by(|a, b| touched(&a.0).cmp(&touched(&b.0)).then(b.1.d.total_cmp(&a.1.d)));
    let nameless = right("unlisted")
        .max_by(|a, b| (!a.1.resembling, a.1.way_to_noise).partial_cmp(&(!b.1.resembling, b.1.way_to_noise)).unwrap());
    let nothing = right("absent").max_by(|a, b| a.0.benign_d.total_cmp(&b.0.benign_d));
    let wrong = cases
        .iter()
        .filter(|(_, judged)| judged.wrong_and_confident || (!judged.right && judged.d > 25.0))
        .max_by(|a, b| (a.1.wrong_and_confident, a.1.d).partial_cmp(&(b.1.wrong_and_confident, b.1.d)).unwrap());
    let story = |name, found: Option<&(Hidden, Judged)>| {
        found.map(|(hidden, judged)| Story { name, case: judged.case.clone(), about: about(hidden, judged) })
    };
    [
        story("absorbed", absorbed),
        story("few-recordings", few),
        story("not-in-the-list", nameless),
        story("nothing-hidden", nothing),
        story("got-wrong", wrong),
    ]
    .into_iter()
    .flatten()
    .collect()
}

fn about(hidden: &Hidden, judged: &Judged) -> String {
    let truth = if judged.truth.is_empty() {
        format!("Nothing is hidden but traces that every rig has (d = {:.1})", hidden.benign_d)
    } else {
        let each: Vec<String> = hidden
            .effects
            .iter()
            .map(|effect| {
                let few = hidden.way == "conditional";
                let where_ =
                    if few { format!(", in recordings {} only", effect.recordings.join(", ")) } else { String::new() };
                format!("{} with d = {:.1}{where_}", effect.id, effect.d)
            })
            .collect();
        format!("Hidden: {}", each.join(" and "))
    };
    let stated = if hidden.kind == "fall" {
        String::new()
    } else {
        format!("; R² of the simulation as stated: {:.4} in the worst recording", judged.stated_r_squared)
    };
    let said = judged.names();
    let said = if said.is_empty() { String::new() } else { format!(", {}", said.join(" and ")) };
    let held =
        judged.over_true.map_or_else(String::new, |ratio| format!(", held-out rmse {ratio:.3} times the true model's"));
    format!("{truth}{stated}. Said: {}{said}{held}.", judged.verdict)
}
