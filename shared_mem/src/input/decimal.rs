//! Numbers as people of different countries write them: `0.5` and `0,5`, `1,234.5`, `1.234,5`, `1'234.5`, `1 234,5`.
//!
//! Which sign is the decimal one is a matter of a whole table: `1,234` alone says nothing.

/// Which sign stands before the fraction.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Decimal {
    /// `0.5`
    #[default]
    Point,
    /// `0,5`
    Comma,
}

/// What the cells of one column say about their decimal sign.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Said<'a> {
    /// The sign without which one of them would be no number; a point where they have both.
    pub sign: Option<Decimal>,
    /// A cell whose comma may stand for thousands or before a fraction.
    pub either: Option<&'a str>,
}

impl<'a> Said<'a> {
    /// By these cells.
    pub fn by(cells: impl Iterator<Item = &'a str>) -> Self {
        let mut said = Self::default();
        for cell in cells.filter(|cell| cell.contains(['.', ','])) {
            match [Decimal::Point, Decimal::Comma].map(|sign| sign.number(cell).is_some()) {
                [true, false] => return Self { sign: Some(Decimal::Point), either: None },
                [false, true] => said.sign = Some(Decimal::Comma),
                [true, true] if cell.contains(',') => said.either = said.either.or(Some(cell)),
                _ => {}
            }
        }
        said
    }
}

impl Decimal {
    /// The number that a cell holds; `None` where it holds none.
    pub fn number(self, cell: &str) -> Option<f64> {
        if self == Self::Point
            && let Ok(number) = cell.parse()
        {
            return Some(number);
        }
        let (mantissa, exponent) = cell.split_at(cell.find(char::is_alphabetic).unwrap_or(cell.len()));
        let mut behind = mantissa.chars();
        let (sign, mantissa) = match behind.next() {
            Some('-' | '\u{2212}') => ("-", behind.as_str()),
            Some('+') => ("", behind.as_str()),
            _ => ("", mantissa),
        };
        if mantissa.is_empty() {
            // `nan`, `inf`: the same in every country.
            return cell.parse().ok();
        }
        let (decimal, other) = match self {
            Self::Point => ('.', ','),
            Self::Comma => (',', '.'),
        };
        let (whole, fraction) = mantissa.split_once(decimal).unwrap_or((mantissa, ""));
        let is_digits = |text: &str| text.bytes().all(|byte| byte.is_ascii_digit());
        let whole = if is_digits(whole) { whole.to_owned() } else { ungrouped(whole, other)? };
        // `5,` is the end of a list.
        if !is_digits(fraction) || fraction.is_empty() && (whole.is_empty() || mantissa.ends_with(decimal)) {
            return None;
        }
        let exponent = exponent.replace('\u{2212}', "-");
        format!("{sign}{whole}.{fraction}0{exponent}").parse().ok()
    }
}

/// The digits of a number whose thousands are parted by one sign: `other`, or one that is a decimal sign nowhere.
fn ungrouped(text: &str, other: char) -> Option<String> {
    let parting = text.chars().find(|c| !c.is_ascii_digit())?;
    if parting != other && !matches!(parting, '\'' | '’' | ' ' | '\u{a0}' | '\u{202f}') {
        return None;
    }
    let mut groups = text.split(parting);
    let first = groups.next()?;
    let is_group = |group: &str| group.len() == 3 && group.bytes().all(|byte| byte.is_ascii_digit());
    let begins = (1..=3).contains(&first.len())
        && first.bytes().all(|byte| byte.is_ascii_digit())
        // `0,123` is a fraction.
        && !first.starts_with('0');
    (begins && groups.all(is_group)).then(|| text.split(parting).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn numbers_of_every_country_are_numbers() {
        for (cell, point, comma) in [
            ("0.5", Some(0.5), None),
            ("-0,785003", None, Some(-0.785_003)),
            ("1e-3", Some(1e-3), Some(1e-3)),
            ("1,5E+02", None, Some(150.0)),
            ("12", Some(12.0), Some(12.0)),
            ("1,234", Some(1234.0), Some(1.234)),
            ("1.234", Some(1.234), Some(1234.0)),
            ("-1,234,567.25", Some(-1_234_567.25), None),
            ("1.234.567,25", None, Some(1_234_567.25)),
            ("1'234.5", Some(1234.5), None),
            ("1\u{202f}234,5", None, Some(1234.5)),
            ("\u{2212}0.5", Some(-0.5), None),
            (".5", Some(0.5), None),
            (",5", None, Some(0.5)),
            ("0,123", None, Some(0.123)),
            ("nan", Some(f64::NAN), Some(f64::NAN)),
            ("-inf", Some(f64::NEG_INFINITY), Some(f64::NEG_INFINITY)),
            ("", None, None),
            ("-", None, None),
            (",", None, None),
            ("5,", None, None),
            ("1,2,3", None, None),
            ("12,34.5", None, None),
            ("1.2.3", None, None),
            ("fr3_joint1", None, None),
            ("--1", None, None),
            ("2026-01-02", None, None),
        ] {
            for (sign, expected) in [(Decimal::Point, point), (Decimal::Comma, comma)] {
                let found = sign.number(cell);
                let equal = found == expected || found.is_some_and(f64::is_nan) && expected.is_some_and(f64::is_nan);
                assert!(equal, "{cell:?} with {sign:?}: {found:?}");
            }
        }
    }

    #[test]
    fn a_column_says_its_sign_where_one_of_its_cells_is_a_number_with_it_alone() {
        let said = |cells: &[&'static str]| Said::by(cells.iter().copied());
        let sign = |sign| Said { sign: Some(sign), either: None };
        assert_eq!(said(&["0", "0.1", "name"]), sign(Decimal::Point));
        assert_eq!(said(&["0,000", "name"]), sign(Decimal::Comma), "no thousand begins with 0");
        assert_eq!(said(&["1,234", "1,234.5"]), sign(Decimal::Point));
        assert_eq!(said(&["1.234,5", "1.234"]), sign(Decimal::Comma));
        assert_eq!(said(&["0,5", "0.25"]), sign(Decimal::Point), "both");
        assert_eq!(said(&["a, b", "12", "1.234"]), Said::default());
        assert_eq!(said(&["1,234", "12"]), Said { sign: None, either: Some("1,234") });
    }

    proptest! {
        #[test]
        fn no_cell_makes_it_panic_and_a_number_keeps_its_value(cell in "[-+0-9.,'eE −]{0,12}", number in any::<f64>()) {
            let _ = (Decimal::Point.number(&cell), Decimal::Comma.number(&cell));
            prop_assume!(number.is_finite());
            let text = format!("{number:?}");
            prop_assert_eq!(Decimal::Point.number(&text), Some(number));
            prop_assert_eq!(Decimal::Comma.number(&text.replace('.', ",")), Some(number));
        }
    }
}
