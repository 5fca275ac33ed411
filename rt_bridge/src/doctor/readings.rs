//! What is read of this machine and of the way to the robot, for `communication` to judge.

use super::echo::{self, Echoes};
use crate::rt::idle::{DeepIdle, ShallowIdle};
use crate::rt::process::{self, PacketHold};
use std::fs;
use std::net::{IpAddr, Ipv4Addr, ToSocketAddrs as _};
use std::path::Path;

/// The robot's port, where its address names none: only to resolve the name.
const PORT: u16 = 1337;

/// Of the machine.
#[derive(Debug, Clone)]
pub(super) struct Readings {
    pub(super) version: String,
    /// It is PREEMPT_RT.
    pub(super) is_realtime: bool,
    /// The control thread's core.
    pub(super) core: usize,
    /// Cores that this process may use.
    pub(super) cores: usize,
    /// The scheduler keeps other programs off the control thread's core.
    pub(super) isolated: bool,
    /// Of that core's frequency; none where this system does not set it.
    pub(super) governor: Option<String>,
    /// Why the bridge cannot keep processors out of deep sleep; none where it can.
    pub(super) deep_idle: Option<DeepIdle>,
    /// Programs that ran or waited to, over the last minute.
    pub(super) load: Option<f64>,
    /// To the robot, where one is named.
    pub(super) network: Option<NetworkPath>,
}

/// Of the network between this machine and the robot.
#[derive(Debug, Clone)]
pub(super) struct NetworkPath {
    /// Name of the network interface.
    pub(super) interface: Option<String>,
    /// It is one.
    pub(super) is_wireless: bool,
    /// How long it keeps packets back; none where it cannot.
    pub(super) held: Option<PacketHold>,
    /// What came back; none where none may be sent.
    pub(super) echoes: Option<Echoes>,
}

/// Reads below `root`, which is `/` but in tests. `robot`: its address, with or without port.
pub(super) fn read(root: &Path, robot: Option<&str>) -> Readings {
    let text = |path: &str| fs::read_to_string(root.join(path)).ok().map(|text| text.trim().to_owned());
    let core = process::last_core().unwrap_or(0);
    let processors = "sys/devices/system/cpu";
    Readings {
        version: text("proc/sys/kernel/osrelease").unwrap_or_default(),
        is_realtime: text("sys/kernel/realtime").as_deref() == Some("1"),
        core,
        cores: std::thread::available_parallelism().map_or(1, usize::from),
        isolated: text(&format!("{processors}/isolated")).is_some_and(|list| holds(&list, core)),
        governor: text(&format!("{processors}/cpu{core}/cpufreq/scaling_governor")),
        deep_idle: ShallowIdle::hold().err(),
        load: text("proc/loadavg").and_then(|line| line.split(' ').next()?.parse().ok()),
        network: robot.map(|robot| network(root, robot)),
    }
}

fn network(root: &Path, robot: &str) -> NetworkPath {
    let address = address(robot);
    let table = fs::read_to_string(root.join("proc/net/route")).unwrap_or_default();
    let interface = address.and_then(|address| interface_to(address, &table));
    let folder = interface.as_ref().map(|name| root.join("sys/class/net").join(name).join("wireless"));
    NetworkPath {
        is_wireless: folder.is_some_and(|folder| folder.exists()),
        held: interface.as_deref().and_then(|name| process::packet_hold(name).ok()),
        echoes: address.and_then(echo::round_trips),
        interface,
    }
}

/// The robot's address; none where its name is not known or it has none of version 4.
fn address(robot: &str) -> Option<Ipv4Addr> {
    let found = robot.to_socket_addrs().or_else(|_| (robot, PORT).to_socket_addrs());
    found.ok()?.find_map(|socket| match socket.ip() {
        IpAddr::V4(address) => Some(address),
        IpAddr::V6(_) => None,
    })
}

/// The interface by which packets to `address` leave, by the kernel's table `/proc/net/route`: of the routes that fit, the one
/// with the longest mask.
fn interface_to(address: Ipv4Addr, table: &str) -> Option<String> {
    if address.is_loopback() {
        return Some("lo".into());
    }
    let routes = table.lines().skip(1).filter_map(|line| {
        let columns: Vec<&str> = line.split_whitespace().collect();
        let number = |column: usize| u32::from_str_radix(columns.get(column)?, 16).ok();
        // As they lie in memory: the address's first byte is the lowest.
        let (target, mask) = (number(1)?, number(7)?);
        let fits = u32::from_le_bytes(address.octets()) & mask == target;
        fits.then(|| (mask.count_ones(), columns.first().copied().unwrap_or_default().to_owned()))
    });
    routes.max_by_key(|(bits, _)| *bits).map(|(_, name)| name)
}

/// Whether a list of Linux, such as `2-3,7`, holds a number.
fn holds(list: &str, number: usize) -> bool {
    list.split(',').any(|part| {
        let (first, last) = part.split_once('-').unwrap_or((part, part));
        matches!((first.parse::<usize>(), last.parse::<usize>()), (Ok(first), Ok(last)) if (first..=last).contains(&number))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_route_with_the_longest_mask_names_the_interface() {
        let table = "Iface\tDestination\tGateway\tFlags\tRefCnt\tUse\tMetric\tMask\tMTU\tWindow\tIRTT\n\
            wlan0\t00000000\t0100A8C0\t0003\t0\t0\t600\t00000000\t0\t0\t0\n\
            eth1\t000010AC\t00000000\t0001\t0\t0\t100\t00FFFFFF\t0\t0\t0\n";
        let to = |address: &str| interface_to(address.parse().expect("an address"), table);
        assert_eq!(to("172.16.0.2").as_deref(), Some("eth1"));
        assert_eq!(to("172.16.1.2").as_deref(), Some("wlan0"));
        assert_eq!(to("127.0.0.1").as_deref(), Some("lo"));
        assert_eq!(interface_to(Ipv4Addr::new(172, 16, 0, 2), ""), None);
    }

    #[test]
    fn lists_of_processors_are_read_as_linux_writes_them() {
        assert!(holds("2-3,7", 3) && holds("2-3,7", 7));
        assert!(!holds("2-3,7", 4) && !holds("", 0));
    }

    #[test]
    fn a_machine_is_read_from_its_files() {
        let folder = tempfile::tempdir().expect("a folder");
        let core = process::last_core().unwrap_or(0);
        let write = |file: &str, text: &str| {
            let path = folder.path().join(file);
            fs::create_dir_all(path.parent().expect("a folder")).expect("a folder can be made");
            fs::write(path, text).expect("a file can be written");
        };
        write("proc/sys/kernel/osrelease", "6.12.8-rt\n");
        write("sys/kernel/realtime", "1\n");
        write("sys/devices/system/cpu/isolated", &format!("{core}\n"));
        write(&format!("sys/devices/system/cpu/cpu{core}/cpufreq/scaling_governor"), "powersave\n");
        write("proc/loadavg", "1.25 0.80 0.40 2/99 15017\n");
        let readings = read(folder.path(), None);
        assert_eq!((readings.version.as_str(), readings.is_realtime, readings.isolated), ("6.12.8-rt", true, true));
        assert_eq!((readings.governor.as_deref(), readings.load), (Some("powersave"), Some(1.25)));
        assert!(readings.network.is_none());
    }

    #[test]
    fn a_host_is_an_address_with_or_without_a_port() {
        assert_eq!(address("127.0.0.1"), Some(Ipv4Addr::LOCALHOST));
        assert_eq!(address("127.0.0.1:1340"), Some(Ipv4Addr::LOCALHOST));
    }
}
