//! Pictures of what is left between robot and twin over a clip, before and after: the part of the evidence that eyes can judge.

use super::figure::chart::{Chart, Line};
use super::frame::legend;
use crate::answer::Trace;
use inference::statistics::median;
use maud::{Markup, html};

/// Half the width of the grey band, in sigma: noise alone stays inside 95 % of the time.
const BAND: f64 = 2.0;
/// Points further apart than so many of the usual distances are not joined.
const GAP: f64 = 5.0;
/// Width and height of one picture; two stand side by side.
const SIZE: [f64; 2] = [445.0, 165.0];

impl Trace {
    /// Root mean square of the residual before, in sigma.
    fn size(&self) -> f64 {
        let squares = self.before.iter().map(|[_, value]| value * value);
        let mean = squares.sum::<f64>() / self.before.len().max(1) as f64;
        mean.sqrt() / if self.sigma > 0.0 { self.sigma } else { 1.0 }
    }

    /// Whether there is an after. A residual that stays as it was shows one line, not two on top of each other.
    fn changes(&self) -> bool {
        !self.after.is_empty() && self.after != self.before
    }

    /// Before and after, and after alone beside it: what is left is often too small to be seen next to what was there.
    fn draw(&self) -> Markup {
        let [before, after] = [("before", &self.before), ("after", &self.after)].map(|(class, points)| {
            let pieces = pieces(points);
            pieces.into_iter().map(move |points| Line { class, points }).collect::<Vec<_>>()
        });
        let title = format!("{}, {}", self.clip.trim_end_matches(".mcap"), self.channel);
        if !self.changes() {
            return self.chart(&title, &before);
        }
        html! { (self.chart(&title, &[before, after.clone()].concat())) (self.chart("after alone", &after)) }
    }

    fn chart(&self, title: &str, lines: &[Line]) -> Markup {
        let band = (self.sigma > 0.0).then_some(BAND * self.sigma);
        Chart { title, x: "time [s]", unit: &self.unit, lines, band, logarithmic: false, size: SIZE }.draw()
    }
}

/// The stretches of a trace between which nothing was measured: no line may suggest what was there.
fn pieces(points: &[[f64; 2]]) -> Vec<&[[f64; 2]]> {
    let usual = median(points.windows(2).map(|w| w[1][0] - w[0][0])).unwrap_or(0.0);
    points.chunk_by(|a, b| b[0] - a[0] <= GAP * usual).collect()
}

/// The worst channel of each of the worst `clips` clips, worst first.
pub fn worst_first(traces: &[Trace], clips: usize) -> Vec<&Trace> {
    let mut sorted: Vec<&Trace> = traces.iter().collect();
    sorted.sort_by(|a, b| b.size().total_cmp(&a.size()));
    let mut chosen: Vec<&Trace> = Vec::new();
    for trace in sorted {
        if chosen.len() < clips && chosen.iter().all(|other| other.clip != trace.clip) {
            chosen.push(trace);
        }
    }
    chosen
}

/// Pictures of the worst clips with a legend; `names` of before and after.
pub(crate) fn gallery(traces: &[Trace], clips: usize, [before, after]: [&str; 2]) -> Markup {
    let worst = worst_first(traces, clips);
    let mut entries = vec![("before", before), ("after", after), ("band", "\u{b1}2\u{3c3} of the noise")];
    entries.retain(|(class, _)| *class != "after" || worst.iter().any(|trace| trace.changes()));
    html! {
        (legend(&entries))
        div.pair { @for trace in worst { (trace.draw()) } }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::page::canvas::tests::assert_well_formed;

    fn trace(clip: &str, channel: &str, size: f64) -> Trace {
        let before = (0..50).map(|i| [0.1 * f64::from(i), size * f64::from(i).sin()]).collect();
        let channel = channel.into();
        Trace { clip: clip.into(), channel, unit: "rad".into(), sigma: 1e-4, before, after: vec![] }
    }

    #[test]
    fn the_worst_channel_of_the_worst_clips_is_shown() {
        let traces = [
            trace("a.mcap", "joint1", 1e-4),
            trace("b.mcap", "joint1", 5e-4),
            trace("b.mcap", "joint2", 9e-4),
            trace("c.mcap", "joint7", 3e-4),
        ];
        let chosen: Vec<(&str, &str)> =
            worst_first(&traces, 2).iter().map(|t| (t.clip.as_str(), t.channel.as_str())).collect();
        assert_eq!(chosen, [("b.mcap", "joint2"), ("c.mcap", "joint7")]);
    }

    #[test]
    fn nothing_is_drawn_where_nothing_was_measured() {
        let holed: Vec<[f64; 2]> =
            (0..40).filter(|k| !(15..30).contains(k)).map(|k| [0.1 * f64::from(k), 1.0]).collect();
        let lengths: Vec<usize> = pieces(&holed).iter().map(|piece| piece.len()).collect();
        assert_eq!(lengths, [15, 10]);
    }

    #[test]
    fn a_trace_shows_both_lines_and_the_noise() {
        let mut both = trace("clip_05.mcap", "joint2", 2e-3);
        both.after = both.before.iter().map(|[t, value]| [*t, 0.1 * value]).collect();
        let html = both.draw().into_string();
        let (svg, alone) = html.split_at(html.rfind("<svg").expect("two pictures"));
        assert_well_formed(svg);
        assert_well_formed(alone);
        assert!(alone.contains("after alone") && !alone.contains("line before"));
        assert!(svg.contains("line before") && svg.contains("line after") && svg.contains("clip_05, joint2 [mrad]"));
        assert!(!trace("a", "b", 1.0).draw().into_string().contains("line after"));
        assert_well_formed(&Trace::default().draw().into_string());
    }
}
