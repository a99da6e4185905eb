//! The simulator must share nothing with what it is to test.

use std::fs;
use std::path::Path;

fn sources(folder: &Path, found: &mut Vec<std::path::PathBuf>) {
    for entry in fs::read_dir(folder).expect("a folder") {
        let path = entry.expect("an entry").path();
        if path.is_dir() {
            sources(&path, found);
        } else if path.extension().is_some_and(|e| e == "rs") {
            found.push(path);
        }
    }
}

#[test]
fn the_manifest_names_no_crate_of_this_workspace() {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    let root: toml::Table =
        fs::read_to_string(here.join("../../Cargo.toml")).expect("the root manifest").parse().expect("TOML");
    let own: Vec<String> = root["workspace"]["members"]
        .as_array()
        .expect("members")
        .iter()
        .map(|member| {
            let path = here.join("../..").join(member.as_str().expect("a path")).join("Cargo.toml");
            let manifest: toml::Table = fs::read_to_string(path).expect("a manifest").parse().expect("TOML");
            manifest["package"]["name"].as_str().expect("a name").to_owned()
        })
        .collect();
    assert!(own.len() >= 5, "{own:?}");
    let manifest: toml::Table =
        fs::read_to_string(here.join("Cargo.toml")).expect("the manifest").parse().expect("TOML");
    for section in ["dependencies", "dev-dependencies", "build-dependencies"] {
        for (name, value) in manifest.get(section).and_then(|s| s.as_table()).into_iter().flatten() {
            assert!(!own.contains(name), "{section} names {name}");
            assert!(value.get("path").is_none() && value.get("package").is_none(), "{name} comes by a side way");
        }
    }
}

#[test]
fn no_source_file_reaches_into_another_crate() {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut files = Vec::new();
    sources(&here.join("src"), &mut files);
    assert!(files.len() > 10);
    for file in files {
        let text = fs::read_to_string(&file).expect("a source file");
        for foreign in ["thud_sim", "thud_firmware", "thud::", "include!", "#[path"] {
            assert!(!text.contains(foreign), "{} has {foreign}", file.display());
        }
    }
}
