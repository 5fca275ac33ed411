//! nalgebra (the project's vectors) to and from glam (parry's). Nothing else converts.

use nalgebra::{Matrix3, Point3, Vector3};
use parry3d_f64::math::{Matrix, Vector};

pub(super) fn vector(v: &Vector3<f64>) -> Vector {
    Vector::new(v.x, v.y, v.z)
}

pub(super) fn point(p: &Point3<f64>) -> Vector {
    vector(&p.coords)
}

pub(super) fn to_vector(v: Vector) -> Vector3<f64> {
    Vector3::new(v.x, v.y, v.z)
}

pub(super) fn to_matrix(m: &Matrix) -> Matrix3<f64> {
    Matrix3::from_columns(&[to_vector(m.x_axis), to_vector(m.y_axis), to_vector(m.z_axis)])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_matrix_keeps_its_rows_and_columns() {
        let matrix = to_matrix(&Matrix::from_cols_array(&[1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0]));
        assert_eq!(matrix[(0, 1)], 4.0);
        assert_eq!(matrix * Vector3::x(), Vector3::new(1.0, 2.0, 3.0));
    }
}
