//! Matrices and vectors of numbers in a file of results, `#[serde(with = "numbers")]`: their size and their elements, column by column.

use nalgebra::{DMatrix, DVector};
use serde::de::{DeserializeOwned, Error as _};
use serde::{Deserialize as _, Deserializer, Serialize, Serializer};

/// Numbers with what a file holds of them.
pub trait Numbers: Sized {
    type Held: Serialize + DeserializeOwned;

    fn held(&self) -> Self::Held;

    /// `None` where the size does not fit the elements.
    fn of(held: Self::Held) -> Option<Self>;
}

impl Numbers for DMatrix<f64> {
    type Held = (usize, usize, Vec<f64>);

    fn held(&self) -> Self::Held {
        (self.nrows(), self.ncols(), self.as_slice().to_vec())
    }

    fn of((rows, columns, elements): Self::Held) -> Option<Self> {
        // A product that overflows is no size either.
        (rows.checked_mul(columns) == Some(elements.len())).then(|| Self::from_vec(rows, columns, elements))
    }
}

impl Numbers for DVector<f64> {
    type Held = Vec<f64>;

    fn held(&self) -> Self::Held {
        self.as_slice().to_vec()
    }

    fn of(held: Self::Held) -> Option<Self> {
        Some(Self::from_vec(held))
    }
}

impl Numbers for Vec<DVector<f64>> {
    type Held = Vec<Vec<f64>>;

    fn held(&self) -> Self::Held {
        self.iter().map(Numbers::held).collect()
    }

    fn of(held: Self::Held) -> Option<Self> {
        held.into_iter().map(Numbers::of).collect()
    }
}

/// # Errors
/// The serializer's.
pub fn serialize<N: Numbers, S: Serializer>(numbers: &N, serializer: S) -> Result<S::Ok, S::Error> {
    numbers.held().serialize(serializer)
}

/// # Errors
/// The deserializer's, and where the size does not fit the elements.
pub fn deserialize<'de, N: Numbers, D: Deserializer<'de>>(deserializer: D) -> Result<N, D::Error> {
    N::of(N::Held::deserialize(deserializer)?).ok_or_else(|| D::Error::custom("a matrix of another size"))
}
