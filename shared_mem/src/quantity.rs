//! Numbers with a unit, as they are typed: finite, in a range, and refused with the range and the unit.

use std::ops::RangeInclusive;
use std::time::Duration;

/// Shortest and longest time that can be asked for [s]: a millisecond to some four months.
const TIMES: RangeInclusive<f64> = 1e-3..=1e7;

/// A number in `range`; `unit` is what the refusal calls it, for example `m`, or nothing for a plain number.
///
/// # Errors
/// One sentence with the range and the unit, for text that is no number, not finite or outside.
///
/// # Example
/// ```
/// use shared_mem::quantity::number;
///
/// assert_eq!(number("0.03", 0.0..=0.5, "m"), Ok(0.03));
/// assert_eq!(number("3 cm", 0.0..=0.5, "m"), Err("give a number from 0 to 0.5 [m]".into()));
/// ```
pub fn number(text: &str, range: RangeInclusive<f64>, unit: &str) -> Result<f64, String> {
    match text.trim().parse::<f64>() {
        Ok(number) if range.contains(&number) => Ok(number),
        _ => {
            let unit = if unit.is_empty() { String::new() } else { format!(" [{unit}]") };
            Err(format!("give a number from {} to {}{unit}", range.start(), range.end()))
        }
    }
}

/// A length of time in seconds.
///
/// # Errors
/// As [`number`].
pub fn seconds(text: &str) -> Result<Duration, String> {
    number(text, TIMES, "s").map(Duration::from_secs_f64)
}

/// Exactly `N` numbers in `range` with commas between them.
///
/// # Errors
/// As [`number`]; and how many there must be.
///
/// # Example
/// ```
/// use shared_mem::quantity::numbers;
///
/// assert_eq!(numbers::<2>("20, 0.3", 0.0..=180.0, ""), Ok([20.0, 0.3]));
/// assert!(numbers::<2>("20", 0.0..=180.0, "").is_err());
/// ```
pub fn numbers<const N: usize>(text: &str, range: RangeInclusive<f64>, unit: &str) -> Result<[f64; N], String> {
    let numbers: Result<Vec<f64>, String> = text.split(',').map(|part| number(part, range.clone(), unit)).collect();
    numbers?.try_into().map_err(|_| format!("give {N} numbers with commas between them"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_number_outside_of_its_range_is_refused_with_range_and_unit() {
        assert_eq!(number(" 0.03 ", 0.0..=0.5, "m"), Ok(0.03));
        for wrong in ["30", "-0.1", "nan", "inf", "1e400", "", "3 cm"] {
            assert_eq!(number(wrong, 0.0..=0.5, "m"), Err("give a number from 0 to 0.5 [m]".into()), "{wrong}");
        }
        assert_eq!(number("11", 0.05..=10.0, ""), Err("give a number from 0.05 to 10".into()));
    }

    #[test]
    fn a_time_is_a_positive_number_of_seconds() {
        assert_eq!(seconds("0.5"), Ok(Duration::from_millis(500)));
        for wrong in ["", "ten", "0", "-1", "nan", "inf", "1e9"] {
            assert_eq!(seconds(wrong), Err("give a number from 0.001 to 10000000 [s]".into()), "{wrong}");
        }
    }

    #[test]
    fn numbers_are_counted() {
        assert_eq!(numbers::<2>("20, 0.3", 0.0..=180.0, ""), Ok([20.0, 0.3]));
        for wrong in ["20", "1,2,3", "1,", "1,nan", "1,200"] {
            assert!(numbers::<2>(wrong, 0.0..=180.0, "").is_err(), "{wrong}");
        }
    }
}
