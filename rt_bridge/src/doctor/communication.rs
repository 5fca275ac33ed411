//! Known causes of `communication_constraints_violation`, the robot's error when commands miss their millisecond: which of
//! them this machine has, as far as that can be seen before a robot moves. Judges only; what is read is in `readings`.

use super::Finding;
use super::readings::{NetworkPath, Readings};
use crate::times::in_words;

/// What a network interface may keep packets back for and leave the loop its share of the millisecond [us].
const GOOD_HOLD_US: u32 = 50;
/// Round trip to the robot that leaves the loop its share: what the makers of libfranka advise at most [us].
const GOOD_ROUND_TRIP_US: f64 = 400.0;

/// One finding for each cause, as far as it was read.
pub(super) fn judge(readings: &Readings) -> Vec<Finding> {
    let mut findings = vec![kernel(readings), governor(readings), sleep(readings), load(readings)];
    if let Some(network) = &readings.network {
        findings.extend([interface(network), round_trip(network)]);
    }
    findings
}

fn kernel(readings: &Readings) -> Finding {
    let Readings { version, core, .. } = readings;
    if readings.is_realtime {
        return Finding::ok("kernel", format!("{version}, PREEMPT_RT"));
    }
    let share = if readings.isolated {
        format!("has core {core} for itself")
    } else {
        format!("shares core {core} with other programs")
    };
    Finding::warning(
        "kernel",
        format!("{version}, not PREEMPT_RT; the control thread {share}"),
        "install a real-time kernel before a robot moves; with `--realtime ignore` the bridge runs without, less badly on a core of its own (`isolcpus` on the kernel's command line)",
    )
    .delaying()
}

fn governor(readings: &Readings) -> Finding {
    match readings.governor.as_deref() {
        Some("performance") => Finding::ok("governor", "performance"),
        Some(name) => Finding::warning(
            "governor",
            format!("{name} on core {}", readings.core),
            "set it with `cpupower frequency-set -g performance`: clocks that ramp up cost hundreds of microseconds",
        )
        .delaying(),
        None => Finding::ok("governor", "the clock is not this system's to set (a virtual machine?)"),
    }
}

fn sleep(readings: &Readings) -> Finding {
    let Some(error) = readings.deep_idle else {
        return Finding::ok("sleep states", "the bridge keeps processors out of deep ones while it runs");
    };
    let text = error.to_string();
    let (found, remedy) = text.split_once("; ").unwrap_or((&text, "ask the administrator of this machine"));
    Finding::warning("sleep states", found, remedy).delaying()
}

fn load(readings: &Readings) -> Finding {
    let Some(load) = readings.load else {
        return Finding::ok("load", "not known");
    };
    let found = format!("{load:.1} on {} cores over the last minute", readings.cores);
    // One core belongs to the control thread.
    if load > readings.cores.saturating_sub(1).max(1) as f64 {
        Finding::warning("load", found, "end other programs, `top` lists them").delaying()
    } else {
        Finding::ok("load", found)
    }
}

fn interface(network: &NetworkPath) -> Finding {
    let Some(name) = &network.interface else {
        return Finding::ok("interface", "the one that leads to the robot is not known");
    };
    if network.is_wireless {
        let remedy = "connect the robot by cable, directly";
        return Finding::warning("interface", format!("{name} is wireless"), remedy).delaying();
    }
    let Some(held) = network.held else {
        return Finding::ok("interface", format!("{name} leads to the robot; it hands on packets by itself"));
    };
    let found = format!("{name} keeps packets back for {} us in and {} us out", held.receive_us, held.send_us);
    let remedy = format!("set it with `sudo ethtool -C {name} adaptive-rx off rx-usecs 0 tx-usecs 0`");
    if held.receive_us.max(held.send_us) > GOOD_HOLD_US {
        Finding::warning("interface", found, remedy).delaying()
    } else if held.is_adaptive {
        Finding::warning("interface", format!("{found}, or longer as it sees fit (adaptive-rx)"), remedy)
    } else {
        Finding::ok("interface", found)
    }
}

fn round_trip(network: &NetworkPath) -> Finding {
    let Some(echoes) = &network.echoes else {
        return Finding::ok("round trip", "not measured: this user may send no echo requests (as root, `ping` does)");
    };
    if echoes.came == 0 {
        return Finding::ok("round trip", "not measured: no echo request was answered");
    }
    let found = format!(
        "{} of {} echoes came, after {} (p99), at worst {}",
        echoes.came,
        echoes.sent,
        in_words(echoes.times_us.p99),
        in_words(echoes.times_us.max)
    );
    if echoes.came < echoes.sent || echoes.times_us.p99.is_none_or(|us| us > GOOD_ROUND_TRIP_US) {
        let remedy = "connect the robot directly, without switch or Wi-Fi: at most 0.4 ms leave the loop its share";
        Finding::warning("round trip", found, remedy).delaying()
    } else {
        Finding::ok("round trip", found)
    }
}

