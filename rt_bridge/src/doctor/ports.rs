//! What is plugged in: cameras, serial ports, CAN interfaces; and, where asked, whether gripper and force sensor answer.

use super::Finding;
use crate::device::{Device as _, DeviceFault};
use crate::gripper::GripperChoice;
use crate::wrench::{self, WrenchChoice};
use shared_mem::cell::Cell;
use std::fs;
use std::path::Path;

/// Longest time that a serial adapter may collect bytes before it hands them over [ms].
const GOOD_LATENCY_MS: u32 = 1;
/// Linux's number for network interfaces that are CAN buses.
const CAN: &str = "280";

/// Everything found below `root`, which is `/` but in tests.
pub(super) fn examine(root: &Path) -> Vec<Finding> {
    let mut findings = vec![cameras(root)];
    findings.extend(entries(&root.join("dev"), &["ttyUSB", "ttyACM"]).iter().map(|name| serial(root, name)));
    let networks = root.join("sys/class/net");
    findings.extend(entries(&networks, &[""]).iter().filter_map(|name| can(&networks.join(name), name)));
    findings
}

/// Names in a folder that begin with one of `starts`, sorted.
fn entries(folder: &Path, starts: &[&str]) -> Vec<String> {
    let entries = fs::read_dir(folder).into_iter().flatten().filter_map(Result::ok);
    let names = entries.map(|e| e.file_name().to_string_lossy().into_owned());
    let mut names: Vec<_> = names.filter(|name| starts.iter().any(|start| name.starts_with(start))).collect();
    names.sort();
    names
}

fn cameras(root: &Path) -> Finding {
    let found = entries(&root.join("dev"), &["video"]);
    Finding::ok("cameras", if found.is_empty() { "none".into() } else { found.join(", ") })
}

fn serial(root: &Path, name: &str) -> Finding {
    use rustix::fs::{Access, access};
    if access(root.join("dev").join(name), Access::READ_OK | Access::WRITE_OK).is_err() {
        let remedy = "add yourself to the group `dialout` and log in again";
        return Finding::warning("serial port", format!("/dev/{name} is not yours to use"), remedy);
    }
    // Only adapters that collect bytes have the file.
    let timer = root.join("sys/bus/usb-serial/devices").join(name).join("latency_timer");
    match fs::read_to_string(&timer).ok().and_then(|text| text.trim().parse::<u32>().ok()) {
        Some(ms) if ms > GOOD_LATENCY_MS => Finding::warning(
            "serial port",
            format!("/dev/{name} keeps bytes back for {ms} ms"),
            format!("set it with `echo 1 > /sys/bus/usb-serial/devices/{name}/latency_timer`"),
        ),
        _ => Finding::ok("serial port", format!("/dev/{name}")),
    }
}

/// A CAN interface; `None` for other networks.
fn can(folder: &Path, name: &str) -> Option<Finding> {
    let read = |file: &str| fs::read_to_string(folder.join(file)).unwrap_or_default().trim().to_owned();
    if read("type") != CAN {
        return None;
    }
    let flags = u32::from_str_radix(read("flags").trim_start_matches("0x"), 16).unwrap_or(0);
    Some(match (flags & 1 == 1, read("operstate").as_str()) {
        (false, _) => {
            let remedy = format!("bring it up with `ip link set {name} up type can bitrate 1000000`");
            Finding::warning("CAN", format!("{name} is down"), remedy)
        }
        (true, "down") => {
            let remedy = format!("check bit rate and termination, then `ip link set {name} down` and `up`");
            Finding::warning("CAN", format!("{name} is up but its bus is off"), remedy)
        }
        (true, _) => Finding::ok("CAN", format!("{name} is up")),
    })
}

