//! Round trips to a host, by echo requests as `ping` sends them (RFC 792).

use crate::times::{Percentiles, Times};
use socket2::{Domain, Protocol, Socket, Type};
use std::io::Read as _;
use std::net::{Ipv4Addr, SocketAddrV4};
use std::thread;
use std::time::{Duration, Instant};

/// Requests of a measurement.
const REQUESTS: u16 = 100;
/// From one to the next.
const PAUSE: Duration = Duration::from_millis(2);
/// An answer that takes longer counts as lost.
const PATIENCE: Duration = Duration::from_millis(50);
/// Answers that may be lost one after the other before the host counts as silent.
const MOST_SILENCE: u16 = 5;
/// Kinds of messages.
const REQUEST: u8 = 8;
const REPLY: u8 = 0;
/// What a request carries, so that other programs' answers are not taken for ours.
const MARK: &[u8; 8] = b"twinalgn";
/// Kind, code, checksum, identifier, number.
const HEADER: usize = 8;

/// Echo requests and their answers.
#[derive(Debug, Clone)]
pub(super) struct Echoes {
    /// How many were sent.
    pub(super) sent: u32,
    /// How many came back in time.
    pub(super) came: u32,
    /// From sending to receiving [us].
    pub(super) times_us: Percentiles,
}

/// Sends requests and waits for each answer. `None` where this user may send none.
pub(super) fn round_trips(host: Ipv4Addr) -> Option<Echoes> {
    // Where users may not, the superuser may in another way.
    let socket = [Type::DGRAM, Type::RAW]
        .into_iter()
        .find_map(|kind| Socket::new(Domain::IPV4, kind, Some(Protocol::ICMPV4)).ok())?;
    socket.set_read_timeout(Some(PATIENCE)).ok()?;
    socket.connect(&SocketAddrV4::new(host, 0).into()).ok()?;
    let (mut times, mut sent, mut silent) = (Times::new(), 0, 0);
    for number in 0..REQUESTS {
        sent += 1;
        match round_trip(&socket, number) {
            Some(time) => {
                times.record(u64::try_from(time.as_nanos()).unwrap_or(u64::MAX));
                silent = 0;
            }
            None => silent += 1,
        }
        if silent == MOST_SILENCE {
            break;
        }
        thread::sleep(PAUSE);
    }
    Some(Echoes { sent, came: u32::try_from(times.count()).unwrap_or(u32::MAX), times_us: times.percentiles() })
}

fn round_trip(mut socket: &Socket, number: u16) -> Option<Duration> {
    let begin = Instant::now();
    socket.send(&request(number)).ok()?;
    let mut packet = [0; 128];
    while begin.elapsed() < PATIENCE {
        let length = socket.read(&mut packet).ok()?;
        if is_reply(packet.get(..length)?, number) {
            return Some(begin.elapsed());
        }
    }
    None
}

fn request(number: u16) -> [u8; HEADER + MARK.len()] {
    let mut packet = [0; HEADER + MARK.len()];
    packet[0] = REQUEST;
    packet[6..HEADER].copy_from_slice(&number.to_be_bytes());
    packet[HEADER..].copy_from_slice(MARK);
    let sum = checksum(&packet);
    packet[2..4].copy_from_slice(&sum.to_be_bytes());
    packet
}

/// The complement of the sum of 16-bit words in ones' complement.
fn checksum(packet: &[u8]) -> u16 {
    let words = packet.chunks(2).map(|pair| u32::from(pair[0]) << 8 | u32::from(pair.get(1).copied().unwrap_or(0)));
    let mut sum: u32 = words.sum();
    while sum > 0xffff {
        sum = (sum & 0xffff) + (sum >> 16);
    }
    !u16::try_from(sum).unwrap_or(0)
}

/// Whether a packet answers our request. What the superuser's sockets receive begins with the header of IP.
fn is_reply(packet: &[u8], number: u16) -> bool {
    let ip = packet.first().filter(|first| **first >> 4 == 4).map_or(0, |first| usize::from(first & 0xf) * 4);
    let Some(message) = packet.get(ip..) else { return false };
    message.first() == Some(&REPLY)
        && message.get(6..HEADER) == Some(&number.to_be_bytes())
        && message.get(HEADER..) == Some(MARK)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_request_sums_to_zero_and_only_its_own_answer_counts() {
        let mut packet = request(7);
        assert_eq!(checksum(&packet), 0);
        assert!(!is_reply(&packet, 7), "a request on the loopback is no answer");
        packet[0] = REPLY;
        assert!(is_reply(&packet, 7) && !is_reply(&packet, 8));
        let mut with_ip = vec![0x45];
        with_ip.resize(20, 0);
        with_ip.extend(packet);
        assert!(is_reply(&with_ip, 7));
        assert!(!is_reply(&[], 7) && !is_reply(&[0x4f], 7));
    }

    #[test]
    fn this_host_answers_itself_where_requests_may_be_sent() {
        let Some(echoes) = round_trips(Ipv4Addr::LOCALHOST) else { return };
        assert!(echoes.came > 0 && echoes.times_us.p99 > Some(0.0), "{echoes:?}");
    }
}
