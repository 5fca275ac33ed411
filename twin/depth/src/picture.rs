//! Brightness of a picture between its pixels, and pictures of fewer pixels.

/// A picture's brightness.
#[derive(Debug, Clone)]
pub(crate) struct Picture {
    /// Columns and rows.
    pub(crate) size: [usize; 2],
    /// Row by row [0 to 255].
    pub(crate) grey: Vec<f32>,
}

impl Picture {
    /// Of means of `by` times `by` pixels.
    pub(crate) fn reduced(grey: &[f32], [width, height]: [usize; 2], by: usize) -> Self {
        let size = [width / by, height / by];
        let mean = |at: usize| {
            let (column, row) = (at % size[0] * by, at / size[0] * by);
            let rows = (row..row + by).map(|row| grey[row * width + column..][..by].iter().sum::<f32>());
            rows.sum::<f32>() / (by * by) as f32
        };
        let grey = if by == 1 { grey.to_vec() } else { (0..size[0] * size[1]).map(mean).collect() };
        Self { size, grey }
    }
}