/// Whether a gripper answers. It is not moved.
pub(super) fn gripper(choice: &GripperChoice, cell: &Cell) -> Finding {
    let asked = choice.open(cell).and_then(|opened| {
        let Some(mut gripper) = opened else { return Ok(None) };
        loop {
            if let Some(state) = gripper.round(None)? {
                return Ok(Some((state, gripper.complaint())));
            }
        }
    });
    match asked {
        Err(fault) => fault_finding("gripper", &fault),
        Ok(None) => Finding::ok("gripper", "none was named"),
        Ok(Some((_, Some(complaint)))) => reported("gripper", &format!("{choice} {complaint}")),
        Ok(Some((state, None))) => {
            Finding::ok("gripper", format!("{choice} answers; its fingers are {:.1} mm apart", 1e3 * state.width))
        }
    }
}

/// Whether a force sensor answers.
pub(super) fn wrench(choice: &WrenchChoice, cell: &Cell) -> Finding {
    let WrenchChoice::Can(interface) = choice else {
        return Finding::ok("force sensor", format!("{choice}: nothing to reach"));
    };
    match wrench::probe(interface, cell) {
        Err(fault) => fault_finding("force sensor", &fault),
        Ok(sample) => {
            let [x, y, z] = sample.force;
            Finding::ok("force sensor", format!("{choice} answers; it feels {x:.1}, {y:.1}, {z:.1} N"))
        }
    }
}

fn fault_finding(check: &'static str, fault: &DeviceFault) -> Finding {
    reported(check, &fault.to_string())
}

/// A sentence whose remedy stands behind its first semicolon.
fn reported(check: &'static str, text: &str) -> Finding {
    let (found, remedy) = text.split_once("; ").unwrap_or((text, "see docs/devices.md"));
    Finding::problem(check, found, remedy)
}

#[cfg(test)]
mod tests {
    use super::super::Verdict;
    use super::*;

    fn write(root: &Path, file: &str, text: &str) {
        let path = root.join(file);
        fs::create_dir_all(path.parent().expect("a folder")).expect("a folder can be made");
        fs::write(path, text).expect("a file can be written");
    }

    #[test]
    fn each_port_is_told_with_what_would_make_it_better() {
        let folder = tempfile::tempdir().expect("a folder");
        let root = folder.path();
        write(root, "dev/video0", "");
        write(root, "dev/ttyUSB0", "");
        write(root, "dev/ttyACM0", "");
        write(root, "sys/bus/usb-serial/devices/ttyUSB0/latency_timer", "16\n");
        for (name, kind, flags, state) in
            [("can0", "280", "0x40080", "down"), ("can1", "280", "0x400c1", "up"), ("can2", "280", "0x400c1", "down")]
        {
            for (file, text) in [("type", kind), ("flags", flags), ("operstate", state)] {
                write(root, &format!("sys/class/net/{name}/{file}"), text);
            }
        }
        write(root, "sys/class/net/eth0/type", "1");
        let found: Vec<_> = examine(root).iter().map(|f| (f.verdict, f.found.clone())).collect();
        let (ok, warning) = (Verdict::Ok, Verdict::Warning);
        let expected = [
            (ok, "video0"),
            (ok, "/dev/ttyACM0"),
            (warning, "/dev/ttyUSB0 keeps bytes back for 16 ms"),
            (warning, "can0 is down"),
            (ok, "can1 is up"),
            (warning, "can2 is up but its bus is off"),
        ];
        assert_eq!(found, expected.map(|(verdict, found)| (verdict, found.to_owned())));
    }

    #[test]
    fn what_does_not_answer_is_a_problem_with_its_remedy() {
        let cell = Cell::default();
        let finding = gripper(&"serial:///dev/no-such-port".parse().expect("a gripper"), &cell);
        assert_eq!(finding.verdict, Verdict::Problem);
        assert!(finding.remedy.expect("a remedy").contains("by-id"));
        assert_eq!(wrench(&"can://nosuchcan".parse().expect("a sensor"), &cell).verdict, Verdict::Problem);
        assert_eq!(gripper(&GripperChoice::Sim, &cell).verdict, Verdict::Ok);
    }
}
