//! The criteria of a diagnosis ([`criteria`]) regenerated from labelled sessions of another engine, which `tests/peers/run.py`
//! records and has diagnosed.

use crate::diagnose::criteria::{self, Criterion};
use crate::diagnose::{SensorGap, Sensors, Share};
use anyhow::Context;
use inference::statistics::student_sigmas;
use serde::{Deserialize, Serialize};
use shared_mem::input;
use std::path::Path;

/// What is hidden in a session.
#[derive(Debug, Clone, Deserialize)]
struct Truth {
    /// Names of the registry, and others where not all are known.
    effects: Vec<String>,
    /// Whether all of them are in the registry.
    known: bool,
}

#[derive(Debug, Clone, Deserialize)]
struct Verdict {
    kind: String,
    effects: Vec<String>,
    /// Given where a part of the gap stays.
    explained_share: Option<Share>,
}

#[derive(Debug, Clone, Deserialize)]
struct Gap {
    sensors: Vec<SensorGap>,
}

#[derive(Debug, Clone, Deserialize)]
struct Diagnosis {
    verdict: Verdict,
    gap: Gap,
}

/// A session whose truth is known, with what was said of it.
#[derive(Debug, Clone)]
pub struct Labelled {
    truth: Truth,
    said: Diagnosis,
}

/// A criterion with what labelled sessions make of it.
#[derive(Debug, Clone, Serialize)]
pub struct Regenerated {
    pub name: &'static str,
    pub unit: &'static str,
    /// What it says.
    pub meaning: &'static str,
    /// The value that diagnoses decide by.
    pub in_use: f64,
    /// The value from the sessions; `None` where they are too few.
    pub from_sessions: Option<f64>,
    /// How many sessions bear on it.
    pub sessions: usize,
}

/// Reads `FOLDER/*/truth.json` with `FOLDER/*/diagnosis.json`; folders that lack one of them are passed over.
///
/// # Errors
/// A folder cannot be read, holds no session that was diagnosed, or a file is not what it should be.
pub fn read(folder: &Path) -> anyhow::Result<Vec<Labelled>> {
    let mut places = Vec::new();
    for entry in std::fs::read_dir(folder).with_context(|| format!("cannot read {}", folder.display()))? {
        places.push(entry.with_context(|| format!("cannot read {}", folder.display()))?.path());
    }
    // In the same order everywhere.
    places.sort();
    let both =
        |place: &&std::path::PathBuf| place.join("truth.json").is_file() && place.join("diagnosis.json").is_file();
    let sessions: Vec<Labelled> = places.iter().filter(both).map(|place| one(place)).collect::<anyhow::Result<_>>()?;
    anyhow::ensure!(
        !sessions.is_empty(),
        "{} holds no NAME/truth.json with its NAME/diagnosis.json; record sessions there as tests/peers/README.md says",
        folder.display()
    );
    Ok(sessions)
}

fn one(place: &Path) -> anyhow::Result<Labelled> {
    fn json<T: for<'a> Deserialize<'a>>(path: &Path) -> anyhow::Result<T> {
        let bytes = input::bytes(path, input::Kind::List)?;
        serde_json::from_slice(&bytes).with_context(|| {
            format!(
                "{}: not as `tests/peers/run.py` of this version leaves it; delete it and run that again",
                path.display()
            )
        })
    }
    Ok(Labelled { truth: json(&place.join("truth.json"))?, said: json(&place.join("diagnosis.json"))? })
}

