//! One module for each stage of the search; `sessions` are what they share.

mod candidates;
mod preparing;
mod responses;
mod screening;
mod search;
mod sessions;
mod swinging;
mod trial_specific;
