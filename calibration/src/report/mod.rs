//! Reports: what was found, as one offline HTML file with plots inside.

mod page;
mod plots;

pub use page::page;
pub use plots::PlotError;

/// What a page tells: a robot against its twin, before and after the twin was given the true gains. Angles in rad, times in s.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Story {
    /// Under which circumstances, in a sentence or two.
    pub setting: String,
    /// How the page came about: command, seed.
    pub origin: String,
    /// RMS of twin minus robot by joint, with what cell.toml says.
    pub before: Vec<f64>,
    /// The same with the true gains.
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
    /// The same with the true gains.
    pub error_after: Vec<[f64; 2]>,
}

impl Story {
    /// The finding in one sentence.
    #[must_use]
    pub fn sentence(&self) -> String {
        let [before, after] = [&self.before, &self.after].map(|gap| 1e3 * root_mean_square(gap));
        let explained = if before > 0.0 { 100.0 * (1.0 - (after / before).powi(2)) } else { 0.0 };
        format!(
            "With the gains of cell.toml the twin misses the robot by {before:.2} mrad (RMS over all joints); with the robot's true gains {after:.3} mrad are left: the gains explain {explained:.1} % of the squared gap."
        )
    }
}

/// Root mean square over the joints.
#[must_use]
pub fn root_mean_square(values: &[f64]) -> f64 {
    (values.iter().map(|v| v * v).sum::<f64>() / values.len().max(1) as f64).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn story() -> Story {
        Story {
            setting: "A simulated FR3 & <a box>.".into(),
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
        let html = page(&story()).expect("a page");
        let heading = html.split_once("<h1>").and_then(|(_, rest)| rest.split_once("</h1>")).expect("a heading").0;
        assert!(
            heading.contains("misses the robot by 2.24 mrad") && heading.contains("0.002 mrad are left"),
            "{heading}"
        );
        assert_eq!(html.matches("<svg").count(), 3);
        assert!(html.contains("<td>2</td><td>3.500</td><td>3.000</td><td>0.002</td>"), "{html}");
        assert!(html.contains("Joint 2, where the gap is largest"));
    }

    #[test]
    fn the_page_opens_without_network_and_without_scripts() {
        let html = page(&story()).expect("a page").replace("http://www.w3.org/2000/svg", "");
        for outside in ["http://", "https://", "<script", "<link", "@import", "url("] {
            assert!(!html.contains(outside), "{outside} in the page");
        }
        assert!(html.contains("&amp; &lt;a box&gt;"), "text is escaped");
    }
}