/// What sessions make of every criterion.
pub fn regenerate(sessions: &[Labelled]) -> Vec<Regenerated> {
    let all = || sessions.iter();
    let nothing = |sensors| {
        beyond_noise(
            all().filter(|s| s.nothing_is_hidden()).filter_map(|s| s.of(sensors)).map(|of| (of.before, of.floor)),
        )
    };
    let named = || all().filter(|session| session.is_named_rightly());
    let beside = |sensors| {
        beyond_noise(named().filter_map(|s| s.of(sensors)).filter(|of| of.gaps() > 1.0).map(|of| (of.after, of.floor)))
    };
    let share_left = |sensors| quantile(named().filter_map(|session| session.share_left(sensors)));
    let said = |kind| all().filter(move |session| session.is(kind));
    let far_below_doubt = |session: &&Labelled| session.gaps() < 0.5 * criteria::DOUBTFUL_EXCESS.value;
    let plain = |session: &&Labelled| session.has_a_plain_gap();
    let in_part = |session: &&Labelled| session.leaves_a_part();
    let outside = |session: &Labelled| !session.truth.known;
    let [doubtful, turns] = unseen(sessions);
    let found = [
        (criteria::JOINTS_EXCESS, nothing(Sensors::Joints)),
        (criteria::OBJECT_EXCESS, nothing(Sensors::Object)),
        (criteria::JOINTS_EXCESS_BESIDE_A_CAUSE, beside(Sensors::Joints)),
        (criteria::OBJECT_EXCESS_BESIDE_A_CAUSE, beside(Sensors::Object)),
        (criteria::JOINTS_SHARE_LEFT, share_left(Sensors::Joints)),
        (criteria::OBJECT_SHARE_LEFT, share_left(Sensors::Object)),
        (criteria::DOUBTFUL_EXCESS, doubtful),
        (criteria::TURNS_WITHIN, turns),
        (criteria::NONE_IS_RIGHT, rate(said("none").filter(far_below_doubt), Labelled::nothing_is_hidden)),
        (criteria::CLASS_IS_RIGHT, rate(said("class"), Labelled::holds_what_is_hidden)),
        (criteria::PART_IS_RIGHT, rate(said("named").filter(in_part), Labelled::is_named_rightly)),
        (criteria::UNKNOWN_IS_RIGHT, rate(said("unexplained").filter(plain), outside)),
        (criteria::UNKNOWN_OF_LITTLE_IS_RIGHT, rate(said("unexplained").filter(|s| !plain(s)), outside)),
        (criteria::NAMED_IS_WRONG, rate(said("named").filter(|s| !in_part(s)), Labelled::names_what_is_not_there)),
    ];
    let one = |(criterion, (from_sessions, sessions)): (Criterion, (Option<f64>, usize))| {
        let Criterion { name, unit, meaning, value: in_use } = criterion;
        Regenerated { name, unit, meaning, in_use, from_sessions, sessions }
    };
    found.into_iter().map(one).collect()
}

impl Labelled {
    fn nothing_is_hidden(&self) -> bool {
        self.truth.known && self.truth.effects.is_empty()
    }

    fn is(&self, kind: &str) -> bool {
        self.said.verdict.kind == kind
    }

    /// Whether a part of the gap stays beside what was said.
    fn leaves_a_part(&self) -> bool {
        self.said.verdict.explained_share.is_some()
    }

    /// Whether what was said holds all that is hidden.
    fn holds_what_is_hidden(&self) -> bool {
        self.truth.known && self.truth.effects.iter().all(|effect| self.said.verdict.effects.contains(effect))
    }

    fn names_what_is_not_there(&self) -> bool {
        self.said.verdict.effects.iter().any(|name| !self.truth.effects.contains(name))
    }

    fn is_named_rightly(&self) -> bool {
        self.is("named") && self.holds_what_is_hidden() && self.said.verdict.effects.len() == self.truth.effects.len()
    }

    fn of(&self, sensors: Sensors) -> Option<&SensorGap> {
        self.said.gap.sensors.iter().find(|gap| gap.sensors == sensors)
    }

    /// Of sensors that have a gap.
    fn share_left(&self, sensors: Sensors) -> Option<f64> {
        let of = self.of(sensors).filter(|of| of.gaps() > 1.0)?;
        Some((of.after - of.floor).max(0.0) / (of.before - of.floor))
    }

    fn has_a_plain_gap(&self) -> bool {
        self.said.gap.sensors.iter().any(SensorGap::is_plain)
    }

    /// The largest gap of its sensors, in least gaps.
    fn gaps(&self) -> f64 {
        self.said.gap.sensors.iter().map(SensorGap::gaps).fold(0.0, f64::max)
    }
}

/// Fewer values tell no spread.
const FEWEST: usize = 5;
/// Less than this is nothing, whatever its logarithm [squared sigmas, or a share].
const NOTHING: f64 = 1e-3;
/// Quantile of the normal distribution at 98 %.
const NINETY_EIGHT: f64 = 2.054;

/// The 98 % quantile of an excess beyond the floor, of pairs of a mean square and its floor. Their ratio is lognormal, so that an
/// excess that noise makes negative counts as what it is.
fn beyond_noise(pairs: impl Iterator<Item = (f64, f64)>) -> (Option<f64>, usize) {
    let pairs: Vec<(f64, f64)> = pairs.collect();
    let (ratio, n) = quantile(pairs.iter().map(|(mean_square, floor)| mean_square / floor));
    let floor = pairs.iter().map(|(_, floor)| floor).sum::<f64>() / n.max(1) as f64;
    (ratio.map(|ratio| floor * (ratio - 1.0)), n)
}

