//! What tells two effects apart that look alike in some recordings: the experiment in words, and what has to be recorded for it.
//! The pair stands in the file of one of the two.

/// What separates an effect from another one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Separation {
    /// The other effect.
    pub from: &'static str,
    /// The experiment, and what tells: a clause without a full stop, steps for hands before those for the keyboard.
    pub by: &'static str,
    /// What is recorded, in this order.
    pub record: &'static [Experiment],
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Experiment {
    /// All joints swing at frequencies that rise to 10 Hz.
    Chirp,
    /// The same up to 40 Hz.
    FastChirp,
    /// Joints move at constant speeds that rise from one reversal to the next, 0.005 to 0.5 rad/s.
    Ramps,
    /// The arm rests in eight poses.
    Holds,
    /// The arm rests in twelve poses that lie far apart.
    ManyHolds,
    /// A motion unlike those there are.
    NewMotion,
    /// A stroke of the session again, at half its speed.
    StrokeAgainSlower,
    /// A stroke of the session again, the tool turned by 90 degrees about its own axis.
    StrokeAgainToolTurned,
    /// One new stroke.
    OneStroke,
    Strokes,
    /// New strokes at half the usual speed.
    StrokesSlower,
    /// Strokes through one place in eight headings.
    Headings,
    /// Strokes on the object turned by 0, 90 and 180 degrees.
    ObjectTurned,
    /// Strokes with a weight on the object, in a session of their own.
    StrokesWeighted,
}
