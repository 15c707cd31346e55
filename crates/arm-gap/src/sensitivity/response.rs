//! The response of the channels to a change.

use crate::measurement_model::prediction::Channels;

/// Response of the channels to one unit of a number, by group.
#[derive(Clone, Debug)]
pub struct Response(pub Vec<Channels>);
