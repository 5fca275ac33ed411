//! How late the control loop wakes beside how late `cyclictest` does, in turns on one machine: a table, and the ratios of the
//! medians over the rounds, beside the time that a virtual machine's host took the last core away. `cargo run --release -p rt_bridge --example wake_ups -- ROUNDS SECONDS`, as root, on an idle machine,
//! with Debian's `rt-tests` installed. The loop drives the shipped cell's simulated arm, without a camera.

use anyhow::{Context, Result, bail, ensure};
use rt_bridge::rt::{Realtime, process};
use rt_bridge::run::{ArmChoice, CameraChoice, Settings, run};
use shared_mem::answer;
use std::path::Path;
use std::process::Command;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

/// Lateness of wake-ups [us].
#[derive(Debug, Clone, Copy)]
struct Late {
    median: f64,
    p999: f64,
    max: f64,
    /// Time within the run for which the host gave the last core to somebody else [ms].
    stolen_ms: f64,
}

fn main() -> Result<()> {
    let numbers: Vec<u32> = std::env::args().skip(1).map(|a| a.parse()).collect::<Result<_, _>>()?;
    let [rounds, seconds] = numbers[..] else {
        bail!("give the number of rounds and the seconds of each, as in `6 10`")
    };
    ensure!(rounds > 0 && seconds > 0, "give at least one round of one second");
    answer::words(
        "[us]     cyclictest: p50   p99.9     max  stolen ms |  loop: p50   p99.9     max  missed  stolen ms | p50 x  p99.9 x",
    )?;
    let mut pairs = Vec::new();
    for round in 1..=rounds {
        let peer = cyclictest(seconds)?;
        let (own, missed) = control_loop(seconds)?;
        answer::words(format!(
            "round {round:>2} {:>15.0} {:>7.0} {:>7.0} {:>10.0} | {:>10.1} {:>7.1} {:>7.1} {missed:>7} {:>10.0} | {:>5.2} {:>8.2}",
            peer.median,
            peer.p999,
            peer.max,
            peer.stolen_ms,
            own.median,
            own.p999,
            own.max,
            own.stolen_ms,
            own.median / peer.median,
            own.p999 / peer.p999
        ))?;
        pairs.push((own, peer));
    }
    let over = |of: fn(&(Late, Late)) -> f64| median(pairs.iter().map(of).collect());
    let (p50, peer_p50) = (over(|(own, _)| own.median), over(|(_, peer)| peer.median));
    let (p999, peer_p999) = (over(|(own, _)| own.p999), over(|(_, peer)| peer.p999));
    answer::words(format!(
        "medians over the rounds: p50 {p50:.1} / {peer_p50:.1} = {:.2}; p99.9 {p999:.1} / {peer_p999:.1} = {:.2}, median ratio of a round {:.2}",
        p50 / peer_p50,
        p999 / peer_p999,
        over(|(own, peer)| own.p999 / peer.p999)
    ))?;
    Ok(())
}

/// A thread that does nothing but wake each millisecond, with the control thread's priority and its memory locked.
fn cyclictest(seconds: u32) -> Result<Late> {
    let mut command = Command::new("cyclictest");
    command.args(["-m", "-q", "-t1", "-p80", "-i1000", "-h20000", "-D"]).arg(format!("{seconds}s"));
    let before = stolen_ms()?;
    let output = command.output().context("cyclictest does not start; install Debian's rt-tests")?;
    let text = String::from_utf8_lossy(&output.stdout);
    // The histogram's lines are a latency and its count; all others are comments.
    let counts: Vec<(f64, u64)> = text
        .lines()
        .filter(|line| line.starts_with(|c: char| c.is_ascii_digit()))
        .filter_map(|line| {
            let mut columns = line.split_whitespace();
            Some((columns.next()?.parse().ok()?, columns.next()?.parse().ok()?))
        })
        .filter(|(_, count)| *count > 0)
        .collect();
    let total: u64 = counts.iter().map(|(_, count)| count).sum();
    ensure!(total > 0, "cyclictest measured nothing (it needs root): {}", String::from_utf8_lossy(&output.stderr));
    let at = |share: f64| {
        let mut below = 0;
        let reached = counts.iter().find(|(_, count)| {
            below += count;
            below as f64 >= share * total as f64
        });
        reached.map_or(f64::NAN, |(late, _)| *late)
    };
    Ok(Late { median: at(0.5), p999: at(0.999), max: at(1.0), stolen_ms: stolen_ms()? - before })
}

/// For how long since the machine's start the host of a virtual machine has given the last core, the control thread's, to somebody
/// else [ms]: `steal` of proc_stat(5).
fn stolen_ms() -> Result<f64> {
    const MS_A_TICK: f64 = 10.0; // USER_HZ is 100 on every Linux of x86-64 and ARM
    let core = process::last_core().context("there is no core")?;
    let text = std::fs::read_to_string("/proc/stat")?;
    let line = text.lines().find_map(|line| line.strip_prefix(&format!("cpu{core} ")));
    let steal = line.and_then(|line| line.split_whitespace().nth(7)).context("/proc/stat names no stolen time")?;
    Ok(MS_A_TICK * steal.parse::<f64>()?)
}

/// The control loop, and its missed cycles.
fn control_loop(seconds: u32) -> Result<(Late, u64)> {
    let settings = Settings {
        cell: Path::new(env!("CARGO_MANIFEST_DIR")).join("../config/fr3_cell.toml"),
        arm: ArmChoice::Sim,
        controller: None,
        camera: Some(CameraChoice::Off),
        splats: None,
        hand_eye: None,
        tracker: None,
        gripper: None,
        wrench: None,
        effects: None,
        parameters: None,
        record: None,
        force: false,
        duration: Some(Duration::from_secs(seconds.into())),
        realtime: Realtime::Enforce,
    };
    let before = stolen_ms()?;
    let report = run(&settings, &Arc::new(AtomicBool::new(false)))?;
    let wake = report.wake_us;
    let [median, p999, max] = [wake.p50, wake.p999, wake.max].map(|us| us.unwrap_or(f64::NAN));
    Ok((Late { median, p999, max, stolen_ms: stolen_ms()? - before }, report.missed_cycles))
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    let middle = values.len() / 2;
    if values.len() % 2 == 1 { values[middle] } else { 0.5 * (values[middle - 1] + values[middle]) }
}
