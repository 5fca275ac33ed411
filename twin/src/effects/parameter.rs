//! A parameter of an effect: its range, what it does to the effect, how a search comes by it.

/// How many numbers a parameter holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Shape {
    Number,
    /// One for each joint; a single number stands for all joints.
    PerJoint,
    /// As many as stated.
    Vector(usize),
}

/// Whether the effect vanishes with a parameter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Role {
    /// How strong the effect is. It must be given; where all sizes are neutral, nothing is changed at all.
    Size {
        /// The value that changes nothing.
        neutral: f64,
    },
    /// Where or how it acts.
    Form {
        /// Taken when the parameter is not given.
        default: f64,
    },
}

/// How a search for an effect comes by one of its parameters.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Search {
    /// Along its slope.
    Slope,
    /// A time by which all joints come late. Gains that were fitted without it stand in for it.
    Lateness,
    /// A coordinate of a place on the table: tried wherever objects slid.
    OnTable(OnTable),
    /// Not along with the others, since few clips show it well enough to be worth a number of its own: only what was found is
    /// tried at other values of it.
    Held,
    /// Where a person asks for it (`--also`), and by no diagnosis.
    OnRequest,
    /// Joint by joint, each with the gains of that joint: it acts as a whole from the smallest size on, no slope leads there, and
    /// gains that were fitted without it stand in for it.
    Threshold,
    /// A limit: as long as it is not reached nothing happens, and no slope leads there.
    Limit,
    /// Of a periodic law, like the teeth of a gear: a little out of phase over the travel it explains nothing.
    Periodic,
    /// The angle of a size, which together are a vector: at `quarter` it acts across [rad].
    Angle {
        /// A quarter of the angle's period.
        quarter: f64,
    },
    /// It changes a hit: the likelihood is not smooth in it, and its slope at one point says little.
    NonSmooth,
    /// A place in the base frame that a search does not move: its default, or the middle of where the objects were. A camera is
    /// calibrated for the place where it is used, so an error of its direction or scale is least there.
    Middle,
}

/// Coordinates of a place on the table that begins at a line, or is a disc beyond it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum OnTable {
    /// The line's normal, from the base's x axis [rad].
    Direction,
    /// Of the line from the base's origin [m].
    Distance,
    /// Of the disc [m].
    Radius,
}

/// What is met on robots that are built unlike the FR3.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Elsewhere {
    Same,
    Range([f64; 2]),
    /// So many times the joint's torque limit in N m; the same where that is not known.
    OfTorqueLimit([f64; 2]),
    /// So many times the inertia that the joint moves in the ready pose, in kg m².
    OfInertia([f64; 2]),
    /// So many times the mass of all links that move, in kg; the same where none has any.
    OfMass([f64; 2]),
}

/// One parameter of an effect.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Parameter {
    /// Key in an `[[effect]]` block.
    pub name: &'static str,
    /// SI unit; `1` without.
    pub unit: &'static str,
    /// How many numbers.
    pub shape: Shape,
    /// Values that are met in practice on the FR3 and its kin: the range of a search. [`super::Robot::range`] has those of others.
    pub plausible: [f64; 2],
    /// The same on robots built otherwise.
    pub elsewhere: Elsewhere,
    /// The strongest that is met in arms of laboratories, where simpler machines have more: by this a search takes its steps.
    pub usual: Option<f64>,
    /// Values that have a meaning.
    pub possible: [f64; 2],
    /// What it does to the effect.
    pub role: Role,
    /// How a search comes by it.
    pub search: Search,
    /// Values from each of which a search begins, where its resting value is not enough; of a vector all components.
    pub begun_at: &'static [&'static [f64]],
    /// Whether the arm feels the effect where this is not 0, though it shows first in the hit, the slide or the camera.
    pub felt_by_arm: bool,
    /// Where it lies in engines in which nothing is wrong, though not two of them agree: an effect of which all parameters do is none.
    pub of_engines: Option<[f64; 2]>,
    /// Whether it moves the tip while the arm's own sensors see nothing: in strokes it is the object that tells it.
    pub moves_tip_unseen: bool,
}

impl Parameter {
    /// A single number that is the effect's strength; any finite value means something.
    pub(super) const fn size(name: &'static str, unit: &'static str, plausible: [f64; 2], neutral: f64) -> Self {
        Self {
            name,
            unit,
            shape: Shape::Number,
            plausible,
            elsewhere: Elsewhere::Same,
            usual: None,
            possible: [f64::MIN, f64::MAX],
            role: Role::Size { neutral },
            search: Search::Slope,
            begun_at: &[],
            felt_by_arm: false,
            of_engines: None,
            moves_tip_unseen: false,
        }
    }

    /// A single number that says how the effect acts.
    pub(super) const fn form(name: &'static str, unit: &'static str, plausible: [f64; 2], default: f64) -> Self {
        Self { role: Role::Form { default }, ..Self::size(name, unit, plausible, default) }
    }

    pub(super) const fn per_joint(self) -> Self {
        Self { shape: Shape::PerJoint, ..self }
    }

    pub(super) const fn vector(self, numbers: usize) -> Self {
        Self { shape: Shape::Vector(numbers), ..self }
    }

    pub(super) const fn within(self, lowest: f64, highest: f64) -> Self {
        Self { possible: [lowest, highest], ..self }
    }

    pub(super) const fn elsewhere(self, elsewhere: Elsewhere) -> Self {
        Self { elsewhere, ..self }
    }

    pub(super) const fn usually_up_to(self, strongest: f64) -> Self {
        Self { usual: Some(strongest), ..self }
    }

    pub(super) const fn searched(self, search: Search) -> Self {
        Self { search, ..self }
    }

    pub(super) const fn begun_at(self, begun_at: &'static [&'static [f64]]) -> Self {
        Self { begun_at, ..self }
    }

    pub(super) const fn felt_by_arm(self) -> Self {
        Self { felt_by_arm: true, ..self }
    }

    pub(super) const fn of_engines(self, range: [f64; 2]) -> Self {
        Self { of_engines: Some(range), ..self }
    }

    pub(super) const fn moves_tip_unseen(self) -> Self {
        Self { moves_tip_unseen: true, ..self }
    }

    /// The value that changes nothing, or the default of a parameter that says how.
    pub fn resting_value(&self) -> f64 {
        match self.role {
            Role::Size { neutral } => neutral,
            Role::Form { default } => default,
        }
    }
}
