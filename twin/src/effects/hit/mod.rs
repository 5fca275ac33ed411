//! Effects on the hit: how tool and object press on each other, where the tip is, how hard the object is to turn.
//! Asked once when a cell is made; nothing here changes over time.

pub(super) mod contact_compliance;
pub(super) mod object_inertia;
pub(super) mod restitution;
#[cfg(test)]
mod test_hit;
pub(super) mod tip_friction;
pub(in crate::effects) mod tool_offset;

use crate::contact_law::ContactLaw;
use nalgebra::Translation3;

/// The effects on a hit that are installed.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct HitEffects {
    pub(super) restitution: Option<restitution::Restitution>,
    pub(super) contact_compliance: Option<contact_compliance::ContactCompliance>,
    pub(super) tip_friction: Option<tip_friction::TipFriction>,
    pub(super) tool_offset: Option<tool_offset::ToolOffset>,
    pub(super) object_inertia: Option<object_inertia::ObjectInertia>,
}

impl HitEffects {
    /// The contact law of the real tip, made from the nominal one.
    pub fn real_law(&self, nominal: ContactLaw) -> ContactLaw {
        let mut law = nominal;
        if let Some(effect) = &self.contact_compliance {
            effect.apply(&mut law);
        }
        // After the compliance: a restitution that is stated counts for the softer contact too.
        if let Some(effect) = &self.restitution {
            effect.apply(&mut law);
        }
        if let Some(effect) = &self.tip_friction {
            effect.apply(&mut law);
        }
        law
    }

    /// From where the flange is said to hold the tool to where it does, in the flange frame [m]; `None` where they agree.
    pub fn tool_shift(&self) -> Option<Translation3<f64>> {
        self.tool_offset.map(|effect| effect.shift())
    }
}
