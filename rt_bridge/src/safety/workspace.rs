//! Where the tool tip may be: a box in the base frame that ends above the table.

use shared_mem::cell::Cell;

/// Gap that is kept between the tool and the table [m].
const TABLE_GAP: f64 = 2e-3;
/// Half edge of the box around the base: beyond the reach of an FR3 with a short tool [m].
const REACH: f64 = 1.2;

/// An axis-aligned box for the centre of the tip's cap, base frame [m].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Workspace {
    /// Lowest corner.
    pub low: [f64; 3],
    /// Highest corner.
    pub high: [f64; 3],
}

impl Workspace {
    /// The space of a cell: above its table by the tool's radius and 2 mm, within 1.2 m of the base along each axis.
    #[must_use]
    pub fn of(cell: &Cell) -> Self {
        let radius = cell.tool.as_ref().map_or(0.0, |tool| tool.radius);
        let floor = cell.table.map_or(-REACH, |table| table.height + radius + TABLE_GAP);
        Self { low: [-REACH, -REACH, floor], high: [REACH, REACH, 2.0 * REACH] }
    }

    /// `true` when `tip` is inside. A number that is not finite is outside.
    #[must_use]
    pub fn contains(&self, tip: [f64; 3]) -> bool {
        tip.iter().zip(&self.low).zip(&self.high).all(|((t, lo), hi)| (*lo..=*hi).contains(t))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use shared_mem::cell::Table;

    #[test]
    fn below_the_table_and_nowhere_are_outside() {
        let cell = Cell { table: Some(Table { height: 0.1 }), ..Cell::default() };
        let space = Workspace::of(&cell);
        assert!(space.contains([0.5, 0.0, 0.11]));
        assert!(!space.contains([0.5, 0.0, 0.101]));
        assert!(!space.contains([f64::NAN, 0.0, 0.5]));
    }
}
