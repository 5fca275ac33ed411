//! Whether confidence was earned: how often verdicts were true, over how sure they were said to be.

use super::shares::Shares;
use crate::page::canvas::Anchor;
use maud::Markup;

/// Verdicts of about one confidence.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Bin {
    /// Their mean confidence.
    pub(crate) confidence: f64,
    /// Share of them that were true.
    pub(crate) right: f64,
    pub(crate) interval: [f64; 2],
    pub(crate) count: usize,
}

const SIZE: [f64; 2] = [460.0, 400.0];

/// The curve, with the diagonal on which earned confidence lies.
pub(crate) fn calibration_curve(bins: &[Bin]) -> Markup {
    let Shares { mut canvas, x, y } = Shares::new(SIZE, "confidence stated");
    for bin in bins {
        let at = x.at(bin.confidence);
        canvas.line("whisker", [at, y.at(bin.interval[0])], [at, y.at(bin.interval[1])]);
        canvas.circle("dot", [at, y.at(bin.right)], 4.5);
        let beside = if at > SIZE[0] - 70.0 { (at - 8.0, Anchor::End) } else { (at + 8.0, Anchor::Start) };
        canvas.text("small", [beside.0, y.at(bin.right) + 4.0], beside.1, &bin.count.to_string());
    }
    canvas.text_upwards("small", [16.0, y.at(0.35)], "verdicts that were true", 200.0);
    canvas.finish(SIZE, "share of true verdicts by stated confidence")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::page::canvas::tests::assert_well_formed;

    #[test]
    fn each_bin_shows_its_share_its_interval_and_its_count() {
        let bin = |confidence, right, count| Bin { confidence, right, interval: [right - 0.1, right + 0.1], count };
        let svg = calibration_curve(&[bin(0.55, 0.5, 41), bin(0.98, 0.95, 203)]).into_string();
        assert_well_formed(&svg);
        assert!(svg.contains(">41<") && svg.contains(">203<") && svg.matches("whisker").count() == 2);
        assert_well_formed(&calibration_curve(&[]).into_string());
        assert_well_formed(&calibration_curve(&[bin(f64::NAN, f64::NAN, 0)]).into_string());
    }
}
