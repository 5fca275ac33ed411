//! Kills every verb that writes, and fills its disk: every output has to be the one of before or the new one, whole; what
//! a program says and its exit code have to tell which.
//!
//! `cargo run --release -p tests --bin kill_writers [VERB...]`, once the programs are built. Takes about half an hour;
//! full disks need root, for a `tmpfs`. With `TWINALIGN_SCAN=scan.ply` (a scan of the robot at
//! 0.2, -0.6, 0.1, -2.2, 0.1, 1.7, 0.6 rad, one unit 0.41 m) also `twin label-splats`. Ends with exit code 1 where
//! anything was empty, cut, left over or left running.
#![allow(clippy::print_stdout)] // its answer

mod disk;
mod look;
mod verbs;

use disk::SmallDisk;
use look::{Found, OLD, look, processes_of, unfinished};
use rand::{RngExt as _, SeedableRng as _};
use rand_pcg::Pcg64Mcg;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::{Duration, Instant};
use tests::Program;
use verbs::{Again, Verb, material, verbs};

/// How long a verb may take.
const PATIENCE: Duration = Duration::from_secs(300);
/// How long what a killed program started may take to end.
const ORPHANS: Duration = Duration::from_secs(15);
/// Tries to hit a program before it has ended by itself, for each kill.
const TRIES: u32 = 4;

/// What one kill or full disk left.
struct Trial {
    verb: &'static str,
    what: String,
    left: Vec<(&'static str, Found)>,
    faults: Vec<String>,
}

impl Trial {
    fn line(&self) -> String {
        let left: Vec<String> = self.left.iter().map(|(name, found)| format!("{name} {found}")).collect();
        let verdict =
            if self.faults.is_empty() { String::new() } else { format!("  VIOLATED: {}", self.faults.join("; ")) };
        format!("{:<22} {:<34} {}{verdict}", self.verb, self.what, left.join(", "))
    }
}

/// The folder in which everything happens.
struct Bench {
    folder: tempfile::TempDir,
    domain: String,
    random: Pcg64Mcg,
}

impl Bench {
    /// An output folder with the outputs of before.
    fn fresh(&self, verb: &Verb, out: &Path) {
        if out.exists() {
            for entry in std::fs::read_dir(out).expect("a folder") {
                let path = entry.expect("an entry").path();
                if path.is_dir() { std::fs::remove_dir_all(path) } else { std::fs::remove_file(path) }
                    .expect("removed");
            }
        }
        std::fs::create_dir_all(out).expect("a folder");
        for name in verb.outputs.iter().filter(|_| verb.again == Again::Replaces) {
            std::fs::create_dir_all(out.join(name).parent().expect("a folder")).expect("a folder");
            std::fs::write(out.join(name), OLD).expect("the output of before");
        }
    }

    fn start(&self, verb: &Verb, out: &Path) -> Program {
        let place = |text: &String| text.replace("{out}", &out.display().to_string());
        let arguments: Vec<String> = verb.arguments.iter().map(place).collect();
        let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
        Program::start(verb.program, &self.domain, &arguments)
    }

    /// Runs the verb undisturbed: how long it takes, and the size of what it writes [bytes].
    fn measure(&self, verb: &Verb) -> Result<(Duration, u64), String> {
        let out = self.folder.path().join("measured");
        self.fresh(verb, &out);
        let end = self.start(verb, &out).wait(PATIENCE);
        let wrong: Vec<_> = verb.outputs.iter().filter(|name| look(&out.join(name)) != Found::New).collect();
        if !end.status.success() || !wrong.is_empty() {
            return Err(format!("{} {}: not even undisturbed: {wrong:?}\n{}", verb.name, end.status, end.stderr));
        }
        Ok((end.took, verb.outputs.iter().map(|name| look::size(&out.join(name))).sum()))
    }

    /// Kills the verb at a moment near its end; `None` where it always ended first.
    fn kill(&mut self, verb: &Verb, took: Duration, round: u32) -> Option<Trial> {
        let out = self.folder.path().join("killed");
        let mut earlier = 1.0;
        for _ in 0..TRIES {
            self.fresh(verb, &out);
            let begin = Instant::now();
            let mut program = self.start(verb, &out);
            let share = earlier * self.random.random_range(verb.from..1.02);
            // Every other one as soon as something is being written, or a moment later.
            let what = if round % 2 == 1 && wait_for_unfinished(&mut program, &out) {
                std::thread::sleep(Duration::from_micros(self.random.random_range(0..3000)));
                "killed while it writes".to_owned()
            } else {
                std::thread::sleep(took.mul_f64(share).saturating_sub(begin.elapsed()));
                format!("killed after {:.2} of {:.2} s", begin.elapsed().as_secs_f64(), took.as_secs_f64())
            };
            let (pid, alive) = (program.pid(), program.is_running());
            program.kill_without_warning();
            if alive {
                return Some(self.judge(verb, what, &out, pid));
            }
            earlier *= 0.9;
        }
        None
    }

