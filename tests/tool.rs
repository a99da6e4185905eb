//! The tool as a person runs it: its binary in a process of its own, what it answers and what it refuses.
//!
//! Each file of tests takes what it needs of this; the rest of it stands unused there.
#![allow(dead_code)]

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use serde_json::Value;

pub const THUD: &str = env!("CARGO_BIN_EXE_thud");

/// An empty folder of that name, for one test alone.
pub fn folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).unwrap();
    folder
}

pub fn run(arguments: &[&str]) -> Output {
    Command::new(THUD).args(arguments).output().unwrap()
}

pub fn run_in(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(THUD).current_dir(folder).args(arguments).output().unwrap()
}

/// What it prints when all went well.
#[track_caller]
pub fn told(output: Output) -> String {
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap()
}

/// What it says when it refuses, in one line: without the frame and the line breaks of the terminal.
#[track_caller]
pub fn refused(output: Output) -> String {
    assert_eq!(output.status.code(), Some(2), "{}", String::from_utf8_lossy(&output.stdout));
    let words = String::from_utf8(output.stderr).unwrap();
    words.replace(['│', '×', '╭', '╰', '─'], " ").split_whitespace().collect::<Vec<_>>().join(" ")
}

/// The answer of a command that knows `--json`.
#[track_caller]
pub fn json(arguments: &[&str]) -> Value {
    serde_json::from_str(&told(run(&[arguments, &["--json", "-"]].concat()))).unwrap()
}

/// What it says to arguments that it refuses.
#[track_caller]
pub fn refusal(arguments: &[&str]) -> String {
    refused(run(arguments))
}
