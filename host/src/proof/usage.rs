//! What a process has used, looked at while it runs: time of a processor, which does not depend on who else is there, and memory.
//!
//! Linux says it in `/proc/PID/stat` (clock ticks of 10 ms, proc_pid_stat(5)) and `/proc/PID/status` (`VmHWM`). Elsewhere nothing is known.

/// What a process had used when it was last looked at.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Usage {
    /// Time of all its threads, s.
    pub processor_s: Option<f64>,
    /// The most memory that it held at once, MB (10⁶ bytes).
    pub memory_mb: Option<f64>,
}

/// USER_HZ, which is 100 on every Linux that runs programs of today.
const TICKS_PER_S: f64 = 100.0;
/// Bytes in what the kernel calls kB.
const KIB: f64 = 1024.0;

impl Usage {
    /// Looks at process `id`; what cannot be seen any more stays as it was.
    pub fn look(&mut self, id: u32) {
        let read = |file: &str| std::fs::read_to_string(format!("/proc/{id}/{file}")).ok();
        let now = Self {
            processor_s: read("stat").as_deref().and_then(processor_s).filter(|seconds| *seconds > 0.0),
            memory_mb: read("status").as_deref().and_then(memory_mb),
        };
        self.processor_s = now.processor_s.or(self.processor_s);
        self.memory_mb = now.memory_mb.or(self.memory_mb);
    }
}

/// Fields 14 and 15 of `stat`, counted behind the name, which may hold blanks.
fn processor_s(stat: &str) -> Option<f64> {
    let (_, fields) = stat.rsplit_once(')')?;
    let mut fields = fields.split_whitespace().skip(11);
    let (user, system): (f64, f64) = (fields.next()?.parse().ok()?, fields.next()?.parse().ok()?);
    Some((user + system) / TICKS_PER_S)
}

fn memory_mb(status: &str) -> Option<f64> {
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    let kib: f64 = line.trim().trim_end_matches(" kB").parse().ok()?;
    Some(kib * KIB / 1e6)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_kernels_lines_are_read() {
        let stat = "4711 (a (b) c) R 1 2 3 4 5 6 7 8 9 10 250 30 0 0 20 0 1 0 9 8 7";
        assert_eq!(processor_s(stat), Some(2.8));
        assert_eq!(memory_mb("VmPeak:\t 9 kB\nVmHWM:\t    1000 kB\nThreads: 1\n"), Some(1.024));
        assert_eq!((processor_s("gone"), memory_mb("")), (None, None));
    }
}