    fn judge(&self, verb: &Verb, what: String, out: &Path, pid: u32) -> Trial {
        let mut faults = Vec::new();
        let begin = Instant::now();
        let domains = [self.domain.clone(), format!("demo-{pid}")];
        while begin.elapsed() < ORPHANS && !processes_of(&domains).is_empty() {
            std::thread::sleep(Duration::from_millis(50));
        }
        faults.extend(processes_of(&domains).into_iter().map(|left| format!("still running: {left}")));
        let left = self.left(verb, out, &mut faults);
        Trial { verb: verb.name, what, left, faults }
    }

    fn left(&self, verb: &Verb, out: &Path, faults: &mut Vec<String>) -> Vec<(&'static str, Found)> {
        let left: Vec<_> = verb.outputs.iter().map(|name| (*name, look(&out.join(name)))).collect();
        for (name, found) in &left {
            match found {
                Found::Absent if verb.again == Again::Replaces => faults.push(format!("{name} is gone")),
                _ => {}
            }
        }
        faults.extend(look::halves(out).into_iter().map(|(name, why)| format!("{name}: {why}")));
        left
    }

    /// The same command once more: it has to succeed, and to clear away what the killed one left.
    fn again(&self, verb: &Verb) -> Trial {
        let out = self.folder.path().join("killed");
        let begun = unfinished(&out).len();
        match verb.again {
            Again::Replaces | Again::GoesOn => {}
            Again::WantsNewFolder => self.fresh(verb, &out),
            Again::WantsNewOutputs => {
                for path in verb.outputs.iter().map(|name| out.join(name)) {
                    let _not_there =
                        if path.is_dir() { std::fs::remove_dir_all(path) } else { std::fs::remove_file(path) };
                }
            }
        }
        let end = self.start(verb, &out).wait(PATIENCE);
        let mut faults = Vec::new();
        if !end.status.success() {
            faults.push(format!("{}: {}", end.status, end.stderr.trim_end().lines().last().unwrap_or("")));
        }
        faults.extend(unfinished(&out).into_iter().map(|name| format!("{name} is left over")));
        let left = self.left(verb, &out, &mut faults);
        Trial { verb: verb.name, what: format!("once more, {begun} left over before"), left, faults }
    }

    /// Runs the verb on a disk that has room for a share of what it writes.
    fn fill(&mut self, verb: &Verb, size: u64) -> Option<Trial> {
        let room = (size as f64 * self.random.random_range(0.0..0.9)) as u64;
        let disk = SmallDisk::mount(&self.folder.path().join("disk"), 2 * size + (1 << 20))?;
        let out = disk.folder().join("out");
        self.fresh(verb, &out);
        let room = disk.leave(room);
        let end = self.start(verb, &out).wait(PATIENCE);
        disk.make_room();
        let mut faults = Vec::new();
        let said = end.stderr.trim_end().lines().last().unwrap_or("").to_owned();
        if end.status.code() != Some(1) {
            faults.push(format!("ended with {}", end.status));
        }
        if !said.contains("disk is full") && !said.contains("No space left") {
            faults.push(format!("said only: {said}"));
        }
        faults.extend(unfinished(&out).into_iter().map(|name| format!("{name} is left over")));
        let left = self.left(verb, &out, &mut faults);
        println!("    {said}");
        Some(Trial { verb: verb.name, what: format!("{room} of {size} bytes free"), left, faults })
    }
}

/// Until the program writes something; `false` where it ended before.
fn wait_for_unfinished(program: &mut Program, out: &Path) -> bool {
    let begin = Instant::now();
    while program.is_running() && begin.elapsed() < PATIENCE {
        if !unfinished(out).is_empty() {
            return true;
        }
        std::thread::sleep(Duration::from_micros(200));
    }
    false
}

fn main() -> ExitCode {
    let wanted: Vec<String> = std::env::args().skip(1).collect();
    let folder = tempfile::tempdir().expect("a folder");
    let domain = format!("kill-writers-{}", std::process::id());
    let mut bench = Bench { folder, domain, random: Pcg64Mcg::seed_from_u64(11) };
    let inputs: PathBuf = bench.folder.path().join("inputs");
    material(&inputs, &bench.domain);
    let (mut kills, mut full, mut violations) = (0, 0, 0);
    let mut note = |trial: &Trial| {
        println!("{}", trial.line());
        violations += usize::from(!trial.faults.is_empty());
    };
    for verb in verbs(&inputs).iter().filter(|verb| wanted.is_empty() || wanted.iter().any(|name| name == verb.name)) {
        let (took, size) = match bench.measure(verb) {
            Ok(measured) => measured,
            Err(why) => {
                note(&Trial { verb: verb.name, what: "undisturbed".into(), left: Vec::new(), faults: vec![why] });
                continue;
            }
        };
        println!("{:<22} takes {:.2} s and writes {size} bytes", verb.name, took.as_secs_f64());
        for round in 0..verb.kills {
            if let Some(trial) = bench.kill(verb, took, round) {
                kills += 1;
                note(&trial);
            }
        }
        note(&bench.again(verb));
        for _ in 0..verb.full {
            match bench.fill(verb, size) {
                Some(trial) => {
                    full += 1;
                    note(&trial);
                }
                None => println!("skipped: full disks, because no tmpfs can be mounted; run as root"),
            }
        }
    }
    println!("{kills} kills and {full} full disks: {violations} violations");
    if violations == 0 { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}
