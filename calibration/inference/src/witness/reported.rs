//! In which ways what is reported of camera, tool and encoders may be off, and which effects of the registry are of each: an effect says
//! by the place where it acts and by its parameter's unit what it does to a reported place.

use shared_mem::theta::Theta;
use twin::effects::{EffectInfo, Parameter, Place, Role, Shape, find, registry};

/// How a report is off.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Off {
    /// Poses are shifted by a vector [m].
    Shift,
    /// They are turned by a rotation vector [rad].
    Turn,
    /// Lengths come out too long by this share.
    Scale,
    /// Poses are so old [s], or follow with such a time constant.
    Late,
    /// The tip stands beside its place by a vector [m] in the flange frame.
    Tip,
    /// Encoders read beside the joints' positions [rad].
    Encoders,
}

impl Off {
    /// Whether a parameter of an effect makes a report be off in this way.
    fn is(self, effect: &EffectInfo, parameter: &Parameter) -> bool {
        let (place, unit, shape) = match self {
            Self::Shift => (Place::ObjectObservation, "m", Shape::Vector(3)),
            Self::Turn => (Place::ObjectObservation, "rad", Shape::Vector(3)),
            Self::Scale => (Place::ObjectObservation, "1", Shape::Number),
            Self::Late => (Place::ObjectObservation, "s", Shape::Number),
            Self::Tip => (Place::ToolContact, "m", Shape::Vector(3)),
            Self::Encoders => return parameter.moves_tip_unseen,
        };
        let is_size = matches!(parameter.role, Role::Size { .. });
        is_size && effect.acts_on == place && parameter.unit == unit && parameter.shape == shape
    }

    /// Names of the effects of this kind, in the registry's order.
    pub(super) fn effects(self) -> impl Iterator<Item = &'static str> {
        let of_kind = move |effect: &&EffectInfo| effect.parameters.iter().any(|parameter| self.is(effect, parameter));
        registry().iter().filter(of_kind).map(|effect| effect.name)
    }

    /// By how much it is known to be off, the numbers of each effect.
    pub(super) fn known(self, theta: &Theta) -> Vec<Vec<f64>> {
        let mut all = Vec::new();
        for block in &theta.effects {
            let Some(effect) = find(&block.name) else { continue };
            let parameters = effect.parameters.iter().filter(|parameter| self.is(effect, parameter));
            all.extend(parameters.filter_map(|parameter| block.numbers(parameter.name)));
        }
        all
    }
}
