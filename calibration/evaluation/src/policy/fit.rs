//! What a policy sees, brought into the shape that an input of its network has.
//!
//! Numbers `[n]`, pictures `[rows, columns, 3]` and depth `[rows, columns]` become `[.., n]`, `[.., 3, rows, columns]` or
//! `[.., rows, columns, 3]`; axes before those are one batch and, of two, moments, the latest last.

use super::packed::Array;
use std::collections::VecDeque;

/// Numbers that an input may have: a hundred pictures of a million pixels, in float32 a gigabyte.
const MOST_NUMBERS: usize = 1 << 28;

/// Axes of an input, as its network states them; `None`: any length.
pub(super) type Axes = [Option<usize>];

/// One input's moments: as many as the network wants, before the first as the first.
#[derive(Debug, Default)]
pub(super) struct Moments(VecDeque<Vec<f32>>);

/// A filled input.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Filled {
    /// Length along each axis.
    pub(super) shape: Vec<usize>,
    /// All numbers, the last axis fastest.
    pub(super) values: Vec<f32>,
}

impl Moments {
    /// Forgets what was seen.
    pub(super) fn clear(&mut self) {
        self.0.clear();
    }

    /// Adds what is seen now, each number times `scale`, and fills the input.
    ///
    /// # Errors
    /// Which shape the input would need.
    pub(super) fn fill(&mut self, seen: &Array, axes: &Axes, scale: f32) -> Result<Filled, String> {
        let (item, moved) = layout(&seen.shape, axes)?;
        let moments = match axes.len() - item.len() {
            2 => axes[1].unwrap_or(1).max(1),
            _ => 1,
        };
        let count = moments.checked_mul(seen.values.len()).filter(|count| *count <= MOST_NUMBERS);
        count.ok_or_else(|| {
            format!("asks for {moments} moments of {} numbers each, more than {MOST_NUMBERS}", seen.values.len())
        })?;
        let mut values: Vec<f32> = if moved {
            let channels = item[0];
            (0..channels).flat_map(|c| seen.values.iter().skip(c).step_by(channels).copied()).collect()
        } else {
            seen.values.clone()
        };
        values.iter_mut().for_each(|value| *value *= scale);
        while self.0.len() + 1 < moments {
            self.0.push_back(self.0.back().unwrap_or(&values).clone());
        }
        self.0.push_back(values);
        while self.0.len() > moments {
            self.0.pop_front();
        }
        let before = axes.len() - item.len();
        let mut shape = vec![1; before];
        if before == 2 {
            shape[1] = moments;
        }
        shape.extend(item);
        Ok(Filled { shape, values: self.0.iter().flatten().copied().collect() })
    }
}

/// The last axes of the input, and whether channels move from the last place to the first.
fn layout(seen: &[usize], axes: &Axes) -> Result<(Vec<usize>, bool), String> {
    let forms: Vec<(Vec<usize>, bool)> = match *seen {
        [rows, columns, channels] => {
            vec![(vec![channels, rows, columns], true), (vec![rows, columns, channels], false)]
        }
        [rows, columns] => {
            vec![(vec![1, rows, columns], false), (vec![rows, columns, 1], false), (vec![rows, columns], false)]
        }
        _ => vec![(seen.to_vec(), false)],
    };
    let fits = |form: &Vec<usize>| {
        let before = axes.len().checked_sub(form.len()).filter(|before| *before <= 2);
        before.is_some_and(|before| {
            let batch = before == 0 || axes[0].is_none_or(|length| length == 1);
            batch && axes[before..].iter().zip(form).all(|(axis, length)| axis.is_none_or(|axis| axis == *length))
        })
    };
    let wanted: Vec<String> =
        axes.iter().map(|axis| axis.map_or_else(|| "any".to_owned(), |length| length.to_string())).collect();
    let lengths = |form: &[usize]| form.iter().map(usize::to_string).collect::<Vec<_>>().join(", ");
    let possible: Vec<String> = forms.iter().map(|(form, _)| format!("[.., {}]", lengths(form))).collect();
    forms
        .into_iter()
        .find(|(form, _)| fits(form))
        .ok_or_else(|| format!("has the shape [{}], where {} is seen", wanted.join(", "), possible.join(" or ")))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fill(shape: &[usize], axes: &Axes) -> Result<Filled, String> {
        let values = (0..shape.iter().product()).map(|i: usize| i as f32).collect();
        Moments::default().fill(&Array { shape: shape.to_vec(), values }, axes, 1.0)
    }

    #[test]
    fn channels_go_where_the_input_has_them() {
        let picture = [1, 2, 3];
        let first = fill(&picture, &[Some(1), Some(3), Some(1), Some(2)]).expect("channels first");
        assert_eq!((first.shape, first.values), (vec![1, 3, 1, 2], vec![0.0, 3.0, 1.0, 4.0, 2.0, 5.0]));
        let last = fill(&picture, &[None, Some(1), Some(2), Some(3)]).expect("channels last");
        assert_eq!((last.shape, last.values), (vec![1, 1, 2, 3], vec![0.0, 1.0, 2.0, 3.0, 4.0, 5.0]));
        // Whatever is possible of an input that states nothing: channels first, as torch has them.
        assert_eq!(fill(&picture, &[None; 4]).expect("any").shape, [1, 3, 1, 2]);
        assert_eq!(fill(&[4, 5], &[None, Some(1), Some(4), Some(5)]).expect("depth").shape, [1, 1, 4, 5]);
        assert_eq!(fill(&[4, 5], &[None, None, Some(4), Some(5)]).expect("depth").shape, [1, 1, 4, 5]);
        assert_eq!(fill(&[7], &[Some(1), Some(7)]).expect("numbers").shape, [1, 7]);
        let wrong = fill(&[7], &[Some(1), Some(8)]).expect_err("a number too many");
        assert_eq!(wrong, "has the shape [1, 8], where [.., 7] is seen");
        fill(&picture, &[Some(2), Some(3), Some(1), Some(2)]).expect_err("two of a batch");
        fill(&[7], &[]).expect_err("no axis");
    }

    #[test]
    fn moments_before_the_first_are_as_the_first() {
        let mut moments = Moments::default();
        let mut show = |value: f32| {
            let seen = Array { shape: vec![1], values: vec![value] };
            moments.fill(&seen, &[Some(1), Some(3), Some(1)], 2.0).expect("numbers")
        };
        assert_eq!(show(1.0), Filled { shape: vec![1, 3, 1], values: vec![2.0, 2.0, 2.0] });
        assert_eq!(show(2.0).values, [2.0, 2.0, 4.0]);
        assert_eq!(show(3.0).values, [2.0, 4.0, 6.0]);
        assert_eq!(show(4.0).values, [4.0, 6.0, 8.0]);
        moments.clear();
        let seen = Array { shape: vec![1], values: vec![5.0] };
        assert_eq!(moments.fill(&seen, &[None, None, None], 1.0).expect("one moment").shape, [1, 1, 1]);
        let told = moments.fill(&seen, &[Some(1), Some(1_000_000_000_000), Some(1)], 1.0).expect_err("too many");
        assert!(told.contains("1000000000000 moments"), "{told}");
    }
}
