//! Where an advice is carried out: the session, its clips that can be repeated, and how much faster they may be played. It
//! makes commands that can be typed of what an advice asks for.

use capture::arm_motion::ArmMotion;
use capture::body::Body;
use capture::request::Kind;
use capture::session::number_of;
use capture::{limits, pace, recorded};
use inference::admit::torques::is_tracking;
use shared_mem::cell::ClipKind;
use shared_mem::origin::Origin;
use shared_mem::recording::{Provenance, Session};
use shared_mem::typed::{Command, quoted};
use std::path::{Path, PathBuf};

/// Clips that are repeated to confirm something.
const CLIPS_REPEATED: usize = 2;
/// A faster clip is worth it from this factor on (a choice).
const WORTH_PLAYING_FASTER: f64 = 1.2;
/// So many times as fast is enough (a choice).
const FAST_ENOUGH: f64 = 2.0;

/// What to record next.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Advice {
    /// The reason and the experiment, in words; steps for hands before those for the keyboard.
    pub sentence: String,
    /// Commands that can be typed as they are, in this order.
    pub commands: Vec<String>,
    /// Motions of an arm that no bridge drives.
    pub motions: Vec<ArmMotion>,
}

impl Advice {
    fn of(sentence: String) -> Self {
        Self { sentence, ..Self::default() }
    }
}

/// A capture of an advice, without cell and session.
#[derive(Debug, Clone, Copy)]
pub(in crate::diagnose) enum Capture {
    /// The arm alone, new clips.
    Arm(ArmMotion),
    /// A stroke of the session again, with these arguments; a new one where there is none to repeat.
    StrokeAgain(&'static str),
    Strokes(&'static str),
    /// New strokes into a session of its own, named so, because something in the cell is another then.
    Elsewhere(&'static str, &'static str),
}

/// A session and what can be recorded into it.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Site {
    /// The session that clips are added to.
    folder: PathBuf,
    /// What captures know of the cell.
    cell: PathBuf,
    /// The arm that records them, as `--arm` takes it; none where no bridge drives it.
    arm: Option<String>,
    /// Where the clips of the session in question come from, in words.
    origin: String,
    /// Whether that session is still to be made.
    is_new: bool,
    /// Whether its clips are strokes; otherwise the arm moves alone.
    strokes: bool,
    /// Numbers of clips that can be repeated.
    clips: Vec<usize>,
    /// The largest factor at which the first of them can be played.
    fastest: f64,
    /// Whether objects move by themselves: no command records such clips.
    alone: bool,
    /// Whether torques along the measured motion are asked about.
    torques: bool,
    /// Of several objects the one that is asked about.
    object: Option<String>,
    /// The page of the command that advises; it keeps its name.
    page: Option<PathBuf>,
}

impl Site {
    /// Of a session whose clips lie on disk; where they cannot be read again, nothing can be repeated. Where a cell.toml was
    /// given besides, clips go into a session of their own, which is captured with it: the folder's own cell.toml is another
    /// one, or there is none, and the one given lists no new clips. `page`: where the command that advises writes its own.
    pub fn of(session: &Session, page: Option<&Path>) -> Self {
        let object = session.cell.one_of_several().map(str::to_owned);
        Self { page: page.map(Path::to_owned), object, ..Self::found(session) }
    }

