//! The last few things of a kind, so that what comes again and again is said once. Pure, and allocates nothing.

/// How many: each sender has its place, and as many ids again.
const KEPT: usize = 8;

/// The newest of what was noted.
#[derive(Debug, Clone, Copy)]
pub struct Newest<T> {
    newest: [Option<T>; KEPT],
    next: usize,
}

impl<T> Default for Newest<T> {
    fn default() -> Self {
        Self { newest: std::array::from_fn(|_| None), next: 0 }
    }
}

impl<T: PartialEq> Newest<T> {
    /// Whether this was noted, and not so many others since.
    pub fn has(&self, what: &T) -> bool {
        self.newest.iter().flatten().any(|noted| noted == what)
    }

    /// Notes it in the place of the oldest. `false`: it was noted already.
    pub fn note(&mut self, what: T) -> bool {
        if self.has(&what) {
            return false;
        }
        if let Some(place) = self.newest.get_mut(self.next) {
            *place = Some(what);
        }
        self.next = (self.next + 1) % KEPT;
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn several_that_come_in_turn_are_new_once_each_and_the_oldest_is_forgotten() {
        let mut said = Newest::default();
        for round in 0..3 {
            for id in 0..KEPT {
                assert_eq!(said.note(id), round == 0, "{id}");
            }
        }
        assert!(said.note(KEPT) && !said.has(&0) && said.has(&1));
    }
}
