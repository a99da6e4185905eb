//! `cargo xtask stories`: the telling cases in `docs/proof/`, made anew.
//!
//! Four are chosen by rule from a run of `thud prove` with a fixed seed, and one that went wrong; the real one is the friction loop of a piston.
//! Each is the page that the diagnosis writes, with its first picture apart for `docs/proof.md`.

use std::path::Path;

use crate::step;

/// The run from which they are chosen: its seed came from the operating system.
const SEED: &str = "16807112869511577590";
const CASES: &str = "60";
/// The real campaign that is told.
const REAL: &str = "piston-1-bar";
/// No page may be longer, bytes.
const LONGEST: u64 = 300_000;

/// Makes pages and pictures.
///
/// # Errors
/// Says which step failed.
pub fn run() -> Result<(), String> {
    let folder = step::root().join("docs/proof");
    let run = step::root().join("target/stories").join(SEED);
    std::fs::create_dir_all(&folder).map_err(|error| format!("{}: {error}", folder.display()))?;
    let thud = ["run", "--release", "-p", "thud", "--bin", "thud", "--"];
    let mut prove = step::cargo(&thud);
    prove.args(["prove", "--seed", SEED, "--cases", CASES, "--json"]).arg(run.join("proof.json"));
    step::run("cases", prove.arg("--out").arg(run.join("run")).arg("--stories").arg(&folder))?;
    let mut real = step::cargo(&["run", "--release", "-p", "thud", "--example", "real", "--"]);
    step::run("a real one", real.arg(run.join("real")).arg(REAL))?;
    let made = run.join("real").join(format!("{REAL}.html"));
    std::fs::copy(&made, folder.join("real.html")).map_err(|error| format!("{}: {error}", made.display()))?;
    for name in ["absorbed", "few-recordings", "not-in-the-list", "nothing-hidden", "got-wrong", "real"] {
        let page = folder.join(format!("{name}.html"));
        if page.is_file() {
            picture(&page)?;
        } else {
            eprintln!("the run has no case of the kind `{name}`");
        }
    }
    Ok(())
}

/// Writes the first picture of a page beside it.
fn picture(page: &Path) -> Result<(), String> {
    let text = std::fs::read_to_string(page).map_err(|error| format!("{}: {error}", page.display()))?;
    let svg = first_picture(&text).ok_or_else(|| format!("{} has no picture", page.display()))?;
    let path = page.with_extension("svg");
    std::fs::write(&path, svg).map_err(|error| format!("{}: {error}", path.display()))?;
    if text.len() as u64 > LONGEST {
        return Err(format!("{} has {} bytes, more than {LONGEST}", page.display(), text.len()));
    }
    Ok(())
}

/// The first picture as a file of its own: it needs its namespace and a white ground.
fn first_picture(page: &str) -> Option<String> {
    let begin = page.find("<svg")?;
    let end = begin + page[begin..].find("</svg>")? + "</svg>".len();
    let svg = &page[begin..end];
    let head = svg.find('>')?;
    let namespace = if svg[..head].contains("xmlns=") { "" } else { " xmlns=\"http://www.w3.org/2000/svg\"" };
    Some(format!(
        "{}{namespace}><rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>{}\n",
        &svg[..head],
        &svg[head + 1..]
    ))
}

#[cfg(test)]
mod tests {
    use super::first_picture;

    #[test]
    fn the_first_picture_stands_alone() {
        let page = "<p>a</p><svg viewBox=\"0 0 2 1\"><line/></svg><svg><circle/></svg>";
        let wanted = "<svg viewBox=\"0 0 2 1\" xmlns=\"http://www.w3.org/2000/svg\"><rect width=\"100%\" height=\"100%\" fill=\"#fff\"/><line/></svg>\n";
        assert_eq!(first_picture(page).as_deref(), Some(wanted));
        assert_eq!(first_picture("<p>no</p>"), None);
    }
}
