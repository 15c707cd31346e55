//! The results of a session in the terms of files and reports. One type for Rust, Python and JSON.
//!
//! Kinds have joints from 1 and channels by name, values have units and intervals, gaps are root mean squares.

mod absorbed;
mod amended;
mod channel_gap;
mod detection_limit;
mod effect;
mod gap_result;
mod root_mean_square;
mod search_input;
mod simulated_trial;
mod value;
mod verdict;

pub use absorbed::Absorbed;
pub use amended::Fitted;
pub use channel_gap::{ChannelGap, Open, channel_names, confirmed};
pub use detection_limit::{Limit, SearchStep, Suspect, Tried};
pub use effect::{Alternative, Missing, Place, Separation, TIE};
pub use gap_result::{GapResult, Lack, Screening};
pub use root_mean_square::{pairwise_sum, root_mean_square};
pub use search_input::{SearchInput, TrialFile};
pub use simulated_trial::{SimulatedTrial, Version, sizes};
pub use value::Value;
pub use verdict::{Evidence, LACK_OF_FIT, NEAR_NOISE, NEGLIGIBLE, Verdict};

pub use crate::selection::held_out::OPEN_GAP;

use arm_core::effect::Kind;
use arm_model::Site;

/// Values by name, in their order.
pub type Named<T> = indexmap::IndexMap<String, T>;

/// Name of a kind, joint or segment from 1, and channel, from the index in the core.
fn placed(kind: Kind, index: usize) -> (String, Option<usize>, Option<String>) {
    let name = kind.info().kind.to_owned();
    match Site::of(kind, index) {
        Site::Whole => (name, None, None),
        Site::Joint(joint) => (name, Some(joint + 1), None),
        Site::Channel(channel) => (name, None, Some(channel.name().to_owned())),
    }
}

/// A value, or the least that it may be; what is no number stays.
fn at_least(value: f64, least: f64) -> f64 {
    if least > value { least } else { value }
}

/// A value, or the most that it may be; what is no number stays.
fn at_most(value: f64, most: f64) -> f64 {
    if most < value { most } else { value }
}
