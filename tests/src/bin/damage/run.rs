//! One case: a copy of a scenario with one damaged file, a program that is run on it, and what it did.

use crate::changes;
use crate::files::copy;
use crate::verbs::Verb;
use rand::{RngExt as _, SeedableRng as _};
use rand_pcg::Pcg64;
use rustix::process::{Pid, Resource, Rlimit, prlimit};
use std::fs;
use std::io::Read as _;
use std::os::unix::process::ExitStatusExt as _;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

/// What a case may take.
pub(crate) struct Limits {
    pub(crate) cpu: Duration,
    pub(crate) memory_mib: u64,
}

/// What must not happen.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Wrong {
    Panic,
    Signal,
    TooLong,
    TooMuchMemory,
    /// Neither done nor failed.
    ExitCode,
    /// A failure that is not told in one line which names a file of the case.
    Message,
}

impl Wrong {
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Panic => "panic",
            Self::Signal => "signal",
            Self::TooLong => "too long",
            Self::TooMuchMemory => "too much memory",
            Self::ExitCode => "exit code",
            Self::Message => "message",
        }
    }
}

/// How a case ended.
pub(crate) struct Outcome {
    pub(crate) code: Option<i32>,
    pub(crate) wrong: Vec<Wrong>,
    pub(crate) cpu: Duration,
    pub(crate) memory_mib: u64,
    /// The command, the damage and the last line on standard error.
    pub(crate) told: String,
}

/// Without processor time a program waits for something that does not come.
const WAITING: Duration = Duration::from_secs(240);
const LOOK: Duration = Duration::from_millis(4);

