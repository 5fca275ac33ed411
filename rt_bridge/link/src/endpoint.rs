//! Addresses as they are typed: `tcp/HOST:PORT`.

use std::fmt;
use std::str::FromStr;

/// A host and a port, over TCP.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Endpoint {
    /// Name, IPv4 address, or IPv6 address in brackets.
    host: String,
    port: u16,
}

impl Endpoint {
    /// Host and port.
    pub fn address(&self) -> String {
        format!("{}:{}", self.host, self.port)
    }
}

impl fmt::Display for Endpoint {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "tcp/{}", self.address())
    }
}

impl FromStr for Endpoint {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let wrong = |what: &str| format!("{what}; give tcp/HOST:PORT, for example tcp/192.168.1.20:7447");
        let Some(address) = text.strip_prefix("tcp/") else { return Err(wrong("it does not begin with tcp/")) };
        let Some((host, port)) = address.rsplit_once(':') else { return Err(wrong("there is no port")) };
        let port = port.parse().ok().filter(|port| *port > 0);
        let Some(port) = port else { return Err(wrong("the port is no number from 1 to 65535")) };
        let inside = host.strip_prefix('[').and_then(|host| host.strip_suffix(']'));
        let is_host = match inside {
            Some(v6) => v6.parse::<std::net::Ipv6Addr>().is_ok(),
            None => !host.is_empty() && host.bytes().all(|b| b.is_ascii_alphanumeric() || b == b'-' || b == b'.'),
        };
        if !is_host {
            return Err(wrong("the host is neither a name nor an address (IPv6 in brackets)"));
        }
        Ok(Self { host: host.to_owned(), port })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_and_addresses_with_a_port_are_taken_and_written_as_they_came() {
        for text in ["tcp/192.168.1.20:7447", "tcp/robot-host.lab:1", "tcp/[::1]:7447", "tcp/[::]:65535"] {
            assert_eq!(text.parse::<Endpoint>().map(|e| e.to_string()), Ok(text.to_owned()));
        }
    }

    #[test]
    fn what_is_no_address_is_refused_with_the_form() {
        let wrong = ["", "192.168.1.20:7447", "udp/a:1", "tcp/a", "tcp/:1", "tcp/a:0", "tcp/a:65536", "tcp/::1:7447"];
        // What the network would take for settings of its own is refused, too.
        for text in wrong.into_iter().chain(["tcp/a:1#iface=eth0", "tcp/a b:1", "tcp/[x]:1", "tcp/a?b:1"]) {
            let what = text.parse::<Endpoint>().expect_err(text);
            assert!(what.contains("tcp/HOST:PORT"), "{text}: {what}");
        }
    }
}
