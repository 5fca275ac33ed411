//! By which names the page may be opened. A name of somebody else that leads to this machine is none of them: a page of that
//! name's owner would otherwise count as this program's.

use shared_mem::input;
use std::net::{IpAddr, Ipv6Addr};
use std::path::Path;

/// Where the system says what this machine is called.
const OWN_NAME: &str = "/proc/sys/kernel/hostname";

/// Names and addresses by which the page may be opened.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Hosts {
    bound: IpAddr,
    /// In small letters.
    names: Vec<String>,
}

impl Hosts {
    /// Those of an address: itself, `localhost`, what this machine is called, and `names`.
    pub(super) fn of(bound: IpAddr, names: &[String]) -> Self {
        let own = input::text(Path::new(OWN_NAME), input::Kind::Configuration).unwrap_or_default();
        let all = ["localhost", own.trim()].into_iter().chain(names.iter().map(String::as_str));
        Self { bound, names: all.filter(|name| !name.is_empty()).map(spelt).collect() }
    }

    /// Whether a request's `Host` is one of them, with any port: a port may be led here from another one.
    pub(super) fn allow(&self, host: &str) -> bool {
        let Some(name) = without_port(host) else { return false };
        let bare = name.strip_prefix('[').and_then(|name| name.strip_suffix(']'));
        let address = match bare {
            Some(bare) => bare.parse::<Ipv6Addr>().ok().map(IpAddr::V6),
            None => name.parse::<IpAddr>().ok(),
        };
        // An address leads to no other machine than its own, whoever writes it; a name leads where its owner wants.
        address.is_some_and(|address| self.is_bound(address.to_canonical())) || self.names.contains(&spelt(name))
    }

    fn is_bound(&self, address: IpAddr) -> bool {
        let bound = self.bound.to_canonical();
        bound.is_unspecified() || address == bound || (bound.is_loopback() && address.is_loopback())
    }
}

/// As names are compared: in small letters, without the dot at the end.
fn spelt(name: &str) -> String {
    name.strip_suffix('.').unwrap_or(name).to_ascii_lowercase()
}

/// `NAME` of `NAME` or `NAME:PORT`.
fn without_port(host: &str) -> Option<&str> {
    let (name, port) = match host.rsplit_once(':') {
        // The colons of an address in brackets are no port's.
        Some((name, port)) if !port.ends_with(']') => (name, Some(port)),
        _ => (host, None),
    };
    let is_port = port.is_none_or(|port| port.bytes().all(|c| c.is_ascii_digit()) && port.parse::<u16>().is_ok());
    (is_port && !name.is_empty()).then_some(name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn own_addresses_and_names_are_allowed_and_no_name_that_only_leads_here() {
        let own = input::text(Path::new(OWN_NAME), input::Kind::Configuration).expect("a name");
        let own = format!("{}:8380", own.trim());
        let names = ["bench.lab.example", "10.1.2.3"].map(str::to_owned);
        for (bound, host, is_allowed) in [
            ("127.0.0.1", "127.0.0.1:8380", true),
            ("127.0.0.1", "127.0.0.1", true),
            ("127.0.0.1", "localhost:8380", true),
            ("127.0.0.1", "LocalHost", true),
            ("127.0.0.1", "[::1]:8380", true),
            ("::1", "[::1]", true),
            ("127.0.0.1", own.as_str(), true),
            ("127.0.0.1", "bench.lab.example:1", true),
            ("127.0.0.1", "192.168.1.5:8380", false),
            ("127.0.0.1", "localhost.example.org", false),
            ("127.0.0.1", "127.0.0.1.nip.io:80", false),
            ("127.0.0.1", "localhost:1@example.org", false),
            ("127.0.0.1", "localhost:99999", false),
            ("127.0.0.1", "localhost:", false),
            ("127.0.0.1", "", false),
            ("127.0.0.1", ":8380", false),
            ("192.168.1.5", "192.168.1.5:8380", true),
            ("192.168.1.5", "10.0.0.1:8380", false),
            ("192.168.1.5", "10.1.2.3:8380", true),
            ("192.168.1.5", "example.org:8380", false),
            ("192.168.1.5", own.as_str(), true),
            ("192.168.1.5", "BENCH.lab.example.:8380", true),
            ("0.0.0.0", "192.168.1.5:8380", true),
            ("0.0.0.0", "0.0.0.0:8380", true),
            ("0.0.0.0", "[fe80::1]:8380", true),
            ("0.0.0.0", "[fe80::1", false),
            ("0.0.0.0", "example.org:8380", false),
            ("::", "example.org", false),
            ("::ffff:10.0.0.1", "10.0.0.1", true),
        ] {
            let hosts = Hosts::of(bound.parse().expect("an address"), &names);
            assert_eq!(hosts.allow(host), is_allowed, "{host:?} at {bound}");
        }
    }
}
