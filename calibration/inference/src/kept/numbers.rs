//! Matrices and vectors of numbers in a file of results: their size and their elements, column by column.

/// `#[serde(with = "matrix")]`
pub mod matrix {
    use nalgebra::DMatrix;
    use serde::{Deserialize as _, Deserializer, Serialize as _, Serializer, de};

    /// Rows, columns, elements.
    ///
    /// # Errors
    /// The serializer's.
    pub fn serialize<S: Serializer>(matrix: &DMatrix<f64>, serializer: S) -> Result<S::Ok, S::Error> {
        (matrix.nrows(), matrix.ncols(), matrix.as_slice()).serialize(serializer)
    }

    /// The other way.
    ///
    /// # Errors
    /// The deserializer's, and where the size does not fit the elements.
    pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<DMatrix<f64>, D::Error> {
        let (rows, columns, elements) = <(usize, usize, Vec<f64>)>::deserialize(deserializer)?;
        if rows.checked_mul(columns) != Some(elements.len()) {
            return Err(de::Error::custom("a matrix of another size"));
        }
        Ok(DMatrix::from_vec(rows, columns, elements))
    }
}

/// `#[serde(with = "vector")]`
pub mod vector {
    use nalgebra::DVector;
    use serde::{Deserialize as _, Deserializer, Serialize as _, Serializer};

    /// Its elements.
    ///
    /// # Errors
    /// The serializer's.
    pub fn serialize<S: Serializer>(vector: &DVector<f64>, serializer: S) -> Result<S::Ok, S::Error> {
        vector.as_slice().serialize(serializer)
    }

    /// The other way.
    ///
    /// # Errors
    /// The deserializer's.
    pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<DVector<f64>, D::Error> {
        Ok(DVector::from_vec(Vec::deserialize(deserializer)?))
    }
}

/// `#[serde(with = "vectors")]`
pub mod vectors {
    use nalgebra::DVector;
    use serde::{Deserialize as _, Deserializer, Serialize as _, Serializer};

    /// The elements of each.
    ///
    /// # Errors
    /// The serializer's.
    pub fn serialize<S: Serializer>(vectors: &[DVector<f64>], serializer: S) -> Result<S::Ok, S::Error> {
        vectors.iter().map(DVector::as_slice).collect::<Vec<_>>().serialize(serializer)
    }

    /// The other way.
    ///
    /// # Errors
    /// The deserializer's.
    pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Vec<DVector<f64>>, D::Error> {
        Ok(Vec::<Vec<f64>>::deserialize(deserializer)?.into_iter().map(DVector::from_vec).collect())
    }
}
