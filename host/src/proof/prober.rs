//! Has each campaign diagnosed by a process of its own, which gets a campaign and nothing else: no seed, no key, no answer, no
//! environment, and a name that says nothing.

use std::fs::File;
use std::io::Read as _;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

use miette::{IntoDiagnostic as _, WrapErr as _, miette};

use super::folder::{Done, Folder};
use super::seal::sha256;
use super::usage::Usage;
use crate::interrupt;

/// Who diagnoses.
pub struct Prober {
    program: PathBuf,
    /// SHA-256 of the program: what another build said is not taken over.
    pub hash: String,
    limit: Duration,
}

/// How often a running process is looked at.
const LOOK: Duration = Duration::from_millis(20);
/// How many times its limit of processor time a process may take by the clock.
const PATIENCE: u32 = 10;
/// How much of what a failed process wrote is kept.
const WORDS: u64 = 2000;

impl Prober {
    /// This very program, with so much processor time for each campaign.
    ///
    /// # Errors
    /// Its own file cannot be found or read.
    pub fn this_program(limit: Duration) -> miette::Result<Self> {
        let program = std::env::current_exe().into_diagnostic().wrap_err("cannot find this program's own file")?;
        let bytes = std::fs::read(&program)
            .into_diagnostic()
            .wrap_err_with(|| format!("cannot read this program's own file {}", program.display()))?;
        Ok(Self { program, hash: sha256(&bytes), limit })
    }

    /// Diagnoses what is not done yet, `jobs` at a time; `sealed` goes into the journal, `finished` hears of each case. Ends early, without an error, on Ctrl-C.
    ///
    /// # Errors
    /// A process that cannot be started, a file that cannot be written.
    pub fn diagnose(
        &self,
        folder: &Folder,
        cases: &[(String, Vec<String>)],
        sealed: bool,
        jobs: usize,
        finished: &(impl Fn() + Sync),
    ) -> miette::Result<()> {
        let next = AtomicUsize::new(0);
        let fault: Mutex<Option<miette::Report>> = Mutex::new(None);
        let journal = Mutex::new(());
        std::thread::scope(|scope| {
            for _ in 0..jobs.max(1) {
                scope.spawn(|| {
                    loop {
                        let index = next.fetch_add(1, Ordering::Relaxed);
                        if index >= cases.len() || interrupt::asked() || fault.lock().is_ok_and(|fault| fault.is_some())
                        {
                            return;
                        }
                        let (case, without) = &cases[index];
                        let noted = self.one(folder, case, without, sealed).and_then(|done| match done {
                            Some(done) => {
                                let _one_at_a_time = journal.lock();
                                folder.note(&done)
                            }
                            None => Ok(()),
                        });
                        if let Err(error) = noted
                            && let Ok(mut fault) = fault.lock()
                        {
                            *fault = Some(error);
                        }
                        finished();
                    }
                });
            }
        });
        match fault.into_inner() {
            Ok(Some(fault)) => Err(fault),
            _ => Ok(()),
        }
    }

    /// Writes the page of a case to `page`.
    ///
    /// # Errors
    /// The diagnosis failed.
    pub fn report(&self, folder: &Folder, case: &str, without: &[String], page: &Path) -> miette::Result<()> {
        let page = std::path::absolute(page).into_diagnostic()?;
        let mut command = Command::new(&self.program);
        command.current_dir(folder.cases()).args(["diagnose", case, "--report"]).arg(&page);
        for mechanism in without {
            command.args(["--without", mechanism]);
        }
        let output = command.output().into_diagnostic().wrap_err("cannot start the diagnosis of a telling case")?;
        if !output.status.success() {
            return Err(miette!("the page of case {case} failed: {}", String::from_utf8_lossy(&output.stderr)));
        }
        Ok(())
    }

    /// Diagnoses one case. None where Ctrl-C ended it.
    fn one(&self, folder: &Folder, case: &str, without: &[String], sealed: bool) -> miette::Result<Option<Done>> {
        let part = |ending: &str| folder.diagnosis(case).with_extension(ending);
        let (said, words) = (part("part"), part("stderr"));
        let file = |path: &Path| {
            File::create(path).into_diagnostic().wrap_err_with(|| format!("cannot write {}", path.display()))
        };
        let mut command = Command::new(&self.program);
        command
            .current_dir(folder.cases())
            .env_clear()
            // So that cases side by side do not disturb each other; the answer is the same on any number of threads.
            .env("RAYON_NUM_THREADS", "1")
            .args(["diagnose", case, "--json", "-"])
            .stdin(Stdio::null())
            .stdout(file(&said)?)
            .stderr(file(&words)?);
        for mechanism in without {
            command.args(["--without", mechanism]);
        }
        let begun = Instant::now();
        let mut child =
            command.spawn().into_diagnostic().wrap_err_with(|| format!("cannot start {}", self.program.display()))?;
        let mut usage = Usage::default();
        let status = loop {
            usage.look(child.id());
            if let Some(status) = child.try_wait().into_diagnostic()? {
                break Some(status);
            }
            // On a busy machine a process waits; one that waits for ever is ended all the same.
            let used = usage.processor_s.unwrap_or_else(|| begun.elapsed().as_secs_f64());
            if interrupt::asked() || used > self.limit.as_secs_f64() || begun.elapsed() > self.limit * PATIENCE {
                child.kill().into_diagnostic()?;
                child.wait().into_diagnostic()?;
                break None;
            }
            std::thread::sleep(LOOK);
        };
        let seconds = begun.elapsed().as_secs_f64();
        if interrupt::asked() {
            let _ = std::fs::remove_file(&said);
            return Ok(None);
        }
        let failure = match status {
            Some(status) if status.success() => None,
            Some(status) => Some(format!("{status}: {}", beginning(&words))),
            None => Some(format!("no answer within {:.0} s", self.limit.as_secs_f64())),
        };
        if failure.is_none() {
            let goal = folder.diagnosis(case);
            std::fs::rename(&said, &goal)
                .into_diagnostic()
                .wrap_err_with(|| format!("cannot write {}", goal.display()))?;
        } else {
            let _ = std::fs::remove_file(&said);
        }
        let _ = std::fs::remove_file(&words);
        Ok(Some(Done {
            case: case.to_owned(),
            program: self.hash.clone(),
            sealed,
            seconds,
            processor_s: usage.processor_s,
            memory_mb: usage.memory_mb,
            failure,
        }))
    }
}

/// The beginning of what a process wrote.
fn beginning(path: &Path) -> String {
    let mut text = Vec::new();
    let _ = File::open(path).map(|file| file.take(WORDS).read_to_end(&mut text));
    String::from_utf8_lossy(&text).split_whitespace().collect::<Vec<_>>().join(" ")
}

/// Keeps the processes that diagnose from reading this one's memory, where the system can (Linux, and not as root).
pub fn close_memory() {
    #[cfg(target_os = "linux")]
    {
        // Where it cannot, the seal still holds against everything but a look into this process.
        let _ = nix::sys::prctl::set_dumpable(false);
    }
}

/// A limit of time from seconds.
///
/// # Errors
/// It is none.
pub fn limit(seconds: f64) -> miette::Result<Duration> {
    Duration::try_from_secs_f64(seconds)
        .ok()
        .filter(|limit| !limit.is_zero())
        .ok_or_else(|| miette!("{seconds} s is no limit of time; choose more than 0"))
}
