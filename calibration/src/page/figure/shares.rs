//! The frame of a figure of one share over another: both from 0 to 100 %, equal ones on the diagonal.

use crate::page::canvas::{Anchor, Canvas};
use crate::page::scale::Scale;

const LEFT: f64 = 60.0;
const BOTTOM: f64 = 44.0;

/// The frame on a canvas of a size, and its scales.
pub(super) struct Shares {
    pub(super) canvas: Canvas,
    pub(super) x: Scale,
    pub(super) y: Scale,
}

impl Shares {
    /// Grid, values and diagonal; `below` says what the share below is.
    pub(super) fn new([width, height]: [f64; 2], below: &str) -> Self {
        let mut canvas = Canvas::new();
        let x = Scale::new([0.0, 1.0], [LEFT, width - 20.0]);
        let y = Scale::new([0.0, 1.0], [height - BOTTOM, 12.0]);
        for (value, _) in x.ticks(5) {
            let name = format!("{:.0} %", 100.0 * value);
            canvas.line("grid", [x.at(value), y.at(0.0)], [x.at(value), y.at(1.0)]);
            canvas.line("grid", [x.at(0.0), y.at(value)], [x.at(1.0), y.at(value)]);
            canvas.text("small", [x.at(value), y.at(0.0) + 16.0], Anchor::Middle, &name);
            canvas.text("small", [LEFT - 8.0, y.at(value) + 4.0], Anchor::End, &name);
        }
        canvas.line("floor", [x.at(0.0), y.at(0.0)], [x.at(1.0), y.at(1.0)]);
        let middle = 0.5 * (x.at(0.0) + x.at(1.0));
        canvas.text_within("small", [middle, height - 6.0], Anchor::Middle, below, width - 80.0);
        Self { canvas, x, y }
    }
}
