//! Constants in a text: names, types and values.

/// A constant as it is written.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Constant {
    pub name: String,
    /// Its type, without spaces.
    pub of: String,
    pub value: String,
}

/// Names that say how large something is, or where, and not what: on their own they name nothing.
const GENERIC: &str = "AHEAD ALIKE ALL ALONE ANEW APART AROUND ASIDE BESIDE BETTER BEYOND BROUGHT CLEAR CLOSE DOUBTED \
     DOUBTFUL ELSEWHERE ENOUGH EVERY FAR FARTHEST FAST FASTEST FELT FEW FEWEST FIRST FITTED FREE FURTHER HAIR HEAT \
     HIDDEN HIGHEST KEPT LARGEST LAST LEAST LIKELY LITTLE LONGEST LOOK LOOKS LOST MORE MOST MOVED MOVES NARROWER NEAR \
     NEGLIGIBLE NEXT NOTHING ODD OFF ONCE ONE OPEN OUTSTANDING OVER OWN PLACED PLAIN QUIET REACH ROUGH SAID SAME SEEN \
     SHARE SHORT SHORTEST SLOWER SLOWEST SMALL SOUGHT STILL STOPPED THIRD TOGETHER TRIED TURNED TWICE TWO WANTED WAY \
     WIDE WIDENED WIDEST WIDER WORTH WORTHWHILE";

impl Constant {
    /// Whether its value is one or several numbers.
    pub fn is_number(&self) -> bool {
        let holds_text = ["str", "fn(", "EffectInfo"].iter().any(|part| self.of.contains(part));
        !holds_text && self.value.contains(|c: char| c.is_ascii_digit())
    }

    /// Whether its name is one generic word.
    pub fn is_generic(&self) -> bool {
        GENERIC.split_whitespace().any(|word| word == self.name)
    }
}

/// The constants of some Rust code, those inside of functions too.
pub fn constants(code: &str) -> Vec<Constant> {
    let after_word = code.match_indices("const ").filter(|(at, _)| {
        let before = &code[..*at];
        before.is_empty() || before.ends_with(|c: char| c.is_whitespace() || c == '(')
    });
    let read = |(at, word): (usize, &str)| {
        let rest = &code[at + word.len()..];
        let (name, rest) = rest.split_once(':')?;
        let is_name = |c: char| c.is_ascii_uppercase() || c.is_ascii_digit() || c == '_';
        if name.is_empty() || !name.chars().all(is_name) {
            return None; // a function, or a parameter of a type
        }
        let (of, rest) = rest.split_once(" = ").or_else(|| rest.split_once(" =\n"))?;
        let value = rest.split(";\n").next().unwrap_or(rest);
        let of = of.split_whitespace().collect();
        Some(Constant { name: name.to_owned(), of, value: value.trim().to_owned() })
    };
    after_word.filter_map(read).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn constants_are_found_wherever_they_stand() {
        let code = "const LEAST: f64 = 1e-3;\n    pub(super) const NAMES: [&str; 2] =\n [\"a1\", \"b\"];\n\
                    const fn f() {}\nimpl<const N: usize> A<N> {}\npub const MIN_GAIN: [f64; 2] = [4.0, 5.0];\n";
        let found = constants(code);
        assert_eq!(found.iter().map(|c| c.name.as_str()).collect::<Vec<_>>(), ["LEAST", "NAMES", "MIN_GAIN"]);
        assert_eq!(found.iter().map(Constant::is_number).collect::<Vec<_>>(), [true, false, true]);
        assert_eq!(found.iter().map(Constant::is_generic).collect::<Vec<_>>(), [true, false, false]);
    }
}