/// The 98 % quantile of one value more of the kind: of a lognormal distribution that is known from these values alone.
fn quantile(values: impl Iterator<Item = f64>) -> (Option<f64>, usize) {
    let logarithms: Vec<f64> = values.map(|value| value.max(NOTHING).ln()).collect();
    let n = logarithms.len();
    if n < FEWEST {
        return (None, n);
    }
    let mean = logarithms.iter().sum::<f64>() / n as f64;
    let variance = logarithms.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / (n - 1) as f64;
    let spread = (variance * (1.0 + 1.0 / n as f64)).sqrt();
    (Some((mean + student_sigmas(NINETY_EIGHT, n - 1) * spread).exp()), n)
}

/// A share of sessions, as the mean of Jeffreys' posterior: no share is certain after few.
fn rate<'a>(sessions: impl Iterator<Item = &'a Labelled>, hit: impl Fn(&Labelled) -> bool) -> (Option<f64>, usize) {
    let (hits, of) = sessions.fold((0, 0), |(hits, of), session| (hits + usize::from(hit(session)), of + 1));
    ((of >= FEWEST).then(|| (hits as f64 + 0.5) / (of as f64 + 1.0)), of)
}

/// Where half of the sessions in which no cause was seen have one, and within which scale that turns: a logistic function of
/// their gaps at its greatest likelihood, slopes held to be positive and finite by a prior of 1 on their logarithm around that
/// in use.
fn unseen(sessions: &[Labelled]) -> [(Option<f64>, usize); 2] {
    let silent = sessions.iter().filter(|session| session.is("none") || session.is("unexplained"));
    let points: Vec<(f64, bool)> = silent.map(|session| (session.gaps(), !session.nothing_is_hidden())).collect();
    let hidden = points.iter().filter(|(_, hidden)| *hidden).count();
    let n = points.len();
    if hidden < FEWEST || n - hidden < FEWEST {
        return [(None, n); 2];
    }
    let cost = |doubtful: f64, within: f64| -> f64 {
        let one = |(gaps, hidden): &(f64, bool)| {
            let x = (gaps - doubtful) / within;
            (if *hidden { -x } else { x }).exp().ln_1p()
        };
        points.iter().map(one).sum::<f64>() + 0.5 * (within / criteria::TURNS_WITHIN.value).ln().powi(2)
    };
    // Two numbers and a cost that is cheap: a lattice finds the lowest, to a hundredth of a least gap.
    let lattice = (0..=300).flat_map(|i| (0..=60).map(move |k| (0.01 * f64::from(i), 0.01 * 1.1_f64.powi(k))));
    let best = lattice.min_by(|a, b| cost(a.0, a.1).total_cmp(&cost(b.0, b.1)));
    [(best.map(|best| best.0), n), (best.map(|best| best.1), n)]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn session(hidden: &[&str], known: bool, (kind, said): (&str, &[&str]), object: [f64; 2]) -> Labelled {
        let names = |names: &[&str]| names.iter().map(|name| (*name).to_owned()).collect::<Vec<_>>();
        let [before, after] = object;
        let sensors = vec![
            SensorGap { sensors: Sensors::Joints, before: 1.05, after: 1.05, floor: 1.0 },
            SensorGap { sensors: Sensors::Object, before, after, floor: 1.0 },
        ];
        let verdict = Verdict { kind: kind.into(), effects: names(said), explained_share: None };
        Labelled { truth: Truth { effects: names(hidden), known }, said: Diagnosis { verdict, gap: Gap { sensors } } }
    }

    fn found(sessions: &[Labelled], criterion: &Criterion) -> Regenerated {
        regenerate(sessions).into_iter().find(|row| row.name == criterion.name).expect("all are regenerated")
    }

    #[test]
    fn the_quantile_of_a_lognormal_distribution_is_found_and_few_values_make_it_wider() {
        // Quantiles of the standard normal distribution at 5, 15, ... 95 %.
        let normal = [-1.645, -1.036, -0.674, -0.385, -0.126, 0.126, 0.385, 0.674, 1.036, 1.645];
        let values = |times: usize| normal.iter().cycle().take(10 * times).map(|z: &f64| (1.0 + 0.5 * z).exp());
        let (Some(of_ten), 10) = quantile(values(1)) else { panic!("ten are enough") };
        let (Some(of_thousand), 1000) = quantile(values(100)) else { panic!("a thousand are enough") };
        // Ten quantiles spread a little less than what they are quantiles of.
        let spread = 0.5 * (normal.iter().map(|z| z * z).sum::<f64>() / 10.0).sqrt();
        let truth = (1.0 + spread * NINETY_EIGHT).exp();
        assert!((of_thousand / truth - 1.0).abs() < 0.01, "{of_thousand} {truth}");
        assert!(of_ten > 1.1 * of_thousand);
        assert_eq!(quantile([1.0; 4].into_iter()), (None, 4));
    }

    #[test]
    fn sessions_with_nothing_wrong_say_what_a_gap_is_and_rightly_named_ones_what_a_cause_leaves() {
        let mut sessions: Vec<Labelled> =
            (1..9).map(|k| session(&[], true, ("none", &[]), [1.0 + f64::from(k), 1.0])).collect();
        sessions.push(session(&["wind"], false, ("unexplained", &[]), [400.0, 400.0]));
        let gap = found(&sessions, &criteria::OBJECT_EXCESS);
        assert!(gap.sessions == 8 && gap.from_sessions.is_some_and(|gap| (8.0..40.0).contains(&gap)), "{gap:?}");
        assert_eq!(found(&sessions, &criteria::OBJECT_SHARE_LEFT).from_sessions, None, "nothing was named");
        let named = |left| session(&["table_tilt"], true, ("named", &["table_tilt"]), [201.0, left]);
        sessions.extend([9.0, 11.0, 13.0, 11.0, 10.0, 12.0].map(named));
        sessions.push(session(&["table_tilt"], true, ("named", &["tip_friction"]), [201.0, 150.0]));
        let left = found(&sessions, &criteria::OBJECT_SHARE_LEFT);
        assert!(
            left.sessions == 6 && left.from_sessions.is_some_and(|share| (0.055..0.1).contains(&share)),
            "{left:?}"
        );
        let wrong = found(&sessions, &criteria::NAMED_IS_WRONG);
        assert_eq!((wrong.sessions, wrong.from_sessions), (7, Some(1.5 / 8.0)));
        for session in &mut sessions {
            session.said.verdict.explained_share = Some(Share::default());
        }
        let in_part = found(&sessions, &criteria::PART_IS_RIGHT);
        assert_eq!((in_part.sessions, in_part.from_sessions), (7, Some(6.5 / 8.0)));
    }

    #[test]
    fn where_sessions_with_a_cause_begin_is_found() {
        let scale = criteria::OBJECT_EXCESS.value;
        let gaps = |gaps: f64, hidden: &[&str]| session(hidden, true, ("none", &[]), [1.0 + gaps * scale, 1.0]);
        let without = (0..20).map(|k| gaps(0.05 * f64::from(k), &[]));
        let with = (0..20).map(|k| gaps(0.5 + 0.05 * f64::from(k), &["table_tilt"]));
        let sessions: Vec<Labelled> = without.chain(with).collect();
        let [doubtful, turns] =
            [&criteria::DOUBTFUL_EXCESS, &criteria::TURNS_WITHIN].map(|c| found(&sessions, c).from_sessions);
        assert!(doubtful.is_some_and(|half| (0.65..0.85).contains(&half)), "{doubtful:?}");
        assert!(turns.is_some_and(|within| (0.05..0.3).contains(&within)), "{turns:?}");
        assert_eq!(
            found(&sessions[..22], &criteria::DOUBTFUL_EXCESS).from_sessions,
            None,
            "two with a cause are too few"
        );
    }

    #[test]
    fn every_criterion_has_a_name_of_its_own_and_is_regenerated() {
        let sessions: Vec<Labelled> = ["none", "class", "unexplained", "named"]
            .into_iter()
            .flat_map(|kind| {
                [1.5, 90.0].into_iter().flat_map(move |before| {
                    (0..6).map(move |_| session(&["table_tilt"], true, (kind, &["table_tilt"]), [before, 2.0]))
                })
            })
            .chain((0..6).map(|k| session(&[], true, ("none", &[]), [1.2 + f64::from(k), 1.0])))
            .collect();
        let rows = regenerate(&sessions);
        let names: std::collections::BTreeSet<&str> = rows.iter().map(|row| row.name).collect();
        assert_eq!((names.len(), rows.len()), (14, 14));
        // The joints of these sessions have no gap of which a cause could leave anything, and no part of one stays.
        let open: Vec<&str> = rows.iter().filter(|row| row.from_sessions.is_none()).map(|row| row.name).collect();
        let few = [criteria::JOINTS_EXCESS_BESIDE_A_CAUSE, criteria::JOINTS_SHARE_LEFT, criteria::PART_IS_RIGHT];
        assert_eq!(open, few.map(|criterion| criterion.name), "{rows:?}");
    }
}