    fn found(session: &Session) -> Self {
        let all = |kind| !session.clips.is_empty() && session.clips.iter().all(|clip| clip.kind == kind);
        let alone = all(ClipKind::FreeMotion);
        let strokes = all(ClipKind::ControlHitSlide);
        let torques = is_tracking(&session.cell);
        let provenance = Provenance::of(session);
        let (origin, (arm, goes_on)) = (provenance.to_string(), arm_of(session, &provenance));
        if session.files.cell.is_some() || !goes_on || arm.is_none() {
            let beside = Self::new(&session.folder, strokes, Vec::new(), 1.0).cell;
            let cell = session.files.cell.clone().unwrap_or(beside);
            let next = Self::new(&named_after(&session.folder, "next"), strokes, Vec::new(), 1.0);
            return Self { arm, origin, cell, is_new: true, alone, torques, ..next };
        }
        let kind = if strokes { ClipKind::ControlHitSlide } else { ClipKind::Excitation };
        let (mut clips, mut fastest) = (Vec::new(), 1.0);
        if let Ok(body) = Body::of(&session.cell) {
            let of = (kind, session.cell.object_name());
            let numbers =
                session.clips.iter().filter(|clip| clip.kind == kind).filter_map(|clip| number_of(&clip.file));
            // A clip that cannot be read again may be followed by one that can; not all of a long session are tried.
            let read = numbers.take(2 * CLIPS_REPEATED).filter_map(|number| {
                Some((number, recorded::read(&session.folder, number, of, &body).ok()?.set_points))
            });
            for (number, set_points) in read.take(CLIPS_REPEATED) {
                if clips.is_empty() {
                    fastest = pace::largest(&set_points, &limits::of(&session.cell, &body), &body);
                }
                clips.push(number);
            }
        }
        Self { arm, origin, alone, torques, ..Self::new(&session.folder, strokes, clips, fastest) }
    }

    /// Of a session of the simulation in `folder` with clips that can be repeated, the first of them `fastest` times as fast at most.
    pub fn new(folder: &Path, strokes: bool, clips: Vec<usize>, fastest: f64) -> Self {
        // Without a slash at its end, and never nothing: a clip may lie where the program runs.
        let folder: PathBuf = folder.components().collect();
        let folder = if folder.as_os_str().is_empty() { ".".into() } else { folder };
        Self {
            cell: folder.join("cell.toml"),
            folder,
            arm: Some("sim".into()),
            strokes,
            clips,
            fastest,
            ..Self::default()
        }
    }

    /// Where the clips of the session in question come from, in words.
    pub(in crate::diagnose) fn origin(&self) -> &str {
        &self.origin
    }

    /// Whether its clips are strokes.
    pub(in crate::diagnose) fn strikes(&self) -> bool {
        self.strokes
    }

    /// Whether objects move by themselves in its clips.
    pub(in crate::diagnose) fn objects_alone(&self) -> bool {
        self.alone
    }

    /// The sentence with the commands of `captures`, and what diagnoses them.
    pub(in crate::diagnose) fn advice(&self, sentence: String, captures: &[Capture]) -> Advice {
        if self.alone {
            return Advice::of(sentence);
        }
        if self.arm.is_none() {
            let motions = captures.iter().filter_map(|capture| match capture {
                Capture::Arm(motion) => Some(*motion),
                _ => None,
            });
            return self.finished(Advice { motions: motions.collect(), ..Advice::of(sentence) });
        }
        let mut commands = Vec::new();
        // A session begins with clips enough to be diagnosed.
        let beside = captures.iter().find_map(|capture| match capture {
            Capture::Arm(_) if self.strokes => Some(self.arm("--clips 4")),
            Capture::StrokeAgain(_) | Capture::Strokes(_) if !self.strokes => Some(self.strokes("--clips 6")),
            _ => None,
        });
        commands.extend(beside);
        commands.extend(captures.iter().map(|capture| match capture {
            Capture::Arm(motion) => self.arm(&motion.arguments()),
            Capture::Strokes(rest) => self.strokes(rest),
            Capture::StrokeAgain(rest) => match self.clips.first() {
                Some(number) if self.strokes => self.strokes(&format!("--repeat {number} {rest}")),
                _ => self.strokes(&format!("--clips 1 {rest}")),
            },
            Capture::Elsewhere(name, rest) => {
                let cell = named_after(&self.folder, &format!("{name}.toml"));
                self.strokes_into(&cell, &named_after(&self.folder, name), rest)
            }
        }));
        self.finished(Advice { commands, ..Advice::of(sentence) })
    }

