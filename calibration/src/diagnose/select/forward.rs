//! Forward selection: a model is extended, one extension after the other, by what predicts clips that it was not fitted to best, as long
//! as that is worth it; then what those found later make superfluous is dropped (stepwise regression, with the likelihood of clips left
//! out in place of an F test).

/// How the models of one kind are extended.
pub trait Selection {
    type Model: Clone;
    /// What was tried on top of one model.
    type Step;

    /// Fits the extensions of a model that promise something; and, fitted to the end, the model with the best of them, where one is worth
    /// it. `None` where the twin has no answer, or the time is over.
    fn step(&self, now: &Self::Model, before: &[Self::Step]) -> Option<(Self::Step, Option<Self::Model>)>;

    /// The model that a step extends, as it was fitted for that.
    fn extends(step: &Self::Step) -> &Self::Model;
}

/// What was selected.
pub struct Selected<S: Selection> {
    /// All steps, the first from where the selection began.
    pub steps: Vec<S::Step>,
    /// The model with all extensions that were taken on.
    pub last: S::Model,
}

/// Extends a model for as long as an extension is worth it.
pub fn forward<S: Selection>(selection: &S, begin: S::Model) -> Option<Selected<S>> {
    let (mut steps, mut now) = (Vec::new(), begin);
    loop {
        let (step, extended) = selection.step(&now, &steps)?;
        let last = S::extends(&step).clone();
        steps.push(step);
        match extended {
            Some(extended) => now = extended,
            None => return Some(Selected { steps, last }),
        }
    }
}

/// Drops extensions for as long as the others make one superfluous. `fewer`: the model without the first that is.
pub fn backward<M>(begin: M, fewer: impl Fn(&M) -> Option<M>) -> M {
    let mut now = begin;
    while let Some(next) = fewer(&now) {
        now = next;
    }
    now
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Coins are taken into a purse, the largest first, as long as it holds them.
    struct Coins(Vec<u32>);

    impl Selection for Coins {
        type Model = Vec<u32>;
        type Step = Vec<u32>;

        fn step(&self, now: &Vec<u32>, _: &[Vec<u32>]) -> Option<(Vec<u32>, Option<Vec<u32>>)> {
            let left = self.0.iter().filter(|coin| !now.contains(coin) && now.iter().sum::<u32>() + **coin <= 10);
            Some((now.clone(), left.max().map(|coin| [&now[..], &[*coin]].concat())))
        }

        fn extends(step: &Vec<u32>) -> &Vec<u32> {
            step
        }
    }

    #[test]
    fn extensions_are_added_while_one_is_worth_it_and_dropped_where_others_do_without() {
        let selected = forward(&Coins(vec![1, 5, 2, 9, 4]), Vec::new()).expect("a purse");
        assert_eq!((selected.steps.len(), &selected.last[..]), (3, &[9, 1][..]));
        let fewer = |purse: &Vec<u32>| {
            let without = |place: usize| [&purse[..place], &purse[place + 1..]].concat();
            (0..purse.len()).map(without).find(|fewer| fewer.iter().sum::<u32>() >= 6)
        };
        assert_eq!(backward(vec![1, 2, 5], fewer), [2, 5]);
    }
}
