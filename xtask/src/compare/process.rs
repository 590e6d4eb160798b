//! One run of a program: how it ended, and what it took.

use std::fmt;
use std::fs;
use std::io;
use std::process::{Child, Command, ExitStatus};
use std::time::{Duration, Instant};

/// Clock ticks per second in `/proc`: USER_HZ, 100 on every architecture that Rust's standard library supports.
const TICKS: f64 = 100.0;

/// How a run ended.
#[derive(Debug, Clone, PartialEq)]
pub enum Ending {
    Exit(i32),
    /// Ended by a signal, or not started; in words.
    Broken(String),
    TimedOut,
}

impl fmt::Display for Ending {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Exit(code) => write!(f, "{code}"),
            Self::Broken(why) => f.write_str(why),
            Self::TimedOut => f.write_str("time-out"),
        }
    }
}

/// What a run took. Processor time and memory are known on Linux only.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Usage {
    /// Wall time, seconds.
    pub wall: f64,
    /// User and system time of all threads, seconds.
    pub cpu: Option<f64>,
    /// Largest resident memory, 10⁶ bytes.
    pub peak: Option<f64>,
}

/// Runs to the end, or kills what takes longer than `limit`.
pub fn measured(command: &mut Command, limit: Duration) -> (Ending, Usage) {
    watched(command, limit, |_| ())
}

/// The same; `look_at` sees what has been taken so far, every 20 ms at least.
pub fn watched(command: &mut Command, limit: Duration, look_at: impl FnMut(&Usage)) -> (Ending, Usage) {
    let start = Instant::now();
    let mut usage = Usage::default();
    let ending = match command.spawn() {
        Ok(mut child) => {
            let waited = wait(&mut child, start, limit, &mut usage, look_at);
            waited.unwrap_or_else(|error| Ending::Broken(format!("lost: {error}")))
        }
        Err(error) => Ending::Broken(format!("not started: {error}")),
    };
    usage.wall = start.elapsed().as_secs_f64();
    (ending, usage)
}

fn wait(
    child: &mut Child,
    start: Instant,
    limit: Duration,
    usage: &mut Usage,
    mut look_at: impl FnMut(&Usage),
) -> io::Result<Ending> {
    let mut pause = Duration::from_millis(1);
    loop {
        // A child that has ended keeps its processor time in /proc until it is waited for; its memory is gone by then.
        let ended = match look(child.id()) {
            Some(seen) => {
                usage.cpu = Some(seen.cpu);
                usage.peak = seen.peak.or(usage.peak);
                look_at(usage);
                if seen.ended { Some(child.wait()?) } else { None }
            }
            None => child.try_wait()?,
        };
        if let Some(status) = ended {
            return Ok(ending(status));
        }
        if start.elapsed() > limit {
            child.kill()?;
            child.wait()?;
            return Ok(Ending::TimedOut);
        }
        std::thread::sleep(pause);
        pause = (pause * 2).min(Duration::from_millis(20));
    }
}

fn ending(status: ExitStatus) -> Ending {
    status.code().map_or_else(|| Ending::Broken(status.to_string()), Ending::Exit)
}

struct Seen {
    ended: bool,
    cpu: f64,
    peak: Option<f64>,
}

fn look(process: u32) -> Option<Seen> {
    let stat = fs::read_to_string(format!("/proc/{process}/stat")).ok()?;
    // The name stands in brackets and may itself hold blanks and brackets: state is the first field behind it.
    let fields: Vec<_> = stat.rsplit_once(')')?.1.split_ascii_whitespace().collect();
    let ticks = |field: usize| fields.get(field).and_then(|text| text.parse::<f64>().ok());
    let status = fs::read_to_string(format!("/proc/{process}/status")).unwrap_or_default();
    let peak = status.lines().find_map(|line| line.strip_prefix("VmHWM:")?.trim().strip_suffix(" kB")?.parse().ok());
    Some(Seen {
        ended: matches!(fields.first(), Some(&"Z" | &"X")),
        cpu: (ticks(11)? + ticks(12)?) / TICKS,
        peak: peak.map(|kibibytes: f64| kibibytes * 1024.0 / 1e6),
    })
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;

    #[test]
    fn endings_of_programs() {
        let shell = |script: &str, limit| {
            let mut command = Command::new("sh");
            measured(command.args(["-c", script]), Duration::from_millis(limit))
        };
        assert_eq!(shell("exit 4", 60_000).0, Ending::Exit(4));
        let (ending, usage) = shell("exec sleep 60", 50);
        assert_eq!(ending, Ending::TimedOut);
        assert!(usage.wall < 30.0, "{usage:?}");
        assert!(matches!(shell("kill -9 $$", 60_000).0, Ending::Broken(_)));
        assert!(matches!(measured(&mut Command::new("/no/such/program"), Duration::ZERO).0, Ending::Broken(_)));
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn processor_time_and_memory() {
        let mut command = Command::new("sh");
        command.args(["-c", "i=0; while [ $i -lt 200000 ]; do i=$((i+1)); done"]);
        let (_, usage) = measured(&mut command, Duration::from_secs(60));
        // The loop takes some 0.1 s of one processor: more than two ticks, and no more than the wall time and a tick or two.
        let cpu = usage.cpu.expect("processor time");
        assert!(cpu > 0.02 && cpu < usage.wall + 0.03, "{usage:?}");
        // A shell takes more than 0.1 MB and less than 100 MB.
        assert!(usage.peak.is_some_and(|peak| peak > 0.1 && peak < 100.0), "{usage:?}");
    }
}