    /// Repeats, what they are in words as `sentence` puts them. Of eight only one clip is repeated, of two both.
    pub(in crate::diagnose) fn again(&self, times: usize, sentence: impl FnOnce(String) -> String) -> Advice {
        let repeats = self.repeats(times);
        self.finished(Advice { sentence: sentence(repeats.sentence), ..repeats })
    }

    fn repeats(&self, times: usize) -> Advice {
        let fast = (100.0 * self.fastest.min(FAST_ENOUGH)).floor() / 100.0;
        let speeds = match fast {
            fast if fast >= FAST_ENOUGH => "one at half and one at twice the speed".to_owned(),
            fast if fast >= WORTH_PLAYING_FASTER => {
                format!("one at half and one at {fast} times the speed, the most that the limits allow")
            }
            _ => "one at half the speed".to_owned(),
        };
        let what = if times > CLIPS_REPEATED { "repeat one clip eight times" } else { "repeat two clips" };
        if self.alone {
            let words = format!("let the object go {times} times more, in other directions and at other speeds");
            return Advice::of(words);
        }
        let Some(first) = self.clips.first() else {
            let words =
                format!("record {times} clips more, and {}", speeds.replace("one at half and", "some at half and"));
            let usual = ArmMotion::of(Kind::Multisine, times);
            return self.new_clips(words, &[usual, ArmMotion { speed: 0.5, ..ArmMotion::of(Kind::Multisine, 2) }]);
        };
        let all: Vec<String> = self.clips.iter().take(CLIPS_REPEATED).map(ToString::to_string).collect();
        let repeated = if times > CLIPS_REPEATED {
            format!("--repeat {first} --clips {times}")
        } else {
            format!("--repeat {}", all.join(","))
        };
        let mut commands = vec![self.same(&repeated), self.same(&format!("--repeat {first} --speed 0.5"))];
        if fast >= WORTH_PLAYING_FASTER {
            commands.push(self.same(&format!("--repeat {first} --speed {fast}")));
        }
        Advice { commands, ..Advice::of(format!("{what} and add {speeds}")) }
    }

    /// The sentence with new clips of the session's kind: sums of sines of the arm alone, or as many strokes.
    fn new_clips(&self, sentence: String, motions: &[ArmMotion]) -> Advice {
        let advice = Advice::of(sentence);
        match &self.arm {
            Some(_) => {
                Advice { commands: motions.iter().map(|motion| self.same(&motion.arguments())).collect(), ..advice }
            }
            None if self.strokes => advice,
            None => Advice { motions: motions.to_vec(), ..advice },
        }
    }

    /// The sentence with the command of so many clips more of the same kind.
    pub(in crate::diagnose) fn more(&self, sentence: String, clips: usize) -> Advice {
        if self.alone {
            return Advice::of(sentence);
        }
        self.finished(self.new_clips(sentence, &[ArmMotion::of(Kind::Multisine, clips)]))
    }

    /// Another session of the same kind.
    pub(in crate::diagnose) fn usual(&self) -> Vec<String> {
        if self.alone || self.arm.is_none() {
            return Vec::new();
        }
        let next = if self.is_new { self.folder.clone() } else { named_after(&self.folder, "next") };
        vec![if self.strokes {
            self.strokes_into(&self.cell, &next, "--clips 12")
        } else {
            self.capture_into("excitation", &self.cell, &next, "--clips 8")
        }]
    }