#[cfg(test)]
mod tests {
    use super::super::echo::Echoes;
    use super::*;
    use crate::rt::idle::DeepIdle;
    use crate::rt::process::PacketHold;
    use crate::times::Percentiles;

    fn echoes(p99: f64, came: u32) -> Echoes {
        let times_us = Percentiles { p50: Some(p99), p99: Some(p99), p999: Some(p99), max: Some(2.0 * p99) };
        Echoes { sent: 100, came, times_us }
    }

    /// A laboratory's machine as it should be.
    fn good() -> Readings {
        let held = PacketHold { receive_us: 3, send_us: 3, is_adaptive: false };
        Readings {
            version: "6.12.8-rt".into(),
            is_realtime: true,
            core: 3,
            cores: 4,
            isolated: false,
            governor: Some("performance".into()),
            deep_idle: None,
            load: Some(0.4),
            network: Some(NetworkPath {
                interface: Some("eth1".into()),
                is_wireless: false,
                held: Some(held),
                echoes: Some(echoes(120.0, 100)),
            }),
        }
    }

    /// Checks that are a cause, with what was found.
    fn causes(change: impl FnOnce(&mut Readings, &mut NetworkPath)) -> Vec<(&'static str, String)> {
        let mut readings = good();
        let mut network = readings.network.take().expect("a network");
        change(&mut readings, &mut network);
        readings.network = Some(network);
        let findings = judge(&readings).into_iter();
        findings.filter(|f| f.delays_commands).map(|f| (f.check, f.found)).collect()
    }

    #[test]
    fn a_good_machine_has_no_cause_and_each_cause_is_found_by_itself() {
        assert_eq!(causes(|_, _| ()), []);
        let one = |found: Vec<(&'static str, String)>| {
            assert_eq!(found.len(), 1, "{found:?}");
            found.into_iter().next().expect("one")
        };
        let kernel = one(causes(|r, _| r.is_realtime = false));
        assert_eq!(kernel.0, "kernel");
        assert!(kernel.1.contains("shares core 3"), "{kernel:?}");
        assert!(one(causes(|r, _| (r.is_realtime, r.isolated) = (false, true))).1.contains("has core 3 for itself"));
        assert_eq!(one(causes(|r, _| r.governor = Some("powersave".into()))).1, "powersave on core 3");
        let denied = DeepIdle::from(rustix::io::Errno::ACCESS);
        assert_eq!(one(causes(|r, _| r.deep_idle = Some(denied))).0, "sleep states");
        assert_eq!(one(causes(|r, _| r.load = Some(3.2))).1, "3.2 on 4 cores over the last minute");
        assert_eq!(one(causes(|_, w| w.is_wireless = true)).1, "eth1 is wireless");
        let held = |receive_us, send_us| Some(PacketHold { receive_us, send_us, is_adaptive: false });
        assert_eq!(one(causes(|_, w| w.held = held(250, 0))).1, "eth1 keeps packets back for 250 us in and 0 us out");
        assert_eq!(one(causes(|_, w| w.held = held(0, 64))).0, "interface");
        assert_eq!(one(causes(|_, w| w.echoes = Some(echoes(450.0, 100)))).0, "round trip");
        assert_eq!(one(causes(|_, w| w.echoes = Some(echoes(100.0, 98)))).0, "round trip");
    }

    #[test]
    fn what_is_not_known_or_not_ideal_is_no_cause() {
        let nothing = NetworkPath { interface: None, is_wireless: false, held: None, echoes: None };
        assert_eq!(causes(|r, w| (r.governor, r.load, *w) = (None, None, nothing)), []);
        assert_eq!(causes(|_, w| w.echoes = Some(echoes(0.0, 0))), [], "a robot need not answer");
        let adaptive = PacketHold { receive_us: 20, send_us: 20, is_adaptive: true };
        assert_eq!(causes(|_, w| w.held = Some(adaptive)), []);
        assert_eq!(causes(|r, _| (r.cores, r.load) = (1, Some(0.9))), []);
    }

    #[test]
    fn without_a_robot_nothing_is_said_of_the_way_to_it() {
        let checks: Vec<_> = judge(&Readings { network: None, ..good() }).iter().map(|f| f.check).collect();
        assert_eq!(checks, ["kernel", "governor", "sleep states", "load"]);
    }
}
