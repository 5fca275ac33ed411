//! What to do about effects that were named: in the cell, and in a model. Each effect says it itself, from what was identified.

use crate::answer::diagnosis::{Kind, Remedy, Verdict};
use shared_mem::cell::Cell;
use shared_mem::theta::Theta;
use twin::effects::find;

/// A remedy for each effect that the verdict names, with its numbers of `theta`; none where it names none for sure.
pub(super) fn of(verdict: &Verdict, theta: &Theta, cell: &Cell) -> Vec<Remedy> {
    if verdict.kind != Kind::Named {
        return Vec::new();
    }
    let remedy = |name: &String| {
        let block = theta.effects.iter().find(|block| block.name == *name)?;
        let numbers = |parameter: &str| block.numbers(parameter);
        let twin::effects::Remedy { in_cell, in_model } = find(name)?.remedy(cell, &numbers);
        Some(Remedy { effect: name.clone(), in_cell, in_model })
    };
    verdict.effects.iter().filter_map(remedy).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use shared_mem::toml_file;
    use std::path::Path;

    #[test]
    fn named_effects_get_a_remedy_with_the_numbers_found_and_a_class_gets_none() {
        let text = "[[effect]]\nname = \"table_tilt\"\ntilt = [0.0, 0.04]\n[[effect]]\nname = \"command_delay\"\ndelay = 0.012\n";
        let theta: Theta = toml_file::parse(text, Path::new("theta.toml")).expect("a theta.toml");
        let effects = vec!["command_delay".to_owned(), "table_tilt".to_owned()];
        let (text, explained_share, rest) = (String::new(), None, None);
        let mut verdict = Verdict { kind: Kind::Named, effects, confidence: 0.9, text, explained_share, rest };
        let found = of(&verdict, &theta, &Cell::default());
        assert_eq!(
            found.iter().map(|remedy| remedy.effect.as_str()).collect::<Vec<_>>(),
            ["command_delay", "table_tilt"]
        );
        assert!(found[0].in_cell.contains("12 ms late") && found[1].in_cell.contains("2.29 degrees"), "{found:?}");
        verdict.kind = Kind::Class;
        assert!(of(&verdict, &theta, &Cell::default()).is_empty());
    }
}
