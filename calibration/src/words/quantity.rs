//! Numbers for people: SI prefixes where they help, as many digits as the interval allows, never an exponent that can be avoided.

/// What stands for infinity at the end of an interval of what fades out towards it: JSON has no such number.
pub const UNBOUNDED: f64 = 1e9;

/// How a unit is shown: factor from SI, and the name.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Unit {
    factor: f64,
    name: String,
}

impl Unit {
    /// The prefix that suits values up to `largest` (in SI): `rad` becomes `mrad`, `m` becomes `mm`, `s` becomes `ms`; shares are asked for by `%`.
    pub(crate) fn suited(si: &str, largest: f64) -> Self {
        let largest = largest.abs();
        let name = si.to_owned();
        match si {
            "%" => Self { factor: 100.0, name },
            "1" | "" => Self { factor: 1.0, name: String::new() },
            "rad" | "m" | "s" if largest > 0.0 && largest < 1e-4 => Self { factor: 1e6, name: format!("\u{b5}{si}") },
            "rad" | "m" | "s" | "rad/s" | "m/s" if largest < 0.4 => Self { factor: 1e3, name: format!("m{si}") },
            _ => Self { factor: 1.0, name },
        }
    }

    /// The value in this unit, as a number.
    pub(crate) fn scaled(&self, si: f64) -> f64 {
        self.factor * si
    }

    /// Name with prefix; empty for pure numbers.
    pub(crate) fn name(&self) -> &str {
        &self.name
    }

    /// The value with its unit.
    pub(crate) fn with_unit(&self, si: f64) -> String {
        self.attach(&short(self.scaled(si)))
    }

    /// The value with its interval and unit, with no more digits than the interval deserves: `11.9 [11.2, 12.6] ms`.
    pub(crate) fn interval(&self, si: f64, [lo, hi]: [f64; 2]) -> String {
        if hi >= UNBOUNDED && si < UNBOUNDED {
            return self.attach(&format!("{} [{}, \u{221e}]", short(self.scaled(si)), short(self.scaled(lo))));
        }
        let [value, lo, hi] = [si, lo, hi].map(|x| self.scaled(x));
        if !(lo.is_finite() && hi.is_finite() && hi > lo) {
            return self.attach(&short(value));
        }
        // Numbers far from 1 share a power of ten: `1.45 [1.07, 2.23]` and the power.
        let exponent = value.abs().max(lo.abs()).log10().floor();
        let exponent = if (-4.0..5.0).contains(&exponent) || !exponent.is_finite() { 0.0 } else { exponent };
        let [value, lo, hi] = [value, lo, hi].map(|x| x / 10_f64.powf(exponent));
        let size = value.abs().max(lo.abs());
        let digits = digits_for(if size > 0.0 { (hi - lo).min(size) } else { hi - lo });
        let text = format!("{} [{}, {}]", fixed(value, digits), fixed(lo, digits), fixed(hi, digits));
        self.attach(&if exponent == 0.0 { text } else { format!("{text}{}", times_ten_to(exponent as i32)) })
    }

    fn attach(&self, text: &str) -> String {
        if self.name.is_empty() { text.to_owned() } else { format!("{text} {}", self.name) }
    }
}

/// A value in SI with the prefix that suits it: `2.13 mrad`.
pub fn in_unit(si: &str, value: f64) -> String {
    Unit::suited(si, value).with_unit(value)
}

/// A number with three digits that count, two where it is small: `1.23`, `0.0042`, `1230`; `-` where there is none.
pub(crate) fn short(value: f64) -> String {
    if !value.is_finite() {
        return "-".into();
    }
    let size = value.abs();
    match size {
        0.0 => "0".into(),
        _ if !(1e-5..1e6).contains(&size) => power(value),
        _ if size < 0.1 => fixed(value, (1.0 - size.log10().floor()) as usize),
        _ => fixed(value, (2.0 - size.log10().floor()).max(0.0) as usize),
    }
}

/// Digits behind the point that an interval of this length deserves: one step is a twentieth to a half of half its length.
fn digits_for(length: f64) -> usize {
    (-(length / 6.0).log10().floor()).clamp(0.0, 9.0) as usize
}

