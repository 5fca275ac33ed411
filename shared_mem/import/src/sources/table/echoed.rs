//! Stamps of tables that ROS programs print: one column of nanoseconds under `%time` (`rostopic echo -p`), or seconds and
//! nanoseconds in two (`ros2 topic echo --csv`, and others that write a message field by field).

use super::cells::Cells;

/// How a table says its time.
enum Clock {
    /// Column of nanoseconds.
    Nanoseconds(usize),
    /// Columns of seconds and of the nanoseconds of each.
    Parts(usize, usize),
}

/// Stamps of the rows [ns]; `None` where a table does not come from such a program.
pub(super) fn stamps(cells: &Cells, warnings: &mut Vec<String>) -> Option<Vec<u64>> {
    let rises = |stamps: &[u64]| share(stamps, |before, stamp| stamp > before) >= 0.9;
    let read = |clock: &Clock| clock.read(cells).filter(|stamps| rises(stamps));
    let (clock, stamps) = candidates(cells).into_iter().find_map(|clock| read(&clock).map(|stamps| (clock, stamps)))?;
    if let Clock::Parts(seconds, rest) = clock {
        let name = |at: usize| match &cells.names {
            Some(names) => names.get(at).cloned().unwrap_or_default(),
            None => format!("column[{}]", at + 1),
        };
        warnings.push(format!(
            "`{}` and `{}` are seconds and nanoseconds: together the stamps of the rows",
            name(seconds),
            name(rest)
        ));
    }
    Some(stamps)
}

impl Clock {
    fn read(&self, cells: &Cells) -> Option<Vec<u64>> {
        let of = |column: usize| -> Option<Vec<u64>> {
            (0..cells.rows()).map(|row| cells.at(row, column).parse().ok()).collect()
        };
        match *self {
            Self::Nanoseconds(column) => of(column),
            Self::Parts(seconds, rest) => {
                let (seconds, rest) = (of(seconds)?, of(rest)?);
                // A counter beside counts of an encoder is no clock: seconds repeat, and few parts of one are below a millisecond.
                let is_clock = share(&seconds, |before, second| second == before) >= 0.5
                    && rest.iter().all(|rest| *rest < 1_000_000_000)
                    && 2 * rest.iter().filter(|rest| **rest >= 1_000_000).count() >= rest.len();
                let stamp = |(second, rest): (&u64, &u64)| second.checked_mul(1_000_000_000)?.checked_add(*rest);
                seconds.iter().zip(&rest).map(stamp).collect::<Option<_>>().filter(|_| is_clock)
            }
        }
    }
}

/// The share of the steps from one number to the next of which something holds; 0 where there is none.
fn share(numbers: &[u64], holds: fn(u64, u64) -> bool) -> f64 {
    let steps = numbers.windows(2).filter(|pair| holds(pair[0], pair[1])).count();
    steps as f64 / numbers.len().saturating_sub(1).max(1) as f64
}

/// Whether a table that begins with these bytes may hold one topic of a run whose other topics stand in tables beside it.
pub(in crate::sources) fn may_be_echoed(start: &[u8]) -> bool {
    let text = String::from_utf8_lossy(start);
    let mut cells = text.split(',').map(|cell| cell.parse::<u64>().ok());
    let is_clock = |seconds: u64, rest: u64| seconds >= 1_000_000 && rest < 1_000_000_000;
    text.starts_with("%time,")
        || cells.next().flatten().zip(cells.next().flatten()).is_some_and(|(seconds, rest)| is_clock(seconds, rest))
}

/// Where the stamps may stand, the better ones first: a message's own are those of the measurement.
fn candidates(cells: &Cells) -> Vec<Clock> {
    let Some(names) = &cells.names else {
        return if cells.width > 2 { vec![Clock::Parts(0, 1)] } else { Vec::new() };
    };
    let column = |name: &str| names.iter().position(|other| other == name);
    if cells.is_echoed {
        return ["field.header.stamp", "time"].iter().filter_map(|name| column(name)).map(Clock::Nanoseconds).collect();
    }
    let parts = names.iter().enumerate().filter_map(|(at, name)| {
        let name = name.to_ascii_lowercase();
        let [rest, seconds] = [&["nanosec", "nsec", "nsecs"][..], &["sec", "sec", "secs"][..]];
        let (ending, partner) = rest.iter().zip(seconds).find(|(ending, _)| name.ends_with(*ending))?;
        let wanted = format!("{}{partner}", name.strip_suffix(ending)?);
        let seconds = names.iter().position(|other| other.to_ascii_lowercase() == wanted)?;
        Some(Clock::Parts(seconds, at))
    });
    parts.collect()
}
