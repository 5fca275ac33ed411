//! Stamps that are written as dates or as times of a day: `2026-05-04T09:15:00.25Z`, `09:15:00.25`.

use super::Text;

const DAY_NS: u64 = 86_400_000_000_000;

/// Takes the first column of words that are moments, and rise, as the stamps of the rows, where the table has no others.
pub(super) fn take(table: &mut Text) {
    if table.stamps_ns.is_some() {
        return;
    }
    let found = table.words.iter().enumerate().find_map(|(at, (_, cells))| Some((at, stamps(cells)?)));
    let Some((at, stamps)) = found else { return };
    let (name, _) = table.words.remove(at);
    table.warnings.push(format!("`{name}` holds dates or times of a day: the stamps of the rows"));
    table.stamps_ns = Some(stamps);
}

/// Moments that rise [ns].
fn stamps(cells: &[String]) -> Option<Vec<u64>> {
    let mut days = 0;
    let mut stamps: Vec<u64> = Vec::new();
    for cell in cells {
        let (moment, has_date) = moment(cell.trim())?;
        // A time of a day that falls by half a day and more is one of the next.
        if !has_date && stamps.last().is_some_and(|last| moment + days * DAY_NS + DAY_NS / 2 < *last) {
            days += 1;
        }
        stamps.push(moment + days * DAY_NS);
    }
    let rising = stamps.windows(2).filter(|w| w[1] > w[0]).count();
    (stamps.len() > 2 && rising * 10 >= 9 * (stamps.len() - 1)).then_some(stamps)
}

/// A moment [ns], since 1970 where it has a date, else since midnight; and whether it has one.
fn moment(cell: &str) -> Option<(u64, bool)> {
    let (date, time) = match cell.split_once(['T', ' ']) {
        Some((date, time)) => (Some(date), time.trim()),
        None => (None, cell),
    };
    let time = time.trim_end_matches(['Z', 'z']);
    let (time, offset) = match time.rfind(['+', '-']).map(|at| time.split_at(at)) {
        Some((time, offset)) => (time, minutes(offset)?),
        None => (time, 0),
    };
    let mut parts = time.split(':');
    let (hours, minutes, seconds) = (parts.next()?, parts.next()?, parts.next()?);
    let (hours, minutes): (u64, u64) = (hours.trim().parse().ok()?, minutes.parse().ok()?);
    let (whole, rest) = seconds.split_once(['.', ',']).unwrap_or((seconds, ""));
    let whole: u64 = whole.parse().ok()?;
    let is_number = rest.len() <= 9 && rest.bytes().all(|byte| byte.is_ascii_digit());
    if parts.next().is_some() || hours > 23 || minutes > 59 || whole > 60 || !is_number {
        return None;
    }
    let rest: u64 = format!("{rest:0<9}").parse().ok()?;
    let of_day = ((hours * 60 + minutes) * 60 + whole) * 1_000_000_000 + rest;
    let Some(date) = date else { return Some((of_day, false)) };
    let days = days(date)? * DAY_NS as i128 - i128::from(offset) * 60_000_000_000;
    u64::try_from(days + i128::from(of_day)).ok().map(|moment| (moment, true))
}

/// How far a place is ahead of Greenwich, `+02:00` [min].
fn minutes(offset: &str) -> Option<i64> {
    let (sign, rest) = offset.split_at_checked(1)?;
    let digits: String = rest.chars().filter(|c| *c != ':').collect();
    let number: i64 = digits.parse().ok()?;
    let minutes = match digits.len() {
        2 => number * 60,
        4 => number / 100 * 60 + number % 100,
        _ => return None,
    };
    Some(if sign == "-" { -minutes } else { minutes })
}

/// Days of a date since 1970 in the Gregorian calendar.
fn days(date: &str) -> Option<i128> {
    let mut parts = date.split(['-', '/']).map(str::parse::<i128>);
    let (year, month, day) = (parts.next()?.ok()?, parts.next()?.ok()?, parts.next()?.ok()?);
    if parts.next().is_some() || !(1970..3000).contains(&year) || !(1..=12).contains(&month) || !(1..=31).contains(&day)
    {
        return None;
    }
    // Years begin in March, so that the odd day stands at the end of one.
    let (year, month) = if month > 2 { (year, month - 3) } else { (year - 1, month + 9) };
    let of_years = 365 * year + year / 4 - year / 100 + year / 400;
    Some(of_years + (153 * month + 2) / 5 + day - 1 - 719_468)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dates_and_times_of_a_day_are_moments() {
        for (cell, expected) in [
            ("1970-01-01T00:00:00Z", Some((0, true))),
            ("1970-01-02 00:00:01.5", Some((86_401_500_000_000, true))),
            ("2026-11-28T22:05:50.25+00:00", Some((1_795_903_550_250_000_000, true))),
            ("2026-11-29T00:05:50.25+02:00", Some((1_795_903_550_250_000_000, true))),
            ("00:01:00,002", Some((60_002_000_000, false))),
            ("arm", None),
            ("1:2", None),
        ] {
            assert_eq!(moment(cell), expected, "{cell}");
        }
        let cells = |list: [&str; 3]| list.map(str::to_owned);
        let midnight = stamps(&cells(["23:59:59.5", "00:00:00.0", "00:00:00.5"])).expect("stamps");
        assert_eq!(midnight[2] - midnight[0], 1_000_000_000);
        assert_eq!(stamps(&cells(["10:00:00", "09:00:00", "08:00:00"])), None);
    }
}