/// With so many digits behind the point, and no minus before a zero.
fn fixed(value: f64, digits: usize) -> String {
    let text = format!("{value:.digits$}");
    let zero = text.trim_start_matches('-').chars().all(|c| c == '0' || c == '.');
    if zero { text.trim_start_matches('-').to_owned() } else { text }
}

/// `1.2e-7` as `1.2\u{b7}10\u{207b}\u{2077}`.
pub(crate) fn power(value: f64) -> String {
    let text = format!("{value:.1e}");
    let (mantissa, exponent) = text.split_once('e').unwrap_or((&text, "0"));
    format!("{}{}", mantissa.trim_end_matches(".0"), times_ten_to(exponent.parse().unwrap_or(0)))
}

/// `\u{b7}10\u{207b}\u{2077}`.
fn times_ten_to(exponent: i32) -> String {
    let raised = exponent
        .to_string()
        .chars()
        .map(|c| match c {
            '-' => '\u{207b}',
            '1' => '\u{b9}',
            '2' => '\u{b2}',
            '3' => '\u{b3}',
            digit => char::from_u32(0x2070 + digit.to_digit(10).unwrap_or(0)).unwrap_or(digit),
        })
        .collect::<String>();
    format!("\u{b7}10{raised}")
}

/// Smallest and largest of the finite values; `[0, 0]` without any.
pub(crate) fn span(values: impl Iterator<Item = f64>) -> [f64; 2] {
    values
        .filter(|value| value.is_finite())
        .map(|value| [value, value])
        .reduce(|[lo, hi], [value, _]| [lo.min(value), hi.max(value)])
        .unwrap_or([0.0, 0.0])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn small_lengths_and_angles_are_told_in_thousandths() {
        assert_eq!(Unit::suited("rad", 0.0021).with_unit(0.002_134), "2.13 mrad");
        assert_eq!(Unit::suited("m", 0.0139).with_unit(0.0139), "13.9 mm");
        assert_eq!(Unit::suited("s", 1.2).with_unit(1.2), "1.20 s");
        assert_eq!(Unit::suited("N m/rad", 600.0).with_unit(600.0), "600 N m/rad");
        assert_eq!(Unit::suited("1", 0.3).with_unit(0.3), "0.300");
        assert_eq!(Unit::suited("rad", 3e-5).with_unit(3e-5), "30.0 \u{b5}rad");
    }

    #[test]
    fn digits_follow_the_interval() {
        let ms = Unit::suited("s", 0.012);
        assert_eq!(ms.interval(0.011_93, [0.011_21, 0.012_58]), "11.9 [11.2, 12.6] ms");
        assert_eq!(Unit::suited("N m/rad", 600.0).interval(597.8, [560.0, 640.0]), "598 [560, 640] N m/rad");
        let stiff = Unit::suited("N m/rad", 1e6).interval(1.4499e6, [1.0747e6, 2.2273e6]);
        assert_eq!(stiff, "1.4 [1.1, 2.2]\u{b7}10\u{2076} N m/rad");
        assert_eq!(ms.interval(0.012, [f64::NAN, 0.013]), "12.0 ms");
        assert_eq!(Unit::suited("%", 1.0).interval(0.0, [0.0, 0.7076]), "0 [0, 71] %");
        assert_eq!(Unit::suited("m", 0.001).interval(-0.000_001, [-0.001, 0.001]), "0.0 [-1.0, 1.0] mm");
    }

    #[test]
    fn an_interval_that_does_not_end_says_so() {
        assert_eq!(Unit::suited("m", 7.0).interval(7.0, [0.0, UNBOUNDED]), "7.00 [0, \u{221e}] m");
    }

    #[test]
    fn no_number_is_left_that_a_person_cannot_read() {
        assert_eq!(short(0.0), "0");
        assert_eq!(short(f64::NAN), "-");
        assert_eq!(short(1.2e-7), "1.2\u{b7}10\u{207b}\u{2077}");
        assert_eq!(short(123.4), "123");
    }

    #[test]
    fn what_is_no_number_has_no_part_in_a_span() {
        assert_eq!(span([f64::NAN, 2.0, -1.0].into_iter()), [-1.0, 2.0]);
        assert_eq!(span(std::iter::empty()), [0.0, 0.0]);
    }
}
