//! Slopes through the origin with their standard errors, where some rows are spoilt.

/// A slope and one sigma of it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Slope {
    pub value: f64,
    pub sigma: f64,
}

/// `y = a x + b z` by least squares through the origin, from rows `[x, z, y]`, outliers beyond ten median residuals left out
/// once; the slopes on `x` and `z`. `None` where they cannot be distinguished.
///
/// ```
/// use inference::estimate::plane::plane;
///
/// let row = |x: f64, z: f64| [x, z, 3.0 * x - z];
/// let mut rows: Vec<[f64; 3]> = (0..40).map(f64::from).map(|i| row(i.sin(), i.cos())).collect();
/// rows[7][2] += 100.0; // spoilt
/// let [on_x, on_z] = plane(&rows).expect("they can be distinguished");
/// assert!((on_x.value - 3.0).abs() < 1e-9 && (on_z.value + 1.0).abs() < 1e-9);
/// ```
pub fn plane(rows: &[[f64; 3]]) -> Option<[Slope; 2]> {
    let all = fitted(rows)?;
    let left = |[x, z, y]: &[f64; 3]| (y - all[0].value * x - all[1].value * z).abs();
    let mut sizes: Vec<f64> = rows.iter().map(left).collect();
    let middle = (sizes.len() - 1) / 2;
    let most = 10.0 * *sizes.select_nth_unstable_by(middle, f64::total_cmp).1;
    let kept: Vec<[f64; 3]> = rows.iter().filter(|row| left(row) <= most).copied().collect();
    if kept.len() * 2 < rows.len() { Some(all) } else { fitted(&kept) }
}

fn fitted(rows: &[[f64; 3]]) -> Option<[Slope; 2]> {
    let sum = |f: fn(&[f64; 3]) -> f64| rows.iter().map(f).sum::<f64>();
    let (xx, xz, zz) = (sum(|r| r[0] * r[0]), sum(|r| r[0] * r[1]), sum(|r| r[1] * r[1]));
    let (xy, zy) = (sum(|r| r[0] * r[2]), sum(|r| r[1] * r[2]));
    let determinant = xx * zz - xz * xz;
    if rows.len() < 5 || determinant <= 1e-9 * xx * zz {
        return None;
    }
    let (a, b) = ((xy * zz - zy * xz) / determinant, (zy * xx - xy * xz) / determinant);
    let left = rows.iter().map(|[x, z, y]| (y - a * x - b * z).powi(2)).sum::<f64>() / (rows.len() - 2) as f64;
    Some([
        Slope { value: a, sigma: (left * zz / determinant).sqrt() },
        Slope { value: b, sigma: (left * xx / determinant).sqrt() },
    ])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_slopes_are_found_although_some_rows_are_spoilt() {
        let rows: Vec<[f64; 3]> = (0..200)
            .map(|i| {
                let (x, z) = ((f64::from(i) * 0.1).sin(), (f64::from(i) * 0.17).cos());
                let noise = 1e-3 * (f64::from(i) * 12.9898).sin();
                [x, z, 2.0 * x - 0.3 * z + if i % 40 == 0 { 50.0 } else { noise }]
            })
            .collect();
        let [a, b] = plane(&rows).expect("two directions");
        assert!((a.value - 2.0).abs() < 3.0 * a.sigma + 1e-6 && a.sigma < 1e-3, "{a:?}");
        assert!((b.value + 0.3).abs() < 3.0 * b.sigma + 1e-6, "{b:?}");
        assert_eq!(plane(&[[1.0, 2.0, 3.0]; 9]), None);
    }
}
