//! The seed of what is drawn, as the command line takes it: any whole number, negative ones too.

/// A number from -2^63 to 2^64 - 1; a negative one stands for the same bits.
///
/// # Errors
/// What may be given, where it is no such number.
pub fn parse(text: &str) -> Result<u64, String> {
    let negative = || text.parse::<i64>().map(i64::cast_unsigned);
    text.parse::<u64>().or_else(|_| negative()).map_err(|_| "give a whole number, for example 7 or -5".into())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn any_whole_number_is_a_seed_and_negative_ones_are_seeds_of_their_own() {
        assert_eq!(parse("7"), Ok(7));
        assert_eq!(parse("18446744073709551615"), Ok(u64::MAX));
        assert!(parse("-5").is_ok_and(|seed| seed != 5) && parse("-5") != parse("-6"));
        for wrong in ["", "1.5", "five", "1e3", "99999999999999999999"] {
            assert!(parse(wrong).is_err_and(|error| error.contains("whole number")), "{wrong}");
        }
    }
}
