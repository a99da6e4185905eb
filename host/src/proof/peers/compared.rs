//! How peers did beside the diagnosis, on the same cases.

use std::path::{Path, PathBuf};

use miette::{IntoDiagnostic as _, WrapErr as _};
use serde::Serialize;

use super::super::hidden::Hidden;
use super::super::interval::{Number, Share};
use super::super::judged::{Ended, Judged, judge};
use super::super::said::Said;

/// Folder of a peer's answers, and what it does.
const PEERS: [(&str, &str); 5] = [
    ("lowest-bic", "lowest BIC, every mechanism alone"),
    ("pysindy", "PySINDy (STLSQ) on the residual"),
    ("pysindy-forward", "PySINDy (FROLS) on the residual"),
    ("gradient-boosting", "gradient boosting on the residual"),
    ("gaussian-process", "Gaussian process on the residual"),
];

/// How one method did. All rows are of the same cases.
#[derive(Clone, Debug, Serialize)]
pub struct Compared {
    /// The method.
    pub name: String,
    /// One effect of the list: named first.
    pub first: Share,
    /// One effect of the list, or two: everything that is hidden is named, and nothing else.
    pub exact: Share,
    /// Nothing hidden: something was said all the same.
    pub false_alarm: Share,
    /// Not in the list: called unexplained.
    pub unexplained: Share,
    /// All cases: wrong and confident.
    pub wrong_and_confident: Share,
    /// All cases: the right verdict.
    pub right: Share,
    /// Where something is hidden: rmse on recordings left out over the noise before contact, median.
    pub over_noise: Number,
    /// The same over the true model's rmse.
    pub over_true: Number,
}

impl Compared {
    /// How a method did on these cases.
    #[must_use]
    pub fn of(name: &str, cases: &[Judged]) -> Self {
        let of = |is_so: fn(&Judged) -> bool| cases.iter().filter(move |case| is_so(case));
        let hidden = || of(|case| case.way != "absent");
        Self {
            name: name.to_owned(),
            first: Share::count(of(|case| case.truth.len() == 1 && case.right_verdict == "named"), |case| case.first),
            exact: Share::count(of(|case| case.right_verdict == "named"), |case| case.exact),
            false_alarm: Share::count(of(|case| case.way == "absent"), |case| case.verdict != "consistent"),
            unexplained: Share::count(of(|case| case.right_verdict == "unexplained"), |case| case.right),
            wrong_and_confident: Share::count(cases, |case| case.wrong_and_confident),
            right: Share::count(cases, |case| case.right),
            over_noise: Number::median(hidden().filter_map(|case| case.over_noise).collect()),
            over_true: Number::median(hidden().filter_map(|case| case.over_true).collect()),
        }
    }
}

/// The diagnosis and all peers that have answered in `folder` (`DIR/peers`); nothing where none has. Cases that no peer has got to, since their
/// run was stopped, count for nobody; a case that only some have answered counts as wrong for the others.
///
/// # Errors
/// An answer that cannot be read.
pub fn compared(folder: &Path, hidden: &[Hidden], ours: &[Judged]) -> miette::Result<Vec<Compared>> {
    let peers = || PEERS.iter().filter(|(name, _)| folder.join(name).is_dir());
    let answered = |case: &str| peers().any(|(name, _)| file(&folder.join(name), case).is_file());
    let got_to: Vec<&Hidden> = hidden.iter().filter(|hidden| answered(&hidden.case)).collect();
    if got_to.is_empty() {
        return Ok(Vec::new());
    }
    let ours: Vec<Judged> = ours.iter().filter(|judged| answered(&judged.case)).cloned().collect();
    let mut rows = vec![Compared::of("thud diagnose", &ours)];
    for (name, about) in peers() {
        let of_peer = folder.join(name);
        let judged = got_to.iter().map(|case| judged(&of_peer, case)).collect::<miette::Result<Vec<Judged>>>()?;
        rows.push(Compared::of(about, &judged));
    }
    Ok(rows)
}

fn file(of_peer: &Path, case: &str) -> PathBuf {
    of_peer.join(format!("{case}.json"))
}

