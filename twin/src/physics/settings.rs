//! Every rapier default that is overridden, why, and the test that pins it (all in `table_object`'s tests unless
//! another place is named). rapier's defaults are tuned for games: metre-sized things at 60 Hz that must look right.

use rapier3d_f64::prelude::{FrictionModel, IntegrationParameters, SpringCoefficients};

/// Gravity [m/s²]; the value the arm model uses too.
pub(super) const GRAVITY: f64 = 9.81;

/// Parameters of one step of `dt` seconds.
pub(super) fn integration_parameters(dt: f64) -> IntegrationParameters {
    IntegrationParameters {
        // The caller's own inner step: rapier's 1/60 s is sixty control periods.
        dt,
        min_ccd_dt: dt,
        // The caller steps finely already; further splitting would only cost. `a_bounce_returns_the_restitution`
        num_solver_iterations: 1,
        // One Coulomb row a contact point. The default lumps four points into one and turns a spinning box far too little. `a_sliding_box_travels_within_a_tenth_of_coulomb`
        friction_model: FrictionModel::Coulomb,
        // The default keeps old contact points until a pair moved 5 cm: the size of our objects. `a_toppled_box_comes_to_rest_on_its_side`
        contact_recycling: false,
        // One convex object on one plane has one manifold; nothing to merge.
        contact_clustering: false,
        // Decimetre objects: the speculative margin shrinks from 20 mm to 2 mm, push-out from 3 to 0.3 m/s. `a_dropped_box_does_not_hover`
        length_unit: 0.1,
        // A table is stiff. 60 Hz would let a box sink visibly and rebound late. `a_box_at_rest_stays_where_it_is`
        contact_softness: TABLE,
        static_contact_softness: TABLE,
        // Steps are so short that nothing travels further than the speculative margin.
        max_ccd_substeps: 0,
        ..IntegrationParameters::default()
    }
}

/// Softness of the table's surface: fast against the motions of interest, slow against an inner step of 0.25 ms.
const TABLE: SpringCoefficients<f64> = SpringCoefficients { natural_frequency: 200.0, damping_ratio: 5.0 };
