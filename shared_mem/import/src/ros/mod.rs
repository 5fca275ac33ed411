//! ROS messages of any type, version 1 or 2, as rows of numbers.
//!
//! | file | owns |
//! |---|---|
//! | `definition` | types as their `.msg` texts define them |
//! | `known` | definitions for bags that carry none |
//! | `wire` | numbers and texts of a message, in either encoding |
//! | `flat` | a message as one row: numbers, their names, a stamp |
//! | `joined` | topics of one number each as one table |
//! | `collect` | the messages of a bag as tables |

mod collect;
mod definition;
mod flat;
mod joined;
mod known;
mod wire;

pub(crate) use collect::{Collector, Incoming};
pub(crate) use wire::Encoding;