/// Runs case `number`.
pub(crate) fn case(number: u64, whole: &Path, verbs: &[Verb], limits: &Limits, keep: &Path) -> Outcome {
    let mut random = Pcg64::seed_from_u64(number);
    let verb = &verbs[random.random_range(0..verbs.len())];
    let file = verb.damaged[random.random_range(0..verb.damaged.len())];
    let folder = tempfile::tempdir().expect("a temporary folder");
    copy(&whole.join(verb.scenario), folder.path());
    let path = folder.path().join(file);
    let bytes = fs::read(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    let (bytes, what) = changes::damage(bytes, &mut random);
    fs::write(&path, bytes).expect("room");
    let ended = watched(verb, folder.path(), number, limits);
    let wrong = wrong(&ended, folder.path(), limits);
    let command = format!("{} {}", verb.program, verb.arguments.join(" "));
    let told = format!("{command}; {file}: {what}; {}", last_line(&ended.stderr));
    if !wrong.is_empty() {
        let kept = keep.join(format!("case_{number}"));
        copy(folder.path(), &kept);
        let _for_people = fs::write(kept.join("said.txt"), format!("{told}\n\n{}", ended.stderr));
    }
    Outcome { code: ended.code, wrong, cpu: ended.cpu, memory_mib: ended.memory_mib, told }
}

/// How a program ended.
struct Ended {
    code: Option<i32>,
    killed: bool,
    cpu: Duration,
    memory_mib: u64,
    stderr: String,
}

fn watched(verb: &Verb, folder: &Path, number: u64, limits: &Limits) -> Ended {
    let dir = folder.to_str().expect("a UTF-8 path");
    let arguments = verb.arguments.iter().map(|argument| argument.replace("{dir}", dir));
    let stderr = folder.join("stderr.txt");
    let mut child = Command::new(tests::program_path(verb.program))
        .args(arguments)
        // What a program asks is written where it was started.
        .current_dir(folder)
        .env("TWINALIGN_DOMAIN", format!("damage-{}-{number}", std::process::id()))
        .env("RAYON_NUM_THREADS", "2")
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(fs::File::create(&stderr).expect("room"))
        .spawn()
        .unwrap_or_else(|e| panic!("{} does not start: {e}", verb.program));
    // Address space is more than memory: this only keeps a case from taking the machine's.
    let most = Rlimit { current: Some(limits.memory_mib << 22), maximum: None };
    let _gone_already = Pid::from_raw(child.id().cast_signed()).map(|pid| prlimit(Some(pid), Resource::As, most));
    let (cpu, memory_mib, killed) = watch(&mut child, limits);
    let status = child.wait().expect("a child of this process");
    let mut text = Vec::new();
    let read = fs::File::open(&stderr).and_then(|file| file.take(1 << 20).read_to_end(&mut text));
    let _removed = fs::remove_file(&stderr);
    read.expect("what was said");
    let signalled = status.signal().is_some();
    let code = if signalled { None } else { status.code() };
    Ended { code, killed, cpu, memory_mib, stderr: String::from_utf8_lossy(&text).into_owned() }
}

/// Waits for the end, or kills what takes too long; processor time, most memory [MiB], and whether it was killed.
fn watch(child: &mut Child, limits: &Limits) -> (Duration, u64, bool) {
    let (began, mut cpu, mut memory_mib) = (Instant::now(), Duration::ZERO, 0);
    loop {
        // Looked at first: behind the end there is nothing to see.
        let proc = Path::new("/proc").join(child.id().to_string());
        cpu = cpu.max(cpu_of(&proc).unwrap_or_default());
        memory_mib = memory_mib.max(memory_of(&proc).unwrap_or(0));
        if child.try_wait().expect("a child of this process").is_some() {
            return (cpu, memory_mib, false);
        }
        if cpu > limits.cpu || began.elapsed() > WAITING {
            let _ended_already = child.kill();
            return (cpu, memory_mib, true);
        }
        std::thread::sleep(LOOK);
    }
}

/// User and system time of a process: fields 14 and 15 of `stat`, in hundredths of a second.
fn cpu_of(proc: &Path) -> Option<Duration> {
    let stat = fs::read_to_string(proc.join("stat")).ok()?;
    let fields: Vec<&str> = stat.rsplit_once(") ")?.1.split(' ').collect();
    let ticks: u64 = fields.get(11)?.parse::<u64>().ok()? + fields.get(12)?.parse::<u64>().ok()?;
    Some(Duration::from_millis(10 * ticks))
}

/// The most memory that a process has had [MiB].
fn memory_of(proc: &Path) -> Option<u64> {
    let status = fs::read_to_string(proc.join("status")).ok()?;
    let line = status.lines().find(|line| line.starts_with("VmHWM:"))?;
    Some(line.split_whitespace().nth(1)?.parse::<u64>().ok()? >> 10)
}

fn wrong(ended: &Ended, folder: &Path, limits: &Limits) -> Vec<Wrong> {
    let mut wrong = Vec::new();
    if ended.killed {
        wrong.push(Wrong::TooLong);
    } else {
        match ended.code {
            None => wrong.push(Wrong::Signal),
            Some(101) => wrong.push(Wrong::Panic),
            Some(0) => {}
            Some(1) if names_a_file(last_line(&ended.stderr), folder) => {}
            Some(1) => wrong.push(Wrong::Message),
            Some(_) => wrong.push(Wrong::ExitCode),
        }
        // A panic in a thread of its own may be survived; it is one all the same.
        if ended.code != Some(101) && ended.stderr.contains("panicked at") {
            wrong.push(Wrong::Panic);
        }
    }
    if ended.memory_mib > limits.memory_mib {
        wrong.push(Wrong::TooMuchMemory);
    }
    wrong
}

fn last_line(text: &str) -> &str {
    text.trim_end().lines().last().unwrap_or("")
}

/// Whether a line is a program's complaint and names a file of the case, the folder that they are in, or the argument that
/// would help.
fn names_a_file(line: &str, folder: &Path) -> bool {
    let complains = line.starts_with("error: ");
    let named = |name: &std::ffi::OsStr| line.contains(name.to_string_lossy().as_ref());
    let mut entries = fs::read_dir(folder).into_iter().flatten().flatten();
    let session = folder.to_str().is_some_and(|folder| line.contains(folder));
    complains
        && (session
            || line.contains(" --")
            || line.contains("cell.toml")
            || entries.any(|entry| named(&entry.file_name())))
}
