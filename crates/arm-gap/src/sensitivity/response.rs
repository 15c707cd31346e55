//! The response of the channels to a change.

use crate::data::course::Channels;

/// Response of the channels to one unit of a number, by group.
#[derive(Clone, Debug)]
pub struct Response(pub Vec<Channels>);
