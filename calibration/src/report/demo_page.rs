//! The page of the demo: a robot against its twin, before and after the twin was given what the diagnosis found.

use crate::page::canvas::WIDTH;
use crate::page::figure::bars::{Row, bars};
use crate::page::figure::chart::{Chart, Line};
use crate::page::frame::{figure, frame, legend, unbroken};
use crate::page::root_mean_square;
use maud::{Markup, html};

/// What the page shows. Angles in rad, times in s.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Story {
    /// Under which circumstances, in a sentence or two.
    pub setting: String,
    /// What the diagnosis says, in a sentence.
    pub verdict: String,
    /// How the page came about: command, seed.
    pub origin: String,
    /// RMS of twin minus robot by joint, with what cell.toml says.
    pub before: Vec<f64>,
    /// The same with what the diagnosis found.
    pub after: Vec<f64>,
    /// Largest RMS over one second by joint while the twin shadowed live.
    pub live: Vec<f64>,
    /// The joint of the traces, from 0.
    pub joint: usize,
    /// Its measured path.
    pub real: Vec<[f64; 2]>,
    /// The twin's path, with what cell.toml says.
    pub twin: Vec<[f64; 2]>,
    /// Twin minus robot, with what cell.toml says.
    pub error_before: Vec<[f64; 2]>,
    /// The same with what the diagnosis found.
    pub error_after: Vec<[f64; 2]>,
}

const CELL: &str = "twin with the gains of cell.toml";
const FOUND: &str = "twin with what was found";

impl Story {
    /// The finding in one sentence.
    pub fn sentence(&self) -> String {
        let [before, after] = [&self.before, &self.after].map(|gap| 1e3 * root_mean_square(gap));
        format!(
            "{} With cell.toml alone the twin misses the robot by {before:.2} mrad (RMS over all joints), with the gains and \
             effects found by {after:.3} mrad.",
            self.verdict
        )
    }

    /// The whole page.
    pub fn page(&self) -> String {
        let joint = self.joint + 1;
        let body = html! {
            h1 { (unbroken(&self.sentence())) }
            p { (self.setting) " " a href="diagnosis.html" { "The diagnosis" } " says how it was found, and what was ruled out." }
            (figure("Gap by joint: RMS of twin minus robot", "", &self.gap()))
            (figure(&format!("Joint {joint}, where the gap is largest: robot and twin"), "", &self.motion()))
            (figure(&format!("Joint {joint}: how far off the twin is"), "", &self.error()))
            h2 { "Figures" }
            (self.table())
        };
        frame("robot against twin", &self.origin, &body)
    }

    fn gap(&self) -> Markup {
        let names: Vec<String> = (1..=self.before.len()).map(|joint| format!("joint {joint}")).collect();
        let pairs = self.before.iter().zip(&self.after);
        let row = |(name, (before, after)): (&'_ String, (&f64, &f64))| (name.clone(), vec![*before, *after]);
        let values: Vec<(String, Vec<f64>)> = names.iter().zip(pairs).map(row).collect();
        let rows: Vec<Row> = values
            .iter()
            .map(|(name, values)| Row { name, unit: "rad", values: values.clone(), floor: None })
            .collect();
        html! {
            (legend(&[("before", CELL), ("after", FOUND)]))
            (bars(&["before", "after"], &rows))
        }
    }

    fn motion(&self) -> Markup {
        let lines = [Line { class: "before", points: &self.twin }, Line { class: "data", points: &self.real }];
        html! {
            (legend(&[("before", CELL), ("data", "robot")]))
            (chart("position", &lines))
        }
    }

    fn error(&self) -> Markup {
        let lines =
            [Line { class: "before", points: &self.error_before }, Line { class: "after", points: &self.error_after }];
        html! {
            (legend(&[("before", CELL), ("after", FOUND)]))
            (chart("twin minus robot", &lines))
        }
    }

    fn table(&self) -> Markup {
        let milli = |value: f64| format!("{:.3}", 1e3 * value);
        html! {
            table {
                tr { th { "joint" } th.n { "live [mrad]" } th.n { "replay, cell.toml [mrad]" } th.n { "replay, as found [mrad]" } }
                @for (joint, (before, after)) in self.before.iter().zip(&self.after).enumerate() {
                    tr {
                        td { (joint + 1) }
                        td.n { (self.live.get(joint).map_or("-".to_owned(), |live| milli(*live))) }
                        td.n { (milli(*before)) }
                        td.n { (milli(*after)) }
                    }
                }
            }
        }
    }
}

fn chart(title: &str, lines: &[Line]) -> Markup {
    Chart { title, x: "time [s]", unit: "rad", lines, band: None, logarithmic: false, size: [WIDTH, 260.0] }.draw()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn story() -> Story {
        Story {
            setting: "A simulated FR3 & <a box>.".into(),
            verdict: "payload causes the gap.".into(),
            origin: "calibration demo --seed 7".into(),
            before: vec![1e-3, 3e-3],
            after: vec![2e-6, 2e-6],
            live: vec![1.5e-3, 3.5e-3],
            joint: 1,
            real: vec![[0.0, 0.1], [1.0, 0.2]],
            twin: vec![[0.0, 0.1], [1.0, 0.203]],
            error_before: vec![[0.0, 0.0], [1.0, 0.003]],
            error_after: vec![[0.0, 0.0], [1.0, 0.000_002]],
        }
    }

    #[test]
    fn the_page_says_the_finding_first_and_shows_it() {
        let html = story().page();
        let heading = html.split_once("<h1>").and_then(|(_, rest)| rest.split_once("</h1>")).expect("a heading").0;
        assert!(
            heading.contains("payload causes the gap. With cell.toml alone the twin")
                && heading.contains("misses the robot by 2.24\u{a0}mrad")
                && heading.contains("effects found by 0.002\u{a0}mrad"),
            "{heading}"
        );
        assert_eq!(html.matches("<svg").count(), 3);
        assert!(html.contains(">3.500</td>") && html.contains("Joint 2, where the gap is largest"));
        assert!(html.contains("&amp; &lt;a box&gt;"), "text is escaped");
    }
}
