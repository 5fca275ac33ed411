//! What the reader of a file noticed and mended, as remarks: it is said once, here, and not found again.

use super::columns::Columns;
use super::remark::{Fault, Remark, Severity, Size};

/// Words of the reader's sentences, and the fault that they tell, the first that fits.
const KNOWN: [(&str, Fault, Severity); 19] = [
    ("was put into radians", Fault::Degrees, Severity::Warning),
    ("divided by 57.3 once too often", Fault::CommandUnit, Severity::Wrong),
    ("probably degrees", Fault::Degrees, Severity::Wrong),
    ("do not overlap in time", Fault::DifferentClocks, Severity::Wrong),
    ("come from different clocks", Fault::DifferentClocks, Severity::Wrong),
    ("let one machine stamp both", Fault::DifferentClocks, Severity::Note),
    ("two nodes publish on it; record one", Fault::TwoPublishers, Severity::Wrong),
    ("jump by a whole turn", Fault::AngleWraps, Severity::Note),
    ("samples lost", Fault::LostSamples, Severity::Note),
    ("stamps go back", Fault::StampOrder, Severity::Note),
    ("stamps repeat", Fault::StampOrder, Severity::Note),
    ("clock was set back", Fault::StampOrder, Severity::Warning),
    ("stamps lie far from all others", Fault::StampOrder, Severity::Note),
    ("the first row lies", Fault::StartGlitch, Severity::Note),
    ("taken as not logged", Fault::PlaceholderConstant, Severity::Warning),
    ("probably millimetres", Fault::LengthUnit, Severity::Wrong),
    ("quaternions w first", Fault::Quaternion, Severity::Wrong),
    ("a quaternion has the length", Fault::Quaternion, Severity::Note),
    ("rows left out: row", Fault::UnusableRows, Severity::Note),
];

/// Remarks on a clip. A sentence of the reader ends with what to do, behind its last semicolon or colon.
pub(super) fn remarks(clip: &Columns) -> Vec<Remark> {
    let cut = clip.damage.iter().map(|damage| {
        Remark::new(Fault::CutFile, &clip.file, "file", damage.clone())
            .mended_by("close the recorder before the machine is switched off, and record again what is missing")
    });
    // What holds for both joint topics alike is said once.
    let bare = |sentence: &str| sentence.replace(&format!("`{}`", topic(sentence)), "");
    let first =
        |(at, sentence): &(usize, &String)| !clip.noticed[..*at].iter().any(|other| bare(other) == bare(sentence));
    let sentences = clip.noticed.iter().enumerate().filter(first).map(|(_, sentence)| {
        let known = KNOWN.into_iter().find(|(words, ..)| sentence.contains(words));
        let (fault, severity) = known.map_or((Fault::Reader, Severity::Note), |(_, fault, severity)| (fault, severity));
        let (what, remedy) = sentence.rsplit_once("; ").unwrap_or((sentence, ""));
        let remark = Remark::new(fault, &clip.file, topic(sentence), what).mended_by(remedy).weighed(severity);
        match lost(sentence).filter(|_| fault == Fault::LostSamples) {
            Some(lost) => remark.sized(Size::count(lost, "samples")).mended_by(
                "use a wired network and a real-time kernel: `rt_bridge doctor` says what this machine lacks; nothing is filled in",
            ),
            None => remark,
        }
    });
    cut.chain(sentences).collect()
}

/// How many samples were lost by the reader's own count.
fn lost(sentence: &str) -> Option<f64> {
    sentence.split_once("about ")?.1.split(' ').next()?.parse().ok()
}

/// The topic that a sentence begins with.
fn topic(sentence: &str) -> String {
    let named = sentence.strip_prefix('`').and_then(|rest| rest.split_once('`'));
    named.map_or_else(|| "clip".to_owned(), |(topic, _)| topic.to_owned())
}