fn judged(of_peer: &Path, hidden: &Hidden) -> miette::Result<Judged> {
    let path = file(of_peer, &hidden.case);
    let ended = if path.is_file() {
        let read = || format!("{} is no answer of a peer; remake it with `cargo xtask peers`", path.display());
        let text = std::fs::read(&path).into_diagnostic().wrap_err_with(read)?;
        Ended::Said(Box::new(serde_json::from_slice::<Said>(&text).into_diagnostic().wrap_err_with(read)?))
    } else {
        Ended::Failed("no answer".to_owned())
    };
    Ok(judge(hidden, &ended, 0.0, None))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn hidden(case: &str, right_verdict: &str, effect: Option<&str>) -> Hidden {
        let effects = effect.map_or_else(String::new, |id| {
            format!(
                r#"{{"id": "{id}", "listed": true, "resembles": [], "d": 30.0, "d_beside_others": 30.0, "parameters": [], "recordings": []}}"#
            )
        });
        let way = if effect.is_some() { "unnamed" } else { "absent" };
        serde_json::from_str(&format!(
            r#"{{"case": "{case}", "way": "{way}", "kind": "impact", "seed": 1, "without": [], "right_verdict": "{right_verdict}",
                "d": 30.0, "benign_d": 1.0, "effects": [{effects}], "rest": {{"phase": "rise", "shares": [0, 1, 0, 0], "recordings": []}},
                "stated_r_squared": 0.9, "true_model_rmse": 0.3}}"#
        ))
        .unwrap()
    }

    fn answer(verdict: &str, ids: &[&str], rmse: f64) -> String {
        let mechanisms: Vec<String> = ids
            .iter()
            .map(|id| format!(r#"{{"id": "{id}", "parameters": [], "indistinguishable_from": []}}"#))
            .collect();
        format!(
            r#"{{"verdict": "{verdict}", "baseline": {{"held_out_rmse": 0.9, "noise_rms": 0.3}}, "where": [], "mechanisms": [{}],
                "model": {{"held_out_rmse": {rmse}}}, "unexplained": {{"held_out_rmse": null}}}}"#,
            mechanisms.join(",")
        )
    }

    #[test]
    fn a_peer_is_judged_as_the_diagnosis_is_and_silence_counts_as_wrong() {
        let folder = tempfile::TempDir::new().unwrap();
        let peer = folder.path().join("lowest-bic");
        std::fs::create_dir(&peer).unwrap();
        let write = |case: &str, text: String| std::fs::write(peer.join(format!("{case}.json")), text).unwrap();
        write("a", answer("named", &["guide-friction"], 0.33));
        write("b", answer("named", &["hardening"], 0.6));
        write("c", answer("named", &["clearance"], 0.3));
        let other = folder.path().join("pysindy");
        std::fs::create_dir(&other).unwrap();
        std::fs::write(other.join("d.json"), answer("named", &["stiction"], 0.3)).unwrap();
        let hidden = [
            hidden("a", "named", Some("guide-friction")),
            hidden("b", "named", Some("end-stop")),
            hidden("c", "consistent", None),
            hidden("d", "named", Some("stiction")),
            hidden("nobody got to it", "named", Some("stiction")),
        ];
        let rows = compared(folder.path(), &hidden, &[]).unwrap();
        assert_eq!(rows.len(), 3, "the diagnosis and the two peers that have a folder");
        let row = &rows[1];
        assert_eq!((rows[2].first.hits, rows[2].first.of), (1, 3));
        assert_eq!((row.first.hits, row.first.of), (1, 3));
        assert_eq!((row.false_alarm.hits, row.false_alarm.of), (1, 1));
        assert_eq!(row.wrong_and_confident.hits, 2);
        assert!((row.over_true.value.unwrap() - (0.33 + 0.6) / 2.0 / 0.3).abs() < 1e-9);
        write("d", "{}".to_owned());
        assert!(compared(folder.path(), &hidden, &[]).is_err());
    }

    #[test]
    fn without_peers_there_is_no_table() {
        let folder = tempfile::TempDir::new().unwrap();
        assert!(compared(folder.path(), &[], &[]).unwrap().is_empty());
    }
}