    /// The same, and after its commands what diagnoses the sessions they record into.
    fn finished(&self, Advice { sentence, mut commands, motions }: Advice) -> Advice {
        if self.arm.is_none() && !self.alone {
            let sentence = format!(
                "{sentence} No bridge drives this arm: play the motions with its own controller, log commands and \
                 measurements, and make a session of the logs with `calibration import`."
            );
            return Advice { sentence, commands: Vec::new(), motions };
        }
        let fill = |commands: &[String], folder: &Path| {
            commands.iter().any(|command| command.contains(&format!("--out {} ", quoted(folder))))
        };
        // A session begins with clips enough to be diagnosed.
        let enough = if self.strokes { 6 } else { 4 };
        let clips = |command: &String| command.rsplit_once(" --clips ")?.1.parse::<usize>().ok();
        if self.is_new && fill(&commands, &self.folder) && commands.iter().filter_map(clips).all(|clips| clips < enough)
        {
            commands.insert(0, self.same(&format!("--clips {enough}")));
        }
        let beside = ["arm", "strokes"].map(|end| (named_after(&self.folder, end), format!("report_{end}")));
        for (folder, page) in beside.into_iter().chain([(self.folder.clone(), "report".to_owned())]) {
            if fill(&commands, &folder) {
                let torques = if self.torques { "--torques" } else { "" };
                let object = self.object.as_ref().map_or_else(String::new, |name| format!("--object {name}"));
                let command = Command::new("calibration diagnose").path(&folder).words(&object).words(torques);
                commands.push(command.option("--report", &self.free_page(&page)).into());
            }
        }
        Advice { sentence, commands, motions }
    }

    /// A page whose name is not taken where the program runs: one that is there is kept, and the command refused.
    fn free_page(&self, name: &str) -> PathBuf {
        let own = self.page.as_deref().and_then(Path::file_name);
        let taken = |page: &Path| page.file_name() == own || page.symlink_metadata().is_ok();
        let numbered = (2..).map(|number| format!("{name}_{number}.html"));
        let mut names = std::iter::once(format!("{name}.html")).chain(numbered).map(PathBuf::from);
        names.find(|page| !taken(page)).expect("numbers do not end")
    }

    fn same(&self, rest: &str) -> String {
        if self.strokes { self.strokes(rest) } else { self.arm(rest) }
    }

    fn arm(&self, rest: &str) -> String {
        let folder = if self.strokes { named_after(&self.folder, "arm") } else { self.folder.clone() };
        self.capture_into("excitation", &self.cell, &folder, rest)
    }

    fn strokes(&self, rest: &str) -> String {
        let folder = if self.strokes { self.folder.clone() } else { named_after(&self.folder, "strokes") };
        self.strokes_into(&self.cell, &folder, rest)
    }

    fn strokes_into(&self, cell: &Path, folder: &Path, rest: &str) -> String {
        let rest = self.object.as_ref().map_or_else(|| rest.to_owned(), |name| format!("--object {name} {rest}"));
        self.capture_into("control-hit-slide", cell, folder, &rest)
    }

    fn capture_into(&self, verb: &str, cell: &Path, folder: &Path, rest: &str) -> String {
        let command = Command::new("calibration capture").words(verb).option("--cell", cell).option("--out", folder);
        command.option_of("--arm", self.arm.as_deref().map(Path::new)).words(rest).into()
    }
}

/// The arm that records more clips like those of a session, as `--arm` takes it, and whether they go into that session. A real FR3
/// whose address nobody knows is `fci://ROBOT`; clips of other sources than a bridge's stay by themselves. None where no bridge
/// drives the arm.
fn arm_of(session: &Session, provenance: &Provenance) -> (Option<String>, bool) {
    if let Some(arm) = provenance.source().and_then(Origin::arm) {
        return (Some(arm), true);
    }
    let is_fr3 = session.cell.robot.as_ref().is_some_and(|robot| robot.model.as_deref() == Some("fr3"));
    let robots = provenance.clips().iter().flat_map(|clip| clip.origins.iter());
    let known = robots.filter(|origin| **origin != Origin::Simulation).find_map(Origin::arm);
    let arm = is_fr3.then(|| known.unwrap_or_else(|| "fci://ROBOT".to_owned()));
    (arm, provenance.is_unknown())
}

/// A session beside another one: `monday_arm`.
fn named_after(folder: &Path, end: &str) -> PathBuf {
    match folder.file_name() {
        Some(name) => folder.with_file_name(format!("{}_{end}", name.to_string_lossy())),
        None => folder.join(end),
    }
}

#[cfg(test)]
mod tests;
